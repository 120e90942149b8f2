//! Along which axes sixteen rays go farthest.

use crate::simd::Simd;

/// The axes along which sixteen rays go farthest, and with them their planes of projection: the next axis and the one
/// after, in cyclic order. (For rays that go backward f64 takes them the other way round, which no test sees and no bit of an
/// answer shows.)
pub(crate) trait Axes<S: Simd> {
    /// Coordinates along the plane's axes and along the rays.
    fn turn(&self, s: S, point: [S::F; 3]) -> [S::F; 3];
    /// The numbers of the axes.
    fn axes(&self, s: S) -> [S::U; 3];
}

/// Of rays that differ in this.
#[derive(Clone, Copy)]
pub(crate) struct Mixed<S: Simd> {
    pub(crate) is_x: S::M,
    pub(crate) is_y: S::M,
}

impl<S: Simd> Mixed<S> {
    #[inline(always)]
    pub(crate) fn of(s: S, [x, y, z]: [S::F; 3]) -> Self {
        let size = [s.abs(x), s.abs(y), s.abs(z)];
        let is_x = s.and(s.lt(size[1], size[0]), s.lt(size[2], size[0]));
        Mixed { is_x, is_y: s.and_not(s.lt(size[2], size[1]), is_x) }
    }

    /// The axis that is the same for all.
    #[inline(always)]
    pub(crate) fn common(&self, s: S) -> Option<Common> {
        match (s.mask_bits(self.is_x), s.mask_bits(self.is_y)) {
            (0xffff, _) => Some(Common(0)),
            (_, 0xffff) => Some(Common(1)),
            (0, 0) => Some(Common(2)),
            _ => None,
        }
    }

    #[inline(always)]
    fn choose(&self, s: S, [x, y, z]: [S::F; 3]) -> S::F {
        s.select(self.is_x, x, s.select(self.is_y, y, z))
    }

    #[inline(always)]
    fn choose_u(&self, s: S, [x, y, z]: [u32; 3]) -> S::U {
        s.select_u(self.is_x, s.splat_u(x), s.select_u(self.is_y, s.splat_u(y), s.splat_u(z)))
    }
}

impl<S: Simd> Axes<S> for Mixed<S> {
    #[inline(always)]
    fn turn(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        [self.choose(s, [y, z, x]), self.choose(s, [z, x, y]), self.choose(s, [x, y, z])]
    }
    #[inline(always)]
    fn axes(&self, s: S) -> [S::U; 3] {
        [self.choose_u(s, [1, 2, 0]), self.choose_u(s, [2, 0, 1]), self.choose_u(s, [0, 1, 2])]
    }
}

/// The axis of rays that all go farthest along the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Common(pub(crate) usize);

impl Common {
    /// The axes in the order of the projection.
    #[inline(always)]
    pub(crate) fn order(self) -> [usize; 3] {
        // Not a constant, which would be copied for that.
        static ORDER: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
        ORDER[self.0]
    }
}

impl<S: Simd> Axes<S> for Common {
    #[inline(always)]
    fn turn(&self, _: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        match self.0 {
            0 => [y, z, x],
            1 => [z, x, y],
            _ => [x, y, z],
        }
    }
    #[inline(always)]
    fn axes(&self, s: S) -> [S::U; 3] {
        self.order().map(|k| s.splat_u(k as u32))
    }
}
