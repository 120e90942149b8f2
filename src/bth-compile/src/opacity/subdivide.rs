//! The states of a triangle's micro-triangles.

use super::footprint::Footprint;
use bth_format::layout::{MAX_OPACITY_LEVEL, MICRO_PER_WORD, Opacity, opacity_words};

/// Texels for which there is one micro-triangle, if levels suffice.
const TEXELS_PER_MICRO: f64 = 2.0;

/// The corners of a whole triangle, as weights of its second and third corner.
const WHOLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// What a triangle needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Plan {
    /// One state.
    Whole(Opacity),
    /// Micro-triangles of this level, if there is room.
    Micro(u32),
}

/// States of the micro-triangles of a level, packed as the file packs them.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Pattern {
    /// 0 for one state.
    pub(super) level: u32,
    pub(super) words: Vec<u32>,
    /// Micro-triangles of each state, by its number.
    pub(super) count: [u32; 3],
}

impl Pattern {
    /// One state.
    pub(super) fn whole(state: Opacity) -> Self {
        pack(0, &[state as u8])
    }
}

/// A part of a subdivided triangle: upright or upside down, at the corner (column, row) of its
/// level.
#[derive(Clone, Copy)]
struct SubTriangle {
    level: u32,
    column: u32,
    row: u32,
    upside_down: bool,
}

impl SubTriangle {
    /// The number of its micro-triangle in its level; see [`bth_format::layout::micro_triangle`].
    fn number(self) -> usize {
        let n = 1usize << self.level;
        let (i, j) = (self.column as usize, self.row as usize);
        n * n - (n - j) * (n - j) + 2 * i + usize::from(self.upside_down)
    }

    fn corners(self) -> [[f64; 2]; 3] {
        let n = f64::from(1u32 << self.level);
        let (i, j) = (self.column, self.row);
        let corners = match self.upside_down {
            false => [[i, j], [i + 1, j], [i, j + 1]],
            true => [[i + 1, j + 1], [i, j + 1], [i + 1, j]],
        };
        corners.map(|p| p.map(|x| f64::from(x) / n))
    }

    fn quarters(self) -> [SubTriangle; 4] {
        let (i, j) = (2 * self.column, 2 * self.row);
        let part = |column, row, upside_down| SubTriangle { level: self.level + 1, column, row, upside_down };
        match self.upside_down {
            false => [part(i, j, false), part(i + 1, j, false), part(i, j + 1, false), part(i, j, true)],
            true => [
                part(i + 1, j + 1, false),
                part(i + 1, j, true),
                part(i, j + 1, true),
                part(i + 1, j + 1, true),
            ],
        }
    }
}

const ROOT: SubTriangle = SubTriangle { level: 0, column: 0, row: 0, upside_down: false };

/// What a triangle needs, by the number of its texels.
pub(super) fn plan(footprint: &Footprint<'_>) -> Plan {
    let whole = footprint.state(WHOLE, footprint.is_finite());
    if whole != Opacity::Unknown || !footprint.is_finite() {
        return Plan::Whole(whole);
    }
    let texels = footprint.texels() / TEXELS_PER_MICRO;
    let enough = |level: &u32| f64::from(1u32 << (2 * level)) >= texels;
    Plan::Micro((1..MAX_OPACITY_LEVEL).find(enough).unwrap_or(MAX_OPACITY_LEVEL))
}

/// The states of the micro-triangles of a level, at the smallest level that expresses them.
pub(super) fn pattern(footprint: &Footprint<'_>, level: u32) -> Pattern {
    let mut states = vec![Opacity::Unknown as u8; 1 << (2 * level)];
    decide(footprint, level, ROOT, &mut states);
    let mut level = level;
    while level > 0
        && let Some(coarser) = coarser(level, &states)
    {
        states = coarser;
        level -= 1;
    }
    pack(level, &states)
}

/// Sets the states of all micro-triangles in a part.
fn decide(footprint: &Footprint<'_>, level: u32, part: SubTriangle, states: &mut [u8]) {
    let last = part.level == level;
    match footprint.state(part.corners(), last) {
        state if last => states[part.number()] = state as u8,
        Opacity::Unknown => part.quarters().into_iter().for_each(|q| decide(footprint, level, q, states)),
        state => fill(level, part, state as u8, states),
    }
}

fn fill(level: u32, part: SubTriangle, state: u8, states: &mut [u8]) {
    if part.level == level {
        states[part.number()] = state;
    } else {
        part.quarters().into_iter().for_each(|quarter| fill(level, quarter, state, states));
    }
}

/// The states one level up, if each part there has one state.
fn coarser(level: u32, states: &[u8]) -> Option<Vec<u8>> {
    let n = 1u32 << (level - 1);
    let mut above = Vec::with_capacity(states.len() / 4);
    for row in 0..n {
        for k in 0..2 * (n - row) - 1 {
            let part = SubTriangle { level: level - 1, column: k / 2, row, upside_down: k % 2 == 1 };
            let quarters = part.quarters().map(|quarter| states[quarter.number()]);
            if quarters != [quarters[0]; 4] {
                return None;
            }
            above.push(quarters[0]);
        }
    }
    Some(above)
}

fn pack(level: u32, states: &[u8]) -> Pattern {
    let mut pattern = Pattern { level, words: vec![0; opacity_words(level)], count: [0; 3] };
    for (k, &state) in states.iter().enumerate() {
        pattern.words[k / MICRO_PER_WORD] |= u32::from(state) << (2 * (k % MICRO_PER_WORD));
        pattern.count[usize::from(state)] += 1;
    }
    pattern
}
