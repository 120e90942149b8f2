//! Objects whose vertices move by themselves: BTH-F190 to BTH-F194.

use crate::error::{Code, Error, Result};
use crate::layout::{Instance, Segment, kind};
use crate::object::ObjectView;
use crate::sequence_view::SequenceView;
use zerocopy::IntoBytes;

/// BTH-F190 to BTH-F192 of an object.
pub(crate) fn sequence(view: &ObjectView, sequence: &SequenceView) -> Result<()> {
    let SequenceView { times, positions, .. } = sequence;
    let rows = view.positions.len();
    let fits = times.len().checked_mul(rows) == Some(positions.len());
    if !fits || (!times.is_empty() && !view.is_deformable()) {
        let expected = "a row for each time and each row of POSITIONS, in a deformable object";
        let found = format!("{} rows for {} times and {rows} positions", positions.len(), times.len());
        return Err(Error::within(Code::SequenceRows, kind::SEQUENCE_POSITIONS, 0, expected, found));
    }
    let finite = times.iter().position(|time| !time.is_finite());
    let ascending = || times.windows(2).position(|pair| pair[0] >= pair[1]).map(|row| row + 1);
    if let Some(row) = finite.or_else(ascending) {
        let (at, found) = (8 * row as u64, format!("{}", times[row]));
        let expected = "finite times that ascend strictly";
        return Err(Error::within(Code::SequenceTimes, kind::SEQUENCE_TIMES, at, expected, found));
    }
    let wrong = |row: usize, expected: &'static str| {
        let (at, found) = (12 * row as u64, format!("{:?}", positions[row]));
        Err(Error::within(Code::SequencePositions, kind::SEQUENCE_POSITIONS, at, expected, found))
    };
    if let Some(row) = positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return wrong(row, "a finite position");
    }
    let first = positions.iter().zip(view.positions);
    match first.map(|(a, b)| a.as_bytes() == b.as_bytes()).position(|same| !same) {
        None => Ok(()),
        Some(row) => wrong(row, "the position of the first frame as in POSITIONS"),
    }
}

/// An object as the check of segments sees it.
pub(crate) struct Segmented<'a> {
    pub(crate) view: &'a ObjectView<'a>,
    pub(crate) sequence: SequenceView<'a>,
}

/// BTH-F193 and BTH-F194: the segments of all objects. An error has the number of its object.
pub(crate) fn segments<'a>(
    objects: u32,
    instances: &[Instance],
    object: impl Fn(u32) -> Result<Segmented<'a>>,
    segments_of: impl Fn(u32) -> &'a [Segment],
) -> Result<()> {
    // For each object the object that has it as a segment behind the first.
    let mut owner: Vec<Option<u32>> = Vec::new();
    for number in 0..objects {
        let segments = segments_of(number);
        if segments.is_empty() {
            continue;
        }
        let fail = |code: Code, row: usize, expected: &'static str| {
            let (at, found) = ((size_of::<Segment>() * row) as u64, format!("{:?}", segments.get(row)));
            Err(Error::within(code, kind::SEGMENTS, at, expected, found).in_object(number))
        };
        let in_order = |row: usize| row == 0 || segments[row - 1].first < segments[row].first;
        let valid = |row: usize, s: &Segment| {
            s.first.is_finite() && in_order(row) && s.reserved == 0 && (s.object == 0) == (row == 0)
        };
        if let Some(row) = segments.iter().enumerate().position(|(row, s)| !valid(row, s)) {
            return fail(Code::Segments, row, "finite ascending times, the object itself first, and zeros");
        }
        if segments.len() < 2 {
            return fail(Code::Segments, 0, "two rows or more");
        }
        owner.resize(objects as usize, None);
        let first = object(number)?;
        for (row, segment) in segments.iter().enumerate().skip(1) {
            let at = number.checked_add(segment.object).filter(|at| *at < objects);
            let Some(at) = at.filter(|at| owner[*at as usize].is_none() && segments_of(*at).is_empty())
            else {
                return fail(
                    Code::SegmentObjects,
                    row,
                    "an object without segments, in one row of one object",
                );
            };
            owner[at as usize] = Some(number);
            let other = object(at)?;
            let (a, b) = (first.view, other.view);
            let same = a.is_deformable() && b.is_deformable() && a.header.triangles == b.header.triangles;
            let equal = a.positions.as_bytes() == b.positions.as_bytes()
                && a.triangles.as_bytes() == b.triangles.as_bytes();
            if !same || !equal || !other.sequence.times.is_empty() {
                return fail(
                    Code::SegmentObjects,
                    row,
                    "a deformable object of equal source without a sequence",
                );
            }
        }
    }
    let used = |instance: &Instance| owner.get(instance.object as usize).copied().flatten();
    match instances.iter().enumerate().find_map(|(row, instance)| Some((row, instance, used(instance)?))) {
        None => Ok(()),
        Some((row, instance, number)) => {
            let found = format!("instance {row} of object {}", instance.object);
            let expected = "no instance of a segment but the first";
            Err(Error::within(Code::SegmentObjects, kind::SEGMENTS, 0, expected, found).in_object(number))
        }
    }
}
