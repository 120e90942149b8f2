//! How much of an object's triangles lets rays pass, for `bthc info`.

use bth_format::layout::{MICRO_PER_WORD, Opacity, TriangleOpacity};
use bth_format::object::ObjectView;

/// The triangles of an object that are not opaque, or not everywhere.
pub(super) struct Holes {
    pub(super) triangles: u64,
    /// Shares of their area that are opaque, transparent and unknown; of their number where the
    /// file has no positions.
    pub(super) shares: [f64; 3],
}

/// The holes of an object, whose indices need not be checked; `None` where it has none.
pub(super) fn holes(view: &ObjectView<'_>) -> Option<Holes> {
    let mut found = Holes { triangles: 0, shares: [0.0; 3] };
    for (triangle, row) in view.opacity.iter().enumerate() {
        let shares = match TriangleOpacity::from_code(*row) {
            Some(TriangleOpacity::Whole(Opacity::Opaque)) | None => continue,
            Some(TriangleOpacity::Whole(state)) => of_state(state),
            Some(TriangleOpacity::Micro { level, word }) => of_micro(view, level, word),
        };
        let weight = area(view, triangle).unwrap_or(1.0);
        found.triangles += 1;
        (0..3).for_each(|k| found.shares[k] += weight * shares[k]);
    }
    let all: f64 = found.shares.iter().sum();
    found.shares = found.shares.map(|share| if all > 0.0 { share / all } else { 0.0 });
    (found.triangles > 0).then_some(found)
}

fn of_state(state: Opacity) -> [f64; 3] {
    [Opacity::Opaque, Opacity::Transparent, Opacity::Unknown].map(|s| f64::from(u8::from(s == state)))
}

fn of_micro(view: &ObjectView<'_>, level: u32, word: u32) -> [f64; 3] {
    let micros = 1usize << (2 * level);
    let mut shares = [0.0; 3];
    for micro in 0..micros {
        let word = view.opacity_micro.get(word as usize + micro / MICRO_PER_WORD).copied().unwrap_or(0);
        let state =
            Opacity::from_code(word >> (2 * (micro % MICRO_PER_WORD)) & 3).unwrap_or(Opacity::Unknown);
        shares[state as usize] += 1.0 / micros as f64;
    }
    shares
}

/// The area of a triangle, if the file has its positions.
fn area(view: &ObjectView<'_>, triangle: usize) -> Option<f64> {
    let [a, b, c] = view.triangles.get(triangle)?.map(|v| view.positions.get(v as usize));
    let point = |p: &[f32; 3]| glam::DVec3::from(p.map(f64::from));
    let [a, b, c] = [point(a?), point(b?), point(c?)];
    Some(0.5 * (b - a).cross(c - a).length())
}
