//! Joins boxes to a binary tree from the bottom up, always the two whose common box is smallest
//! ("Fast Agglomerative Clustering for Rendering", Walter et al. 2008).

use super::super::bounds::Bounds;
use bth_format::layout::WIDTH;

/// A binary tree over boxes.
pub(super) struct Joined {
    /// The given boxes, then the boxes of inner nodes; the last one is the root.
    pub(super) bounds: Vec<Bounds>,
    /// For each inner node its children, as indices of `bounds`.
    pub(super) children: Vec<[usize; 2]>,
}

/// Joins up to [`WIDTH`] boxes, at least one.
pub(super) fn agglomerate(boxes: &[Bounds]) -> Joined {
    assert!((1..=WIDTH).contains(&boxes.len()), "children of a wide node");
    let mut joined = Joined { bounds: boxes.to_vec(), children: Vec::with_capacity(boxes.len() - 1) };
    // Each place holds a node that has no parent yet; the places before `open` are in use.
    let mut nodes: [usize; WIDTH] = std::array::from_fn(|i| i);
    let mut open = boxes.len();
    // Half areas of common boxes, by places, the greater first.
    let mut common = [[0.0; WIDTH]; WIDTH];
    for a in 1..open {
        for b in 0..a {
            common[a][b] = boxes[a].union(&boxes[b]).half_area();
        }
    }
    while open > 1 {
        let (mut least, mut pair) = (f64::INFINITY, (1, 0));
        for (a, row) in common.iter().enumerate().take(open).skip(1) {
            for (b, area) in row[..a].iter().enumerate() {
                if *area < least {
                    (least, pair) = (*area, (a, b));
                }
            }
        }
        let (a, b) = pair;
        let children = [nodes[b], nodes[a]];
        let bounds = joined.bounds[children[0]].union(&joined.bounds[children[1]]);
        nodes[b] = joined.bounds.len();
        joined.bounds.push(bounds);
        joined.children.push(children);
        // The last place moves to the one that is free now.
        open -= 1;
        nodes[a] = nodes[open];
        for other in 0..open {
            let area = |place: usize| bounds.union(&joined.bounds[nodes[place]]).half_area();
            if other != b {
                common[other.max(b)][other.min(b)] = area(other);
            }
            if other != a && a < open && other != b {
                common[other.max(a)][other.min(a)] = common[open][other];
            }
        }
    }
    joined
}
