//! Random instances for tests, and rays that are aimed at them.

use super::World;
use super::placement::{PartBoxes, Placement};
use crate::nodes::affine::Affine;
use crate::rays::Ray;
use bth_format::File;
use bth_random::Rng;

pub(super) const FILES: [&[u8]; 2] = [
    include_bytes!("../../../../format-spec/conformance/valid/two-objects.bth"),
    include_bytes!("../../../../format-spec/conformance/valid/two-levels.bth"),
];

/// Files whose triangles have places, so that rays can start on them.
pub(super) const START_FILES: [&[u8]; 2] = [
    include_bytes!("../../../../format-spec/conformance/valid/places.bth"),
    include_bytes!("../../../../format-spec/conformance/valid/free-directions.bth"),
];

pub(super) fn unit(rng: &mut Rng) -> f64 {
    rng.below(1 << 30) as f64 / (1u64 << 29) as f64 - 1.0
}

/// A random transform: a rotation with scales of either sign, a translation of magnitude `spread`,
/// and in one of four cases a shear. In one of three cases rotation and translation lie on a coarse
/// grid, so that rays often hit edges exactly.
fn transform(rng: &mut Rng, spread: f64) -> Affine {
    let coarse = rng.below(3) == 0;
    let number = |rng: &mut Rng| if coarse { (unit(rng) * 2.0).round() } else { unit(rng) };
    let mut parts = [0.0; 10];
    parts.iter_mut().for_each(|x| *x = number(rng));
    parts[6] += 1.5;
    parts[7..].iter_mut().for_each(|x| *x += x.signum() * 0.01 + 0.02);
    parts[..3].iter_mut().for_each(|x| *x *= spread);
    let mut affine = Affine::from_parts(&parts);
    if rng.below(4) == 0 {
        let (row, column) = (rng.below(3) as usize, rng.below(3) as usize);
        affine.linear[row][column] += number(rng) * 50.0;
    }
    affine
}

/// A world of `count` instances and their transforms. About one instance in eight is not visible.
pub(super) fn world(file: &File, rng: &mut Rng, count: usize) -> (World, Vec<Affine>) {
    let spread = [0.0, 1.0, 4.0, 1e4][rng.below(4) as usize];
    let transforms: Vec<Affine> = (0..count).map(|_| transform(rng, spread)).collect();
    let place = |transform: &Affine, random: u64| {
        let object = (random % u64::from(file.object_count())) as u32;
        // Both kinds of boxes are tested.
        let parts = match object % 2 {
            0 => PartBoxes::of_root_children(&file.object(object).unwrap()),
            _ => PartBoxes::whole(file.object_header(object), [0.0; 3]),
        };
        Placement::new(transform, object, file.object_header(object), &parts).ok()
    };
    let placements = transforms.iter().map(|t| place(t, rng.next()).filter(|_| rng.below(8) > 0)).collect();
    let mut world = World::with_placements(placements, file.object_count());
    world.set_transforms(&transforms);
    (world, transforms)
}

/// Random rays, each aimed at a point of an object under one of the transforms.
pub(super) fn rays(rng: &mut Rng, transforms: &[Affine], count: usize) -> Vec<Ray> {
    let targets = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.25, 0.0], [0.2, 0.3, 0.0]];
    (0..count)
        .map(|i| {
            let transform = &transforms[rng.below(transforms.len() as u64) as usize];
            let target = transform.apply(targets[rng.below(5) as usize]);
            // For rays from the greater distances the boxes must be widened.
            let distance = [0.0, 1.0, 10.0, 1e3, 1e5, 1e7, 1e12][rng.below(7) as usize];
            let mut origin = [0, 1, 2].map(|k| (target[k] + unit(rng) * distance) as f32);
            if rng.below(3) == 0 {
                let k = rng.below(3) as usize;
                origin[k] = target[k] as f32;
            }
            let scale = [1.0, 1e-20, 1e15, 0.3][i % 4];
            let direction = [0, 1, 2].map(|k| ((target[k] - f64::from(origin[k])) * scale) as f32);
            let (tmin, tmax) = match rng.below(5) {
                0 => (0.0, (1.0 / scale) as f32),
                1 => ((1.0 / scale) as f32, f32::INFINITY),
                2 => (f32::NEG_INFINITY, f32::INFINITY),
                _ => (0.0, f32::INFINITY),
            };
            Ray { origin, tmin, direction, tmax }
        })
        .collect()
}
