//! Origins of rays in f64, as far as they are known there.

/// The origin of a ray in f64, as far as it is known there.
pub(crate) trait Origin: Copy {
    fn point(self) -> [f64; 3];
    /// Adds to bounds of the errors of weights and of the volume what the error of the origin adds,
    /// for a triangle whose edges have no component larger than `edge`.
    fn enlarge(self, error: [f64; 2], edge: f64) -> [f64; 2];
}

/// An origin that f64 holds exactly.
impl Origin for [f64; 3] {
    #[inline(always)]
    fn point(self) -> [f64; 3] {
        self
    }
    #[inline(always)]
    fn enlarge(self, error: [f64; 2], _edge: f64) -> [f64; 2] {
        error
    }
}

/// An origin that was rounded to f64, and a bound of the error of its coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedOrigin(pub(crate) [f64; 3], pub(crate) f64);

impl Origin for RoundedOrigin {
    #[inline(always)]
    fn point(self) -> [f64; 3] {
        self.0
    }
    /// An error e of each coordinate changes a weight of the second or the third corner, a
    /// determinant of the direction, an edge and the origin, by at most 6Dme; the weight of the
    /// first by the sum of both changes, 12Dme; and the volume by 6m²e.
    #[inline(always)]
    fn enlarge(self, [weight, volume]: [f64; 2], edge: f64) -> [f64; 2] {
        [weight + self.1 * (16.0 * edge), volume + self.1 * (8.0 * (edge * edge))]
    }
}
