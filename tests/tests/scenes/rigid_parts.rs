//! Parts of skinned meshes that joints move rigidly, as instances: they answer as the undivided
//! mesh does.

use crate::made_gltf::{Document, push};
use crate::support::options;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::CompileOptions;
use bth_import::Keep;
use bth_import::gltf::scene::{ImportOptions, ImportReport, import};
use bth_random::Rng;
use bth_scene::{JointSet, Manifest, Source};
use serde_json::{Value, json};
use std::path::Path;

/// Rows of a ball of the document.
const AROUND: u32 = 12;
const DOWN: u32 = 8;

/// A part of the mesh: where it is in the bind pose, and the joints of its upper and lower half.
struct Ball {
    center: [f32; 3],
    joints: [u8; 2],
}

/// Balls of joints 1 and 2; one of joints 1 and 2, which bends; one of joint 3, which is hidden;
/// and one half of a ball, too small to be worth an instance.
const BALLS: [Ball; 4] = [
    Ball { center: [0.0, 0.0, 0.0], joints: [1, 1] },
    Ball { center: [4.0, 0.0, 0.0], joints: [2, 2] },
    Ball { center: [0.0, 4.0, 0.0], joints: [1, 2] },
    Ball { center: [4.0, 4.0, 0.0], joints: [3, 3] },
];

fn at(ball: &Ball, ring: u32, step: u32) -> [f32; 3] {
    let (down, around) = (ring as f32 / DOWN as f32, (step % AROUND) as f32 / AROUND as f32);
    let (theta, phi) = (down * std::f32::consts::PI, around * std::f32::consts::TAU);
    // The poles are points, so that the ball is closed.
    let sine = if ring == 0 || ring == DOWN { 0.0 } else { theta.sin() };
    let unit = [sine * phi.cos(), theta.cos(), sine * phi.sin()];
    [0, 1, 2].map(|k| ball.center[k] + unit[k])
}

/// Triangles of the quads between two rings of a ball, corner by corner; no vertex is shared.
fn band(ball: &Ball, rings: std::ops::Range<u32>, soup: &mut Soup) {
    for ring in rings {
        for step in 0..AROUND {
            let [a, b] = [0, 1].map(|k| (ring, step + k));
            let [c, d] = [0, 1].map(|k| (ring + 1, step + k));
            let first = if ring == 0 { None } else { Some([a, b, c]) };
            let second = if ring + 1 == DOWN { None } else { Some([b, d, c]) };
            for (ring, step) in first.into_iter().chain(second).flatten() {
                let position = at(ball, ring, step);
                soup.positions.push(position);
                soup.normals.push([0, 1, 2].map(|k| position[k] - ball.center[k]));
                let joint = ball.joints[usize::from(ring > DOWN / 2)];
                soup.joints.extend([joint, 0, 0, 0]);
            }
        }
    }
}

#[derive(Default)]
struct Soup {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    joints: Vec<u8>,
}

/// A mesh of two primitives of a material each. The first has the upper halves of all balls, the
/// second the lower ones, so that only equal positions connect them. Joints turn about a moved
/// node; joint 3 does so below a hidden node.
fn document() -> Document {
    let mut document = Document::new();
    let mut primitives = Vec::new();
    for (material, rings) in [0..DOWN / 2, DOWN / 2..DOWN].into_iter().enumerate() {
        let mut soup = Soup::default();
        BALLS.iter().for_each(|ball| band(ball, rings.clone(), &mut soup));
        let weights = vec![[0.7f32, 0.0, 0.0, 0.0]; soup.positions.len()];
        let (positions, normals) = (document.floats(&soup.positions), document.floats(&soup.normals));
        let (joints, weights) = (document.integers(&soup.joints, "VEC4", 4), document.floats(&weights));
        let attributes =
            json!({"POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights});
        primitives.push(json!({"attributes": attributes, "material": material}));
    }
    let mut binds = [[0.0f32; 16]; 4];
    for (joint, matrix) in binds.iter_mut().enumerate() {
        (0..4).for_each(|i| matrix[5 * i] = 1.0);
        matrix[12] = [0.0, 0.0, -4.0, -4.0][joint];
    }
    let binds = document.floats(&binds);
    document.json["meshes"][0]["primitives"] = primitives.into();
    document.json["materials"] = json!([{"name": "upper"}, {"name": "lower"}]);
    document.json["nodes"] = json!([
        {"name": "figure", "mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"name": "root", "children": [2, 3, 4], "translation": [0, 10, 0]},
        {"name": "a", "translation": [0, 0, 5]},
        {"name": "b", "translation": [4, 0, 5], "scale": [2, 1.5, 1]},
        {"name": "hidden", "children": [5], "extensions": {"KHR_node_visibility": {"visible": false}}},
        {"name": "c", "translation": [4, 0, 9]}
    ]);
    document.json["extensionsUsed"] = json!(["KHR_node_visibility"]);
    document.json["skins"] = json!([{"joints": [1, 2, 3, 5], "inverseBindMatrices": binds}]);
    let half = 0.5f32.sqrt();
    let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, half, 0.0, half], [0.6, 0.0, 0.0, 0.8]];
    document
        .animate((1, "translation", "LINEAR"), &[0.0, 4.0], &[[0.0f32, 10.0, 0.0], [3.0, 10.0, -2.0]])
        .animate((2, "rotation", "LINEAR"), &[0.0, 2.0, 4.0], &turns)
        .animate((3, "translation", "LINEAR"), &[0.0, 4.0], &[[4.0f32, 0.0, 5.0], [6.0, 1.0, 5.0]])
        .animate((3, "rotation", "STEP"), &[0.0, 1.0, 3.0], &turns)
        .animate((5, "rotation", "LINEAR"), &[0.0, 4.0], &turns[..2])
}

fn parted(document: &Document) -> (Manifest, ImportReport) {
    document.imported(&ImportOptions { rigid_parts: true, ..ImportOptions::default() }).unwrap()
}

fn scene(document: &Document, rigid_parts: bool) -> bth::Scene {
    let folder = document.written();
    let import_options = ImportOptions { rigid_parts, ..ImportOptions::default() };
    let (manifest, _) = import(&folder.path().join("a.gltf"), "a.gltf", &import_options, &Silent).unwrap();
    let read = bth_scene::parse(&manifest.to_toml(), Path::new("x")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(read, manifest);
    let options = CompileOptions { attributes: Keep::Normals, names: true, ..options() };
    let (compiled, _) =
        bth_compile::scene::compile(&manifest, folder.path(), Path::new("x"), &options, &Silent).unwrap();
    let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
    bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
    bth::from_bytes(&compiled.bytes).unwrap()
}

/// For each triangle of the undivided mesh where it is in the divided scene, by the ranks that the
/// specification gives triangles.
fn places(parts: &bth::Scene) -> Vec<PrimitiveRef> {
    let node = |name: &str| {
        (0..parts.instance_count())
            .find(|row| parts.description().unwrap().node_name(parts.instance(*row).node) == name)
            .expect("an instance")
    };
    let instances = [node("figure/a"), node("figure/b"), node("figure"), node("figure")];
    let mut next = vec![0; parts.instance_count() as usize];
    let mut places = Vec::new();
    for rings in [0..DOWN / 2, DOWN / 2..DOWN] {
        for (ball, instance) in BALLS.iter().zip(instances) {
            let mut soup = Soup::default();
            band(ball, rings.clone(), &mut soup);
            for _ in 0..soup.positions.len() / 3 {
                places.push(PrimitiveRef { instance, triangle: next[instance as usize] });
                next[instance as usize] += 1;
            }
        }
    }
    places
}

fn near(a: [f64; 3], b: [f64; 3], bound: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= bound)
}

#[test]
fn rigid_parts_are_whole_components_below_their_joints() {
    let (manifest, report) = parted(&document());
    assert_eq!((report.deformers, report.rigid_parts), (1, 2));
    let names: Vec<_> = manifest.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["square", "square/a", "square/b"]);
    let without: JointSet = [1, 2].into_iter().collect();
    let sources: Vec<_> = manifest.objects.iter().map(|o| o.source.clone()).collect();
    let part = |joint| Source::RigidPart { path: "a.gltf".into(), mesh: 0, joint };
    assert_eq!(sources, [Source::Deforming { path: "a.gltf".into(), mesh: 0, without }, part(1), part(2)]);
    let scene = scene(&document(), true);
    let places = places(&scene);
    let triangles: Vec<_> = (0..3).map(|o| scene.object(o).triangles.len()).collect();
    assert_eq!(triangles.iter().sum::<usize>(), places.len());
    assert_eq!(places.len(), BALLS.len() * (2 * AROUND * (DOWN - 1)) as usize);
}

#[test]
fn divided_and_undivided_meshes_answer_alike() {
    let (mut whole, mut parts) = (scene(&document(), false), scene(&document(), true));
    let places = places(&parts);
    let mut rng = Rng::new(5);
    let (mut hits, mut on_parts) = (0, 0);
    for seconds in [-1.0, 0.0, 0.3, 1.0, 1.7, 2.5, 3.1, 4.0, 9.0] {
        let updates = [whole.set_seconds(seconds).unwrap(), parts.set_seconds(seconds).unwrap()];
        if updates[0].deformed > 0 {
            assert_eq!(updates[1].deformed, 1, "what is soft");
        }
        for (triangle, place) in (0..).zip(&places) {
            let expected = whole.triangle_in_world(PrimitiveRef { instance: 0, triangle }).unwrap();
            let found = parts.triangle_in_world(*place).unwrap();
            assert!(expected.iter().zip(found).all(|(a, b)| near(*a, b, 2e-6 * 20.0)), "{triangle}");
        }
        for _ in 0..1000 {
            let origin = rng.unit_vector().map(|x| 25.0 * x);
            let to = [rng.between(-2.0, 9.0), rng.between(7.0, 18.0), rng.between(2.0, 9.0)];
            let direction = [0, 1, 2].map(|k| (to[k] - origin[k]) as f32);
            let ray = Ray::new(origin.map(|x| x as f32), direction);
            let (expected, found) = (whole.nearest(&ray), parts.nearest(&ray));
            let (Some(expected), Some(found)) = (expected, found) else {
                assert_eq!(expected, found, "{ray:?}");
                continue;
            };
            hits += 1;
            assert!((expected.t - found.t).abs() <= 1e-5 * expected.t, "{expected:?} {found:?}");
            let [a, b] = [whole.surface(&expected).unwrap(), parts.surface(&found).unwrap()];
            let material = |scene: &bth::Scene, surface: &bth::SurfacePoint| {
                scene.material_name(surface.object, surface.material.unwrap()).to_owned()
            };
            let same = places[expected.primitive.triangle as usize] == found.primitive;
            on_parts += usize::from(same && b.object > 0);
            // On an edge either neighbour may be hit.
            if same {
                assert_eq!(material(&whole, &a), material(&parts, &b));
                let unit = |v: [f64; 3]| {
                    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
                    v.map(|x| x / length)
                };
                // Where a joint scales the axes differently, it makes a difference whether corners
                // or points between them are turned.
                let bound = if b.object == 2 { 0.1 } else { 1e-4 };
                assert!(near(unit(a.normal), unit(b.normal), bound), "{a:?} {b:?}");
                assert!(near(unit(a.geometric_normal), unit(b.geometric_normal), 1e-4), "{a:?} {b:?}");
            } else {
                let edge = |hit: &Hit| hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < 1e-3;
                assert!(edge(&expected) && edge(&found), "{expected:?} {found:?}");
            }
        }
    }
    assert!(hits > 1500 && on_parts > 700, "{hits} {on_parts}");
}

#[test]
fn rays_do_not_leave_closed_parts_at_vertices_and_edges() {
    let mut parts = scene(&document(), true);
    let places = places(&parts);
    let mut rng = Rng::new(8);
    for seconds in [0.4, 1.0, 2.2, 3.7] {
        parts.set_seconds(seconds).unwrap();
        for ball in 0..2 {
            let own: Vec<_> = places.iter().filter(|p| parts.object_of(p.instance) == ball + 1).collect();
            let corners: Vec<_> = own.iter().filter_map(|place| parts.triangle_in_world(**place)).collect();
            let all = corners.as_flattened();
            let sum = |k: usize| all.iter().map(|p| p[k]).sum::<f64>();
            let center = [0, 1, 2].map(|k| sum(k) / all.len() as f64);
            for _ in 0..2 {
                let origin = center.map(|x| (x + rng.between(-0.2, 0.2)) as f32);
                let mut rays = Vec::new();
                for [a, b, c] in &corners {
                    let share = rng.unit_f64();
                    let along = |p: &[f64; 3], q: &[f64; 3]| [0, 1, 2].map(|k| p[k] + share * (q[k] - p[k]));
                    for to in [*a, *b, *c, along(a, b), along(b, c), along(c, a)] {
                        // Ends behind the surface but before another ball, which then cannot be
                        // hit.
                        let direction = [0, 1, 2].map(|k| to[k] as f32 - origin[k]);
                        rays.push(Ray { tmax: 1.001, ..Ray::new(origin, direction) });
                    }
                }
                let mut found = vec![Hit::MISS; rays.len()];
                parts.batch(&rays).nearest(&mut found);
                assert!(found.iter().all(Hit::is_hit), "a ray leaves the ball {ball} at {seconds} s");
                assert!(rays.iter().all(|ray| parts.any(ray)));
            }
        }
    }
}

#[test]
fn a_mesh_of_rigid_parts_alone_never_deforms() {
    let all_rigid = document().edit(|d| {
        // Without the soft ball's joint and without a hidden one.
        d["skins"][0]["joints"] = json!([1, 2, 2, 2]);
        d["nodes"][4].as_object_mut().unwrap().remove("extensions");
    });
    // The bending ball still follows two joints of one node.
    let (manifest, report) = parted(&all_rigid);
    assert_eq!((report.deformers, report.rigid_parts), (1, 3));
    assert_eq!(manifest.deformers.len(), 1);
    let soft = |document: Document| {
        document.edit(|d| d["meshes"][0]["primitives"] = json!([d["meshes"][0]["primitives"][0]]))
    };
    // The upper halves have one joint each, so nothing is left that deforms, however small they
    // are.
    let document = soft(all_rigid);
    let (manifest, report) = parted(&document);
    assert_eq!((report.deformers, report.rigid_parts, manifest.objects.len()), (0, 3, 3));
    assert!(manifest.nodes.get(0).object.is_none());
    let (mut whole, mut parts) = (scene(&document, false), scene(&document, true));
    for seconds in [0.5, 3.0] {
        assert_eq!(whole.set_seconds(seconds).unwrap().deformed, 1);
        assert_eq!(parts.set_seconds(seconds).unwrap().deformed, 0);
        // To the middle of the first ball.
        let [x, z] = [0.75 * seconds, 5.0 - 0.5 * seconds].map(|x| x as f32);
        let ray = Ray::new([x, 30.0, z], [0.0, -1.0, 0.0]);
        let [a, b] = [&whole, &parts].map(|scene| scene.nearest(&ray).expect("a hit").t);
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}

#[test]
fn subscenes_of_rigid_parts_have_times_of_their_own() {
    let rigid = document().edit(|d| {
        d["skins"][0]["joints"] = json!([1, 2, 2, 2]);
        d["meshes"][0]["primitives"] = json!([d["meshes"][0]["primitives"][0]]);
    });
    let mut file = scene(&rigid, true);
    let mut builder = bth::SceneBuilder::new();
    let first = builder.add(&file);
    let at = |x: f32| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    for (x, seconds) in [(0.0, 0.5), (50.0, 3.0)] {
        let subscene = builder.subscene(first, &at(x)).unwrap();
        builder.set_subscene_seconds(subscene, seconds).unwrap();
    }
    let update = builder.commit().unwrap();
    let parts = file.instance_count();
    assert_eq!((update.deformed, update.visible), (0, 2 * parts as usize));
    for (number, (x, seconds)) in [(0.0, 0.5), (50.0, 3.0)].into_iter().enumerate() {
        file.set_seconds(seconds).unwrap();
        for part in 0..parts {
            let mut expected = file.instance(part).to_world;
            expected[0][3] += x;
            let found = builder.scene().instance(number as u32 * parts + part).to_world;
            let differ = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-12 * (1.0 + b.abs());
            assert!(!found.as_flattened().iter().zip(expected.as_flattened()).any(differ), "{found:?}");
        }
    }
}

#[test]
fn parts_that_an_instance_cannot_show_stay_in_the_object_that_deforms() {
    let left = |edit: &dyn Fn(&mut Value)| {
        let (manifest, report) = parted(&document().edit(|d| edit(d)));
        assert_eq!(manifest.deformers.len(), 1);
        report.rigid_parts
    };
    assert_eq!(left(&|_| ()), 2);
    assert_eq!(left(&|d| d["nodes"][3]["scale"] = json!([0, 1, 1])), 1, "no inverse");
    assert_eq!(left(&|d| d["nodes"][3]["scale"] = json!([-1, 1, 1])), 1, "mirrored");
    assert_eq!(left(&|d| d["nodes"][3]["scale"] = json!([1e-8, 1, 1])), 1, "too flat");
    assert_eq!(left(&|d| d["nodes"][1]["scale"] = json!([-1, -1, 1])), 2, "turned");
    let scaled = |interpolation: &str, values: &[[f32; 3]]| {
        let times = [0.0, 1.0];
        parted(&document().animate((3, "scale", interpolation), &times, values)).1.rigid_parts
    };
    assert_eq!(scaled("LINEAR", &[[1.0, 2.0, 1.0], [0.5; 3]]), 2);
    assert_eq!(scaled("LINEAR", &[[1.0; 3], [0.0, 1.0, 1.0]]), 1, "vanishes");
    assert_eq!(scaled("LINEAR", &[[1.0; 3], [-1.0; 3]]), 1, "passes through zero");
    assert_eq!(scaled("CUBICSPLINE", &[[1.0; 3]; 6]), 1, "not bounded by its keys");
    // A morph target that moves one vertex, or turns its normal.
    for name in ["POSITION", "NORMAL"] {
        let mut morphed = document();
        let rows = BALLS.len() * (AROUND * (DOWN - 1) * 3) as usize;
        let mut deltas = vec![[0.0f32; 3]; rows];
        deltas[5] = [0.0, 0.1, 0.0];
        let deltas = morphed.floats(&deltas);
        for primitive in morphed.json["meshes"][0]["primitives"].as_array_mut().unwrap() {
            primitive["targets"] = json!([{name: deltas}]);
        }
        assert_eq!(parted(&morphed).1.rigid_parts, 1, "{name}");
    }
    // A hidden mesh has hidden parts.
    let (manifest, _) = parted(&document().edit(|d| {
        d["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    }));
    assert!(manifest.nodes.iter().filter(|node| node.object.is_some()).all(|node| !node.visible));
    // Two nodes with the mesh and the same joints share the objects of its parts.
    let (manifest, report) = parted(&document().edit(|d| {
        let second = push(&mut d["nodes"], json!({"mesh": 0, "skin": 1}));
        push(&mut d["scenes"][0]["nodes"], second.into());
        let skin = d["skins"][0].clone();
        push(&mut d["skins"], skin);
    }));
    assert_eq!((report.deformers, report.rigid_parts, manifest.objects.len()), (2, 4, 4));
}
