//! Objects whose vertices move by themselves: BTH-F190 to BTH-F192.

use super::rows::{check_all, is_finite};
use crate::error::{Code, Error, Result};
use crate::layout::kind;
use crate::object::ObjectView;
use crate::view::SequenceView;
use zerocopy::IntoBytes;

/// BTH-F190 to BTH-F192 of an object.
pub(crate) fn sequence(view: &ObjectView, sequence: &SequenceView) -> Result<()> {
    let SequenceView { times, positions } = sequence;
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
    let (code, section) = (Code::SequencePositions, kind::SEQUENCE_POSITIONS);
    check_all(code, section, positions, |p| is_finite(p), "a finite position")?;
    let first = positions.iter().zip(view.positions);
    match first.map(|(a, b)| a.as_bytes() == b.as_bytes()).position(|same| !same) {
        None => Ok(()),
        Some(row) => {
            let (expected, found) =
                ("the position of the first frame as in POSITIONS", format!("{:?}", positions[row]));
            Err(Error::within(code, section, 12 * row as u64, expected, found))
        }
    }
}
