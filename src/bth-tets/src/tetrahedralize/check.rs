//! Decides if what TetGen returned is a constrained tetrahedralization after rounding to `f32`.
//!
//! Decided by topology and exact predicates. If all tetrahedra have the same strict orientation,
//! every face is shared by exactly two that lie on opposite sides of it, except for twelve that
//! make up the box's surface, then the tetrahedra fill the box once: no point of it is missed
//! or covered twice. The sum of the volumes is compared as well, since that costs next to nothing.

use super::faces::{Faces, NONE, even, face};
use super::failure::Defect;
use super::gather::{NodeInput, SIDES};
use super::nudge;
use super::orientation::orientation;
use bth_tetgen_protocol::Tetrahedra;

/// A tetrahedralization that passes the check, in the worker's order.
#[derive(Clone, Debug)]
pub(super) struct Checked {
    /// Positions: the input's vertices, the box's corners, free-space points, TetGen's points.
    pub(super) vertices: Vec<[f32; 3]>,
    /// All of positive [`orientation`].
    pub(super) tets: Vec<[u32; 4]>,
    /// Per side (`4 * tet + k`) the side behind it, `NONE` at the hull.
    pub(super) behind: Vec<u32>,
    /// Per triangle of the input the two sides of its face.
    pub(super) sides: Vec<[u32; 2]>,
    /// Points that had to be moved after rounding.
    pub(super) nudged: u32,
}

/// Rounds, repairs what rounding broke, and checks. `sent` are the points that were sent to the
/// worker, relative to `origin`; it must return them bit for bit.
///
/// # Errors
/// The first defect found.
pub(super) fn check(
    input: &NodeInput,
    sent: &[[f32; 3]],
    origin: [f64; 3],
    answer: Tetrahedra,
) -> Result<Checked, Defect> {
    let Tetrahedra { points, mut tets } = answer;
    if tets.len() >= 1 << 29 {
        return Err(Defect::TooMany);
    }
    let same = |(s, p): (&[f32; 3], &[f64; 3])| (0..3).all(|k| f64::from(s[k]) - origin[k] == p[k]);
    if points.len() < sent.len() || !sent.iter().zip(&points).all(same) {
        return Err(Defect::Moved);
    }
    let mut vertices = sent.to_vec();
    vertices.extend(points[sent.len()..].iter().map(|p| std::array::from_fn(|k| (p[k] + origin[k]) as f32)));

    let total: f64 = tets.iter().map(|t| orientation(&vertices, *t)).sum();
    if total < 0.0 {
        tets.iter_mut().for_each(|t| t.swap(0, 1));
    }
    let fixed = input.vertices.len() + 8;
    let nudged = nudge::repair(&mut vertices, fixed, &tets).map_err(Defect::Orientation)?;
    let faces = Faces::new(vertices.len(), &tets);
    let behind = faces.neighbours().ok_or(Defect::Manifold)?;
    fills_box(input, &vertices, &tets, &behind)?;

    let mut seen = std::collections::HashSet::with_capacity(input.triangles.len());
    let mut sides = Vec::with_capacity(input.triangles.len());
    let mut missing = 0;
    for &triangle in &input.triangles {
        let mut at = faces.sides(triangle);
        match (at.next(), at.next()) {
            (Some(a), Some(b)) if seen.insert(a) => sides.push([a, b]),
            (Some(_), Some(_)) => return Err(Defect::Duplicate),
            _ => missing += 1,
        }
    }
    if missing > 0 {
        return Err(Defect::Missing(missing));
    }
    Ok(Checked { vertices, tets, behind, sides, nudged })
}

/// Bounds the relative error of a sum of a few million volumes, a thousandfold.
const SUM_ERROR: f64 = 1e-6;

/// Checks that positively oriented tetrahedra fill the box once.
fn fills_box(
    input: &NodeInput,
    vertices: &[[f32; 3]],
    tets: &[[u32; 4]],
    behind: &[u32],
) -> Result<(), Defect> {
    // Rows of the box's corners on each side of the box.
    let first = input.vertices.len() as u32;
    let mut halves: [Vec<[u32; 3]>; 6] = Default::default();
    for side in 0..behind.len() as u32 {
        let mut here = face(tets, side);
        if behind[side as usize] != NONE {
            if even(here) == even(face(tets, behind[side as usize])) {
                return Err(Defect::Manifold);
            }
            continue;
        }
        here.sort_unstable();
        let on = |quad: &[u32; 4]| here.iter().all(|&v| v >= first && quad.contains(&(v - first)));
        let plane = SIDES.iter().position(on).ok_or(Defect::Hull)?;
        halves[plane].push(here);
    }
    for (quad, halves) in SIDES.iter().zip(&halves) {
        // A side of the box is two triangles along a diagonal: each omits one corner, and these two
        // are opposite corners.
        let &[a, b] = halves.as_slice() else { return Err(Defect::Hull) };
        let without = |half: [u32; 3]| quad.iter().position(|&c| !half.contains(&(c + first)));
        match (without(a), without(b)) {
            (Some(i), Some(j)) if (i + 2) % 4 == j => {}
            _ => return Err(Defect::Hull),
        }
    }
    let total: f64 = tets.iter().map(|t| orientation(vertices, *t)).sum();
    let extent = |k: usize| f64::from(input.upper[k]) - f64::from(input.lower[k]);
    let expected = 6.0 * extent(0) * extent(1) * extent(2);
    // The product may underflow to 0.
    if expected > 0.0 && (total - expected).abs() > SUM_ERROR * expected {
        return Err(Defect::Volume);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::orientation::in_front;
    use super::*;

    /// The unit cube in six tetrahedra around a diagonal (Kuhn), with one triangle inside.
    fn kuhn() -> (NodeInput, Vec<[f32; 3]>, Tetrahedra) {
        let corner: [[f32; 3]; 8] = std::array::from_fn(|i| std::array::from_fn(|k| (i >> k & 1) as f32));
        let mut tets = Vec::new();
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            let tet = [0, a, b, 7];
            let positive = orientation(&corner, tet) > 0.0;
            tets.push(if positive { tet } else { [a, 0, b, 7] });
        }
        let input = NodeInput {
            lower: [0.0; 3],
            upper: [1.0; 3],
            vertices: vec![],
            triangles: vec![[0, 3, 7]],
            ids: vec![0],
        };
        let points = corner.map(|p| p.map(f64::from)).to_vec();
        (input, corner.to_vec(), Tetrahedra { points, tets })
    }

    #[test]
    fn a_cube_in_six_tetrahedra_holds_in_either_orientation() {
        let (input, sent, mut answer) = kuhn();
        let checked = check(&input, &sent, [0.0; 3], answer.clone()).unwrap();
        assert_eq!(checked.sides.len(), 1);
        assert_eq!(checked.nudged, 0);
        answer.tets.iter_mut().for_each(|t| t.swap(1, 3));
        check(&input, &sent, [0.0; 3], answer).unwrap();
    }

    #[test]
    fn in_front_is_where_the_normal_points() {
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(in_front(triangle, [0.3, 0.3, 1.0]));
        assert!(!in_front(triangle, [0.3, 0.3, -1.0]));
        assert!(!in_front(triangle, [0.3, 0.3, 0.0]));
    }

    #[test]
    fn rejects_a_moved_point() {
        let (input, sent, mut answer) = kuhn();
        answer.points[3][1] = 1.0 + 1e-15;
        assert_eq!(check(&input, &sent, [0.0; 3], answer).unwrap_err(), Defect::Moved);
        let (_, _, mut answer) = kuhn();
        answer.points.pop();
        assert_eq!(check(&input, &sent, [0.0; 3], answer).unwrap_err(), Defect::Moved);
    }

    #[test]
    fn rejects_a_tetrahedron_inside_out() {
        let (input, sent, mut answer) = kuhn();
        answer.tets[2].swap(0, 1);
        assert_eq!(check(&input, &sent, [0.0; 3], answer).unwrap_err(), Defect::Orientation(1));
    }

    #[test]
    fn rejects_a_missing_and_a_doubled_tetrahedron() {
        let (input, sent, mut answer) = kuhn();
        let last = answer.tets.pop().unwrap();
        assert_eq!(check(&input, &sent, [0.0; 3], answer.clone()).unwrap_err(), Defect::Hull);
        answer.tets.extend([last, last]);
        assert_eq!(check(&input, &sent, [0.0; 3], answer).unwrap_err(), Defect::Manifold);
    }

    #[test]
    fn rejects_a_box_that_is_not_filled() {
        let (mut input, sent, answer) = kuhn();
        input.upper[0] = 1.5;
        assert_eq!(check(&input, &sent, [0.0; 3], answer).unwrap_err(), Defect::Volume);
    }

    #[test]
    fn rejects_missing_hull_and_doubled_triangles() {
        let (mut input, sent, answer) = kuhn();
        for (triangles, defect) in [
            (vec![[1, 2, 4]], Defect::Missing(1)),
            (vec![[0, 1, 3]], Defect::Missing(1)),
            (vec![[0, 3, 7], [3, 7, 0]], Defect::Duplicate),
        ] {
            input.triangles = triangles;
            assert_eq!(check(&input, &sent, [0.0; 3], answer.clone()).unwrap_err(), defect);
        }
    }
}
