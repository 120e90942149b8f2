//! Normals at the corners of a triangle of an object that deforms. They are computed where a ray
//! hits, not for all vertices.

use super::pose::Pose;
use super::positions::blend;
use bth_format::DeformationView;

/// The normal of a corner in a pose, given the normal in the file, its row, and the row of the
/// corner's position. Of any length; zero if the pose leaves it without a direction.
///
/// The normal is transformed by the inverse transpose of the position's blended matrix, up to a
/// positive factor: by the cofactors of the matrix with the sign of its determinant.
pub(crate) fn corner_normal(
    deformation: &DeformationView<'_>,
    pose: &Pose,
    row: u32,
    normal: [f32; 3],
    position: u32,
) -> [f64; 3] {
    let mut moved = normal.map(f64::from);
    if deformation.has_normal_morphs() {
        let targets = deformation.counts().targets as usize;
        for (target, weight) in pose.weights.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            let morph = deformation.morph(targets + target);
            let at = match morph.rows {
                None => Some(row as usize),
                Some(rows) => rows.binary_search(&row).ok(),
            };
            if let Some(delta) = at.map(|at| morph.deltas[at]) {
                for k in 0..3 {
                    moved[k] += weight * f64::from(delta[k]);
                }
            }
        }
    }
    let Some(joints) = &pose.joints else { return moved };
    let sets = deformation.counts().influence_sets as usize;
    let rows = position as usize * sets..(position as usize + 1) * sets;
    let ([x, y, z, _], _) = blend(&deformation.joints[rows.clone()], &deformation.weights[rows], joints);
    // The columns of the cofactor matrix are the cross products of the columns of the matrix.
    let cofactors = [cross(y, z), cross(z, x), cross(x, y)];
    let determinant = x[0] * cofactors[0][0] + x[1] * cofactors[0][1] + x[2] * cofactors[0][2];
    let sign = if determinant < 0.0 { -1.0 } else { 1.0 };
    [0, 1, 2].map(|k| {
        let sum = cofactors[0][k] * moved[0] + cofactors[1][k] * moved[1] + cofactors[2][k] * moved[2];
        sign * sum
    })
}

fn cross(a: [f64; 4], b: [f64; 4]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
