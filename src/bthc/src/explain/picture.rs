//! Pictures of the model: twice, coloured by the structure that holds each triangle and by the cost
//! of a bounced ray; and coloured by how many directions are free.

use super::Explained;
use bth::rays::{Hit, Ray, StartRay};
use bth_compile::Result;
use bth_compile::bvh::BinaryBvh;
use bth_compile::costs::SelectionOutcome;
use bth_compile::free::Free;
use bth_format::layout::{FREE_BINS, FreeSectors, KnownFree};
use bth_import::Mesh;
use glam::Vec3;

/// Pixels of each half.
const SIZE: u32 = 640;
/// Rays in one call.
const BATCH: usize = 1024;
/// Direction from the model to the camera, as in the benchmarks.
const TOWARDS_CAMERA: Vec3 = Vec3::new(0.8, 0.5, 1.0);

/// The unit vector along `v`, or along z if `v` is zero.
fn unit(v: Vec3) -> Vec3 {
    let length = v.length();
    if length > 0.0 { v / length } else { Vec3::Z }
}

/// The bytes of a PNG file, and the cost in nanoseconds that is drawn brightest.
///
/// # Errors
/// An internal error of the encoder.
pub(crate) fn picture(of: &Explained<'_>) -> Result<(Vec<u8>, f64)> {
    let rays = camera(of.tree);
    let hits = nearest(of.plain, &rays);
    let kind = kinds(of);
    let costs: Vec<Option<f64>> = rays.iter().zip(&hits).map(|(ray, hit)| bounce(of, ray, hit)).collect();
    let mut sorted: Vec<f64> = costs.iter().flatten().copied().collect();
    sorted.sort_by(f64::total_cmp);
    // A percentile, since a few rays cost many times as much as the others.
    let most = sorted.get(sorted.len() * 98 / 100).copied().unwrap_or(1.0).max(1.0);

    let mut pixels = vec![255u8; (2 * SIZE * SIZE * 3) as usize];
    for (i, ((ray, hit), cost)) in rays.iter().zip(&hits).zip(&costs).enumerate() {
        let Some(cost) = cost else { continue };
        let (x, y) = (i as u32 % SIZE, i as u32 / SIZE);
        let left = kind[hit.primitive.triangle as usize] * light(of.mesh, ray, hit);
        for (colour, x) in [(left, x), (heat((cost / most) as f32), x + SIZE)] {
            paint(&mut pixels, y * 2 * SIZE + x, colour);
        }
    }
    Ok((encode(&pixels, 2 * SIZE)?, most))
}

/// Draws as PNG in how many of its directions rays from each triangle hit nothing: from dark for
/// none to yellow for all. Directions that are free up to a distance count in part.
///
/// # Errors
/// An internal error of the encoder.
pub(crate) fn free_picture(
    (mesh, tree): (&Mesh, &BinaryBvh),
    scene: &bth::Scene,
    free: &Free,
) -> Result<Vec<u8>> {
    let rays = camera(tree);
    let hits = nearest(scene, &rays);
    let mut pixels = vec![255u8; (SIZE * SIZE * 3) as usize];
    for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate().filter(|(_, (_, hit))| hit.is_hit()) {
        let known = free.directions.get(hit.primitive.triangle as usize).map(KnownFree::from);
        let openness = known.map_or(0.0, |known| openness(&known));
        paint(&mut pixels, i as u32, light(mesh, ray, hit) * heat(openness));
    }
    encode(&pixels, SIZE)
}

/// Mean over the bins of a triangle: 1 where a bin is free, and a quarter for each level of its
/// sector where it is not.
fn openness(known: &KnownFree) -> f32 {
    let sectors = known.sectors[usize::from(known.bins.is_back())];
    let of_bin = |bin: usize| match known.bins.is_free(bin) {
        true => 1.0,
        false => sectors.level_of_bin(bin) as f32 / (FreeSectors::LEVELS + 1) as f32,
    };
    (0..FREE_BINS).map(of_bin).sum::<f32>() / FREE_BINS as f32
}

fn nearest(scene: &bth::Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
        scene.batch(rays).nearest(hits);
    }
    hits
}

/// Light of a lamp at the camera on what a ray hits.
fn light(mesh: &Mesh, ray: &Ray, hit: &Hit) -> f32 {
    0.35 + 0.65 * normal(mesh, hit.primitive.triangle).dot(Vec3::from_array(ray.direction)).abs()
}

fn paint(pixels: &mut [u8], pixel: u32, colour: Vec3) {
    let at = (pixel * 3) as usize;
    for k in 0..3 {
        pixels[at + k] = (255.0 * colour[k].clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8;
    }
}

fn encode(pixels: &[u8], width: u32) -> Result<Vec<u8>> {
    let failed = |e: png::EncodingError| bth_compile::Error::Internal {
        code: "BTH-X061",
        message: format!("a picture cannot be encoded: {e}"),
    };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, SIZE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(pixels)).map_err(failed)?;
    Ok(bytes)
}

/// Rays of a camera that sees the whole model, row by row.
fn camera(tree: &BinaryBvh) -> Vec<Ray> {
    let Some(root) = tree.nodes.first() else { return Vec::new() };
    let (lower, upper) = (Vec3::from_array(root.lower), Vec3::from_array(root.upper));
    let middle = 0.5 * (lower + upper);
    let radius = 0.5 * (upper - lower).length();
    let back = unit(TOWARDS_CAMERA);
    let right = unit(Vec3::Y.cross(back));
    let up = back.cross(right);
    let eye = middle + 3.0 * radius * back;
    let at = |i: u32| 1.0 - (2.0 * i as f32 + 1.0) / SIZE as f32;
    let pixel = |i: u32| {
        let (x, y) = (-radius * at(i % SIZE), radius * at(i / SIZE));
        let target = middle + x * right + y * up;
        let direction = unit(target - eye).to_array();
        Ray::new(eye.to_array(), direction)
    };
    (0..SIZE * SIZE).map(pixel).collect()
}

fn normal(mesh: &Mesh, triangle: u32) -> Vec3 {
    let [a, b, c] = mesh.corners(triangle).map(Vec3::from_array);
    unit((b - a).cross(c - a))
}

/// Colour of each triangle: greens for tet leaves, orange where bad contacts forbid them, greys
/// where the BVH is cheaper or there are too few triangles.
fn kinds(of: &Explained<'_>) -> Vec<Vec3> {
    let mut colours = vec![Vec3::splat(0.5); of.mesh.triangles.len()];
    let mut paint = |node: u32, colour: [f32; 3]| {
        let at = &of.tree.nodes[node as usize];
        for &triangle in &of.tree.order[at.first as usize..(at.first + at.count) as usize] {
            colours[triangle as usize] = Vec3::from_array(colour);
        }
    };
    // Descendants come after their ancestors and overwrite them.
    for verdict in &of.choice.verdicts {
        match verdict.decision {
            SelectionOutcome::RefusedSmall if verdict.suitable => paint(verdict.node, [0.62, 0.62, 0.62]),
            SelectionOutcome::RefusedSmall | SelectionOutcome::Unsuitable => {
                paint(verdict.node, [0.85, 0.42, 0.08])
            }
            _ => paint(verdict.node, [0.42, 0.47, 0.55]),
        }
    }
    for (node, _) in of.built {
        // A hash of the node, so that neighbours differ in their green.
        let share = (node.wrapping_mul(2_654_435_761) >> 24) as f32 / 255.0;
        let green = Vec3::new(0.02, 0.3, 0.12).lerp(Vec3::new(0.45, 0.85, 0.3), share);
        paint(*node, green.to_array());
    }
    colours
}

/// The cost in nanoseconds, by the profile, of the ray that is mirrored at a hit: of the nodes,
/// leaves and tetrahedra that it visits.
fn bounce(of: &Explained<'_>, ray: &Ray, hit: &Hit) -> Option<f64> {
    if !hit.is_hit() {
        return None;
    }
    let incoming = Vec3::from_array(ray.direction);
    let n = normal(of.mesh, hit.primitive.triangle);
    let direction = unit(incoming - 2.0 * n.dot(incoming) * n).to_array();
    let (_, steps) = of.compiled.nearest_counted(&StartRay::from_hit(hit, direction));
    let costs = &of.costs.profile;
    let walk = costs.record(bth_format::layout::RecordKind::Link32).surface;
    let tets = if steps.cells > 0 {
        walk.cost(f64::from(steps.cells), 0.5, costs.bytes[0], costs.bytes)
    } else {
        0.0
    };
    Some(
        costs.bvh.ray
            + costs.bvh.node * f64::from(steps.nodes)
            + costs.bvh.block * f64::from(steps.leaves)
            + tets,
    )
}

/// The color map: from dark blue over green to yellow.
fn heat(share: f32) -> Vec3 {
    let stops =
        [[0.02, 0.01, 0.12], [0.05, 0.2, 0.35], [0.1, 0.55, 0.25], [0.95, 0.85, 0.1]].map(Vec3::from_array);
    let at = share.clamp(0.0, 1.0) * 3.0;
    let i = (at as usize).min(2);
    stops[i].lerp(stops[i + 1], at - i as f32)
}
