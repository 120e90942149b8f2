//! Rays and surfaces for which ray tracers tend to miss hits, with answers that are checked
//! exactly.
//!
//! Shapes and rays have integer coordinates times a power of two, so that a ray aimed at a vertex
//! passes exactly through it, and each answer is checked in integer arithmetic: fast enough for 100
//! million rays.

mod grid;
mod inside;
mod rays;
mod shapes;
mod statistics;
mod tile_rays;
mod tiles;

pub use grid::{Grid, GridRay, LIMIT, Point, Quotient};
pub use inside::{Corners, InsideStatistics, is_closed, run_inside};
pub use rays::{Aimed, Kind, Target, rays};
pub use shapes::{Shape, shapes};
pub use statistics::Statistics;
pub use tile_rays::run_tiles;
pub use tiles::{Tiles, tiles};

use crate::structures::{Traced, bits};
use bth::Isa;
use bth::rays::{Hit, Ray, StartRay};

/// Rays that are traced together.
const BATCH: usize = 1024;

/// Traces about `count` rays of every kind through all structures of a shape, with every
/// instruction set of this machine in turn, and adds what was found. One of `one_in` rays is
/// compared with every triangle.
pub fn run(
    shape: &Shape,
    structures: &[Traced],
    count: usize,
    one_in: usize,
    seed: u64,
    statistics: &mut Statistics,
) {
    let isas: Vec<Isa> = Isa::ALL.into_iter().filter(|isa| isa.is_available()).collect();
    for batch in 0..count.div_ceil(BATCH) {
        let aimed = rays(shape, BATCH.min(count - batch * BATCH), seed ^ ((batch as u64 + 1) << 20));
        let rays: Vec<Ray> = aimed.iter().map(|a| shape.grid.ray(&a.ray)).collect();
        let mut expected = vec![Hit::MISS; rays.len()];
        let (mut onward, mut after) = (Vec::new(), Vec::new());
        for (i, traced) in structures.iter().enumerate() {
            // The instruction sets take turns, so that each structure is traced with each of them.
            isas[(batch + i + seed as usize) % isas.len()].choose().expect("it is available");
            let mut hits = vec![Hit::MISS; rays.len()];
            traced.scene.batch(&rays).nearest(&mut hits);
            if i == 0 {
                expected = hits;
                onward = self::onward(&rays, &expected);
                after = onward.iter().map(|ray| traced.scene.nearest(ray).unwrap_or(Hit::MISS)).collect();
            } else {
                statistics.different += differing(&expected, &hits);
            }
            let mut found = vec![false; rays.len()];
            traced.scene.batch(&rays).any(&mut found);
            statistics.different +=
                expected.iter().zip(&found).filter(|(hit, found)| hit.is_hit() != **found).count() as u64;
            statistics.traced += 2 * rays.len() as u64;
            if batch % 4 == i % 4 {
                one_by_one(traced, &rays, &expected, statistics);
                from_starts(traced, &onward, &after, statistics);
            }
        }
        for (i, (aimed, hit)) in aimed.iter().zip(&expected).enumerate() {
            statistics.check(shape, aimed, hit);
            if one_in > 0 && i % one_in == batch % one_in {
                statistics.compare_with_all(shape, aimed, hit);
            }
        }
    }
    let best = Isa::best();
    best.choose().expect("it is available");
}

/// Rays one by one: the same bits.
fn one_by_one(traced: &Traced, rays: &[Ray], expected: &[Hit], statistics: &mut Statistics) {
    for (ray, hit) in rays.iter().zip(expected).step_by(16) {
        let one = traced.scene.nearest(ray).unwrap_or(Hit::MISS);
        statistics.different += u64::from(bits(&one) != bits(hit));
        statistics.traced += 1;
    }
}

/// Rays that start where others hit, in the directions of other rays.
fn onward(rays: &[Ray], hits: &[Hit]) -> Vec<StartRay> {
    let at = |(i, hit): (usize, &Hit)| {
        let direction = if i % 4 == 0 { rays[i].direction } else { rays[(i + 1) % rays.len()].direction };
        let tmax = if i % 3 == 0 { rays[i].tmax } else { f32::INFINITY };
        StartRay::from_hit(hit, direction).with_tmax(tmax)
    };
    hits.iter().enumerate().map(at).collect()
}

/// Rays from starts: the bits of the first structure, and whether they hit.
fn from_starts(traced: &Traced, rays: &[StartRay], expected: &[Hit], statistics: &mut Statistics) {
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    traced.scene.batch(rays).nearest(&mut hits);
    traced.scene.batch(rays).any(&mut found);
    statistics.different += differing(expected, &hits);
    statistics.different +=
        expected.iter().zip(&found).filter(|(hit, found)| hit.is_hit() != **found).count() as u64;
    statistics.traced += 2 * rays.len() as u64;
}

fn differing(a: &[Hit], b: &[Hit]) -> u64 {
    a.iter().zip(b).filter(|(a, b)| bits(a) != bits(b)).count() as u64
}
