//! A picture of the model twice: coloured by what its triangles are in, and by what a bounce from them costs.

use super::Explained;
use bth::rays::{Hit, Ray, Surface};
use bth_compile::Result;
use bth_compile::costs::Decision;

/// Pixels of each half.
const SIZE: u32 = 640;
/// Rays in one call.
const BATCH: usize = 1024;
/// From where the camera looks, as in the benchmarks.
const FROM: [f32; 3] = [0.8, 0.5, 1.0];

type Vector = [f32; 3];

fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Vector) -> Vector {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|x| x / length) } else { [0.0, 0.0, 1.0] }
}

fn mix(a: Vector, b: Vector, share: f32) -> Vector {
    [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]))
}

/// Bytes of a PNG, and the cost in nanoseconds that is drawn brightest.
///
/// # Errors
/// An internal error of the encoder.
pub(crate) fn picture(of: &Explained<'_>) -> Result<(Vec<u8>, f64)> {
    let rays = camera(of);
    let mut hits = vec![Hit::MISS; rays.len()];
    for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
        of.plain.nearest_batch(rays, None, hits);
    }
    let kind = kinds(of);
    let costs: Vec<Option<f64>> = rays.iter().zip(&hits).map(|(ray, hit)| bounce(of, ray, hit)).collect();
    let mut sorted: Vec<f64> = costs.iter().flatten().copied().collect();
    sorted.sort_by(f64::total_cmp);
    // Few rays cost many times what the others do.
    let most = sorted.get(sorted.len() * 98 / 100).copied().unwrap_or(1.0).max(1.0);

    let mut pixels = vec![255u8; (2 * SIZE * SIZE * 3) as usize];
    for (i, ((ray, hit), cost)) in rays.iter().zip(&hits).zip(&costs).enumerate() {
        let Some(cost) = cost else { continue };
        let normal = normal(of, hit.surface.triangle);
        let light = 0.35 + 0.65 * dot(normal, ray.direction).abs();
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        let left = kind[hit.surface.triangle as usize].map(|c| c * light);
        for (colour, x) in [(left, x), (heat((cost / most) as f32), x + SIZE)] {
            let at = ((y * 2 * SIZE + x) * 3) as usize;
            for k in 0..3 {
                pixels[at + k] = (255.0 * colour[k].clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8;
            }
        }
    }
    Ok((encode(&pixels)?, most))
}

fn encode(pixels: &[u8]) -> Result<Vec<u8>> {
    let failed = |e: png::EncodingError| bth_compile::Error::Internal {
        code: "BTH-X061",
        message: format!("a picture cannot be encoded: {e}"),
    };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2 * SIZE, SIZE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels)).map_err(failed)?;
    Ok(bytes)
}

/// Rays of a camera that sees the whole model, row by row.
fn camera(of: &Explained<'_>) -> Vec<Ray> {
    let Some(root) = of.tree.nodes.first() else { return Vec::new() };
    let middle = [0, 1, 2].map(|k| 0.5 * (root.lower[k] + root.upper[k]));
    let extent = sub(root.upper, root.lower);
    let radius = 0.5 * dot(extent, extent).sqrt();
    let back = unit(FROM);
    let right = unit(cross([0.0, 1.0, 0.0], back));
    let up = cross(back, right);
    let eye = [0, 1, 2].map(|k| middle[k] + 3.0 * radius * back[k]);
    let at = |i: u32| 1.0 - (2.0 * i as f32 + 1.0) / SIZE as f32;
    let pixel = |i: u32| {
        let (x, y) = (-radius * at(i % SIZE), radius * at(i / SIZE));
        let target = [0, 1, 2].map(|k| middle[k] + x * right[k] + y * up[k]);
        Ray { origin: eye, tmin: 0.0, direction: unit(sub(target, eye)), tmax: f32::INFINITY }
    };
    (0..SIZE * SIZE).map(pixel).collect()
}

fn normal(of: &Explained<'_>, triangle: u32) -> Vector {
    let [a, b, c] = of.mesh.corners(triangle);
    unit(cross(sub(b, a), sub(c, a)))
}

/// Colour of each triangle: greens for tet leaves, orange where bad contacts forbid them, greys where the BVH is cheaper
/// or there are too few triangles.
fn kinds(of: &Explained<'_>) -> Vec<Vector> {
    let mut colours = vec![[0.5, 0.5, 0.5]; of.mesh.triangles.len()];
    let mut paint = |node: u32, colour: Vector| {
        let at = &of.tree.nodes[node as usize];
        for &triangle in &of.tree.order[at.first as usize..(at.first + at.count) as usize] {
            colours[triangle as usize] = colour;
        }
    };
    // Nodes below others come after them, and are more particular.
    for verdict in &of.choice.verdicts {
        match verdict.decision {
            Decision::RefusedSmall if verdict.suitable => paint(verdict.node, [0.62, 0.62, 0.62]),
            Decision::RefusedSmall | Decision::Unsuitable => paint(verdict.node, [0.85, 0.42, 0.08]),
            _ => paint(verdict.node, [0.42, 0.47, 0.55]),
        }
    }
    for (node, _) in of.built {
        // Neighbours in different greens.
        let share = (node.wrapping_mul(2_654_435_761) >> 24) as f32 / 255.0;
        paint(*node, mix([0.02, 0.3, 0.12], [0.45, 0.85, 0.3], share));
    }
    colours
}

/// What a bounce from a hit costs by the profile, nanoseconds: nodes, leaves and tetrahedra that a mirrored ray visits.
fn bounce(of: &Explained<'_>, ray: &Ray, hit: &Hit) -> Option<f64> {
    if !hit.is_hit() {
        return None;
    }
    let n = normal(of, hit.surface.triangle);
    let cosine = dot(n, ray.direction);
    let direction = unit([0, 1, 2].map(|k| ray.direction[k] - 2.0 * cosine * n[k]));
    let root = &of.tree.nodes[0];
    let extent = sub(root.upper, root.lower);
    let lift = -2e-5 * dot(extent, extent).sqrt() * cosine.signum();
    let origin = [0, 1, 2].map(|k| ray.origin[k] + hit.t * ray.direction[k] + lift * n[k]);
    let ray = Ray { origin, tmin: 0.0, direction, tmax: f32::INFINITY };
    let from = Surface { instance: 0, triangle: hit.surface.triangle };
    let (_, steps) = of.compiled.nearest_counted(&ray, from);
    let costs = &of.costs.profile;
    let walk = costs.record(bth_format::layout::RecordKind::Link32).surface;
    let tets =
        if steps.tets > 0 { walk.cost(f64::from(steps.tets), 0.5, costs.bytes[0], costs.bytes) } else { 0.0 };
    Some(
        costs.bvh.ray
            + costs.bvh.node * f64::from(steps.nodes)
            + costs.bvh.block * f64::from(steps.leaves)
            + tets,
    )
}

/// From dark blue by green to yellow.
fn heat(share: f32) -> Vector {
    let stops = [[0.02, 0.01, 0.12], [0.05, 0.2, 0.35], [0.1, 0.55, 0.25], [0.95, 0.85, 0.1]];
    let at = share.clamp(0.0, 1.0) * 3.0;
    let i = (at as usize).min(2);
    mix(stops[i], stops[i + 1], at - i as f32)
}
