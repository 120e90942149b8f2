//! Parts of a picture: the tiles of `--tiles`, which many machines render.

use std::ops::Range;

/// Pixels along the side of the squares whose pixels are rendered together.
pub(super) const TILE: u32 = 16;

/// A rectangle of pixels in a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    pub(crate) x: Range<u32>,
    pub(crate) y: Range<u32>,
}

impl Region {
    /// All of a picture.
    pub(crate) fn whole((width, height): (u32, u32)) -> Region {
        Region { x: 0..width, y: 0..height }
    }

    /// The parts of a picture in columns and rows, row by row. In small pictures some are empty.
    pub(crate) fn grid(size: (u32, u32), (columns, rows): (u32, u32)) -> Vec<Region> {
        let cut = |length: u32, at: u32, parts: u32| length * at / parts;
        let range = |length, at, parts| cut(length, at, parts)..cut(length, at + 1, parts);
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| Region { x: range(size.0, column, columns), y: range(size.1, row, rows) })
            .collect()
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.x.end - self.x.start, self.y.end - self.y.start)
    }

    /// The region with a number of pixels around it, as far as the picture reaches.
    pub(crate) fn with_margin(&self, margin: u32, (width, height): (u32, u32)) -> Region {
        let grow = |range: &Range<u32>, length: u32| {
            range.start.saturating_sub(margin)..(range.end + margin).min(length)
        };
        Region { x: grow(&self.x, width), y: grow(&self.y, height) }
    }

    /// The numbers of the squares that overlap it in a picture of this width, in Morton order, so
    /// that successive ones are close to each other.
    pub(super) fn squares(&self, width: u32) -> Vec<u32> {
        if self.x.is_empty() || self.y.is_empty() {
            return Vec::new();
        }
        let across = |range: &Range<u32>| range.start / TILE..range.end.div_ceil(TILE);
        let columns = width.div_ceil(TILE);
        let mut squares: Vec<u32> = across(&self.y)
            .flat_map(|row| across(&self.x).map(move |column| row * columns + column))
            .collect();
        squares.sort_by_cached_key(|square| spread(square % columns) | spread(square / columns) << 1);
        squares
    }

    /// The place of a pixel of the picture in this region, row by row; `None` outside.
    pub(super) fn index(&self, (x, y): (u32, u32)) -> Option<usize> {
        let inside = self.x.contains(&x) && self.y.contains(&y);
        inside.then(|| (y - self.y.start) as usize * self.size().0 as usize + (x - self.x.start) as usize)
    }
}

/// The bits of a number, with a zero above each.
fn spread(number: u32) -> u64 {
    (0..u32::BITS).fold(0, |sum, bit| sum | u64::from(number >> bit & 1) << (2 * bit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_each_pixel_once() {
        for (size, grid) in [((100, 37), (3, 2)), ((2, 2), (3, 1)), ((1, 1), (1, 1)), ((64, 64), (64, 1))] {
            let parts = Region::grid(size, grid);
            assert_eq!(parts.len() as u32, grid.0 * grid.1);
            for pixel in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
                assert_eq!(parts.iter().filter(|part| part.index(pixel).is_some()).count(), 1, "{pixel:?}");
            }
        }
    }

    #[test]
    fn squares_are_all_that_overlap() {
        let region = Region { x: 15..33, y: 0..17 };
        assert_eq!(region.squares(50), [0, 1, 4, 5, 2, 6]);
        assert_eq!(region.with_margin(20, (50, 30)), Region { x: 0..50, y: 0..30 });
        assert!(Region { x: 3..3, y: 0..9 }.squares(50).is_empty());
    }
}
