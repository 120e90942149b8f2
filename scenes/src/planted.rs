//! Pairs and small groups of triangles with a known answer to: are any two in bad contact?
//!
//! Bad contact is any contact beyond a shared vertex or edge (by index, after welding).

use crate::Model;

/// A planted case.
#[derive(Clone, Debug)]
pub struct Case {
    /// What is planted.
    pub name: &'static str,
    /// The triangles.
    pub model: Model,
    /// True if two triangles are in bad contact.
    pub bad: bool,
}

/// All cases. Coordinates are small whole numbers, halves, or one ulp from such a number, and so
/// all are exact.
pub fn cases() -> Vec<Case> {
    [without_shared_vertices(), with_shared_vertices()].concat()
}

/// The corners of the triangle that comes first in nearly all cases.
const FIRST: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

fn case(name: &'static str, bad: bool, positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Case {
    Case { name, model: Model { positions: positions.to_vec(), triangles: triangles.to_vec() }, bad }
}

/// Pairs of triangles that share no vertex by index.
fn without_shared_vertices() -> Vec<Case> {
    let above = 1.0f32.next_up();
    let [o, x, y] = FIRST;
    let two = [[0, 1, 2], [3, 4, 5]];
    vec![
        case("apart", false, &[o, x, y, [0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0]], &two),
        case("crossing", true, &[o, x, y, [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [9.0, 9.0, 0.0]], &two),
        case("vertex in a face", true, &[o, x, y, [1.0, 1.0, 0.0], [1.0, 1.0, 3.0], [2.0, 1.0, 3.0]], &two),
        case(
            "vertex in an edge",
            true,
            &[o, x, y, [2.0, 0.0, 0.0], [2.0, -1.0, 3.0], [1.0, -1.0, 3.0]],
            &two,
        ),
        case("edges cross", true, &[o, x, y, [2.0, -1.0, 1.0], [2.0, 1.0, -1.0], [2.0, -9.0, -9.0]], &two),
        case(
            "one ulp above a face",
            false,
            &[
                [0.0, 0.0, 1.0],
                [4.0, 0.0, 1.0],
                [0.0, 4.0, 1.0],
                [1.0, 1.0, above],
                [1.0, 1.0, 3.0],
                [2.0, 1.0, 3.0],
            ],
            &two,
        ),
        case("coplanar overlap", true, &[o, x, y, [1.0, 1.0, 0.0], [5.0, 1.0, 0.0], [1.0, 5.0, 0.0]], &two),
        case(
            "coplanar containment",
            true,
            &[o, x, y, [0.5, 0.5, 0.0], [1.0, 0.5, 0.0], [0.5, 1.0, 0.0]],
            &two,
        ),
        case("coplanar apart", false, &[o, x, y, [5.0, 0.0, 0.0], [9.0, 0.0, 0.0], [5.0, 4.0, 0.0]], &two),
        case(
            "partial edge overlap",
            true,
            &[o, x, y, [1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, -1.0, 2.0]],
            &two,
        ),
        case(
            "t-junction in a plane",
            true,
            &[o, x, y, [2.0, 0.0, 0.0], [1.0, -2.0, 0.0], [3.0, -2.0, 0.0]],
            &two,
        ),
        case("equal positions", true, &[o, x, y, o, x, y], &two),
    ]
}

/// Groups of triangles that share vertices by index.
fn with_shared_vertices() -> Vec<Case> {
    let [o, x, y] = FIRST;
    vec![
        case("duplicate", true, &[o, x, y], &[[0, 1, 2], [0, 1, 2]]),
        case("reversed duplicate", true, &[o, x, y], &[[0, 1, 2], [0, 2, 1]]),
        case("shared edge", false, &[o, x, y, [4.0, 4.0, 3.0]], &[[0, 1, 2], [2, 1, 3]]),
        case("flat neighbours", false, &[o, x, y, [4.0, 4.0, 0.0]], &[[0, 1, 2], [2, 1, 3]]),
        case("shared edge folded flat", true, &[o, x, y, [1.0, 1.0, 0.0]], &[[0, 1, 2], [2, 1, 3]]),
        case(
            "non-manifold edge",
            false,
            &[o, x, y, [0.0, 4.0, 3.0], [0.0, 4.0, -3.0]],
            &[[0, 1, 2], [0, 1, 3], [0, 1, 4]],
        ),
        case("shared vertex", false, &[o, x, y, [-4.0, 0.0, 1.0], [0.0, -4.0, 1.0]], &[[0, 1, 2], [0, 3, 4]]),
        case(
            "shared vertex, flat",
            false,
            &[o, x, y, [-4.0, 0.0, 0.0], [0.0, -4.0, 0.0]],
            &[[0, 1, 2], [0, 3, 4]],
        ),
        case(
            "shared vertex, crossing",
            true,
            &[o, x, y, [2.0, 2.0, 2.0], [1.0, 1.0, -1.0]],
            &[[0, 1, 2], [0, 3, 4]],
        ),
        case(
            "shared vertex, collinear edges",
            true,
            &[o, x, y, [2.0, 0.0, 0.0], [1.0, -1.0, 2.0]],
            &[[0, 1, 2], [0, 3, 4]],
        ),
    ]
}
