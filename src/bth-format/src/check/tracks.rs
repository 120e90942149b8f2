//! Tracks and their keys: BTH-F155 to BTH-F157 and BTH-F185.

use super::rows::{RowResult, Violation, violation};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::view::SceneView;
use std::mem::offset_of;

/// Checks the tracks of a scene whose nodes have been checked.
pub(super) fn check(view: &SceneView<'_>) -> Result<()> {
    let mut ends = Ends::default();
    let mut previous = None;
    for (row, track) in view.tracks.iter().enumerate() {
        let width = property_and_interpolation(view, track)
            .and_then(|(property, interpolation)| {
                follows(track, previous)?;
                let width = width(view, track, property)? * interpolation.values_per_key();
                ends.append(view, track, width)?;
                Ok(width)
            })
            .map_err(|violation| violation.in_row::<Track>(kind::TRACKS, row))?;
        keys(view, track, width)?;
        previous = Some((track.node, track.property));
    }
    ends.check_cover(view)
}

/// BTH-F155: the node, the property and the interpolation exist and fit each other.
fn property_and_interpolation(view: &SceneView<'_>, track: &Track) -> RowResult<(Property, Interpolation)> {
    let Some(node) = view.nodes.get(track.node as usize) else {
        return violation(Code::Track, offset_of!(Track, node), "a row of NODES", track.node);
    };
    let at = offset_of!(Track, property);
    let Some(property) = Property::from_code(track.property) else {
        return violation(Code::Track, at, "a known property", track.property);
    };
    let moves = !matches!(property, Property::Visible | Property::Weights);
    if node.flags & NODE_MATRIX != 0 && moves {
        return violation(Code::Track, at, "visibility or weights, of a node with a matrix", track.property);
    }
    let fits = |i: &Interpolation| property != Property::Visible || *i == Interpolation::Step;
    let Some(interpolation) = Interpolation::from_code(track.interpolation).filter(fits) else {
        let at = offset_of!(Track, interpolation);
        return violation(Code::Track, at, "an interpolation that fits", track.interpolation);
    };
    if track.reserved != [0; 2] {
        let found = track.reserved[0] | track.reserved[1];
        return violation(Code::Track, offset_of!(Track, reserved), "zeros", found);
    }
    Ok((property, interpolation))
}

/// BTH-F185: the numbers of a value; for weights the node has a deformer, with at least 1 weight.
fn width(view: &SceneView<'_>, track: &Track, property: Property) -> RowResult<usize> {
    debug_assert_eq!(Property::from_code(track.property), Some(property));
    match view.width_of(track) {
        0 => violation(Code::WeightTrack, 0, "weights of a node whose deformer has some", track.node),
        width => Ok(width),
    }
}

/// BTH-F155: tracks ascend by node and property.
fn follows(track: &Track, previous: Option<(u32, u32)>) -> RowResult<()> {
    let key = (track.node, track.property);
    match previous {
        Some(previous) if previous >= key => {
            let found = format!("{key:?} behind {previous:?}");
            Err(Violation {
                code: Code::Track,
                offset: 0,
                expected: "ascending nodes and properties".into(),
                found,
            })
        }
        _ => Ok(()),
    }
}

/// Where the ranges of the tracks so far end in TIMES and VALUES.
#[derive(Default)]
struct Ends {
    times: u64,
    values: u64,
}

impl Ends {
    /// BTH-F156: the keys of a track follow the keys of the tracks before and lie within the
    /// sections. `width` is the number of values of a key.
    fn append(&mut self, view: &SceneView<'_>, track: &Track, width: usize) -> RowResult<()> {
        let (at, keys) = (offset_of!(Track, keys), u64::from(track.keys));
        let error = |expected: &'static str, found| {
            Err(Violation { code: Code::TrackRanges, offset: at, expected: expected.into(), found })
        };
        let first = (u64::from(track.first_time), u64::from(track.first_value));
        if keys == 0 || first != (self.times, self.values) {
            let found = format!("{keys} keys at {} and {}", track.first_time, track.first_value);
            return error("ranges behind those before", found);
        }
        self.times += keys;
        self.values += keys * width as u64;
        if self.times > view.times.len() as u64 || self.values > view.values.len() as u64 {
            return error("ranges within TIMES and VALUES", format!("{keys} keys"));
        }
        Ok(())
    }

    /// BTH-F156: every row of TIMES and VALUES belongs to a track.
    fn check_cover(&self, view: &SceneView<'_>) -> Result<()> {
        let sections =
            [(kind::TIMES, self.times, view.times.len()), (kind::VALUES, self.values, view.values.len())];
        for (kind, used, rows) in sections {
            if used != rows as u64 {
                let expected = format!("{used} rows, as the tracks have");
                return Err(Error::within_file(
                    Code::TrackRanges,
                    kind,
                    8 * used,
                    expected,
                    format!("{rows}"),
                ));
            }
        }
        Ok(())
    }
}

/// BTH-F157: the keys of a track whose ranges have been checked. `width` is the number of values of
/// a key.
fn keys(view: &SceneView<'_>, track: &Track, width: usize) -> Result<()> {
    let (times, values) = view.keys(track, width);
    let ascending = |i: usize| times[i].is_finite() && (i == 0 || times[i - 1] < times[i]);
    if let Some(i) = (0..times.len()).find(|i| !ascending(*i)) {
        let at = 8 * (u64::from(track.first_time) + i as u64);
        let found = format!("{}", times[i]);
        return Err(Error::within_file(Code::TrackKeys, kind::TIMES, at, "finite ascending times", found));
    }
    let fits = |key: &[f64]| {
        // Of a cubic rotation only the value, between its tangents, has to be a quaternion.
        let rotation = if width == 12 { &key[4..8] } else { key };
        match Property::from_code(track.property) {
            Some(Property::Rotation) => !is_zero(rotation),
            Some(Property::Visible) => key[0] == 0.0 || key[0] == 1.0,
            _ => true,
        }
    };
    for (i, key) in values.chunks_exact(width).enumerate() {
        if !key.iter().all(|x| x.is_finite()) || !fits(key) {
            let at = 8 * (u64::from(track.first_value) + (i * width) as u64);
            let (expected, found) = ("a value of the property", format!("{key:?}"));
            return Err(Error::within_file(Code::TrackKeys, kind::VALUES, at, expected, found));
        }
    }
    Ok(())
}

/// Returns true if all numbers are 0.
pub(super) fn is_zero(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| *x == 0.0)
}
