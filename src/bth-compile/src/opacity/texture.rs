//! The smallest and largest alpha of rectangles of texels.

use bth_import::{AlphaImage, Wrap};

/// Smallest and largest value of some texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Range {
    pub(super) least: u8,
    pub(super) greatest: u8,
}

impl Range {
    /// Of no texels.
    pub(super) const EMPTY: Self = Self { least: u8::MAX, greatest: 0 };
    /// Of texels that are opaque.
    pub(super) const FULL: Self = Self { least: u8::MAX, greatest: u8::MAX };

    fn join(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), greatest: self.greatest.max(other.greatest) }
    }
}

/// Rows or columns of texels: the first and the last.
pub(super) type Interval = [usize; 2];

/// The ranges of an image's texels, of the squares of 2 by 2 of them, and so on up to the whole
/// image.
pub(super) struct Pyramid {
    /// From the image itself to one row of the whole: columns, rows and a range for each square.
    levels: Vec<(usize, usize, Vec<Range>)>,
}

impl Pyramid {
    pub(super) fn new(image: &AlphaImage) -> Self {
        let texels: Vec<Range> = image.alpha.iter().map(|&a| Range { least: a, greatest: a }).collect();
        let mut levels = vec![(image.width as usize, image.height as usize, texels)];
        while let Some((width, height, below)) = levels.last()
            && (*width > 1 || *height > 1)
        {
            let (columns, rows) = (width.div_ceil(2), height.div_ceil(2));
            let square = |k: usize| {
                let (x, y) = (k % columns * 2, k / columns * 2);
                let inside = |(x, y): (usize, usize)| x < *width && y < *height;
                let four =
                    [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].into_iter().filter(|p| inside(*p));
                four.fold(Range::EMPTY, |range, (x, y)| range.join(below[y * width + x]))
            };
            let squares = (0..columns * rows).map(square).collect();
            levels.push((columns, rows, squares));
        }
        Self { levels }
    }

    /// Columns and rows of the image.
    pub(super) fn size(&self) -> [usize; 2] {
        self.levels.first().map_or([1; 2], |(width, height, _)| [*width, *height])
    }

    /// The range of a rectangle of texels, joined to `found`. The search ends early, with some
    /// range between `found` and that, once `enough` is true of a range.
    pub(super) fn range(
        &self,
        [columns, rows]: [Interval; 2],
        found: Range,
        enough: &dyn Fn(Range) -> bool,
    ) -> Range {
        let mut search = RangeSearch { pyramid: self, columns, rows, found, enough };
        search.square(self.levels.len() - 1, [0, 0]);
        search.found
    }
}

/// A search for the range of a rectangle.
struct RangeSearch<'a> {
    pyramid: &'a Pyramid,
    columns: Interval,
    rows: Interval,
    found: Range,
    enough: &'a dyn Fn(Range) -> bool,
}

impl RangeSearch<'_> {
    /// Joins the part of a square that lies in the rectangle. Returns true if that is enough.
    fn square(&mut self, level: usize, [x, y]: [usize; 2]) -> bool {
        let (width, height, squares) = &self.pyramid.levels[level];
        let ([left, right], [top, bottom]) = (self.columns, self.rows);
        let (first, last) = ([x << level, y << level], [((x + 1) << level) - 1, ((y + 1) << level) - 1]);
        let apart = first[0] > right || last[0] < left || first[1] > bottom || last[1] < top;
        if x >= *width || y >= *height || apart {
            return false;
        }
        let joined = self.found.join(squares[y * width + x]);
        if joined == self.found {
            return false;
        }
        if level == 0 || left <= first[0] && last[0] <= right && top <= first[1] && last[1] <= bottom {
            self.found = joined;
            return (self.enough)(joined);
        }
        let (x, y) = (2 * x, 2 * y);
        [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
            .into_iter()
            .any(|square| self.square(level - 1, square))
    }
}

/// The texels of an axis that the numbers from `first` to `last` wrap to; `size` is the number of
/// texels. What is no number wraps to all.
pub(super) fn wrapped(wrap: Wrap, first: f64, last: f64, size: usize) -> impl Iterator<Item = Interval> {
    let all = [0, size - 1];
    let n = size as f64;
    let mut pieces = [None; 3];
    if wrap == Wrap::Clamp && first <= last {
        pieces[0] = Some([first, last].map(|x| x.clamp(0.0, n - 1.0) as usize));
    } else if last - first < 2.0 * n && first.abs() < 2f64.powi(50) {
        let (first, last) = (first as i64, last as i64);
        let n = size as i64;
        for (piece, block) in pieces.iter_mut().zip(first.div_euclid(n)..=last.div_euclid(n)) {
            let [a, b] = [first.max(block * n) - block * n, last.min(block * n + n - 1) - block * n];
            let mirrored = wrap == Wrap::Mirror && block.rem_euclid(2) == 1;
            let [a, b] = if mirrored { [n - 1 - b, n - 1 - a] } else { [a, b] };
            *piece = Some([a as usize, b as usize]);
        }
    } else {
        pieces[0] = Some(all);
    }
    pieces.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    #[test]
    fn ranges_are_those_of_all_texels() {
        let mut random = Rng::new(4);
        for (width, height) in [(1, 1), (1, 7), (5, 3), (16, 16), (17, 9)] {
            let alpha: Vec<u8> = (0..width * height).map(|_| random.below(256) as u8).collect();
            let image = AlphaImage { width: width as u32, height: height as u32, alpha: alpha.clone() };
            let pyramid = Pyramid::new(&image);
            for _ in 0..200 {
                let mut two = |n: usize| {
                    let (a, b) = (random.below(n as u64) as usize, random.below(n as u64) as usize);
                    [a.min(b), a.max(b)]
                };
                let (columns, rows) = (two(width), two(height));
                let texels = (rows[0]..=rows[1]).flat_map(|y| (columns[0]..=columns[1]).map(move |x| (x, y)));
                let texels: Vec<u8> = texels.map(|(x, y)| alpha[y * width + x]).collect();
                let expected =
                    Range { least: *texels.iter().min().unwrap(), greatest: *texels.iter().max().unwrap() };
                assert_eq!(pyramid.range([columns, rows], Range::EMPTY, &|_| false), expected);
            }
        }
    }

    #[test]
    fn wrapped_intervals_are_the_texels_of_all_numbers() {
        let texel = |wrap: Wrap, k: i64, n: i64| match wrap {
            Wrap::Repeat => k.rem_euclid(n),
            Wrap::Clamp => k.clamp(0, n - 1),
            Wrap::Mirror => match k.rem_euclid(2 * n) {
                k if k < n => k,
                k => 2 * n - 1 - k,
            },
        };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for n in [1, 2, 5] {
                for first in -13..13 {
                    for last in first..first + 12 {
                        let mut found = vec![false; n as usize];
                        for [a, b] in wrapped(wrap, first as f64, last as f64, n as usize) {
                            found[a..=b].fill(true);
                        }
                        let mut expected = vec![false; n as usize];
                        (first..=last).for_each(|k| expected[texel(wrap, k, n) as usize] = true);
                        assert_eq!(found, expected, "{wrap:?} {n} {first}..{last}");
                    }
                }
            }
            for (first, last) in [(f64::NAN, 0.0), (f64::NEG_INFINITY, f64::INFINITY), (1e300, 1.5e300)] {
                let found: Vec<_> = wrapped(wrap, first, last, 4).collect();
                assert!(!found.is_empty() && found.iter().all(|[a, b]| a <= b && *b < 4), "{found:?}");
            }
        }
    }
}
