//! Objects with new positions have the answers of the same objects compiled with these positions,
//! on every instruction set and with any number of threads.

use crate::built::{IDENTITY, compare, transform};
use crate::support::options;
use bth::rays::Ray;
use bth::{Code, Isa, Scene, SceneBuilder};
use bth_compile::Silent;
use bth_compile::memory::{PositionRows, TriangleMesh};
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_random::Rng;
use bth_tests::oracle::World;

type Positions = Vec<[f32; 3]>;

fn deformable() -> CompileOptions {
    CompileOptions { deformable: true, ..options() }
}

fn bytes(positions: &[[f32; 3]], triangles: &[[u32; 3]], options: &CompileOptions) -> Vec<u8> {
    let (compiled, _) =
        compile(TriangleMesh { positions: PositionRows::F32(positions), triangles }, options, &Silent)
            .unwrap();
    let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
    bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
    compiled.bytes
}

/// A closed mesh; and triangles of zero area, a doubled vertex and a vertex that no triangle uses.
fn mesh(triangles: u32) -> (Positions, Vec<[u32; 3]>) {
    let knot = bth_scenes::knot::torus_knot(triangles);
    let (mut positions, mut rows) = (knot.positions, knot.triangles);
    let first = positions.len() as u32;
    positions.extend([
        [f32::NAN; 3],
        [3.0, 0.0, 0.0],
        [3.0, 1.0, 0.0],
        [3.0, 2.0, -0.0],
        positions[0],
        [3.0; 3],
    ]);
    rows.extend([[first + 1, first + 2, first + 3], [first + 4, first + 4, 0], [first + 5, 0, first + 4]]);
    (positions, rows)
}

/// Deformations of many kinds.
fn deformed(rest: &[[f32; 3]], kind: usize, rng: &mut Rng) -> Positions {
    let twist = rng.unit_f32() * 2.0 - 1.0;
    let mut noise = || rng.unit_f32() * 2.0 - 1.0;
    rest.iter()
        .map(|p| p.map(|x| if x.is_finite() { x } else { 7.0 }))
        .map(|[x, y, z]| match kind % 7 {
            0 => [x, y, z],
            1 => {
                let (sin, cos) = (twist * y).sin_cos();
                [x * cos - z * sin, y, x * sin + z * cos]
            }
            2 => [x + 0.1 * noise(), y + 0.1 * noise(), z + 0.1 * noise()],
            // Many corners coincide, edges lie in one line, triangles lie in planes of the axes.
            3 => [x, y, z].map(|x| x.round()),
            4 => [x * 0.5, -0.0, z * 3.0],
            5 => [x * 1e-20, y * 1e-22, z * 1e-20],
            _ => [noise() * 5.0, noise() * 5.0, noise() * 5.0],
        })
        .collect()
}

#[test]
fn new_positions_have_the_answers_of_a_new_compilation() {
    let (rest, triangles) = mesh(600);
    let file = bytes(&rest, &triangles, &deformable());
    let mut scene = bth::from_bytes(&file).unwrap();
    let other = bth::from_bytes(&file).unwrap();
    let before: Vec<u8> = scene.file().bytes().to_vec();
    let rng = &mut Rng::new(22);
    let mut hits = 0;
    for kind in 0..7 {
        let positions = deformed(&rest, kind, rng);
        let update = scene.set_positions(0, &positions).unwrap();
        assert_eq!((update.deformed, update.visible), (1, 1));
        let fresh = bth::from_bytes(&bytes(&positions, &triangles, &options())).unwrap();
        hits += compare(&fresh, &scene, 0, rng);
        let exact = World::new(&scene);
        for ray in crate::built::rays(&scene, rng, 10) {
            let (found, truth) = (scene.nearest(&ray), exact.hit(ray));
            assert_eq!(found.map_or(f32::INFINITY, |hit| hit.t), truth.t, "kind {kind}: {ray:?}");
        }
        assert!(kind % 7 != 6 || update.deformed_cost_ratio > 3.0, "{}", update.deformed_cost_ratio);
    }
    assert!(hits > 3000, "{hits}");
    assert_eq!(scene.file().bytes(), before);
    // Another scene of the same file keeps its positions, and these come back bit for bit.
    scene.set_positions(0, &deformed(&rest, 0, rng)).unwrap();
    compare(&other, &scene, 0, rng);
}

#[test]
fn a_refit_has_the_same_bits_on_every_instruction_set_and_with_any_number_of_threads() {
    let (rest, triangles) = mesh(60_000);
    let file = bytes(&rest, &triangles, &deformable());
    let mut scene = bth::from_bytes(&file).unwrap();
    let rng = &mut Rng::new(5);
    let still = deformed(&rest, 0, rng);
    let update = scene.set_positions(0, &still).unwrap();
    let view = *scene.file().view(0).unwrap();
    assert!(scene.object(0).lines == view.lines, "the positions of the file give its bytes");
    assert_eq!((scene.object(0).header.lower, update.deformed_cost_ratio), (view.header.lower, 1.0));
    for kind in [1, 2, 6] {
        let positions = deformed(&rest, kind, rng);
        let mut expected = None;
        let _choice = crate::built::CHOICE.lock();
        let chosen = Isa::chosen();
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            isa.choose().unwrap();
            for threads in [1, 2, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let update = pool.install(|| scene.set_positions(0, &positions)).unwrap();
                let view = scene.object(0);
                let found = (view.lines.to_vec(), view.header.upper, update.deformed_cost_ratio.to_bits());
                assert!(expected.get_or_insert_with(|| found.clone()) == &found, "{isa}, {threads} threads");
            }
        }
        chosen.choose().unwrap();
        let ratio = scene.set_positions(0, &positions).unwrap().deformed_cost_ratio;
        assert!(ratio > 1.0 && ratio.is_finite(), "kind {kind}: {ratio}");
        scene.set_positions(0, &still).unwrap();
    }
}

/// Positions between two times, by integers: the multiple of 2⁻¹⁴⁹ that is nearest to the exact
/// value, which needs no more than a share of few bits.
fn between(a: f32, b: f32, eighths: i64) -> f32 {
    // Coordinates of the mesh are multiples of 2⁻²⁰ below 2⁷, so that all of this is exact in
    // integers.
    let [a, b] = [a, b].map(|x| (f64::from(x) * f64::from(1 << 20)) as i64);
    let sum = (8 - eighths) * a + eighths * b;
    // Sums below 2³¹ are exact in f64; the only rounding is that to f32.
    (sum as f64 / f64::from(1 << 23)) as f32
}

#[test]
fn positions_between_two_times_are_those_of_the_formula_and_traced_as_exactly() {
    let grid =
        |p: [f32; 3]| p.map(|x| ((f64::from(x) * f64::from(1 << 20)).round() / f64::from(1 << 20)) as f32);
    let (rest, triangles) = mesh(600);
    let rest: Positions = rest.into_iter().map(grid).collect();
    let rng = &mut Rng::new(27);
    let open: Positions = deformed(&rest, 1, rng).into_iter().map(grid).collect();
    let close: Positions = deformed(&rest, 2, rng).into_iter().map(grid).collect();
    let largest = open.iter().chain(&close).flatten().fold(0.0f32, |most, x| most.max(x.abs()));
    assert!(largest < 128.0, "{largest}");
    let mut scene = bth::from_bytes(&bytes(&rest, &triangles, &deformable())).unwrap();
    let bounds = [&open, &close].map(|ends| {
        scene.set_positions(0, ends).unwrap();
        scene.bounds().unwrap()
    });
    let mut builder = placed(&scene, &[IDENTITY]);
    let mut hits = 0;
    for eighths in 0..=8 {
        let expected: Positions =
            (open.iter().zip(&close)).map(|(a, b)| [0, 1, 2].map(|k| between(a[k], b[k], eighths))).collect();
        let share = eighths as f64 / 8.0;
        let update = scene.set_positions_between(0, [&open, &close], share).unwrap();
        assert_eq!((update.deformed, scene.object(0).positions), (1, &expected[..]), "{eighths}");
        builder.set_positions_between(0, [&open, &close], share).unwrap();
        builder.commit().unwrap();
        assert!(builder.scene().object(0).lines == scene.object(0).lines);
        let fresh = bth::from_bytes(&bytes(&expected, &triangles, &options())).unwrap();
        hits += compare(&fresh, &scene, 0, rng);
        let (lower, upper) = scene.bounds().unwrap();
        for k in 0..3 {
            assert!(lower[k] >= bounds[0].0[k].min(bounds[1].0[k]));
            assert!(upper[k] <= bounds[0].1[k].max(bounds[1].1[k]));
        }
    }
    assert!(hits > 3000, "{hits}");
}

/// Ends of any magnitude: positions never leave what lies between them, are the ends at shares of 0
/// and 1, and stay where both are equal.
#[test]
fn positions_between_two_times_never_leave_what_lies_between() {
    let (rest, triangles) = mesh(600);
    let mut scene = bth::from_bytes(&bytes(&rest, &triangles, &deformable())).unwrap();
    let rng = &mut Rng::new(28);
    let mut any = |_: &[f32; 3]| {
        [0; 3].map(|_| f32::from_bits(rng.next() as u32)).map(|x| if x.is_finite() { x } else { f32::MAX })
    };
    for share in [0.0, 5e-324, 0.1, 1.0 / 3.0, 0.5, 0.999, 1.0 - f64::EPSILON / 2.0, 1.0] {
        let open: Positions = rest.iter().map(&mut any).collect();
        let mut close: Positions = rest.iter().map(&mut any).collect();
        close[..100].copy_from_slice(&open[..100]);
        scene.set_positions_between(0, [&open, &close], share).unwrap();
        for ((found, a), b) in
            scene.object(0).positions.as_flattened().iter().zip(open.as_flattened()).zip(close.as_flattened())
        {
            assert!(*found >= a.min(*b) && *found <= a.max(*b), "{found} between {a} and {b}");
            assert!(share > 0.0 && share < 1.0 || found == if share == 0.0 { a } else { b });
            assert!(found.to_bits() != (-0.0f32).to_bits());
        }
        assert_eq!(scene.object(0).positions[99], open[99].map(|x| x + 0.0));
    }
}

/// A model of triangles that share no vertex, as STL files hold them.
#[test]
fn a_surface_is_closed_where_its_vertices_are_at_one_place() {
    let knot = bth_scenes::knot::torus_knot(64);
    let corners = |row: &[u32; 3]| row.map(|vertex| knot.positions[vertex as usize]);
    let mut positions: Positions = knot.triangles.iter().flat_map(corners).collect();
    let rows: Vec<[u32; 3]> =
        (0..knot.triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let mut scene = bth::from_bytes(&bytes(&positions, &rows, &deformable())).unwrap();
    assert_eq!(scene.is_closed(0), Some(true));
    positions[0][2] += 0.5;
    scene.set_positions(0, &positions).unwrap();
    assert_eq!(scene.is_closed(0), Some(false), "a corner stands off");
}

#[test]
fn what_cannot_be_set_is_an_error_and_changes_nothing() {
    let (rest, triangles) = mesh(600);
    let mut scene = bth::from_bytes(&bytes(&rest, &triangles, &deformable())).unwrap();
    let rng = &mut Rng::new(1);
    let good = deformed(&rest, 1, rng);
    scene.set_positions(0, &good).unwrap();
    let lines = scene.object(0).lines.to_vec();
    assert_eq!(scene.vertex_count(0), Some(rest.len()));
    for (i, x) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].into_iter().enumerate() {
        let mut bad = good.clone();
        bad[[0, 17, rest.len() - 1][i]][i] = x;
        assert_eq!(scene.set_positions(0, &bad).unwrap_err().code(), Code::NewPositions);
    }
    assert_eq!(scene.set_positions(0, &good[1..]).unwrap_err().code(), Code::NewPositions);
    assert_eq!(scene.set_positions(1, &good).unwrap_err().code(), Code::NoSuchObject);
    for share in [-0.1, 1.5, f64::NAN, f64::INFINITY] {
        assert_eq!(
            scene.set_positions_between(0, [&rest, &rest], share).unwrap_err().code(),
            Code::NewPositions
        );
    }
    let mut bad = rest.clone();
    bad[3][1] = f32::NAN;
    for ends in [[&rest, &bad], [&bad, &rest]] {
        assert_eq!(
            scene.set_positions_between(0, [ends[0], ends[1]], 0.5).unwrap_err().code(),
            Code::NewPositions
        );
        let ends = [&rest[..], &rest[1..]];
        assert_eq!(scene.set_positions_between(0, ends, 0.5).unwrap_err().code(), Code::NewPositions);
    }
    let mut staged = placed(&scene, &[IDENTITY]);
    staged.set_positions(0, &good).unwrap();
    assert!(staged.set_positions_between(0, [&rest, &bad], 0.5).is_err());
    staged.commit().unwrap();
    assert!(staged.scene().object(0).positions == good, "what was staged before remains");
    assert!(scene.object(0).lines == lines && scene.object(0).positions[5] == good[5]);
    let mut still = bth::from_bytes(&bytes(&rest, &triangles, &options())).unwrap();
    assert_eq!(still.vertex_count(0), None);
    assert_eq!(still.set_positions(0, &good).unwrap_err().code(), Code::NotDeformable);
    // All triangles without area: there is nothing to hit.
    scene.set_positions(0, &vec![[1.0; 3]; rest.len()]).unwrap();
    let ray = Ray::new([1.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    assert_eq!((scene.nearest(&ray), scene.crossings(&ray).count), (None, 0));
    assert!(scene.closest([0.0; 3], f32::INFINITY).is_none() && !scene.overlaps_sphere([1.0; 3], 1.0));
}

/// The scene of a builder with a file's object as it is in a manifest scene of one instance for
/// each transform.
fn placed(scene: &Scene, transforms: &[[f32; 12]]) -> SceneBuilder {
    let mut builder = SceneBuilder::new();
    let object = builder.add(scene);
    transforms.iter().for_each(|transform| {
        builder.instance(object, transform).unwrap();
    });
    builder.commit().unwrap();
    builder
}

#[test]
fn instances_follow_objects_that_deform_and_a_failed_commit_changes_nothing() {
    let (rest, triangles) = mesh(900);
    let file = bth::from_bytes(&bytes(&rest, &triangles, &deformable())).unwrap();
    let rng = &mut Rng::new(8);
    let transforms: Vec<_> = (0..40).map(|_| transform(rng)).collect();
    let mut builder = placed(&file, &transforms);
    let mut hits = 0;
    for kind in [1, 2, 3, 6, 0] {
        let positions = deformed(&rest, kind, rng);
        builder.set_positions(0, &deformed(&rest, 4, rng)).unwrap();
        builder.set_positions(0, &positions).unwrap();
        let update = builder.commit().unwrap();
        assert_eq!((update.deformed, update.placed), (1, 40));
        let fresh = bth::from_bytes(&bytes(&positions, &triangles, &options())).unwrap();
        hits += compare(placed(&fresh, &transforms).scene(), builder.scene(), 0, rng);
    }
    assert!(hits > 1500, "{hits}");
    // Positions that no instance can be placed with: everything stays, and the staged positions
    // too.
    let before = builder.scene().object(0).lines.to_vec();
    let bounds = builder.scene().bounds();
    let huge: Positions = rest.iter().map(|_| [3e38, 0.0, 0.0]).collect();
    let far = builder.instance(0, &IDENTITY.map(|x| x * 4.0)).unwrap();
    builder.set_positions(0, &huge).unwrap();
    assert_eq!(builder.commit().unwrap_err().code(), Code::NotFinite);
    assert!(builder.scene().object(0).lines == before && builder.scene().bounds() == bounds);
    builder.remove(far).unwrap();
    transforms.iter().enumerate().for_each(|(id, _)| builder.set_visible(id as u32, false).unwrap());
    builder.commit().unwrap();
    assert_eq!(builder.scene().object(0).positions[0], huge[0]);
    // A separate scene refuses them at once.
    let mut alone = placed(&file, &[IDENTITY.map(|x| x * 4.0)]).into_scene();
    let still = alone.object(0).lines.to_vec();
    assert_eq!(alone.set_positions(0, &huge).unwrap_err().code(), Code::NotFinite);
    assert!(alone.object(0).lines == still && alone.object(0).positions[0] == file.object(0).positions[0]);
}

#[test]
fn options_that_exclude_each_other_are_an_error() {
    let (positions, triangles) = mesh(600);
    let tets = CompileOptions { structure: Structure::Tets, ..deformable() };
    let no_geometry = CompileOptions { geometry: false, ..deformable() };
    let mut free = deformable();
    free.free.keep = bth_compile::free::KeepFree::All;
    for options in [tets, no_geometry, free] {
        let mesh = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
        let error = compile(mesh, &options, &Silent).unwrap_err().to_string();
        assert!(error.contains("BTH-L033"), "{error}");
    }
    // Tetrahedralizations are skipped where they would be a choice.
    let default = CompileOptions { structure: Default::default(), ..deformable() };
    let file = bytes(&positions, &triangles, &default);
    assert!(file != bytes(&positions, &triangles, &options()));
    assert!(bth::from_bytes(&file).unwrap().object(0).tet_leaves.is_empty());
}
