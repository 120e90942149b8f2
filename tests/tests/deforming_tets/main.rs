//! Tetrahedra under objects that deform: a tet leaf is in use exactly where no tetrahedron is turned over, and rays that start in it
//! have the answers of the BVH, whatever the positions.

mod meshes;

use crate::meshes::{KINDS, Positions, Triangles, compiled, deformed, mesh, with_flat};
use bth::rays::{Hit, Ray, StartRay};
use bth::{Code, Isa, Scene, SceneBuilder, Update};
use bth_compile::pipeline::Structure;
use bth_format::layout::{NONE, RecordKind, TetLeaf};
use bth_format::object::{ObjectView, Records};
use bth_random::Rng;
use bth_tests::oracle::{World, orientation};
use bth_tests::rays::{alone, assorted, check_batch, starts};
use bth_tests::structures::bits;
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::sync::Mutex;

/// The choices of how to trace are those of the process.
static CHOICE: Mutex<()> = Mutex::new(());

const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// The tet leaves that may be used, by an oracle: every tetrahedron, by the vertices that Tet32 stores, has the exact orientation that
/// it has in the file; corners of faces are those of their triangles; the hull's vertices are the corners of the box, which holds all.
fn usable(file: &ObjectView<'_>, view: &ObjectView<'_>) -> Vec<bool> {
    let Records::Tet32(records) = file.records else { panic!("Tet32") };
    let at = |view: &ObjectView<'_>, v: u32| view.tet_vertices[v as usize].position;
    let is_usable = |leaf: &TetLeaf| {
        let same_side = |row: u32| {
            let record = records[row as usize];
            let [a, b, c] = record.vertex;
            let four = [a, b, c, record.xor ^ a ^ b ^ c];
            let [before, now] = [file, view].map(|view| orientation(four.map(|v| at(view, v))));
            before != Ordering::Equal && before == now
        };
        let is_of_triangle = |row: u32| {
            let face = &view.tet_faces[row as usize];
            let corners = view.triangles[face.triangle as usize].map(|v| view.positions[v as usize]);
            let bits = |corners: [[f32; 3]; 3]| corners.map(|p| p.map(f32::to_bits));
            bits(corners) == bits(face.vertex.map(|v| at(view, v)))
        };
        let is_corner = |v: u32| {
            let p = at(view, v);
            (0..3).all(|k| p[k] == leaf.lower[k] || p[k] == leaf.upper[k])
        };
        let is_inside = |v: u32| (0..3).all(|k| (leaf.lower[k]..=leaf.upper[k]).contains(&at(view, v)[k]));
        let hull = leaf.first_hull..leaf.first_hull + leaf.hulls;
        (leaf.first_face..leaf.first_face + leaf.faces).all(is_of_triangle)
            && (leaf.first_tet..leaf.first_tet + leaf.tets).all(same_side)
            && (leaf.first_vertex..leaf.first_vertex + leaf.vertices).all(is_inside)
            && hull.flat_map(|row| view.hull_faces[row as usize].vertex).all(is_corner)
    };
    view.tet_leaves.iter().map(is_usable).collect()
}

/// The tet leaves that rays may start in, after checking that this is all of their triangles or none.
fn in_use(file: &ObjectView<'_>, view: &ObjectView<'_>) -> Vec<bool> {
    let of = |leaf: &TetLeaf| {
        let rows = leaf.first_face..leaf.first_face + leaf.faces;
        let faces: BTreeSet<bool> = rows
            .map(|row| {
                let triangle = view.tet_faces[row as usize].triangle as usize;
                assert!([file.triangle_faces[triangle], NONE].contains(&view.triangle_faces[triangle]));
                view.triangle_faces[triangle] == row
            })
            .collect();
        assert_eq!(faces.len(), 1);
        faces.contains(&true)
    };
    view.tet_leaves.iter().map(of).collect()
}

/// Rays of every kind, and rays that start on the surface.
fn rays_and_starts(scene: &Scene, rng: &mut Rng) -> (Vec<Ray>, Vec<StartRay>) {
    let view = scene.object(0);
    let corners: Vec<[[f32; 3]; 3]> =
        view.triangles.iter().map(|t| t.map(|v| view.positions[v as usize])).collect();
    (assorted(&corners, 500, rng.next()), starts(&corners, 1500, rng.next()))
}

/// Compares rays through the scene with those through another without tetrahedra; returns the number of hits.
fn compare(scene: &Scene, plain: &Scene, rng: &mut Rng, isas: &[Isa]) -> usize {
    let (rays, starts) = rays_and_starts(plain, rng);
    let (expected, after) = (alone(plain, &rays), alone(plain, &starts));
    let chosen = Isa::chosen();
    for isa in isas {
        isa.choose().unwrap();
        check_batch(scene, &rays, &expected, isa);
        check_batch(scene, &starts, &after, isa);
        for (ray, hit) in starts.iter().zip(&after).step_by(29) {
            assert_eq!(bits(&scene.nearest(ray).unwrap_or(Hit::MISS)), bits(hit), "{isa}: {ray:?}");
        }
    }
    chosen.choose().unwrap();
    let exact = World::new(scene);
    for (ray, hit) in rays.iter().zip(&expected).step_by(97) {
        assert_eq!(exact.hit(ray).t, hit.t, "{ray:?}");
    }
    for (ray, hit) in starts.iter().zip(&after).step_by(97) {
        assert_eq!(exact.hit_from_start(ray).t, hit.t, "{ray:?}");
    }
    expected.iter().chain(&after).filter(|hit| hit.is_hit()).count()
}

fn available() -> Vec<Isa> {
    Isa::ALL.into_iter().filter(|isa| isa.is_available()).collect()
}

fn used(update: &Update) -> (usize, usize) {
    (update.tet_leaves_in_use, update.tet_leaves_aside)
}

/// Deforms a mesh in every way; returns how often a leaf was in use and how often not.
fn check(mesh: &(Positions, Triangles), structure: Structure, seed: u64) -> (usize, usize) {
    let _choice = CHOICE.lock();
    let plain = compiled(mesh, Structure::Bvh, RecordKind::Link32);
    let mut plain = bth::from_bytes(&plain).unwrap();
    let mut scenes: Vec<Scene> =
        RecordKind::ALL.map(|record| bth::from_bytes(&compiled(mesh, structure, record)).unwrap()).into();
    let file = bth::from_bytes(&compiled(mesh, structure, RecordKind::Tet32)).unwrap();
    let file = file.object(0);
    assert!(!file.tet_leaves.is_empty());
    let rng = &mut Rng::new(seed);
    let (mut in_all, mut aside, mut hits) = (0, 0, 0);
    for kind in 0..KINDS {
        let positions = deformed(&mesh.0, kind, rng);
        plain.set_positions(0, &positions).unwrap();
        let updates: Vec<Update> =
            scenes.iter_mut().map(|scene| scene.set_positions(0, &positions).unwrap()).collect();
        let expected = usable(&file, &scenes[1].object(0));
        let count = expected.iter().filter(|usable| **usable).count();
        for (record, (scene, update)) in scenes.iter().zip(&updates).enumerate() {
            assert_eq!(in_use(&file, &scene.object(0)), expected, "kind {kind}, record {record}");
            assert_eq!(used(update), (count, expected.len() - count), "kind {kind}");
        }
        in_all += count;
        aside += expected.len() - count;
        let isas = available();
        for (record, scene) in scenes.iter().enumerate() {
            // One record with all instruction sets, the others with the best one.
            let isas = if record == kind % 4 { &isas[..] } else { &isas[isas.len() - 1..] };
            hits += compare(scene, &plain, &mut Rng::new(seed + kind as u64), isas);
        }
        if kind == 0 {
            assert_eq!(aside, 0, "the compiled positions");
            let bytes =
                |view: &ObjectView<'_>| view.tet_vertices.iter().map(|v| v.position).collect::<Vec<_>>();
            assert!(bytes(&scenes[1].object(0)) == bytes(&file), "have the compiled tetrahedra");
        }
    }
    assert!(hits > 20_000, "{hits}");
    (in_all, aside)
}

#[test]
fn a_whole_tetrahedralization_is_used_where_no_tetrahedron_is_turned_over() {
    if bth_tests::worker().is_some() {
        let (in_use, aside) = check(&mesh(700, 1, false), Structure::Tets, 1);
        assert!(in_use >= 6 && aside >= 6, "{in_use} in use, {aside} aside");
    }
}

#[test]
fn of_several_tet_leaves_some_are_used_and_others_not() {
    if bth_tests::worker().is_some() {
        let (in_use, aside) = check(&with_flat(mesh(500, 3, true)), Structure::Bth, 2);
        assert!(in_use >= 18 && aside >= 18, "{in_use} in use, {aside} aside");
    }
}

/// The positions of the file give its tetrahedra again, after any others, and the same ones with any number of threads and instruction
/// set; a failed change leaves all as it was.
#[test]
fn tetrahedra_depend_on_the_positions_alone() {
    if bth_tests::worker().is_none() {
        return;
    }
    let _choice = CHOICE.lock();
    let mesh = mesh(30_000, 2, true);
    let file = compiled(&mesh, Structure::Bth, RecordKind::Link32);
    let mut scene = bth::from_bytes(&file).unwrap();
    let leaves = scene.object(0).tet_leaves.len();
    assert!(leaves > 1);
    type State = (Vec<[f32; 3]>, Vec<[[f32; 3]; 2]>, Vec<u32>);
    let state = |scene: &Scene| -> State {
        let view = scene.object(0);
        let boxes = view.tet_leaves.iter().map(|leaf| [leaf.lower, leaf.upper]);
        (
            view.tet_vertices.iter().map(|v| v.position).collect(),
            boxes.collect(),
            view.triangle_faces.to_vec(),
        )
    };
    let rest = state(&scene);
    let rng = &mut Rng::new(4);
    let chosen = Isa::chosen();
    let mut numbers = BTreeSet::new();
    for kind in [7, 22, 1, 8, 14] {
        let positions = deformed(&mesh.0, kind, rng);
        let mut expected: Option<(State, (usize, usize))> = None;
        for isa in available() {
            isa.choose().unwrap();
            for threads in [1, 2] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let update = pool.install(|| scene.set_positions(0, &positions)).unwrap();
                let found = (state(&scene), used(&update));
                assert!(expected.get_or_insert_with(|| found.clone()) == &found, "{isa}, {threads} threads");
            }
            let update = scene.set_positions(0, &mesh.0).unwrap();
            assert_eq!(used(&update), (leaves, 0));
            assert!(state(&scene) == rest, "kind {kind}: the positions of the file");
        }
        numbers.insert(expected.unwrap().1.0);
    }
    chosen.choose().unwrap();
    assert!(numbers.len() > 1, "{numbers:?}");

    // A builder of two objects of the file, each with positions of its own, and a commit that fails.
    let mut builder = SceneBuilder::new();
    let objects = [builder.add(&scene), builder.add(&scene)];
    for object in objects {
        builder.instance(object, &IDENTITY).unwrap();
    }
    builder.commit().unwrap();
    let small = deformed(&mesh.0, 8, rng);
    builder.set_positions(objects[0], &small).unwrap();
    builder.set_positions(objects[1], &deformed(&mesh.0, 4, rng)).unwrap();
    assert_eq!(used(&builder.commit().unwrap()), (leaves, leaves));
    scene.set_positions(0, &small).unwrap();
    assert!(state(builder.scene()) == state(&scene));
    let huge: Positions = mesh.0.iter().map(|_| [3e38, 0.0, 0.0]).collect();
    builder.instance(objects[0], &IDENTITY.map(|x| x * 4.0)).unwrap();
    builder.set_positions(objects[0], &huge).unwrap();
    assert_eq!(builder.commit().unwrap_err().code(), Code::NotFinite);
    assert!(state(builder.scene()) == state(&scene), "the commit changed nothing");
    builder.set_positions_between(objects[0], [&mesh.0, &small], 0.5).unwrap();
    assert_eq!(used(&builder.commit().unwrap()), (leaves, 0));
}

/// Instances of an object whose tetrahedra are in use, or stand aside, have the answers of those without any.
#[test]
fn instances_of_an_object_with_tetrahedra_have_the_answers_of_the_bvh() {
    if bth_tests::worker().is_none() {
        return;
    }
    let _choice = CHOICE.lock();
    let mesh = mesh(700, 1, false);
    let placed = |structure| {
        let scene = bth::from_bytes(&compiled(&mesh, structure, RecordKind::Link32)).unwrap();
        let mut builder = SceneBuilder::new();
        let object = builder.add(&scene);
        for at in 0..3 {
            let mut transform = IDENTITY.map(|x| x * 0.5);
            transform[3] = 0.9 * at as f32;
            builder.instance(object, &transform).unwrap();
        }
        builder.commit().unwrap();
        builder
    };
    let (mut tets, mut bvh) = (placed(Structure::Tets), placed(Structure::Bvh));
    let rng = &mut Rng::new(6);
    let mut numbers = BTreeSet::new();
    for kind in [0, 7, 8, 22] {
        let positions = deformed(&mesh.0, kind, rng);
        for builder in [&mut tets, &mut bvh] {
            builder.set_positions(0, &positions).unwrap();
            numbers.insert(builder.commit().unwrap().tet_leaves_in_use);
        }
        let (rays, mut starts) = rays_and_starts(bvh.scene(), rng);
        let half = |x: [f32; 3]| x.map(|x| 0.5 * x);
        let rays: Vec<Ray> = rays
            .iter()
            .map(|ray| Ray { origin: half(ray.origin), direction: half(ray.direction), ..*ray })
            .collect();
        for (row, ray) in starts.iter_mut().enumerate() {
            ray.start.primitive.instance = row as u32 / 5 % 3;
            ray.direction = half(ray.direction);
        }
        let (expected, after) = (alone(bvh.scene(), &rays), alone(bvh.scene(), &starts));
        for isa in available() {
            isa.choose().unwrap();
            check_batch(tets.scene(), &rays, &expected, isa);
            check_batch(tets.scene(), &starts, &after, isa);
        }
        assert!(expected.iter().chain(&after).filter(|hit| hit.is_hit()).count() > 300);
    }
    Isa::best().choose().unwrap();
    assert_eq!(numbers, BTreeSet::from([0, 1]));
}

/// The conformance file: a leaf around a doubled vertex, and one whose surface touches its box, which is never in use.
#[test]
fn doubled_vertices_that_move_apart_and_surfaces_that_touch_the_box_set_a_leaf_aside() {
    let _choice = CHOICE.lock();
    for record in ["link32", "tet16"] {
        let name = format!("deformable-tets-{record}");
        let case = bth_tests::conformance::valid().into_iter().find(|case| case.name == name).unwrap();
        let mut scene = bth::from_bytes(&case.bytes).unwrap();
        let rest = scene.object(0).positions.to_vec();
        let moved = |rows: &[usize], by: f32| {
            let mut positions = rest.clone();
            rows.iter().for_each(|row| positions[*row][2] += by);
            positions
        };
        for (positions, in_use) in [
            (rest.clone(), 1),
            (moved(&[0, 4], 0.25), 1),
            (moved(&[4], f32::EPSILON), 0),
            (moved(&[0], 0.25), 0),
            (moved(&[3], -3.0), 0),
            (moved(&[1, 2], 0.125), 1),
            (moved(&[8, 11], 0.125), 1),
        ] {
            let update = scene.set_positions(0, &positions).unwrap();
            assert_eq!(used(&update), (in_use, 2 - in_use), "{positions:?}");
            let (rays, mut starts) = rays_and_starts(&scene, &mut Rng::new(9));
            // The file does not tell where its triangles lie, so none is a start.
            starts.truncate(100);
            assert!(alone(&scene, &starts).iter().all(|hit| *hit == Hit::MISS));
            let exact = World::new(&scene);
            let expected: Vec<Hit> = rays.iter().map(|ray| exact.hit(ray)).collect();
            let mut hits = expected.clone();
            scene.batch(&rays).nearest(&mut hits);
            for (ray, (hit, expected)) in rays.iter().zip(hits.iter().zip(&expected)) {
                assert_eq!(hit.t, expected.t, "{ray:?}");
            }
        }
    }
}
