//! Joints and morph targets of an object: BTH-F173 to BTH-F179.

use super::rows::{check_all, is_finite};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;
use crate::view::DeformationView;
use std::borrow::Cow;
use std::fmt::Debug;

/// Checks the deformation sections of an object.
pub(crate) fn check(view: &DeformationView<'_>, object: &ObjectView<'_>) -> Result<()> {
    let counts = counts(view, object)?;
    influences(view, counts, object.positions.len())?;
    morphs(view, counts, [object.positions.len(), object.normals.len()])
}

/// BTH-F173.
fn counts(view: &DeformationView<'_>, object: &ObjectView<'_>) -> Result<Deformation> {
    let code = Code::Deformation;
    let counts = match view.rows {
        [] => view.counts(),
        [row] => *row,
        rows => return error(code, kind::DEFORMATION, 0, "one row or none", &rows.len()),
    };
    if view.rows.is_empty() {
        let others = [
            (kind::JOINTS, view.joints.len()),
            (kind::JOINT_WEIGHTS, view.weights.len()),
            (kind::MORPHS, view.morphs.len()),
            (kind::MORPH_ROWS, view.morph_rows.len()),
            (kind::MORPH_DELTAS, view.deltas.len()),
        ];
        return match others.iter().find(|(_, rows)| *rows != 0) {
            None => Ok(counts),
            Some((kind, rows)) => error(code, *kind, 0, "no rows without DEFORMATION", rows),
        };
    }
    let joints = counts.joints <= MAX_JOINTS && (counts.joints == 0) == (counts.influence_sets == 0);
    let known = joints && counts.influence_sets <= MAX_INFLUENCE_SETS && counts.reserved == 0;
    if !known || object.triangles.len() != object.header.triangles as usize {
        let expected = "counts in range, zeros, and positions and triangles that are kept";
        return error(code, kind::DEFORMATION, 0, expected, &counts);
    }
    Ok(counts)
}

/// BTH-F174 and BTH-F175.
fn influences(view: &DeformationView<'_>, counts: Deformation, positions: usize) -> Result<()> {
    let sets = counts.influence_sets as usize;
    let rows = positions as u64 * sets as u64;
    for (kind, found) in [(kind::JOINTS, view.joints.len()), (kind::JOINT_WEIGHTS, view.weights.len())] {
        if found as u64 != rows {
            return error(Code::InfluenceRows, kind, 0, format!("{rows} rows"), &found);
        }
    }
    let exist = |joints: &[u16; 4]| joints.iter().all(|joint| u32::from(*joint) < counts.joints);
    let expected = format!("joints below {}", counts.joints);
    check_all(Code::Influences, kind::JOINTS, view.joints, exist, expected)?;
    let unusable = |weights: &[[f32; 4]]| {
        let all = weights.as_flattened();
        !all.iter().all(|w| w.is_finite() && *w >= 0.0) || all.iter().all(|w| *w == 0.0)
    };
    match view.weights.chunks_exact(sets.max(1)).position(unusable) {
        None => Ok(()),
        Some(position) => {
            let (at, expected) = (16 * sets * position, "finite weights from 0, not all of them 0");
            let found = &view.weights[sets * position..][..sets];
            error(Code::Influences, kind::JOINT_WEIGHTS, at, expected, &found)
        }
    }
}

/// BTH-F176 to BTH-F179. `rows` are the numbers of positions and normals.
fn morphs(view: &DeformationView<'_>, counts: Deformation, rows: [usize; 2]) -> Result<()> {
    let (targets, found) = (counts.targets as usize, view.morphs.len());
    if found != targets && found as u64 != 2 * targets as u64 {
        let expected = format!("{targets} rows or twice as many");
        return error(Code::MorphRows, kind::MORPHS, 0, expected, &found);
    }
    let (mut delta, mut row) = (0u64, 0u64);
    for (i, morph) in view.morphs.iter().enumerate() {
        let (at, all) = (size_of::<Morph>() * i, rows[usize::from(i >= targets)]);
        if morph.reserved != 0 {
            return error(Code::MorphRows, kind::MORPHS, at, "zeros", morph);
        }
        let dense = morph.first_row == NONE;
        let starts = u64::from(morph.first_delta) == delta && (dense || u64::from(morph.first_row) == row);
        delta += u64::from(morph.deltas);
        row += if dense { 0 } else { u64::from(morph.deltas) };
        let ends = delta <= view.deltas.len() as u64 && row <= view.morph_rows.len() as u64;
        if !starts || !ends || dense && morph.deltas as usize != all {
            let expected =
                format!("a range behind those before within its sections; if dense, of {all} rows");
            return error(Code::MorphRanges, kind::MORPHS, at, expected, morph);
        }
        let (Some(rows), first) = (view.morph(i).rows, morph.first_row as usize) else { continue };
        let wrong = |k: usize| rows[k] as usize >= all || k > 0 && rows[k - 1] >= rows[k];
        if let Some(k) = (0..rows.len()).find(|k| wrong(*k)) {
            let expected = format!("ascending rows below {all}");
            return error(Code::MorphOrder, kind::MORPH_ROWS, 4 * (first + k), expected, &rows[k]);
        }
    }
    for (kind, stride, used, there) in [
        (kind::MORPH_DELTAS, 12, delta, view.deltas.len()),
        (kind::MORPH_ROWS, 4, row, view.morph_rows.len()),
    ] {
        if used != there as u64 {
            let expected = format!("{used} rows, as the morphs have");
            return error(Code::MorphRanges, kind, stride * used as usize, expected, &there);
        }
    }
    check_all(Code::MorphDeltas, kind::MORPH_DELTAS, view.deltas, |d| is_finite(d), "a finite delta")
}

fn error<T>(
    code: Code,
    kind: u32,
    at: usize,
    expected: impl Into<Cow<'static, str>>,
    found: &dyn Debug,
) -> Result<T> {
    Err(Error::within(code, kind, at as u64, expected, format!("{found:?}")))
}
