//! Models that are twisted about their longest axis.

use crate::model::Model;

/// Greatest angle of the twist from one end of a model to the other, in radians.
pub(crate) const TWIST: f32 = 1.5;

/// The positions of a model, twisted about the axis along which it is longest.
pub(crate) fn twisted(model: &Model, angle: f32) -> Vec<[f32; 3]> {
    let bounds = model.bounds();
    let (lower, upper) = (bounds.lower.as_vec3().to_array(), bounds.upper.as_vec3().to_array());
    let size = |k: &usize| upper[*k] - lower[*k];
    let axis = (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or_default();
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let [center_u, center_v] = [u, v].map(|k| 0.5 * (lower[k] + upper[k]));
    let twist = |p: &[f32; 3]| {
        let (sin, cos) = (angle * (p[axis] - lower[axis]) / size(&axis).max(f32::MIN_POSITIVE)).sin_cos();
        let (a, b) = (p[u] - center_u, p[v] - center_v);
        let mut moved = *p;
        (moved[u], moved[v]) = (center_u + cos * a - sin * b, center_v + sin * a + cos * b);
        moved
    };
    model.mesh.positions.iter().map(twist).collect()
}
