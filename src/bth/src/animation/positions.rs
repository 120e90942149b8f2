//! Positions of the vertices of an object that deforms.

use super::JointMatrix;
use super::morph_runs::{CHUNK, MorphRuns};
use super::pose::Pose;
use crate::parallel::Tasks;
use crate::simd::{Isa, Kernel, Simd};
use bth_format::DeformationView;

/// How vertices are computed.
const TASKS: Tasks = Tasks { rows: 16 * CHUNK, min_rows: 16 * CHUNK + 1 };

/// What the positions of an object are computed from.
#[derive(Clone, Copy)]
pub(crate) struct Vertices<'a> {
    /// Positions before anything moves them.
    pub(crate) base: &'a [[f32; 3]],
    pub(crate) deformation: DeformationView<'a>,
}

/// Computes the positions of all vertices in a pose. `out` is as long as the base. They may be
/// infinite or NaN.
pub(crate) fn compute(vertices: Vertices<'_>, pose: &Pose, out: &mut [[f32; 3]]) {
    let isa = Isa::chosen();
    let runs = &MorphRuns::new(&vertices.deformation, &pose.weights, out.len());
    TASKS.for_each(out, |first, out| isa.run(VertexRange { vertices, pose, runs, first, out }));
}

/// The positions of successive vertices, from `first` on, which is a multiple of [`CHUNK`].
pub(super) struct VertexRange<'a> {
    pub(super) vertices: Vertices<'a>,
    pub(super) pose: &'a Pose,
    pub(super) runs: &'a MorphRuns<'a>,
    pub(super) first: usize,
    pub(super) out: &'a mut [[f32; 3]],
}

impl Kernel for VertexRange<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let VertexRange { vertices, pose, runs, mut first, out } = self;
        let mut moved = [[0.0f64; 4]; CHUNK];
        for out in out.chunks_mut(CHUNK) {
            let moved = &mut moved[..out.len()];
            for (moved, base) in moved.iter_mut().zip(&vertices.base[first..]) {
                *moved = [f64::from(base[0]), f64::from(base[1]), f64::from(base[2]), 0.0];
            }
            runs.of_chunk(first / CHUNK).iter().for_each(|run| run.add_to(moved));
            if let Some(joints) = &pose.joints {
                skin(&vertices.deformation, joints, first, moved);
            }
            for (out, moved) in out.iter_mut().zip(moved) {
                // As in compiled files, no zero is negative.
                *out = [moved[0] as f32 + 0.0, moved[1] as f32 + 0.0, moved[2] as f32 + 0.0];
            }
            first += out.len();
        }
    }
}

/// Moves positions with their joints.
#[inline(always)]
fn skin(
    deformation: &DeformationView<'_>,
    matrices: &[JointMatrix],
    first: usize,
    positions: &mut [[f64; 4]],
) {
    let sets = deformation.counts().influence_sets as usize;
    let rows = first * sets..(first + positions.len()) * sets;
    let (joints, weights) = (&deformation.joints[rows.clone()], &deformation.weights[rows]);
    if sets == 1 {
        // The usual case, compiled without an inner loop over sets.
        for ((position, joints), weights) in positions.iter_mut().zip(joints).zip(weights) {
            *position =
                blended(std::slice::from_ref(joints), std::slice::from_ref(weights), matrices, *position);
        }
        return;
    }
    for (i, position) in positions.iter_mut().enumerate() {
        let own = sets * i..sets * (i + 1);
        *position = blended(&joints[own.clone()], &weights[own], matrices, *position);
    }
}

/// A position moved by the sum of its joints' matrices by their weights, divided by the sum of the
/// weights. Weights of zero are skipped.
#[inline(always)]
fn blended(
    joints: &[[u16; 4]],
    weights: &[[f32; 4]],
    matrices: &[JointMatrix],
    position: [f64; 4],
) -> [f64; 4] {
    let (sum, total) = blend(joints, weights, matrices);
    let mut moved = [0.0; 4];
    for k in 0..4 {
        moved[k] =
            (sum[0][k] * position[0] + sum[1][k] * position[1] + sum[2][k] * position[2] + sum[3][k]) / total;
    }
    moved
}

/// The sum of the matrices of joints by their weights, and the sum of the weights.
#[inline(always)]
pub(super) fn blend(
    joints: &[[u16; 4]],
    weights: &[[f32; 4]],
    matrices: &[JointMatrix],
) -> (JointMatrix, f64) {
    let (mut sum, mut total) = ([[0.0; 4]; 4], 0.0);
    for (joints, weights) in joints.iter().zip(weights) {
        for i in 0..4 {
            if weights[i] == 0.0 {
                continue;
            }
            let (weight, matrix) = (f64::from(weights[i]), &matrices[usize::from(joints[i])]);
            total += weight;
            for c in 0..4 {
                for k in 0..4 {
                    sum[c][k] += weight * matrix[c][k];
                }
            }
        }
    }
    (sum, total)
}
