//! Slow, obvious checks of both trees against the mesh: the oracle of the tests.

use super::{BinaryBvh, Wide};
use bth_format::layout::{
    BOX_MARGIN, Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, NONE, RAW_LINES, RawLeaf, WideNode,
};
use bth_import::Mesh;
use std::collections::BTreeSet;
use zerocopy::{FromBytes, IntoBytes};

type Box3 = ([f32; 3], [f32; 3]);

/// Bit-exact bounds of triangles.
fn bounds_of(mesh: &Mesh, ids: &[u32]) -> Box3 {
    let points: Vec<[f32; 3]> = ids.iter().flat_map(|&id| mesh.corners(id)).collect();
    let end = |pick: fn(f32, f32) -> f32| {
        std::array::from_fn(|k| points.iter().map(|p| p[k]).reduce(pick).expect("a triangle"))
    };
    (end(f32::min), end(f32::max))
}

fn hittable(mesh: &Mesh) -> Vec<u32> {
    (0..mesh.triangles.len() as u32).filter(|&id| !mesh.has_zero_area(id)).collect()
}

/// Asserts the contract of `BinaryBvh`. Quadratic in the depth of the tree. Returns the edges on
/// the longest path.
pub(super) fn validate_binary(mesh: &Mesh, bvh: &BinaryBvh) -> u32 {
    let mut sorted = bvh.order.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, hittable(mesh), "every triangle with area is in the order exactly once");
    if bvh.order.is_empty() {
        assert!(bvh.nodes.is_empty());
        return 0;
    }
    assert_eq!(bvh.nodes.len(), 2 * bvh.order.len() - 1);
    let (mut next, mut deepest) = (0u32, 0);
    let mut stack = vec![(0u32, 0u32, bvh.order.len() as u32, 0u32)];
    while let Some((at, first, count, level)) = stack.pop() {
        assert_eq!(at, next, "nodes lie in preorder");
        next += 1;
        deepest = deepest.max(level);
        let node = &bvh.nodes[at as usize];
        assert_eq!((node.first, node.count), (first, count), "ranges of children follow each other");
        let ids = &bvh.order[first as usize..(first + count) as usize];
        assert_eq!((node.lower, node.upper), bounds_of(mesh, ids), "boxes are exact");
        assert_eq!(node.is_leaf(), count == 1, "leaves hold one triangle");
        if !node.is_leaf() {
            let left = &bvh.nodes[at as usize + 1];
            assert!(left.count < count);
            stack.push((node.right, first + left.count, count - left.count, level + 1));
            stack.push((at + 1, first, left.count, level + 1));
        }
    }
    assert_eq!(next as usize, bvh.nodes.len());
    deepest
}

/// Decodes a wide BVH from its lines.
struct Reader<'a> {
    mesh: &'a Mesh,
    bvh: &'a BinaryBvh,
    cut: &'a [u32],
    wide: &'a Wide,
    lines_seen: BTreeSet<usize>,
    rows_seen: BTreeSet<u32>,
    deepest: u32,
}

/// Asserts the contract of `Wide`: every triangle in exactly one leaf or cut node, boxes exact,
/// corners bit for bit and in order, every line used once.
pub(super) fn validate_wide(mesh: &Mesh, bvh: &BinaryBvh, cut: &[u32], wide: &Wide) {
    let lines = BTreeSet::new();
    let mut reader =
        Reader { mesh, bvh, cut, wide, lines_seen: lines, rows_seen: BTreeSet::new(), deepest: 0 };
    if bvh.nodes.is_empty() {
        assert_eq!(wide.root, NONE);
        assert!(wide.lines.is_empty() && wide.triangle_ids.is_empty());
        return;
    }
    let mut found = reader.child(wide.root, 0);
    found.sort_unstable();
    assert_eq!(found, hittable(mesh), "every triangle with area is in the tree exactly once");
    assert_eq!(reader.deepest, wide.depth);
    assert_eq!(reader.lines_seen.len(), wide.lines.len(), "no line is unused");
    assert_eq!(reader.rows_seen.len(), wide.triangle_ids.len(), "no id is unused");
}

impl Reader<'_> {
    /// Decodes a structure and marks its lines as used.
    fn read<T: FromBytes>(&mut self, line: u32, lines: usize) -> T {
        for l in line as usize..line as usize + lines {
            assert!(self.lines_seen.insert(l), "line {l} belongs to one structure");
        }
        T::read_from_bytes(self.wide.lines[line as usize..line as usize + lines].as_bytes()).expect("size")
    }

    /// The triangle ids below a child; `level` wide nodes lie above it.
    fn child(&mut self, code: u32, level: u32) -> Vec<u32> {
        self.deepest = self.deepest.max(level);
        match Child::from_code(code).expect("a code") {
            Child::Node(line) => self.node(line, level),
            Child::Indexed(line) => {
                let leaf: IndexedLeaf = self.read(line, INDEXED_LINES);
                let used = leaf.vertices as usize;
                assert!((1..=16).contains(&used) && (1..=16).contains(&leaf.triangles));
                let vertex = |i: usize| -> [f32; 3] { std::array::from_fn(|k| leaf.vertex[k][i]) };
                assert!((used..16).all(|i| vertex(i) == vertex(0)));
                let distinct: BTreeSet<_> = (0..used).map(|i| vertex(i).map(f32::to_bits)).collect();
                assert_eq!(distinct.len(), used);
                let corner = |t: usize| leaf.corner.map(|row| row[t] as usize);
                assert!((leaf.triangles as usize..16).all(|t| corner(t) == [0; 3]));
                assert!((0..16).all(|t| corner(t).iter().all(|&v| v < used)));
                self.ids(leaf.first, leaf.triangles, |t| corner(t).map(vertex))
            }
            Child::Raw(line) => {
                let leaf: RawLeaf = self.read(line, RAW_LINES);
                assert!((1..=16).contains(&leaf.triangles));
                let corners = |t: usize| -> [[f32; 3]; 3] {
                    std::array::from_fn(|c| std::array::from_fn(|k| leaf.corner[c][k][t]))
                };
                assert!((leaf.triangles as usize..16).all(|t| corners(t) == corners(0)));
                assert_eq!(leaf.reserved, [0; 14]);
                self.ids(leaf.first, leaf.triangles, corners)
            }
            Child::Tets(row) => {
                let node = &self.bvh.nodes[self.cut[row as usize] as usize];
                self.bvh.order[node.first as usize..][..node.count as usize].to_vec()
            }
        }
    }

    fn node(&mut self, line: u32, level: u32) -> Vec<u32> {
        self.deepest = self.deepest.max(level + 1);
        let node: WideNode = self.read(line, NODE_LINES);
        let used = node.child.iter().take_while(|&&c| c != NONE).count();
        assert!(used >= 2);
        let mut all = Vec::new();
        for slot in 0..16 {
            let lower: [f32; 3] = std::array::from_fn(|k| node.bounds[k][0][slot]);
            let upper: [f32; 3] = std::array::from_fn(|k| node.bounds[k][1][slot]);
            if slot >= used {
                assert_eq!((lower, upper, node.child[slot]), ([f32::MAX; 3], [-f32::MAX; 3], NONE));
                continue;
            }
            let code = node.child[slot];
            if let Some(Child::Node(l) | Child::Indexed(l) | Child::Raw(l)) = Child::from_code(code) {
                assert!(l > line, "children lie behind their parent");
            }
            let ids = self.child(code, level + 1);
            let exact = bounds_of(self.mesh, &ids);
            if self.wide.widened_boxes {
                assert_widened((lower, upper), exact);
            } else {
                assert_eq!((lower, upper), exact, "boxes are exact");
            }
            all.extend(ids);
        }
        all
    }

    /// Marks a leaf's rows of the id table as used and compares its corners.
    fn ids(&mut self, first: u32, count: u32, corners: impl Fn(usize) -> [[f32; 3]; 3]) -> Vec<u32> {
        let ids = self.wide.triangle_ids[first as usize..(first + count) as usize].to_vec();
        for (t, &id) in ids.iter().enumerate() {
            assert!(self.rows_seen.insert(first + t as u32), "an id belongs to one leaf");
            let bits = |c: [[f32; 3]; 3]| c.map(|p| p.map(f32::to_bits));
            assert_eq!(bits(corners(t)), bits(self.mesh.corners(id)), "corners are those of triangle {id}");
        }
        ids
    }
}

/// A box is widened by the room that its largest |coordinate| asks for, and a few roundings at
/// most.
fn assert_widened((lower, upper): ([f32; 3], [f32; 3]), exact: ([f32; 3], [f32; 3])) {
    let greatest = exact.0.iter().chain(&exact.1).fold(0.0, |m: f64, x| m.max(f64::from(*x).abs()));
    let room = greatest * BOX_MARGIN;
    for k in 0..3 {
        for (end, exact) in [(-lower[k], -exact.0[k]), (upper[k], exact.1[k])] {
            let [end, exact] = [end, exact].map(f64::from);
            let rounded = 4.0 * f64::from(f32::EPSILON) * end.abs().max(room) + f64::from(f32::MIN_POSITIVE);
            assert!(exact + room <= end && end <= exact + room + rounded, "{exact} widened by {room}: {end}");
        }
    }
}
