//! Where the lines of sixteen rays leave the tetrahedra behind faces that they certainly cross, in
//! f64: what [`super::walk`] computes for one ray with `exit` and [`Line::t_before`], without
//! branches, so that the compiler vectorizes it.
//!
//! Projections, their errors and the signs of cross products are computed as in [`Line`].
//! Coordinates come permuted to the axes of each ray's projection, so that no lane selects an axis.
//! The reach in the error bound is the reach of the four vertices of the tetrahedron.

use crate::intersect::exact::RATIO_ERROR;
use crate::intersect::exact_lanes::F32Lanes;
use crate::intersect::line::Line;
use crate::intersect::vector::{greater, max_norm};
use crate::simd::LANES;

/// Sixteen rays and tetrahedra, by lane. Coordinates are along the axes of a ray's projection. The
/// third axis is the depth.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Exits {
    pub(super) origin: [F32Lanes; 3],
    pub(super) direction: [F32Lanes; 3],
    /// The corners of the entered face, counterclockwise along the ray, and the fourth vertex,
    /// `[vertex][axis]`.
    pub(super) vertex: [[F32Lanes; 3]; 4],
}

impl Exits {
    pub(super) const NONE: Exits =
        Exits { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], vertex: [[[0.0; LANES]; 3]; 4] };

    /// Lower bounds of the t at which the lines leave their tetrahedra; -∞ or NaN where a sign is
    /// uncertain.
    #[inline(always)]
    pub(super) fn t_before(&self) -> [f64; LANES] {
        let mut out = [0.0; LANES];
        for i in 0..LANES {
            out[i] = self.t_before_in(i);
        }
        out
    }

    #[inline(always)]
    fn t_before_in(&self, i: usize) -> f64 {
        let Exits { origin, direction, vertex } = self;
        let inverse_depth = 1.0 / f64::from(direction[2][i]);
        let shear = [f64::from(direction[0][i]) * inverse_depth, f64::from(direction[1][i]) * inverse_depth];
        let [mut x, mut y, mut depth, mut size] = [[0.0; 4]; 4];
        let (mut reach, mut sizes, mut farthest) = (0.0, 0.0, 0.0);
        for k in 0..4 {
            let mut from = [0.0; 3];
            for axis in 0..3 {
                from[axis] = f64::from(vertex[k][axis][i]) - f64::from(origin[axis][i]);
            }
            reach = greater(reach, max_norm(from));
            depth[k] = from[2];
            farthest = greater(farthest, depth[k].abs());
            x[k] = from[0] - shear[0] * depth[k];
            y[k] = from[1] - shear[1] * depth[k];
            size[k] = x[k].abs() + y[k].abs();
            sizes += size[k];
        }
        let error = Line::projection_error(reach);
        let [mut side, mut edge] = [[0.0; 3]; 2];
        let [mut positive, mut negative] = [[false; 3]; 2];
        for k in 0..3 {
            let next = (k + 1) % 3;
            edge[k] = x[k] * y[next] - y[k] * x[next];
            side[k] = x[3] * y[k] - y[3] * x[k];
            let bound = 2.0 * error * (size[3] + size[k] + error);
            positive[k] = side[k] > bound;
            negative[k] = side[k] < -bound;
        }
        // The face of exit has the fourth vertex instead of one corner.
        let replaced = [positive[1] & negative[2], negative[0] & positive[2], positive[0] & negative[1]];
        let weight = [
            select(replaced[2], -side[1], select(replaced[1], side[2], 0.0)),
            select(replaced[2], side[0], select(replaced[0], -side[2], 0.0)),
            select(replaced[1], -side[0], select(replaced[0], side[1], 0.0)),
            select(replaced[2], edge[0], select(replaced[1], edge[2], edge[1])),
        ];
        let sum = weight[0] + weight[1] + weight[2] + weight[3];
        let depth = weight[0] * depth[0] + weight[1] * depth[1] + weight[2] * depth[2] + weight[3] * depth[3];
        let bound = 16.0 * error * (sizes + error);
        let shift = 2.0 * farthest * (bound / greater(sum.abs() - bound, 0.0)) + farthest * RATIO_ERROR;
        let t = depth / sum * inverse_depth - shift * inverse_depth.abs();
        select(replaced[0] | replaced[1] | replaced[2], t, f64::NEG_INFINITY)
    }
}

/// `a` if the condition holds, else `b`.
#[inline(always)]
fn select(condition: bool, a: f64, b: f64) -> f64 {
    if condition { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Ray;
    use bth_random::Rng;

    /// Tetrahedra of all scales and shapes, with rays that aim at a point of the first face.
    fn random(rng: &mut Rng, round: usize) -> (Ray, [[f32; 3]; 4]) {
        let scale = [1.0, 1e-12, 1e12, 1e-30][round % 4];
        let spread = [1.0, 1e-2, 1e-5][round / 4 % 3];
        let mut unit = || rng.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0;
        let middle = [0; 3].map(|_| unit());
        let vertices = [0; 4].map(|_: i32| middle.map(|x| (x + unit() * spread) * scale));
        let (a, b) = (unit().abs() * 0.5, unit().abs() * 0.5);
        let target = [0, 1, 2].map(|k| {
            vertices[0][k] + a * (vertices[1][k] - vertices[0][k]) + b * (vertices[2][k] - vertices[0][k])
        });
        let origin = [0; 3].map(|_| unit() * 3.0 * scale);
        (Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k])), vertices)
    }

    #[test]
    fn bounds_lie_before_the_exact_crossing_of_the_face_of_exit_and_most_behind_the_entry() {
        let mut rng = Rng::new(61);
        let (mut bounded, mut behind, mut tested) = (0, 0, 0);
        for round in 0..if cfg!(miri) { 300 } else { 30_000 } {
            let (ray, mut vertices) = random(&mut rng, round);
            let line = Line::new(&ray).expect("a direction");
            let Some(entry) = line.intersection([vertices[0], vertices[1], vertices[2]]) else { continue };
            if Line::turns_clockwise([0, 1, 2].map(|k| line.project(vertices[k])).each_ref()) {
                vertices.swap(1, 2);
            }
            let crossed = [0, 1, 2].map(|replaced| {
                let mut face = [vertices[0], vertices[1], vertices[2]];
                face[replaced] = vertices[3];
                line.intersection(face)
            });
            let mut exits = Exits::NONE;
            let lane = round % LANES;
            for (k, axis) in line.axis.into_iter().enumerate() {
                exits.origin[k][lane] = ray.origin[axis];
                exits.direction[k][lane] = ray.direction[axis];
                for vertex in 0..4 {
                    exits.vertex[vertex][k][lane] = vertices[vertex][axis];
                }
            }
            let before = exits.t_before()[lane];
            tested += 1;
            if before > f64::NEG_INFINITY {
                bounded += 1;
                let found: Vec<_> = crossed.iter().flatten().collect();
                assert_eq!(found.len(), 1, "round {round}: {crossed:?}");
                let t = found[0].t;
                assert!(before <= t + t.abs() * RATIO_ERROR, "round {round}: {before} is not before {t}");
                // Where the line leaves before it enters, the tetrahedron lies before the face.
                behind += usize::from(before > entry.t || t < entry.t);
            }
        }
        assert!(10 * bounded > 9 * tested && 10 * behind > 8 * tested, "{behind}, {bounded} of {tested}");
    }
}
