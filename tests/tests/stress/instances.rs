//! Instances under transforms: closed surfaces stay closed, and hits stay within a documented
//! distance of the exact ones.

use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_oracle::World;
use bth_random::Rng;
use bth_scenes::blob::blob;

/// Nodes, each with an instance of a closed surface around the origin of its space.
const NODES: &str = r#"
version = 1
objects = [{ name = "blob", model = "blob.ply" }]
nodes = [
    { name = "plain", object = "blob" },
    { name = "turned", object = "blob", rotation = { axis = [1, 2, 3], degrees = 77 }, translation = [10, 0, 0] },
    { name = "mirrored", object = "blob", scale = [-1, 1, 1], rotation = [0.1, 0.2, 0.3, 0.4], translation = [0, 10, 0] },
    { name = "flattened", object = "blob", scale = [1, 0.001, 100], translation = [0, -300, 5] },
    { name = "sheared", object = "blob", matrix = [[1, 0.7, 0, -20], [0, 1, 0.3, 0.1], [0.2, 0, -2, 0]] },
    { name = "far", object = "blob", scale = [0.5, 0.5, 0.5], translation = [30000, -50000, 10000] },
    { name = "grown", scale = [1e15, 1e15, 1e15], rotation = { axis = [0, 1, 1], degrees = 20 } },
    { name = "grown and shrunk", parent = "grown", object = "blob", scale = [1e-15, 1e-15, 1e-15], translation = [4e-14, 0, 0] },
    { name = "shrunk", scale = [1e-12, 1e-12, 1e-12], translation = [0, 0, 40] },
    { name = "tiny", parent = "shrunk", object = "blob", rotation = [0, 0.6, 0, 0.8] },
    { name = "huge", object = "blob", scale = [1e18, 3e18, 2e18], translation = [0, 0, 1e19] },
]
"#;

/// Index of the instance of the node `tiny`.
const TINY: u32 = 7;

fn scene() -> Scene {
    let folder = tempfile::tempdir().unwrap();
    bth_scenes::write::file(&blob(300), &folder.path().join("blob.ply")).unwrap();
    let manifest = bth_scene::parse(NODES, "stress.manifest".as_ref()).unwrap();
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let compiled = bth_compile::scene::compile(&manifest, folder.path(), "x".as_ref(), &options, &Silent);
    bth::from_bytes(&compiled.unwrap().0.bytes).unwrap()
}

type Rows = [[f64; 4]; 3];

fn apply(rows: &Rows, p: [f64; 3]) -> [f64; 3] {
    rows.map(|[a, b, c, moved]| a * p[0] + b * p[1] + c * p[2] + moved)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Norm (largest sum of a row) and condition number of the linear part.
fn norm_and_condition(rows: &Rows) -> (f64, f64) {
    let norm =
        |rows: [[f64; 3]; 3]| rows.map(|r| r.iter().map(|x| x.abs()).sum()).into_iter().fold(0.0, f64::max);
    let linear = rows.map(|[a, b, c, _]| [a, b, c]);
    let [a, b, c] = linear;
    let columns = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = dot(a, columns[0]);
    let inverse: [[f64; 3]; 3] =
        std::array::from_fn(|k| std::array::from_fn(|j| columns[j][k] / determinant));
    (norm(linear), norm(linear) * norm(inverse))
}

fn greatest(v: impl IntoIterator<Item = f64>) -> f64 {
    v.into_iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Rays from inside an instance: at its vertices, at middles of its edges, and anywhere.
fn rays_from_inside(scene: &Scene, instance: u32, rng: &mut Rng) -> Vec<Ray> {
    let view = scene.instance(instance);
    let object = scene.object(view.object);
    let origin = apply(&view.to_world, [0.0; 3]).map(|x| x as f32);
    let ray = |_: usize| loop {
        let [a, b, c] = object.triangles[rng.below(object.triangles.len() as u64) as usize]
            .map(|v| object.positions[v as usize].map(f64::from));
        let s = [0.0, 0.5, f64::from(rng.unit_f32())][rng.below(3) as usize];
        let r = [0.0, f64::from(rng.unit_f32()) * (1.0 - s)][rng.below(2) as usize];
        let at = [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + r * (c[k] - a[k]));
        let target = apply(&view.to_world, at);
        let direction = [0, 1, 2].map(|k| (target[k] - f64::from(origin[k])) as f32);
        if direction != [0.0; 3] {
            return Ray::new(origin, direction);
        }
    };
    (0..600).map(ray).collect()
}

/// Let M be an instance's linear part, T its translation, κ the condition number of M, b the
/// largest coordinate of the object's box and o the ray's origin, all in the maximum norm. The
/// point at the reported t lies within 2^-21 (κ (|o| + |T|) + |M| b) of the plane of the reported
/// triangle: t is off by at most that over the speed at which the ray nears the plane.
#[test]
fn closed_surfaces_stay_closed_under_transforms_and_t_keeps_its_bound() {
    let scene = scene();
    let mut rng = Rng::new(3);
    let world = World::new(&scene);
    for instance in 0..scene.instance_count() {
        let view = scene.instance(instance);
        let object = scene.object(view.object);
        let (norm, condition) = norm_and_condition(&view.to_world);
        let size = greatest(object.header.lower.into_iter().chain(object.header.upper).map(f64::from));
        let rays = rays_from_inside(&scene, instance, &mut rng);
        let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        scene.batch(&rays).nearest(&mut hits);
        scene.batch(&rays).any(&mut found);
        let mut worst: f64 = 0.0;
        for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            assert!(hit.is_hit() && found[i], "leak: {ray:?} within instance {instance}");
            assert_eq!(scene.nearest(ray).unwrap_or(Hit::MISS), *hit);
            let of = scene.instance(hit.primitive.instance);
            assert_eq!(hit.primitive.instance, instance, "instances stand apart: {ray:?}");
            let corners = object.triangles[hit.primitive.triangle as usize]
                .map(|v| apply(&of.to_world, object.positions[v as usize].map(f64::from)));
            let [a, b, c] = corners;
            let normal = cross([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
            let point = [0, 1, 2]
                .map(|k| f64::from(ray.origin[k]) + f64::from(hit.t) * f64::from(ray.direction[k]) - a[k]);
            let distance = dot(normal, point).abs() / dot(normal, normal).sqrt();
            let translation = greatest(view.to_world.map(|row| row[3]));
            let origin = greatest(ray.origin.map(f64::from));
            let bound = (condition * (origin + translation) + norm * size) / f64::from(1 << 21);
            worst = worst.max(distance / bound);
            // Of a sample, the exact truth for the instance as it is: hit as well, and at about the
            // same t.
            if i % 10 == 0 {
                let exact = world.hit(ray);
                assert_eq!((exact.is_hit(), exact.primitive.instance), (true, instance), "{ray:?}");
                if exact.primitive == hit.primitive {
                    let speed = dot(normal, ray.direction.map(f64::from)).abs() / dot(normal, normal).sqrt();
                    assert!(f64::from((exact.t - hit.t).abs()) * speed <= bound, "{exact:?} {hit:?}");
                }
            }
        }
        assert!(worst <= 1.0, "instance {instance}: {worst} of the bound");
    }
}

#[test]
fn instances_take_less_than_200_bytes_whether_or_not_each_has_tracks_of_its_own() {
    for own_tracks in [false, true] {
        let count = 10_000;
        let mut scene = bth::from_bytes(&bth_tests::crowd::crowd(count, own_tracks)).unwrap();
        for frame in [0, 17, 1200] {
            let update = scene.set_frame(frame).unwrap();
            assert_eq!(update.visible, count as usize);
            let (instances, hierarchy) = scene.heap_bytes();
            let each = (instances + hierarchy) as f64 / f64::from(count);
            assert!(
                each < 200.0,
                "frame {frame}, own tracks {own_tracks}: {instances} and {hierarchy}, {each} each"
            );
        }
    }
}

/// The winding number of a point is that along any ray from it, however the instance is
/// transformed, and a mirrored instance keeps its inside.
#[test]
fn points_inside_of_instances_are_found_under_every_transform() {
    let scene = scene();
    let mut rng = Rng::new(41);
    for instance in 0..scene.instance_count() {
        let view = scene.instance(instance);
        let object = scene.object(view.object);
        assert_eq!(scene.is_closed(view.object), Some(true));
        for round in 0..200 {
            let vertex = object.positions[rng.below(object.positions.len() as u64) as usize];
            let share = [0.0, 0.5, 0.9, 1.25][round % 4];
            let point = apply(&view.to_world, vertex.map(|x| f64::from(x) * share)).map(|x| x as f32);
            let winding = scene.winding(point);
            // The tiny instance is smaller than a step of f32 at its place, so rounding may move
            // points into it.
            if instance != TINY || share == 0.0 {
                assert_eq!(winding, i32::from(share < 1.0), "instance {instance}: {point:?}");
            }
            assert_eq!(scene.contains(point), winding != 0);
            // Towards another instance, most often.
            let other = scene.instance(rng.below(u64::from(scene.instance_count())) as u32);
            let target = apply(&other.to_world, [0.25, -0.125, 0.5]);
            let ray = Ray::new(point, [0, 1, 2].map(|k| (target[k] - f64::from(point[k])) as f32));
            assert_eq!(scene.crossings(&ray).winding, winding, "instance {instance}: {ray:?}");
            assert_eq!(scene.crossings(&ray.with_range(f32::NEG_INFINITY, f32::INFINITY)).winding, 0);
        }
    }
}
