//! Matches the faces of tetrahedra: finds for every face the sides of the tetrahedra that share it.

/// Marks the absence of a side.
pub(super) const NONE: u32 = u32::MAX;

/// Every face of every tetrahedron by its vertices. A side is `4 * tet + k`, the face opposite
/// to vertex `k` of the tetrahedron.
pub(super) struct Faces {
    /// Where the faces whose lowest vertex is `v` begin in `entries`.
    starts: Vec<u32>,
    /// Middle and highest vertex and side, ascending within a lowest vertex.
    entries: Vec<(u32, u32, u32)>,
}

impl Faces {
    /// Collects and sorts the faces. There are less than 2^30 tetrahedra, whose vertices are below
    /// `vertices`.
    pub(super) fn new(vertices: usize, tets: &[[u32; 4]]) -> Self {
        let mut starts = vec![0u32; vertices + 1];
        let sides = || (0..4 * tets.len() as u32).map(|side| (key(face(tets, side)), side));
        for (k, _) in sides() {
            starts[k[0] as usize + 1] += 1;
        }
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0, 0); 4 * tets.len()];
        for (k, side) in sides() {
            let at = &mut next[k[0] as usize];
            entries[*at as usize] = (k[1], k[2], side);
            *at += 1;
        }
        for v in 0..vertices {
            entries[starts[v] as usize..starts[v + 1] as usize].sort_unstable();
        }
        Self { starts, entries }
    }

    /// The sides that have these three vertices.
    pub(super) fn sides(&self, vertices: [u32; 3]) -> impl Iterator<Item = u32> {
        let [a, b, c] = key(vertices);
        let run = &self.entries[self.starts[a as usize] as usize..self.starts[a as usize + 1] as usize];
        let first = run.partition_point(|e| (e.0, e.1) < (b, c));
        run[first..].iter().take_while(move |e| (e.0, e.1) == (b, c)).map(|e| e.2)
    }

    /// Per side the side behind it, `NONE` at the hull; `None` when a face has more than two sides.
    pub(super) fn neighbours(&self) -> Option<Vec<u32>> {
        let mut behind = vec![NONE; self.entries.len()];
        for window in self.starts.windows(2) {
            let run = &self.entries[window[0] as usize..window[1] as usize];
            for same in run.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
                match *same {
                    [_] => {}
                    [a, b] => {
                        behind[a.2 as usize] = b.2;
                        behind[b.2 as usize] = a.2;
                    }
                    _ => return None,
                }
            }
        }
        Some(behind)
    }
}

/// The vertices of a side, such that all sides of a tetrahedron are seen from outside in the same
/// sense.
pub(super) fn face(tets: &[[u32; 4]], side: u32) -> [u32; 3] {
    let [a, b, c, d] = tets[side as usize / 4];
    match side % 4 {
        0 => [b, c, d],
        1 => [a, d, c],
        2 => [a, b, d],
        _ => [a, c, b],
    }
}

/// The vertices in ascending order.
fn key(mut vertices: [u32; 3]) -> [u32; 3] {
    vertices.sort_unstable();
    vertices
}

/// Returns true if the order of the vertices is an even permutation of the ascending one.
pub(super) fn even(v: [u32; 3]) -> bool {
    (v[0] < v[1]) ^ (v[1] < v[2]) ^ (v[0] < v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parity_of_all_permutations() {
        assert!(even([1, 2, 3]) && even([2, 3, 1]) && even([3, 1, 2]));
        assert!(!even([2, 1, 3]) && !even([3, 2, 1]) && !even([1, 3, 2]));
    }

    #[test]
    fn two_tetrahedra_meet_in_one_face_with_opposite_parity() {
        let tets = [[0, 1, 2, 3], [1, 0, 2, 4]];
        let faces = Faces::new(5, &tets);
        let behind = faces.neighbours().unwrap();
        assert_eq!(behind.iter().filter(|&&s| s != NONE).count(), 2);
        assert_eq!(behind[3], 7);
        assert_eq!(behind[7], 3);
        assert_ne!(even(face(&tets, 3)), even(face(&tets, 7)));
        assert_eq!(faces.sides([2, 0, 1]).collect::<Vec<_>>(), [3, 7]);
        assert_eq!(faces.sides([2, 0, 4]).count(), 1);
        assert_eq!(faces.sides([1, 3, 4]).count(), 0);
    }

    #[test]
    fn a_face_of_three_tetrahedra_is_refused() {
        let tets = [[0, 1, 2, 3], [1, 0, 2, 4], [0, 1, 2, 5]];
        assert!(Faces::new(6, &tets).neighbours().is_none());
    }
}
