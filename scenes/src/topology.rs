//! Topology of a model: boundary, non-manifold and inconsistently oriented edges, and components.

use std::collections::HashMap;

use crate::Model;

/// What [`topology`] counts, by index and without welding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose two triangles pass it in the same direction.
    pub flipped_edges: usize,
    /// Triangles with a repeated index or position.
    pub degenerate: usize,
    /// Triangles with the same three positions as an earlier one.
    pub duplicate: usize,
    /// Components connected by shared vertices; unused positions do not count.
    pub components: usize,
}

impl Topology {
    /// Returns true if the surface is closed, consistently oriented and manifold along its edges.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges + self.non_manifold_edges + self.flipped_edges + self.degenerate == 0
    }
}

/// Counts boundary edges, components and so on.
pub fn topology(model: &Model) -> Topology {
    let mut result = Topology::default();
    let mut edges: HashMap<(u32, u32), [usize; 2]> = HashMap::new();
    let mut seen = std::collections::HashSet::new();
    let mut parent: Vec<u32> = (0..model.positions.len() as u32).collect();
    let mut used = vec![false; model.positions.len()];
    for (index, t) in model.triangles.iter().enumerate() {
        let mut bits = model.corners(index).map(|p| p.map(|x| (x + 0.0).to_bits()));
        bits.sort_unstable();
        result.degenerate += usize::from(bits[0] == bits[1] || bits[1] == bits[2]);
        result.duplicate += usize::from(!seen.insert(bits));
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            edges.entry((a.min(b), a.max(b))).or_default()[usize::from(a > b)] += 1;
            let (a_root, b_root) = (find(&mut parent, a), find(&mut parent, b));
            parent[a_root.max(b_root) as usize] = a_root.min(b_root);
            used[a as usize] = true;
        }
    }
    for [forth, back] in edges.values() {
        match forth + back {
            1 => result.boundary_edges += 1,
            2 => result.flipped_edges += usize::from(forth != back),
            _ => result.non_manifold_edges += 1,
        }
    }
    result.components = (0..parent.len()).filter(|&v| used[v] && parent[v] as usize == v).count();
    result
}

/// Root of a union-find tree, halving the path.
fn find(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}
