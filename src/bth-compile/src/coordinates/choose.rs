//! Choice of the grid: the finest one whose bits reach over the object's box.

use crate::error::{Error, Place, Result};
use bth_format::layout::{Grid, GridBits};
use bth_import::Mesh;
use serde::{Serialize, Serializer};
use std::path::Path;
use std::str::FromStr;

/// How far a vertex may move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MaxError {
    /// In the units of the object.
    Absolute(f64),
    /// As a share of the diagonal of the object's box.
    OfDiagonal(f64),
}

impl FromStr for MaxError {
    type Err = String;

    /// A distance, or a percentage of the diagonal of the object's box: `0.001`, `0.01%`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (number, percent) = match text.strip_suffix('%') {
            Some(number) => (number, true),
            None => (text, false),
        };
        match number.trim().parse::<f64>() {
            Ok(value) if value >= 0.0 && value.is_finite() => {
                Ok(if percent { MaxError::OfDiagonal(value / 100.0) } else { MaxError::Absolute(value) })
            }
            _ => {
                Err("expected a distance from 0, such as 0.001, or a share of the diagonal, such as 0.01%"
                    .into())
            }
        }
    }
}

impl MaxError {
    /// The distance in the units of the object, whose box has this diagonal.
    fn distance(self, diagonal: f64) -> f64 {
        match self {
            MaxError::Absolute(distance) => distance,
            MaxError::OfDiagonal(share) => share * diagonal,
        }
    }
}

/// The form of coordinates in triangle leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CoordinateOptions {
    /// Bits of a coordinate. If absent, coordinates are `f32`, or have the fewest bits that keep
    /// within `max_error` if that is given.
    #[serde(serialize_with = "number_of_bits")]
    pub bits: Option<GridBits>,
    /// Largest distance that a vertex may move.
    pub max_error: Option<MaxError>,
}

fn number_of_bits<S: Serializer>(bits: &Option<GridBits>, to: S) -> std::result::Result<S::Ok, S::Error> {
    bits.map(|b| b as u32).serialize(to)
}

/// Report on the coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CoordinateReport {
    /// Bits of a coordinate.
    pub bits: u32,
    /// Largest distance that a vertex moved, object space.
    pub displacement: f32,
    /// Distance between neighbouring points of the grid on each axis.
    pub step: [f32; 3],
}

/// A mesh's positions on a grid.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OnGrid {
    pub(crate) grid: Grid,
    /// Largest distance that a position moved, rounded up.
    pub(crate) displacement: f32,
    /// Original positions of the mesh.
    pub(crate) source: Vec<[f32; 3]>,
}

impl OnGrid {
    pub(crate) fn report(&self) -> CoordinateReport {
        let Grid { bits, step, .. } = self.grid;
        CoordinateReport { bits: bits as u32, displacement: self.displacement, step }
    }
}

/// Moves the positions of a mesh to a grid, if the options have one.
///
/// # Errors
/// `BTH-I070` when `bits` move a vertex farther than `max_error` allows, `BTH-I071` when the object
/// has no grid of this number of bits, as its coordinates are too large or too close together.
pub(crate) fn place(source: &Path, mesh: &mut Mesh, options: &CoordinateOptions) -> Result<Option<OnGrid>> {
    let Some(bounds) = bounds(&mesh.positions) else { return Ok(None) };
    let found = |bits: GridBits| {
        let grid = grid(bits, bounds).ok_or("great that points of a grid of that many would be infinite")?;
        let displacement = displacement(&grid, &mesh.positions);
        if displacement > 0.0 && is_too_coarse(&grid, bounds) {
            return Err(
                "close together that the steps of a grid of that many would be below 2^-126, the least that a file holds",
            );
        }
        Ok((grid, displacement))
    };
    let allowed = options.max_error.map_or(f64::INFINITY, |most| most.distance(diagonal(bounds)));
    let (grid, displacement) = match (options.bits, options.max_error) {
        (None, None) => return Ok(None),
        (None, Some(_)) => {
            let fits = |(_, displacement): &(Grid, f32)| f64::from(*displacement) <= allowed;
            match GridBits::ALL.into_iter().filter_map(|bits| found(bits).ok()).find(fits) {
                Some(fits) => fits,
                None => return Ok(None),
            }
        }
        (Some(bits), _) => {
            let (grid, moved) = found(bits).map_err(|coordinates| out_of_range(source, bits, coordinates))?;
            if f64::from(moved) > allowed {
                return Err(too_far(source, bits, moved, allowed, found(GridBits::B21).ok()));
            }
            (grid, moved)
        }
    };
    let moved = mesh.positions.iter().map(|p| grid.nearest(*p)).collect();
    Ok(Some(OnGrid { grid, displacement, source: std::mem::replace(&mut mesh.positions, moved) }))
}

fn too_far(source: &Path, bits: GridBits, moved: f32, allowed: f64, finer: Option<(Grid, f32)>) -> Error {
    let hint = match finer.filter(|(grid, by)| grid.bits != bits && f64::from(*by) <= allowed) {
        Some((_, by)) => {
            format!(
                "21 bits move vertices by at most {by}; without --coordinates the fewest bits that fit are taken"
            )
        }
        None => "without --coordinates, coordinates stay f32 where no fewer bits fit".to_owned(),
    };
    Error::Input {
        code: "BTH-I070",
        place: Place::File(source.to_owned()),
        message: format!(
            "expected vertices to move by at most {allowed} (--max-error), but coordinates of {} bits move one by {moved}",
            bits as u32
        ),
        hint,
    }
}

fn out_of_range(source: &Path, bits: GridBits, coordinates: &str) -> Error {
    Error::Input {
        code: "BTH-I071",
        place: Place::File(source.to_owned()),
        message: format!(
            "expected coordinates that fit into {} bits (--coordinates), but they are so {coordinates}",
            bits as u32
        ),
        hint: "scale the model, or leave out --coordinates".to_owned(),
    }
}

/// Smallest and largest coordinates.
type AxisRanges = [[f32; 2]; 3];

fn bounds(positions: &[[f32; 3]]) -> Option<AxisRanges> {
    let first = positions.first()?;
    let mut bounds = first.map(|x| [x, x]);
    for point in positions {
        for (end, x) in bounds.iter_mut().zip(point) {
            *end = [end[0].min(*x), end[1].max(*x)];
        }
    }
    Some(bounds)
}

fn diagonal(bounds: AxisRanges) -> f64 {
    bounds.iter().map(|[low, high]| (f64::from(*high) - f64::from(*low)).powi(2)).sum::<f64>().sqrt()
}

/// The finest grid of this many bits that contains a box; `None` where coordinates are near the
/// largest `f32`.
fn grid(bits: GridBits, bounds: AxisRanges) -> Option<Grid> {
    let mut grid = Grid { bits, origin: [0.0; 3], step: [1.0; 3] };
    for (axis, ends) in bounds.into_iter().enumerate() {
        let mut fits = |exponent: i32| {
            let step = 2f64.powi(exponent);
            let [low, high] = ends.map(|x| (f64::from(x) / step).round_ties_even());
            (grid.step[axis], grid.origin[axis]) = (step as f32, (low * step) as f32);
            high - low <= f64::from(bits.max_steps()) && grid.is_exact(axis)
        };
        (first_exponent(bits, ends)..=127).find(|exponent| fits(*exponent))?;
    }
    Some(grid)
}

/// Returns true if the smallest step of a file is too large for a box: its longest side then has
/// less than half of the steps that its bits allow, and no step at the smallest extents, where the
/// surface would be a point.
fn is_too_coarse(grid: &Grid, bounds: AxisRanges) -> bool {
    let extent = |axis: usize| f64::from(bounds[axis][1]) - f64::from(bounds[axis][0]);
    let longest = (0..3).fold(0, |longest, axis| if extent(axis) > extent(longest) { axis } else { longest });
    let steps = extent(longest) / f64::from(grid.step[longest]);
    steps > 0.0 && grid.step[longest] == f32::MIN_POSITIVE && steps < f64::from(grid.bits.max_steps() / 2)
}

/// An exponent of a normal number below which the box certainly has too many steps.
fn first_exponent(bits: GridBits, [low, high]: [f32; 2]) -> i32 {
    let extent = f64::from(high) - f64::from(low);
    let floor = |x: f64| ((x.to_bits() >> 52) as i32 & 0x7ff) - 1023;
    let steps = if extent > 0.0 { floor(extent) - bits as i32 - 1 } else { i32::MIN };
    // Below it the largest coordinate is also more than 2^24 steps.
    let greatest = f64::from(low.abs().max(high.abs()));
    let multiples = if greatest > 0.0 { floor(greatest) - 24 } else { i32::MIN };
    steps.max(multiples).max(-126)
}

/// Largest distance of a position from its grid point, rounded up.
fn displacement(grid: &Grid, positions: &[[f32; 3]]) -> f32 {
    let square = |p: &[f32; 3]| {
        let q = grid.nearest(*p);
        (0..3).map(|k| (f64::from(p[k]) - f64::from(q[k])).powi(2)).sum::<f64>()
    };
    let exact = positions.iter().map(square).fold(0.0, f64::max).sqrt();
    let rounded = exact as f32;
    // One unit in the last place beyond rounding up covers the rounding of the f64 operations
    // above.
    if exact == 0.0 { 0.0 } else { rounded.next_up() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f32> {
        let bits = any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite());
        prop_oneof![-1.0f32..1.0, 1e6f32..1.0001e6, -1e-30f32..1e-30, bits, Just(0.0), Just(f32::MAX)]
    }

    fn mesh(positions: Vec<[f32; 3]>) -> Mesh {
        Mesh { positions, ..Mesh::default() }
    }

    fn exact_distance(a: [f32; 3], b: [f32; 3]) -> f64 {
        (0..3).map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2)).sum::<f64>().sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        /// At any scale every vertex lies on the grid afterwards, no farther than stated; the bound
        /// is at most half the diagonal of a cell; points of the grid do not move.
        #[test]
        fn no_vertex_moves_farther_than_is_said(points in prop::collection::vec(prop::array::uniform3(number()), 1..40)) {
            for bits in GridBits::ALL {
                let options = CoordinateOptions { bits: Some(bits), ..CoordinateOptions::default() };
                let mut moved = mesh(points.clone());
                let found = place(Path::new("a"), &mut moved, &options);
                if points.iter().flatten().any(|x| x.abs() > 2f32.powi(110)) {
                    prop_assert!(found.is_ok() || found.unwrap_err().to_string().contains("BTH-I071"));
                    continue;
                }
                let extent = bounds(&points).unwrap().into_iter().fold(0.0f64, |most, [low, high]| most.max(f64::from(high) - f64::from(low)));
                if extent < 2f64.powi(bits as i32 - 127) && found.is_err() {
                    prop_assert!(found.unwrap_err().to_string().contains("below 2^-126"));
                    continue;
                }
                let on = found.unwrap().unwrap();
                prop_assert_eq!(&on.source, &points);
                let cell = on.grid.step.map(f64::from).iter().map(|s| s * s).sum::<f64>().sqrt();
                prop_assert!(f64::from(on.displacement) <= 0.5001 * cell);
                for (p, q) in points.iter().zip(&moved.positions) {
                    prop_assert!(exact_distance(*p, *q) <= f64::from(on.displacement));
                    for axis in 0..3 {
                        prop_assert!(on.grid.is_exact(axis));
                        let steps = on.grid.steps(axis, q[axis]);
                        prop_assert!((0..=i64::from(bits.max_steps())).contains(&steps), "{}", steps);
                        prop_assert_eq!(on.grid.coordinate(axis, steps as u32).to_bits(), q[axis].to_bits());
                        // At most half a step, so every coordinate is at its nearest grid point.
                        let off = (f64::from(p[axis]) - f64::from(q[axis])).abs();
                        prop_assert!(off <= 0.5 * f64::from(on.grid.step[axis]));
                    }
                }
                let mut again = mesh(moved.positions.clone());
                place(Path::new("a"), &mut again, &options).unwrap();
                prop_assert_eq!(&again.positions, &moved.positions);
            }
        }
    }

    /// For this box of integer coordinates, 1/2 is the finest step that 16 bits reach.
    #[test]
    fn grids_are_as_fine_as_their_bits_allow() {
        let bounds = [[-3.0, 32764.0], [0.0, 32768.0], [5.0, 5.0]];
        let found = grid(GridBits::B16, bounds).unwrap();
        assert_eq!((found.step[0], found.step[1], found.origin[0]), (0.5, 1.0, -3.0));
        assert_eq!(found.nearest([0.25, 0.5, 5.0]), [0.0, 0.0, 5.0]);
    }

    #[test]
    fn the_fewest_bits_that_honour_a_bound_are_taken() {
        let points = vec![[0.0; 3], [1.0; 3], [0.3, 0.4, 0.7]];
        let bits = |max_error| {
            let options = CoordinateOptions { max_error: Some(max_error), ..CoordinateOptions::default() };
            place(Path::new("a"), &mut mesh(points.clone()), &options).unwrap().map(|on| on.grid.bits)
        };
        assert_eq!(bits(MaxError::OfDiagonal(1e-4)), Some(GridBits::B16));
        assert_eq!(bits(MaxError::Absolute(1e-6)), Some(GridBits::B21));
        assert_eq!(bits(MaxError::Absolute(0.0)), None);
    }

    #[test]
    fn too_few_bits_are_refused_with_what_would_do() {
        let points = vec![[0.0; 3], [1.0; 3], [0.3, 0.4, 0.7]];
        let options =
            CoordinateOptions { bits: Some(GridBits::B16), max_error: Some(MaxError::Absolute(1e-6)) };
        let error = place(Path::new("a.ply"), &mut mesh(points), &options).unwrap_err().to_string();
        assert!(
            error.contains("BTH-I070") && error.contains("hint: 21 bits move vertices by at most"),
            "{error}"
        );
    }

    /// The grid of a tiny model would have steps below the smallest of a file, down to none at all.
    #[test]
    fn bits_that_would_lose_a_tiny_surface_are_refused() {
        let corners = |size: f32| vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]];
        let place = |points: &[[f32; 3]], bits, max_error| {
            let options = CoordinateOptions { bits, max_error };
            let mut mesh = mesh(points.to_vec());
            place(Path::new("a.ply"), &mut mesh, &options).map(|on| on.map(|_| mesh.positions))
        };
        for bits in GridBits::ALL {
            for size in [
                f32::from_bits(1),
                2f32.powi(-128),
                2f32.powi(-126) * 1.3,
                2f32.powi(bits as i32 - 128) * 1.3,
            ] {
                let points = corners(size);
                let error = place(&points, Some(bits), None).unwrap_err().to_string();
                assert!(error.contains("BTH-I071") && error.contains("below 2^-126"), "{error}");
                let kept = place(&points, None, Some(MaxError::Absolute(1.0))).unwrap();
                assert!(kept.is_none_or(|moved| moved[1][0] > 0.0), "{size}");
            }
            let moved =
                place(&corners(2f32.powi(bits as i32 - 127) * 1.3), Some(bits), None).unwrap().unwrap();
            assert!(moved[1][0] > 0.0);
            // Nothing is lost of corners that lie on the grid.
            let exact = corners(2f32.powi(-126));
            assert_eq!(place(&exact, Some(bits), None).unwrap(), Some(exact));
        }
    }

    #[test]
    fn bounds_are_distances_or_percentages() {
        let parsed = ["0.5", "1e-3", "0.01%", "-1", "nan", "x%"].map(|t| t.parse::<MaxError>().ok());
        let expected = [Some(MaxError::Absolute(0.5)), Some(MaxError::Absolute(1e-3))];
        assert_eq!(parsed[..2], expected);
        assert!(matches!(parsed[2], Some(MaxError::OfDiagonal(share)) if (share - 1e-4).abs() < 1e-18));
        assert_eq!(parsed[3..], [None; 3]);
    }
}
