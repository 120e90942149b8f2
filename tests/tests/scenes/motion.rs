//! Animation: motion, visibility, and transforms that cannot be used.

use crate::support::{compiled, manifest, models, varied};
use bth::rays::{Hit, PrimitiveRef, Ray, Start, StartRay};
use bth_random::Rng;
use bth_tests::rays::{alone, check_batch, onward};

fn rays(count: usize) -> Vec<Ray> {
    let mut rng = Rng::new(8);
    (0..count)
        .map(|_| {
            let origin = [(); 3].map(|()| 40.0 * rng.unit_f32() - 20.0);
            let target = [(); 3].map(|()| 12.0 * rng.unit_f32() - 6.0);
            let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
            Ray::new(origin, direction)
        })
        .collect()
}

fn hits(scene: &bth::Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    hits
}

#[test]
fn a_frame_does_not_depend_on_those_before() {
    let folder = models();
    let (mut scene, _) = compiled(&varied(), folder.path());
    let rays = rays(500);
    let fresh: Vec<_> = (0..=40)
        .map(|frame| {
            let (mut scene, _) = compiled(&varied(), folder.path());
            scene.set_frame(frame).unwrap();
            hits(&scene, &rays)
        })
        .collect();
    assert!(fresh[0].iter().filter(|h| h.is_hit()).count() > 100);
    let mut different = 0;
    for frame in [40, 0, 17, 3, 3, 39, 12, 28, 29, 30, 31, 11, 9, 10] {
        scene.set_frame(frame).unwrap();
        assert!(hits(&scene, &rays) == fresh[frame as usize], "frame {frame}");
        different += u32::from(fresh[frame as usize] != fresh[0]);
    }
    assert!(different > 8);
}

/// Cameras are framed by these bounds: otherwise parts of a sequence that are rendered separately
/// would not match.
#[test]
fn bounds_of_instances_depend_on_neither_rays_nor_mapping() {
    let (folder, options) = (models(), crate::support::options());
    let (compiled, _) = bth_compile::scene::compile(
        &varied(),
        folder.path(),
        std::path::Path::new("x"),
        &options,
        &bth_compile::Silent,
    )
    .unwrap();
    let path = folder.path().join("scene.bth");
    std::fs::write(&path, &compiled.bytes).unwrap();
    let mut read = bth::open(&path).unwrap();
    // SAFETY: no process writes to the file.
    #[allow(unsafe_code)]
    let mut mapped = unsafe { bth::map(&path) }.unwrap();
    let bounds = |scene: &bth::Scene| -> Vec<_> {
        (0..scene.instance_count()).map(|i| scene.instance_bounds(i)).collect()
    };
    let rays = rays(500);
    for frame in [0, 12, 30, 12] {
        let fresh = mapped.set_frame(frame).map(|_| bounds(&mapped)).unwrap();
        read.set_frame(frame).unwrap();
        assert_eq!(bounds(&read), fresh, "frame {frame}");
        assert!(hits(&read, &rays) == hits(&mapped, &rays), "frame {frame}");
    }
    assert!(mapped.touched_objects() > 0 && bounds(&read).iter().flatten().count() > 1);
}

#[test]
fn only_what_moved_is_placed_anew() {
    let folder = models();
    let (mut scene, report) = compiled(&varied(), folder.path());
    assert_eq!((report.instances, scene.instance_count()), (37, 37));
    // At 1.2 s the turntable with its 32 instances and the shrinking instance move; the floor and
    // three others do not.
    scene.set_frame(11).unwrap();
    let update = scene.set_frame(12).unwrap();
    assert_eq!((update.nodes, update.placed), (34, 33), "{update:?}");
    let again = scene.set_frame(12).unwrap();
    assert_eq!((again.nodes, again.placed), (0, 0));
    let blink = scene.set_frame(9).unwrap();
    assert_eq!(blink.placed, 34, "the blinking one comes to sight too");
    assert_eq!(scene.set_frame(30).unwrap().visible, 36, "scale 0 hides at 3 s");
}

#[test]
fn hidden_instances_are_hit_by_no_ray_and_others_are() {
    let folder = models();
    let text = r#"
        frames = { last = 4, rate = 1 }
        objects = [{ name = "quad", model = "quad.obj" }]
        nodes = [{ name = "above" }, { name = "quad", object = "quad", parent = "above" }]
        tracks = [
            { node = "above", property = "visible", times = [0, 1], values = [true, false] },
            { node = "quad", property = "visible", times = [2], values = [true] },
            { node = "above", property = "scale", interpolation = "step", times = [0, 3], values = [[1, 1, 1], [1, 0, 1]] },
        ]"#;
    let (mut scene, _) = compiled(&manifest(text), folder.path());
    let ray = Ray::new([0.1, 5.0, 0.3], [0.0, -1.0, 0.0]);
    let start = Start { primitive: PrimitiveRef { instance: 0, triangle: 0 }, u: 0.25, v: 0.25 };
    for (frame, seen) in [(0, true), (1, false), (2, false), (3, false), (0, true)] {
        scene.set_frame(frame).unwrap();
        assert_eq!(scene.nearest(&ray).is_some(), seen, "frame {frame}");
        assert_eq!(scene.any(&ray), seen, "frame {frame}");
        assert_eq!(scene.check_start(&start).is_ok(), seen, "frame {frame}");
        assert_eq!(scene.instance(0).visible, seen, "frame {frame}");
    }
}

#[test]
fn transforms_that_cannot_be_shown_name_the_node_and_change_nothing() {
    let folder = models();
    let text = r#"
        frames = { last = 9, rate = 1 }
        objects = [{ name = "quad", model = "quad.obj" }]
        nodes = [{ name = "st\u00e4nder" }, { name = "a \"quad\"", object = "quad", parent = "st\u00e4nder" }]
        tracks = [
            { node = "st\u00e4nder", property = "scale", times = [0, 1, 2, 3, 4, 5], values = [[1, 1, 1], [1, 1e-9, 1], [1, 1, 1], [1e200, 1e200, 1e200], [1e300, 1e300, 1], [1, 1, 1]] },
            { node = "a \"quad\"", property = "scale", interpolation = "step", times = [0, 4, 5], values = [[1, 1, 1], [1e300, 1, 1], [1, 1, 1]] },
            { node = "a \"quad\"", property = "rotation", interpolation = "cubic", times = [6, 8], values = [[[0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]], [[0, 0, 0, 0], [0, 0, 0, -1], [0, 0, 0, 0]]] },
        ]"#;
    let (mut scene, _) = compiled(&manifest(text), folder.path());
    let rays = rays(50);
    let before = hits(&scene, &rays);
    assert!(before.iter().any(Hit::is_hit));
    for (frame, code) in [(1, "BTH-S001"), (3, "BTH-S002"), (4, "BTH-S002"), (7, "BTH-S002")] {
        let error = scene.set_frame(frame).unwrap_err();
        assert_eq!(error.code().as_str(), code, "frame {frame}: {error}");
        assert!(error.to_string().contains(&format!("node \"a \\\"quad\\\"\" at {frame} s")), "{error}");
        assert!(!error.hint().is_empty() && scene.seconds() == 0.0);
        assert!(hits(&scene, &rays) == before, "frame {frame}");
    }
    for seconds in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = scene.set_seconds(seconds).unwrap_err();
        assert!(error.to_string().contains(&format!("expected a finite time, found {seconds}")), "{error}");
        assert!(error.code().as_str() == "BTH-S002" && scene.seconds() == 0.0, "{error}");
    }
    for frame in [2, 5, 8] {
        scene.set_frame(frame).unwrap();
    }
}

#[test]
fn normals_stand_on_their_surfaces_in_the_world() {
    let folder = models();
    let (mut scene, _) = compiled(&varied(), folder.path());
    for frame in [0, 13, 40] {
        scene.set_frame(frame).unwrap();
        for i in (0..scene.instance_count()).filter(|i| scene.instance(*i).visible).collect::<Vec<_>>() {
            let view = scene.instance(i);
            let object = scene.object(view.object);
            let point = |v: u32| {
                let p = object.positions[v as usize].map(f64::from);
                view.to_world.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
            };
            let own = |v: u32| object.positions[v as usize].map(f64::from);
            for triangle in object.triangles.iter().take(50) {
                let edge = |f: &dyn Fn(u32) -> [f64; 3], k: usize| -> [f64; 3] {
                    let (a, b) = (f(triangle[0]), f(triangle[k]));
                    [0, 1, 2].map(|k| b[k] - a[k])
                };
                let (e, f) = (edge(&own, 1), edge(&own, 2));
                let normal = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| e[i] * f[j] - e[j] * f[i]);
                let world = scene.normal_to_world(i, normal);
                let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                for edge in [edge(&point, 1), edge(&point, 2)] {
                    let dot: f64 = (0..3).map(|k| edge[k] * world[k]).sum();
                    assert!(dot.abs() <= 1e-10 * length(edge) * length(world), "instance {i}: {dot}");
                }
            }
        }
    }
}

#[test]
fn starts_have_the_same_hits_in_batches_and_alone_also_with_tetrahedra() {
    use bth_compile::pipeline::{CompileOptions, Structure};
    let folder = models();
    let mut options = CompileOptions { structure: Structure::Tets, ..CompileOptions::default() };
    options.tets.worker = bth_tests::worker().map(Into::into);
    if options.tets.worker.is_none() {
        options.structure = Structure::Bvh;
    }
    let name = std::path::Path::new("x");
    let compiled =
        bth_compile::scene::compile(&varied(), folder.path(), name, &options, &bth_compile::Silent);
    let mut scene = bth::from_bytes(&compiled.unwrap().0.bytes).unwrap();
    let mut hit_count = 0;
    for frame in [0, 12, 35] {
        scene.set_frame(frame).unwrap();
        let onward = onward(&hits(&scene, &rays(2000)), scene.object(0).triangles.len(), 5);
        let expected = alone(&scene, &onward);
        check_batch(&scene, &onward, &expected, format_args!("frame {frame}"));
        let of_others = |(ray, hit): &(&StartRay, &Hit)| ray.start.primitive.instance > 1 && hit.is_hit();
        hit_count += onward.iter().zip(&expected).filter(of_others).count();
    }
    assert!(hit_count > 300, "{hit_count}");
}
