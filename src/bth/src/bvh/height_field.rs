//! An object for tests: a height field whose triangles share their edges and vertices.

use bth_format::Identity;
use bth_format::layout::{
    CacheLine, Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, NONE, Object, RAW_LINES, RawLeaf, WIDTH,
    WideNode,
};
use bth_format::object::ObjectView;
use bth_random::Rng;
use zerocopy::{FromZeros, IntoBytes};

/// Number of quads of the surface along x and y, and of quads of a leaf.
const QUADS: [usize; 2] = [32, 64];
const LEAF_QUADS: [usize; 2] = [2, 4];

/// A surface over a grid, in 256 leaves of 16 triangles, some of them raw, below two levels of
/// nodes.
pub(crate) struct HeightField {
    identity: Identity,
    pub(crate) header: Object,
    lines: Vec<CacheLine>,
    ids: Vec<u32>,
    /// Points of the surface.
    pub(crate) points: Vec<[f32; 3]>,
}

/// Appends a block to the lines; returns the index of its first line.
fn append(lines: &mut Vec<CacheLine>, block: &[u8]) -> u32 {
    let line = lines.len() as u32;
    lines.resize(lines.len() + block.len() / 64, CacheLine([0; 16]));
    lines[line as usize..].as_mut_bytes().copy_from_slice(block);
    line
}

fn bounds(points: &[[f32; 3]]) -> [[f32; 3]; 2] {
    let end = |k: usize, pick: fn(f32, f32) -> f32| points.iter().map(|p| p[k]).reduce(pick).unwrap();
    [[0, 1, 2].map(|k| end(k, f32::min)), [0, 1, 2].map(|k| end(k, f32::max))]
}

fn node(children: &[([[f32; 3]; 2], u32)]) -> WideNode {
    let mut node = WideNode { bounds: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], child: [NONE; WIDTH] };
    for (i, (bounds, code)) in children.iter().enumerate() {
        node.child[i] = *code;
        for k in 0..3 {
            (node.bounds[k][0][i], node.bounds[k][1][i]) = (bounds[0][k], bounds[1][k]);
        }
    }
    node
}

impl HeightField {
    /// A surface whose heights are small integers, scaled and then moved along x.
    pub(crate) fn new(scale: f32, away: f32) -> HeightField {
        let mut rng = Rng::new(5);
        let height: Vec<f32> = (0..(QUADS[0] + 1) * (QUADS[1] + 1)).map(|_| rng.below(5) as f32).collect();
        let point = |x: usize, y: usize| {
            let z = height[y * (QUADS[0] + 1) + x];
            [(2.0 * x as f32 + away) * scale, 2.0 * y as f32 * scale, z * scale]
        };
        let (mut ids, mut points, mut leaves) = (vec![], vec![], vec![]);
        let mut lines = vec![CacheLine([0; 16]); NODE_LINES * (1 + WIDTH)];
        for i in 0..QUADS[0] / LEAF_QUADS[0] * QUADS[1] / LEAF_QUADS[1] {
            let (x0, y0) = (i % 16 * LEAF_QUADS[0], i / 16 * LEAF_QUADS[1]);
            let first = ids.len() as u32;
            let own: Vec<[f32; 3]> = (0..15).map(|v| point(x0 + v % 3, y0 + v / 3)).collect();
            let triangles: Vec<[usize; 3]> = (0..8)
                .flat_map(|q| {
                    let v = q % 2 + q / 2 * 3;
                    [[v, v + 1, v + 4], [v, v + 4, v + 3]]
                })
                .collect();
            ids.extend((0..16).map(|t| 9999 - (first + t)));
            let code = if i % 3 == 0 {
                let mut leaf = RawLeaf::new_zeroed();
                (leaf.first, leaf.triangles) = (first, 16);
                for (t, of) in triangles.iter().enumerate() {
                    for c in 0..3 {
                        for k in 0..3 {
                            leaf.corner[c][k][t] = own[of[c]][k];
                        }
                    }
                }
                assert_eq!(leaf.as_bytes().len(), RAW_LINES * 64);
                Child::Raw(append(&mut lines, leaf.as_bytes())).code()
            } else {
                let mut leaf = IndexedLeaf::new_zeroed();
                (leaf.first, leaf.triangles, leaf.vertices) = (first, 16, 15);
                for v in 0..16 {
                    for k in 0..3 {
                        leaf.vertex[k][v] = own[v % 15][k];
                    }
                }
                for (t, of) in triangles.iter().enumerate() {
                    for c in 0..3 {
                        leaf.corner[c][t] = of[c] as u8;
                    }
                }
                assert_eq!(leaf.as_bytes().len(), INDEXED_LINES * 64);
                Child::Indexed(append(&mut lines, leaf.as_bytes())).code()
            };
            leaves.push((bounds(&own), code));
            points.extend(own);
        }
        let mut inner = vec![];
        for (i, children) in leaves.chunks(WIDTH).enumerate() {
            let line = NODE_LINES * (1 + i);
            lines[line..line + NODE_LINES].as_mut_bytes().copy_from_slice(node(children).as_bytes());
            let corners: Vec<[f32; 3]> = children.iter().flat_map(|c| c.0).collect();
            inner.push((bounds(&corners), Child::Node(line as u32).code()));
        }
        lines[..NODE_LINES].as_mut_bytes().copy_from_slice(node(&inner).as_bytes());
        let [lower, upper] = bounds(&points);
        let header = Object {
            lower,
            upper,
            root: Child::Node(0).code(),
            record: 0,
            triangles: 10_000,
            dropped: 0,
            depth: 2,
            coordinates: 0,
            grid_origin: [0.0; 3],
            displacement: 0.0,
        };
        HeightField { identity: Identity::new(), header, lines, ids, points }
    }

    /// An object that consists of one of the indexed leaves.
    pub(crate) fn one_leaf(&self) -> HeightField {
        let line = NODE_LINES * (1 + WIDTH) + RAW_LINES;
        let lines = self.lines[line..line + INDEXED_LINES].to_vec();
        let points = self.points[15..30].to_vec();
        let [lower, upper] = bounds(&points);
        let header = Object { lower, upper, root: Child::Indexed(0).code(), depth: 0, ..self.header };
        HeightField { identity: Identity::new(), header, lines, ids: self.ids.clone(), points }
    }

    pub(crate) fn view(&self) -> ObjectView<'_> {
        ObjectView::of_tree(self.identity, &self.header, &self.lines, &self.ids)
    }
}
