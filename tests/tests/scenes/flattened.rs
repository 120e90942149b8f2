//! Hits of a scene equal hits of its geometry in world space, compiled as one object.

use crate::support::{animated, compiled, imported, models, options, varied};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::compile;
use bth_random::Rng;

/// The scene's visible geometry, and the first flat triangle of each instance.
fn flatten(scene: &bth::Scene) -> (bth::Scene, Vec<(u32, u32)>) {
    let (mut model, mut first) = (bth_scenes::Model::default(), Vec::new());
    for i in 0..scene.instance_count() {
        let view = scene.instance(i);
        if !view.visible {
            continue;
        }
        first.push((model.triangles.len() as u32, i));
        let object = scene.object(view.object);
        let base = model.positions.len() as u32;
        model.positions.extend(object.positions.iter().map(|p| {
            let p = p.map(f64::from);
            view.to_world.map(|r| (r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3]) as f32)
        }));
        model.triangles.extend(object.triangles.iter().map(|t| t.map(|v| base + v)));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flat.ply");
    bth_scenes::write::file(&model, &path).unwrap();
    let (compiled, _) = compile(&path, &options(), &Silent).unwrap();
    (bth::from_bytes(&compiled.bytes).unwrap(), first)
}

fn rays(flat: &bth::Scene, count: usize, seed: u64) -> Vec<Ray> {
    let object = flat.object(0);
    let mut rng = Rng::new(seed);
    let extent = [0, 1, 2].map(|k| object.header.upper[k] - object.header.lower[k]);
    let size = extent.into_iter().fold(0.0, f32::max);
    (0..count)
        .map(|i| {
            // At the middle of a triangle, from somewhere about; every other ray starts near the
            // surface.
            let corners = object.triangles[rng.below(object.triangles.len() as u64) as usize]
                .map(|v| object.positions[v as usize]);
            let target = [0, 1, 2].map(|k| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0);
            let distance = if i % 2 == 0 { size } else { 0.02 * size };
            let origin = target.map(|x| x + distance * (rng.unit_f32() - 0.5));
            let direction = [0, 1, 2].map(|k| (target[k] - origin[k]) * 0.7);
            Ray::new(origin, direction)
        })
        .collect()
}

/// Compares at some frames; returns how many rays hit.
fn compare(name: &str, scene: &mut bth::Scene, frames: &[i32]) -> usize {
    let mut hit = 0;
    for &frame in frames {
        scene.set_frame(frame).unwrap();
        let (flat, first) = flatten(scene);
        let rays = rays(&flat, 4000, frame as u64 + 1);
        let (mut ours, mut theirs) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
        scene.batch(&rays).nearest(&mut ours);
        flat.batch(&rays).nearest(&mut theirs);
        let (mut graze, mut other_name) = (0, 0);
        for ((ray, a), b) in rays.iter().zip(&ours).zip(&theirs) {
            hit += usize::from(b.is_hit());
            // 1e-5 of the way, or a few roundings of the coordinates of the flattened vertices.
            let length = ray.direction.iter().fold(0.0f32, |m, d| m.max(d.abs()));
            let near = |a: &Hit, b: &Hit, roundings: f32| {
                let most =
                    1e-5 * a.t.abs().max(b.t.abs()) * length + roundings * size(&flat, ray) * f32::EPSILON;
                a.is_hit() == b.is_hit() && (!a.is_hit() || (a.t - b.t).abs() * length <= most)
            };
            if near(a, b, 4.0) {
                let at = first.partition_point(|(t, _)| *t <= b.primitive.triangle).saturating_sub(1);
                let same = !b.is_hit()
                    || a.primitive
                        == PrimitiveRef {
                            instance: first[at].1,
                            triangle: b.primitive.triangle - first[at].0,
                        };
                // Where surfaces of two instances coincide, either may be reported.
                other_name += usize::from(!same);
                continue;
            }
            // Other answers are right only where the ray passes an edge or a surface within
            // rounding: then rays shifted by that much give this answer too, or at grazing angles
            // nearer and farther ones.
            graze += 1;
            let others: Vec<Hit> = shifted(&flat, ray).collect();
            let instance = |c: &Hit| first[first.partition_point(|(t, _)| *t <= c.primitive.triangle) - 1].1;
            let same =
                others.iter().filter(|c| c.is_hit() && instance(c) == a.primitive.instance).map(|c| c.t);
            let (least, most) = same.fold((f32::INFINITY, 0.0f32), |(l, m), t| (l.min(t), m.max(t)));
            assert!(
                others.iter().any(|c| near(a, c, 32.0)) || least <= a.t && a.t <= most,
                "{name} frame {frame}: {ray:?} gives {a:?} and {b:?}"
            );
        }
        // About as many rays hit their triangle at less than half a degree.
        assert!(graze < rays.len() / 50, "{name} frame {frame}: {graze} rays graze");
        assert!(other_name < rays.len() / 10, "{name} frame {frame}: {other_name} other surfaces");
        // Any-hit queries agree with nearest-hit queries.
        let mut found = vec![false; rays.len()];
        scene.batch(&rays).any(&mut found);
        assert!(found.iter().zip(&ours).all(|(f, h)| *f == h.is_hit()), "{name} frame {frame}");
    }
    hit
}

/// The largest absolute coordinate of the object and of the origin of the ray.
fn size(flat: &bth::Scene, ray: &Ray) -> f32 {
    let object = flat.object(0).header;
    let ends = object.lower.iter().chain(&object.upper).chain(&ray.origin);
    ends.fold(0.0f32, |m, x| m.max(x.abs()))
}

/// Answers for rays whose origin and target are shifted by a few rounding errors of the
/// coordinates.
fn shifted<'a>(flat: &'a bth::Scene, ray: &'a Ray) -> impl Iterator<Item = Hit> + 'a {
    let mut rng = Rng::new(77);
    let size = size(flat, ray);
    (0..400).map(move |_| {
        let mut near = |p: [f32; 3]| p.map(|x| x + size * 32.0 * f32::EPSILON * (rng.unit_f32() - 0.5));
        let target = near([0, 1, 2].map(|k| ray.origin[k] + ray.direction[k]));
        let origin = near(ray.origin);
        let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
        flat.nearest(&Ray { origin, direction, ..*ray }).unwrap_or(Hit::MISS)
    })
}

#[test]
fn hits_of_a_varied_scene_are_those_of_its_flattened_geometry() {
    let folder = models();
    let (mut scene, _) = compiled(&varied(), folder.path());
    let hit = compare("varied", &mut scene, &[0, 7, 15, 30, 33, 40]);
    assert!(hit > 10_000, "{hit}");
}

#[test]
fn hits_of_animated_models_are_those_of_their_flattened_geometry() {
    for path in animated() {
        let (manifest, _) = imported(&path);
        let (mut scene, _) = compiled(&manifest, path.parent().unwrap());
        let last = manifest.frames.last;
        let mut frames = [0, last / 7, last / 3, last / 2, last - last / 5].to_vec();
        frames.dedup();
        let hit = compare(&path.display().to_string(), &mut scene, &frames);
        println!("{}: {hit} of {} rays hit", path.display(), 4000 * frames.len());
        assert!(hit > 500 * frames.len(), "{}: {hit}", path.display());
    }
}
