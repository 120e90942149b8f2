//! Several hits through instances: one after the other, masks and mirrored instances.

use crate::{all_hits, check_queries, layers, rays};
use bth::rays::{PrimitiveRef, Ray};
use bth::{Accept, Cull, Scene};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_random::Rng;
use bth_scenes::knot::torus_knot;
use bth_tests::oracle;
use bth_tests::structures::bits;

/// Instances of a knot and of layers: mirrored, sheared, hidden, of extreme scales, and twice at
/// the same place.
pub(crate) fn instances() -> Scene {
    const NODES: &str = r#"
version = 1
objects = [{ name = "knot", model = "knot.ply" }, { name = "layers", model = "layers.ply" }]
nodes = [
    { name = "plain", object = "layers" },
    { name = "same", object = "layers" },
    { name = "turned", object = "knot", rotation = { axis = [1, 2, 3], degrees = 77 }, translation = [1, 0, 0] },
    { name = "mirrored", object = "layers", scale = [-1, 1, 1], translation = [2, 0, 0.5] },
    { name = "hidden", object = "layers", visible = false },
    { name = "flattened", object = "knot", scale = [1, 0.001, 100], translation = [0, -3, 5] },
    { name = "sheared", object = "knot", matrix = [[1, 0.7, 0, -2], [0, 1, 0.3, 0.1], [0.2, 0, -2, 0]] },
    { name = "tiny", object = "knot", scale = [1e-22, 1e-22, 1e-22] },
    { name = "huge", object = "layers", scale = [1e21, 1e21, 1e21], translation = [0, 0, 1] },
"#;
    let folder = tempfile::tempdir().unwrap();
    bth_scenes::write::file(&torus_knot(400), &folder.path().join("knot.ply")).unwrap();
    bth_scenes::write::file(&layers(2), &folder.path().join("layers.ply")).unwrap();
    let mut text = NODES.to_owned();
    // As many that the top level has several nodes.
    for i in 0..40 {
        text += &format!("    {{ name = \"{i}\", object = \"layers\", translation = [{i}, 1, 1] }},\n");
    }
    let manifest = bth_scene::parse(&(text + "]\n"), "hits.manifest".as_ref()).unwrap();
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let compiled = bth_compile::scene::compile(&manifest, folder.path(), "x".as_ref(), &options, &Silent);
    bth::from_bytes(&compiled.unwrap().0.bytes).unwrap()
}

/// The corners of all visible instances in world space, rounded.
pub(crate) fn world_corners(scene: &Scene) -> Vec<[[f32; 3]; 3]> {
    let instances = (0..scene.instance_count()).map(|i| scene.instance(i)).filter(|view| view.visible);
    let world = |view: bth::InstanceView| {
        let place = move |p: [f32; 3]| {
            let [x, y, z] = p.map(f64::from);
            view.to_world.map(|[a, b, c, moved]| (a * x + b * y + c * z + moved) as f32)
        };
        let triangles = oracle::triangles(&scene.object(view.object));
        triangles.into_iter().map(move |triangle| triangle.corners.map(place))
    };
    let corners = instances.flat_map(world);
    corners.filter(|corners| corners.iter().flatten().all(|x| x.abs() < 1e4)).collect()
}

#[test]
fn hits_in_instances_are_those_that_the_nearest_hit_finds_one_after_the_other() {
    let scene = instances();
    let mut found = 0;
    for (i, ray) in rays(&scene, &world_corners(&scene), 1500, 6).into_iter().enumerate() {
        check_queries(&scene, &ray, "instances");
        let mut rest = ray;
        let mut hits = all_hits(&scene, &ray, &Accept::default()).into_iter().peekable();
        // Directions that are scaled in an object's space round the range, too, so only others are
        // ended at hits.
        let ordinary = i % 11 != 6 && i % 11 != 7;
        while let Some(hit) = hits.peek().copied().filter(|_| ordinary) {
            assert_eq!(scene.nearest(&rest).as_ref().map(bits), Some(bits(&hit)), "{rest:?}");
            rest.tmin = hit.t.next_up();
            while hits.next_if(|next| next.t == hit.t).is_some() {
                found += 1;
            }
        }
    }
    assert!(found > 3000, "{found}");
}

/// With a direction so long that t is denormal, hits at different distances have the same t. Of
/// these the first is that in the first instance, in whatever order instances are visited, and a
/// range that ends at this t holds all of them.
#[test]
fn hits_whose_t_are_rounded_to_the_same_are_ordered_by_instance() {
    const NODES: &str = r#"
version = 1
objects = [{ name = "layers", model = "layers.ply" }]
nodes = [
    { name = "0", object = "layers", translation = [0, 0, 1.0000003] },
    { name = "1", object = "layers", translation = [0, 0, 1] },
    { name = "2", object = "layers", translation = [0, 0, 1.0000001] },
]
"#;
    let folder = tempfile::tempdir().unwrap();
    bth_scenes::write::file(&layers(2), &folder.path().join("layers.ply")).unwrap();
    let manifest = bth_scene::parse(NODES, "hits.manifest".as_ref()).unwrap();
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let compiled = bth_compile::scene::compile(&manifest, folder.path(), "x".as_ref(), &options, &Silent);
    let scene = bth::from_bytes(&compiled.unwrap().0.bytes).unwrap();
    for sign in [1.0, -1.0] {
        let ray = Ray::new([0.3, 0.2, 1.0 - 2.0 * sign], [0.0, 0.0, sign * f32::MAX]);
        let hits = all_hits(&scene, &ray, &Accept::default());
        let first = hits[0];
        let equal = hits.iter().filter(|hit| hit.t == first.t).count();
        assert!(equal > 1 && first.t < f32::MIN_POSITIVE, "{hits:?}");
        assert!(hits.is_sorted_by_key(|hit| (hit.t.to_bits(), hit.primitive.instance)), "{hits:?}");
        for cull in [Cull::None, Cull::Back, Cull::Front] {
            let accept = Accept { cull, ..Accept::default() };
            let expected = all_hits(&scene, &ray, &accept).first().copied();
            assert_eq!(scene.nearest_accepted(&ray, &accept), expected, "{cull:?}");
        }
        let mut batch = [bth::rays::Hit::MISS; 20];
        scene.batch(&[ray; 20]).nearest(&mut batch);
        assert_eq!(batch.map(|hit| bits(&hit)), [bits(&first); 20]);
        let up_to = ray.with_range(0.0, first.t);
        assert_eq!(all_hits(&scene, &up_to, &Accept::default()), hits[..equal]);
        assert_eq!(scene.nearest(&up_to), Some(first));
        assert!(
            scene.any(&ray.with_range(first.t, first.t))
                && !scene.any(&ray.with_range(0.0, first.t.next_down()))
        );
    }
}

#[test]
fn masks_hide_instances_from_rays_without_a_common_bit() {
    let mut scene = instances();
    let (unmasked, mut rng) = (instances(), Rng::new(8));
    let mut masks = vec![u32::MAX; scene.instance_count() as usize];
    let rays = rays(&scene, &world_corners(&scene), 400, 7);
    for round in 0..3 {
        for ray in &rays {
            for mask in [0, 1, 6, u32::MAX] {
                let accept = Accept { mask, ..Accept::default() };
                let mut expected = all_hits(&unmasked, ray, &Accept::default());
                expected.retain(|hit| masks[hit.primitive.instance as usize] & mask != 0);
                assert_eq!(all_hits(&scene, ray, &accept), expected, "round {round}, {mask}: {ray:?}");
                assert_eq!(scene.nearest_accepted(ray, &accept), expected.first().copied());
                assert_eq!(scene.any_accepted(ray, &accept), !expected.is_empty());
                assert_eq!(scene.count_hits(ray, &accept), expected.len());
            }
            // Queries without conditions ignore masks.
            assert_eq!(scene.nearest(ray), unmasked.nearest(ray));
        }
        for instance in 0..masks.len() as u32 {
            if rng.below(2) == 0 {
                let mask = [0, 1, 2, 7, 8][rng.below(5) as usize];
                scene.set_instance_mask(instance, mask);
                masks[instance as usize] = mask;
            }
        }
    }
    // The group of all triangles of the layers.
    let layers = scene.object_of(0);
    scene.set_group_mask(layers, 0, 2);
    for ray in &rays {
        for mask in [1, 2, 3] {
            let mut expected = all_hits(&unmasked, ray, &Accept::default());
            expected.retain(|hit| {
                let instance = hit.primitive.instance;
                let group = if scene.object_of(instance) == layers { 2 } else { u32::MAX };
                masks[instance as usize] & mask != 0 && group & mask != 0
            });
            assert_eq!(all_hits(&scene, ray, &Accept { mask, ..Accept::default() }), expected);
        }
    }
}

#[test]
fn mirrored_instances_keep_their_front() {
    let scene = instances();
    // Instances 0 and 3 are the same layers, the second one mirrored. Both are hit from below,
    // where of two triangles at the same place the one with the id 3 modulo 4 has its front.
    let ray = Ray::new([0.5, 0.7, -5.0], [0.0, 0.0, 1.0]);
    for (cull, count) in [(Cull::None, 4), (Cull::Back, 2), (Cull::Front, 2)] {
        let hits = all_hits(&scene, &ray, &Accept { cull, ..Accept::default() });
        for instance in [0, 3] {
            let of_instance: Vec<_> =
                hits.iter().map(|hit| hit.primitive).filter(|of| of.instance == instance).collect();
            assert_eq!(of_instance.len(), count, "{instance}: {hits:?}");
            let seen = |of: &PrimitiveRef| match cull {
                Cull::None => true,
                Cull::Back => of.triangle % 4 == 3,
                Cull::Front => of.triangle % 4 != 3,
            };
            assert!(of_instance.iter().all(seen), "{instance}: {hits:?}");
        }
    }
}
