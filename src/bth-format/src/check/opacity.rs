//! The opacity of triangles: BTH-F145 to BTH-F147.

use crate::error::{Code, Error, Result};
use crate::layout::{Opacity, TriangleOpacity, kind, opacity_words};
use crate::object::ObjectView;

pub(super) fn check(view: &ObjectView) -> Result<()> {
    let (rows, words) = (view.opacity, view.opacity_micro);
    let triangles = view.header.triangles as usize;
    if rows.is_empty() && !words.is_empty() {
        let found = format!("{} words", words.len());
        return Err(Error::within(Code::OpacityRows, kind::OPACITY_MICRO, 0, "none without OPACITY", found));
    }
    if !rows.is_empty() && rows.len() != triangles {
        let found = format!("{}", rows.len());
        let expected = format!("{triangles} rows or none");
        return Err(Error::within(Code::OpacityRows, kind::OPACITY, 0, expected, found));
    }
    for (triangle, row) in rows.iter().enumerate() {
        let wrong = |expected: String| {
            Error::within(Code::Opacity, kind::OPACITY, 4 * triangle as u64, expected, format!("{row:#x}"))
        };
        match TriangleOpacity::from_code(*row) {
            Some(TriangleOpacity::Whole(_)) => {}
            Some(TriangleOpacity::Micro { level, word }) => {
                let first = word as usize;
                if first + opacity_words(level) > words.len() {
                    return Err(wrong(format!("states within {} words", words.len())));
                }
                if level == 1 && words[first] >> 8 != 0 {
                    return Err(micro(first, words[first]));
                }
            }
            None => return Err(wrong("a state, or a level and a word".into())),
        }
    }
    let has_no_state = |word: &u32| (0..16).any(|k| Opacity::from_code(word >> (2 * k) & 3).is_none());
    match words.iter().position(has_no_state) {
        None => Ok(()),
        Some(row) => Err(micro(row, words[row])),
    }
}

fn micro(row: usize, word: u32) -> Error {
    let expected = "states from 0 to 2 and zeros behind the last";
    Error::within(Code::MicroOpacity, kind::OPACITY_MICRO, 4 * row as u64, expected, format!("{word:#010x}"))
}
