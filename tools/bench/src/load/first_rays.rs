//! The first rays that a program traces after it has started.

use bth::rays::{Hit, Ray};

/// Pixels of the camera that the first rays are taken from.
pub(super) const SIZE: (u32, u32) = (512, 288);

/// `count` of the rays, evenly spread over them; the first is one that hits. `None` if none hits.
pub(super) fn first_of(rays: &[Ray], hits: &[Hit], count: usize) -> Option<Vec<Ray>> {
    let first = hits.iter().position(Hit::is_hit)?;
    let spread = (0..count.min(hits.len())).map(|i| i * hits.len() / count.min(hits.len()));
    Some([first].into_iter().chain(spread.skip(1)).map(|i| rays[i]).collect())
}
