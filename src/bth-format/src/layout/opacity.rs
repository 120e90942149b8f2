//! Where triangles let rays pass. Specification: "Opacity".

/// True if a hit on a part of a triangle counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opacity {
    /// There is a surface.
    Opaque = 0,
    /// There is no surface: rays pass.
    Transparent = 1,
    /// There is a surface on some of the part, and none on the rest.
    Unknown = 2,
}

/// Levels of subdivision of a triangle: 4 to the power of the level micro-triangles.
pub const MAX_OPACITY_LEVEL: u32 = 8;

/// Bits of a row of `OPACITY` for the level.
const LEVEL_BITS: u32 = 4;

/// Micro-triangles of a word of `OPACITY_MICRO`.
pub const MICRO_PER_WORD: usize = 16;

/// A row of `OPACITY`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleOpacity {
    /// One state for the whole triangle.
    Whole(Opacity),
    /// A state for each micro-triangle.
    Micro {
        /// Level of subdivision, from 1 to [`MAX_OPACITY_LEVEL`].
        level: u32,
        /// First word of its states in `OPACITY_MICRO`.
        word: u32,
    },
}

impl Opacity {
    /// The state of a number.
    #[inline]
    pub const fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            0 => Self::Opaque,
            1 => Self::Transparent,
            2 => Self::Unknown,
            _ => return None,
        })
    }
}

impl TriangleOpacity {
    /// The number that encodes it. Words of micro-triangles must be below 2^28.
    pub const fn code(self) -> u32 {
        match self {
            Self::Whole(state) => (state as u32) << LEVEL_BITS,
            Self::Micro { level, word } => word << LEVEL_BITS | level,
        }
    }

    /// The opacity that a number encodes.
    #[inline]
    pub const fn from_code(code: u32) -> Option<Self> {
        let (level, payload) = (code & ((1 << LEVEL_BITS) - 1), code >> LEVEL_BITS);
        match level {
            0 => match Opacity::from_code(payload) {
                Some(state) => Some(Self::Whole(state)),
                None => None,
            },
            1..=MAX_OPACITY_LEVEL => Some(Self::Micro { level, word: payload }),
            _ => None,
        }
    }
}

/// Words of `OPACITY_MICRO` that a triangle of a level has.
#[inline]
pub const fn opacity_words(level: u32) -> usize {
    (1usize << (2 * level)).div_ceil(MICRO_PER_WORD)
}

/// The number of the micro-triangle at barycentric coordinates, which are the weights of the second
/// and third corner. Every pair of numbers gives a micro-triangle of the level, also such as are
/// beyond the triangle or no numbers at all.
///
/// Row j holds the micro-triangles between v = j / n and v = (j + 1) / n, n being 2 to the power of
/// the level: by ascending u in turn one that has the orientation of the triangle and one upside
/// down.
#[inline]
pub fn micro_triangle(level: u32, u: f32, v: f32) -> u32 {
    let n = 1u32 << level;
    // In f64 the products and their fractions are exact where they matter; what is no number
    // becomes 0.
    let (a, b) = (f64::from(u) * f64::from(n), f64::from(v) * f64::from(n));
    let j = (b as u32).min(n - 1);
    let i = (a as u32).min(n - 1 - j);
    let beyond_diagonal = (a - f64::from(i)) + (b - f64::from(j)) > 1.0;
    let upside_down = beyond_diagonal && i + j + 1 < n;
    n * n - (n - j) * (n - j) + 2 * i + u32::from(upside_down)
}

/// The corners of a micro-triangle in barycentric coordinates times n; see [`micro_triangle`].
pub fn micro_corners(level: u32, micro: u32) -> [[u32; 2]; 3] {
    let n = 1u32 << level;
    let first = |j: u32| n * n - (n - j) * (n - j);
    let j = (0..n).rev().find(|j| first(*j) <= micro).unwrap_or(0);
    let (i, upside_down) = ((micro - first(j)) / 2, (micro - first(j)) % 2 == 1);
    match upside_down {
        false => [[i, j], [i + 1, j], [i, j + 1]],
        true => [[i + 1, j + 1], [i, j + 1], [i + 1, j]],
    }
}

/// The opacity at barycentric coordinates of a triangle, given the rows of `OPACITY` and
/// `OPACITY_MICRO`. Opaque for what these say nothing about.
#[inline]
pub fn opacity_at(rows: &[u32], words: &[u32], triangle: u32, u: f32, v: f32) -> Opacity {
    let Some(row) = rows.get(triangle as usize) else { return Opacity::Opaque };
    match TriangleOpacity::from_code(*row) {
        Some(TriangleOpacity::Whole(state)) => state,
        Some(TriangleOpacity::Micro { level, word }) => {
            let micro = micro_triangle(level, u, v) as usize;
            let word = words.get(word as usize + micro / MICRO_PER_WORD).copied().unwrap_or(0);
            Opacity::from_code(word >> (2 * (micro % MICRO_PER_WORD)) & 3).unwrap_or(Opacity::Unknown)
        }
        None => Opacity::Opaque,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_in_their_micro_triangles() {
        for level in 0..=5 {
            let n = f64::from(1u32 << level);
            let mut random = bth_random::Rng::new(u64::from(level));
            for _ in 0..2000 {
                let (mut u, mut v) = (random.unit_f32(), random.unit_f32());
                if u + v > 1.0 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                let [a, b, c] = micro_corners(level, micro_triangle(level, u, v)).map(|p| p.map(f64::from));
                let p = [f64::from(u) * n, f64::from(v) * n];
                let side =
                    |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                let inside = [side(a, b), side(b, c), side(c, a)].iter().all(|s| *s >= -1e-6);
                assert!(inside, "level {level}: ({u}, {v}) in {a:?} {b:?} {c:?}");
            }
        }
    }

    #[test]
    fn centers_of_micro_triangles_give_their_numbers_and_anything_gives_one() {
        for level in 0..=MAX_OPACITY_LEVEL {
            let n = (1u32 << level) as f32;
            for micro in 0..1 << (2 * level) {
                let corners = micro_corners(level, micro);
                let center = |k: usize| corners.iter().map(|p| p[k] as f32).sum::<f32>() / 3.0 / n;
                assert_eq!(micro_triangle(level, center(0), center(1)), micro);
            }
            let odd =
                [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 2.0, -0.0, 0.0, 1.0, f32::MIN_POSITIVE];
            for (u, v) in odd.iter().flat_map(|u| odd.map(|v| (*u, v))) {
                assert!(micro_triangle(level, u, v) < 1 << (2 * level), "({u}, {v})");
            }
        }
    }

    #[test]
    fn rows_come_back_from_their_numbers() {
        let micro = |level, word| TriangleOpacity::Micro { level, word };
        for row in [
            TriangleOpacity::Whole(Opacity::Opaque),
            TriangleOpacity::Whole(Opacity::Transparent),
            TriangleOpacity::Whole(Opacity::Unknown),
            micro(1, 0),
            micro(MAX_OPACITY_LEVEL, (1 << 28) - 1),
        ] {
            assert_eq!(TriangleOpacity::from_code(row.code()), Some(row));
        }
        for code in [0x30, 9, 15, u32::MAX] {
            assert_eq!(TriangleOpacity::from_code(code), None);
        }
    }
}
