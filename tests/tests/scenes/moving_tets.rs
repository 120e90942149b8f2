//! Tetrahedra under objects whose vertices a file moves: in use where none is turned over, and with the answers of the BVH everywhere.

use crate::built::CHOICE;
use crate::sequences::{NODE, between, built, exchanging, folder, frames};
use crate::support::{animated, imported, options};
use bth::rays::StartRay;
use bth::{Isa, Scene};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, MotionOptions, Structure};
use bth_compile::scene;
use bth_random::Rng;
use bth_tests::rays::{alone, check_batch, starts};
use std::path::{Path, PathBuf};

/// Rays that start on the surface of a scene of one instance.
fn rays_from_the_surface(positions: &[[f32; 3]], triangles: &[[u32; 3]], rng: &mut Rng) -> Vec<StartRay> {
    let corners: Vec<_> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
    starts(&corners, 4000, rng.next())
}

/// Compares rays through tetrahedra, where there are any, with the BVH.
fn compare(bvh: &Scene, tets: &Scene, rays: &[StartRay]) {
    let expected = alone(bvh, rays);
    assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 300);
    let _choice = CHOICE.lock();
    let chosen = Isa::chosen();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        check_batch(tets, rays, &expected, isa);
    }
    chosen.choose().unwrap();
}

/// Compiles a clip with and without tetrahedra, and compares them at some times; returns how many tet leaves are in use and how many
/// stand aside at each.
fn used_at(clip: &(Vec<Vec<[f32; 3]>>, Vec<[u32; 3]>), segments: u32, times: &[f64]) -> Vec<(usize, usize)> {
    let (frames, triangles) = clip;
    let folder = folder(frames, triangles);
    let text = format!("objects = [{{ name = \"knot\", sequence = \"knot_###.obj\", rate = 1 }}]\n{NODE}");
    let of = |structure| {
        let motion = MotionOptions { poses: 4, segments };
        let mut options = CompileOptions { structure, deformable: true, motion, ..options() };
        options.tets.worker = bth_tests::worker().map(Into::into);
        let (file, report) = built(&text, folder.path(), &options);
        let objects = report.objects[0].motion.as_ref().unwrap().segments.len();
        (bth::from_file(file).unwrap(), report.objects[0].tet_leaves, objects)
    };
    let (mut tets, leaves, objects) = of(Structure::Tets);
    let (mut bvh, none, _) = of(Structure::Bvh);
    assert_eq!((leaves, none, objects > 1), (1, 0, segments > 1));
    let rng = &mut Rng::new(8);
    let used = times.iter().map(|seconds| {
        let update = tets.set_seconds(*seconds).unwrap();
        bvh.set_seconds(*seconds).unwrap();
        compare(&bvh, &tets, &rays_from_the_surface(&between(frames, *seconds), triangles, rng));
        (update.tet_leaves_in_use, update.tet_leaves_aside)
    });
    used.collect()
}

#[test]
fn tetrahedra_under_a_sequence_are_in_use_where_none_is_turned_over() {
    if bth_tests::worker().is_none() {
        return;
    }
    let (mut clip, triangles) = frames(4, 0.001);
    clip[3] = frames(4, 0.3).0.swap_remove(3);
    let used = used_at(&(clip, triangles), 1, &[1.0, 3.0, 0.5, 2.9, 2.0]);
    assert_eq!(used, [(1, 0), (0, 1), (1, 0), (0, 1), (1, 0)]);
}

#[test]
fn each_tree_of_a_divided_clip_has_tetrahedra_of_its_own() {
    if bth_tests::worker().is_none() {
        return;
    }
    let used = used_at(&exchanging(24), 4, &[0.5, 3.0, 1.0, 2.5, 1.4, 0.25]);
    assert_eq!(used, [(1, 0), (0, 1), (1, 0), (0, 1), (0, 1), (1, 0)]);
}

/// The skinned models beside the checkout: a figure that walks and a cylinder that bends.
#[test]
fn skinned_models_with_tetrahedra_have_the_answers_of_the_bvh() {
    if bth_tests::worker().is_none() {
        return;
    }
    let is_skinned = |path: &&PathBuf| {
        path.file_stem().is_some_and(|name| name == "khr_CesiumMan" || name == "khr_RiggedSimple")
    };
    for path in animated().iter().filter(is_skinned) {
        let (manifest, _) = imported(path);
        let of = |structure| {
            let mut options = CompileOptions { structure, deformable: true, ..options() };
            options.tets.worker = bth_tests::worker().map(Into::into);
            let (compiled, report) =
                scene::compile(&manifest, path.parent().unwrap(), Path::new("x"), &options, &Silent)
                    .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            (bth::from_bytes(&compiled.bytes).unwrap(), report.objects[0].tet_leaves)
        };
        let ((mut tets, leaves), (mut bvh, _)) = (of(Structure::Tets), of(Structure::Bvh));
        assert_eq!(leaves, 1, "{}", path.display());
        let triangles = tets.object(0).triangles.to_vec();
        let rng = &mut Rng::new(9);
        for seconds in [0.0, 0.4, 1.1] {
            let update = tets.set_seconds(seconds).unwrap();
            // The first time is the one at which the scene was opened.
            let (used, aside) = (update.tet_leaves_in_use, update.tet_leaves_aside);
            assert_eq!((update.deformed, used + aside), (usize::from(seconds > 0.0), update.deformed));
            bvh.set_seconds(seconds).unwrap();
            let positions = bvh.positions(0).to_vec();
            compare(&bvh, &tets, &rays_from_the_surface(&positions, &triangles, rng));
        }
    }
}

/// Without `deformable` nothing is tetrahedralized under vertices that move.
#[test]
fn tetrahedra_under_a_sequence_are_made_on_request_only() {
    let (clip, triangles) = frames(2, 0.001);
    let folder = folder(&clip, &triangles);
    let text = format!("objects = [{{ name = \"knot\", sequence = \"knot_###.obj\" }}]\n{NODE}");
    for structure in [Structure::Tets, Structure::Bth] {
        let (_, report) = built(&text, folder.path(), &CompileOptions { structure, ..options() });
        assert_eq!(report.objects[0].tet_leaves, 0);
    }
    let options = CompileOptions { structure: Structure::Bth, deformable: true, ..options() };
    assert_eq!(built(&text, folder.path(), &options).1.objects[0].tet_leaves, 0);
}
