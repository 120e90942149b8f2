//! What every box of the format has to be.

/// Whether a box is finite and `lower <= upper` on every axis.
pub(super) fn is_box(lower: [f32; 3], upper: [f32; 3]) -> bool {
    (0..3).all(|a| lower[a].is_finite() && upper[a].is_finite() && lower[a] <= upper[a])
}
