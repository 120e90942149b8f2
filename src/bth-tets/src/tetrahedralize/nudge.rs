//! Repairs tetrahedra that rounding made flat or turned inside out, by moving points that are
//! not part of the input by one or two units in the last place.

use super::orientation::orientation;

/// If more than 16 and one in this many tetrahedra are bad, rounding is not the cause and nothing
/// is repaired.
const SHARE: usize = 100;
/// Most passes over the tetrahedra that are still bad.
const PASSES: usize = 4;

/// Moves vertices at `fixed` and above until every tetrahedron has positive orientation. Returns
/// the number of vertices moved.
///
/// # Errors
/// The number of tetrahedra that stay bad.
pub(super) fn repair(vertices: &mut [[f32; 3]], fixed: usize, tets: &[[u32; 4]]) -> Result<u32, usize> {
    let bad = |vertices: &[[f32; 3]], t: u32| orientation(vertices, tets[t as usize]) <= 0.0;
    let mut left: Vec<u32> = (0..tets.len() as u32).filter(|&t| bad(vertices, t)).collect();
    let mut moved = std::collections::BTreeSet::new();
    for _ in 0..PASSES {
        if left.is_empty() || left.len() > 16 + tets.len() / SHARE {
            break;
        }
        // The tetrahedra around every vertex that may be moved.
        let mut around = std::collections::BTreeMap::<u32, Vec<u32>>::new();
        for &v in left.iter().flat_map(|&t| &tets[t as usize]).filter(|&&v| v as usize >= fixed) {
            around.entry(v).or_default();
        }
        for (t, tet) in tets.iter().enumerate() {
            for v in tet {
                if let Some(list) = around.get_mut(v) {
                    list.push(t as u32);
                }
            }
        }
        for &t in &left {
            if !bad(vertices, t) {
                continue;
            }
            for &v in tets[t as usize].iter().filter(|&&v| v as usize >= fixed) {
                if improve(vertices, v, &around[&v], bad) {
                    moved.insert(v);
                }
                if !bad(vertices, t) {
                    break;
                }
            }
        }
        let near: std::collections::BTreeSet<u32> = around.values().flatten().copied().chain(left).collect();
        left = near.into_iter().filter(|&t| bad(vertices, t)).collect();
    }
    if left.is_empty() { Ok(moved.len() as u32) } else { Err(left.len()) }
}

/// Moves one vertex to the nearby position with the fewest bad tetrahedra around it. Returns true
/// if it moved.
fn improve(
    vertices: &mut [[f32; 3]],
    v: u32,
    around: &[u32],
    bad: impl Fn(&[[f32; 3]], u32) -> bool,
) -> bool {
    let at = vertices[v as usize];
    let count = |vertices: &[[f32; 3]]| around.iter().filter(|&&t| bad(vertices, t)).count();
    let mut best = (count(vertices), at);
    let mut steps: Vec<[i32; 3]> = (0..125).map(|i| [i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2]).collect();
    // The sort is stable, so ties keep their order and the result is the same on every machine.
    steps.sort_by_key(|s| s.iter().map(|x| x * x).sum::<i32>());
    for step in steps {
        if best.0 == 0 {
            break;
        }
        vertices[v as usize] = std::array::from_fn(|k| ulps(at[k], step[k]));
        let now = count(vertices);
        if now < best.0 {
            best = (now, vertices[v as usize]);
        }
    }
    vertices[v as usize] = best.1;
    best.1 != at
}

/// `x` moved by that many units in the last place.
fn ulps(x: f32, steps: i32) -> f32 {
    (0..steps.abs()).fold(x, |x, _| if steps > 0 { x.next_up() } else { x.next_down() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_rounded_onto_a_face_is_moved_off_it() {
        // A tetrahedron split at a point that rounding put onto one of its faces.
        let mut vertices =
            vec![[0.0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.25, 0.25, 0.0]];
        let mut tets = vec![[0, 1, 2, 4], [0, 1, 4, 3], [0, 4, 2, 3], [4, 1, 2, 3]];
        if orientation(&vertices, [0, 1, 2, 3]) < 0.0 {
            tets.iter_mut().for_each(|t: &mut [u32; 4]| t.swap(0, 1));
        }
        assert_eq!(orientation(&vertices, tets[0]), 0.0);
        let before = vertices.clone();
        assert_eq!(repair(&mut vertices.clone(), 5, &tets), Err(1));
        assert_eq!(repair(&mut vertices, 4, &tets), Ok(1));
        assert!(tets.iter().all(|&t| orientation(&vertices, t) > 0.0));
        assert_eq!(vertices[..4], before[..4]);
        assert!(vertices[4][2] > 0.0 && vertices[4][2] < 1e-40);
    }
}
