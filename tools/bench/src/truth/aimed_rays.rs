//! Rays aimed exactly at vertices and at middles of edges.

use crate::model::Model;
use bth::rays::Ray;
use bth_random::Rng;

/// Tries to find an edge whose middle is a point in f32: every axis succeeds about every other
/// time.
const EDGE_TRIES: usize = 1000;

/// What is aimed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Vertices.
    Vertices,
    /// Middles of edges.
    Edges,
}

/// Such rays. Each passes through its target at t = 1 without any rounding.
pub(super) fn rays(model: &Model, target: Target, count: usize) -> Vec<Ray> {
    let mut rng = Rng::new(11 + target as u64);
    let diagonal = model.bounds().diagonal();
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        // A model without a single usable edge has fewer.
        let Some(point) = (0..EDGE_TRIES).find_map(|_| point(model, target, &mut rng)) else { break };
        rays.extend(through(point, diagonal, &mut rng));
    }
    rays
}

fn point(model: &Model, target: Target, rng: &mut Rng) -> Option<[f32; 3]> {
    let below = |n: usize, rng: &mut Rng| ((rng.unit_f64() * n as f64) as usize).min(n - 1);
    let corners = model.mesh.corners(below(model.triangles(), rng) as u32);
    let first = below(3, rng);
    let (a, b) = (corners[first], corners[(first + 1) % 3]);
    match target {
        Target::Vertices => Some(a),
        Target::Edges if a == b => None,
        Target::Edges => {
            let middle = [0, 1, 2].map(|k| 0.5 * (f64::from(a[k]) + f64::from(b[k])));
            middle.iter().all(|x| f64::from(*x as f32) == *x).then(|| middle.map(|x| x as f32))
        }
    }
}

/// A ray through a point at exactly t = 1: origin and direction are multiples of the lowest bit of
/// the point's coordinate, and few enough of them to be f32. So it starts no farther than about the
/// coordinate itself.
fn through(point: [f32; 3], diagonal: f64, rng: &mut Rng) -> Option<Ray> {
    let (mut origin, mut direction) = ([0.0; 3], [0.0; 3]);
    for k in 0..3 {
        let unit = least_bit(point[k]).unwrap_or(diagonal / f64::from(1 << 20));
        let most = (diagonal / unit).min(f64::from(1 << 23));
        let step = ((2.0 * rng.unit_f64() - 1.0) * most).round() * unit;
        let start = f64::from(point[k]) - step;
        (origin[k], direction[k]) = (start as f32, step as f32);
        if f64::from(origin[k]) != start || f64::from(direction[k]) != step {
            return None;
        }
    }
    (direction != [0.0; 3]).then_some(Ray::new(origin, direction))
}

/// The largest power of two that divides a number; `None` for zero.
fn least_bit(x: f32) -> Option<f64> {
    let bits = x.abs().to_bits();
    let (exponent, fraction) = (bits >> 23, bits & 0x7f_ffff);
    let (scale, digits) = if exponent == 0 { (1, fraction) } else { (exponent, fraction | 0x80_0000) };
    (x != 0.0).then(|| 2f64.powi(scale as i32 - 150 + digits.trailing_zeros() as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_bits_are_those_of_the_numbers() {
        assert_eq!([1.0, -1.5, 3.0, 0.0].map(least_bit), [Some(1.0), Some(0.5), Some(1.0), None]);
        assert_eq!(least_bit(f32::from_bits(3)), Some(2f64.powi(-149)));
    }

    #[test]
    fn rays_meet_their_targets_in_exact_arithmetic() {
        let model = Model::load("torus-knot:320").unwrap();
        for target in [Target::Vertices, Target::Edges] {
            let rays = rays(&model, target, 100);
            assert_eq!(rays.len(), 100);
            for ray in &rays {
                let at_one = |t| {
                    let at = bth_oracle::intersection(ray, model.mesh.corners(t));
                    at.is_some_and(|at| bth_oracle::to_f64(&at.t) == 1.0)
                };
                assert!((0..model.triangles() as u32).any(at_one), "{ray:?}");
            }
        }
    }
}
