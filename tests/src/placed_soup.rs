//! Files of a few given triangles, degenerate ones included, that are written without the compiler.

use bth_compile::write::{FileBuilder, ObjectParts, SceneParts, Source, object, scene};
use bth_format::layout::*;
use bth_format::object::relative_to_anchor;
use bth_import::Exact;
use zerocopy::IntoBytes;

/// The smallest box around points.
fn bounds(triangles: &[[[f32; 3]; 3]]) -> ([f32; 3], [f32; 3]) {
    let fold = |pick: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|k| triangles.iter().flatten().map(|p| p[k]).reduce(pick).expect("a triangle"))
    };
    (fold(f32::min), fold(f32::max))
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = CacheLine> {
    bytes.chunks_exact(64).map(|line| {
        let word = |i: usize| u32::from_le_bytes([line[i], line[i + 1], line[i + 2], line[i + 3]]);
        CacheLine(std::array::from_fn(|i| word(4 * i)))
    })
}

/// A file of one object with 1 to 256 triangles, whose ids are their indices: a node over raw
/// leaves of 16 each. With matrices, rows of four, it has an instance for each of them, else no
/// scene.
///
/// # Panics
/// If there are no triangles or too many.
pub fn placed_soup(triangles: &[[[f32; 3]; 3]], matrices: &[[f64; 12]]) -> Vec<u8> {
    let ids: Vec<u32> = (0..triangles.len() as u32).collect();
    let soup = Soup::new(triangles, &ids.chunks(WIDTH).map(<[u32]>::to_vec).collect::<Vec<_>>());
    let scene_parts = scene_of(matrices);
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &soup.parts()).expect("an object");
    if !matrices.is_empty() {
        scene(&mut builder, &scene_parts).expect("a scene");
    }
    builder.finish()
}

/// A file of one object like [`placed_soup`], with corners in f64 and an anchor.
///
/// # Panics
/// If there are no triangles or too many.
pub fn exact_soup(triangles: &[[[f64; 3]; 3]], anchor: [f64; 3]) -> Vec<u8> {
    let ids: Vec<u32> = (0..triangles.len() as u32).collect();
    let round = |p: [f64; 3]| [0, 1, 2].map(|k| relative_to_anchor(p[k], anchor[k]));
    let rounded: Vec<_> = triangles.iter().map(|corners| corners.map(round)).collect();
    let soup = Soup::new(&rounded, &ids.chunks(WIDTH).map(<[u32]>::to_vec).collect::<Vec<_>>());
    let exact = Exact { anchor, positions: triangles.as_flattened().to_vec() };
    let rows: Vec<_> = ids.iter().map(|id| [3 * id, 3 * id + 1, 3 * id + 2]).collect();
    let source = Source {
        positions: rounded.as_flattened(),
        exact: Some(&exact),
        triangles: &rows,
        ..Source::default()
    };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &ObjectParts { source: Some(source), ..soup.parts() }).expect("an object");
    builder.finish()
}

/// An object: the corners of its triangles, and its leaves, each as triangles.
pub type SoupObject<'a> = (&'a [[[f32; 3]; 3]], Vec<Vec<u32>>);

/// A file without a scene, with an object for each list of triangles and of the ids in its raw
/// leaves. A triangle may lie in several leaves.
///
/// # Panics
/// If a list is empty, or has too many leaves or triangles in one of them.
pub fn soups(objects: &[SoupObject<'_>]) -> Vec<u8> {
    let soups: Vec<Soup> = objects.iter().map(|(triangles, leaves)| Soup::new(triangles, leaves)).collect();
    let mut builder = FileBuilder::new();
    for (index, soup) in (0..).zip(&soups) {
        object(&mut builder, index, &soup.parts()).expect("an object");
    }
    builder.finish()
}

/// An object of one node over raw leaves.
struct Soup {
    bounds: ([f32; 3], [f32; 3]),
    lines: Vec<CacheLine>,
    ids: Vec<u32>,
    places: Vec<u32>,
}

impl Soup {
    fn new(triangles: &[[[f32; 3]; 3]], leaf_ids: &[Vec<u32>]) -> Soup {
        let ids: Vec<u32> = leaf_ids.concat();
        let corners = |leaf: &Vec<u32>| leaf.iter().map(|id| triangles[*id as usize]).collect::<Vec<_>>();
        let leaves: Vec<Vec<[[f32; 3]; 3]>> = leaf_ids.iter().map(corners).collect();
        assert!((1..=WIDTH).contains(&leaves.len()));
        let mut node =
            WideNode { bounds: [[[f32::MAX; WIDTH], [-f32::MAX; WIDTH]]; 3], child: [NONE; WIDTH] };
        for (slot, leaf) in leaves.iter().enumerate() {
            let (lower, upper) = bounds(leaf);
            for k in 0..3 {
                (node.bounds[k][0][slot], node.bounds[k][1][slot]) = (lower[k], upper[k]);
            }
            node.child[slot] = Child::Raw((NODE_LINES + slot * RAW_LINES) as u32).code();
        }
        let mut all: Vec<CacheLine> = lines(node.as_bytes()).collect();
        let (mut first, mut places) = (0, vec![NONE; triangles.len()]);
        for (slot, leaf) in leaves.iter().enumerate() {
            let row = |c: usize, k: usize| std::array::from_fn(|i| leaf.get(i).unwrap_or(&leaf[0])[c][k]);
            let raw = RawLeaf {
                corner: std::array::from_fn(|c| std::array::from_fn(|k| row(c, k))),
                first,
                triangles: leaf.len() as u32,
                reserved: [0; 14],
            };
            all.extend(lines(raw.as_bytes()));
            let at = Child::Raw((NODE_LINES + slot * RAW_LINES) as u32);
            for (row, id) in leaf_ids[slot].iter().enumerate() {
                let place = &mut places[*id as usize];
                if *place == NONE {
                    *place = TrianglePlace { leaf: at, slot: row as u32 }.code();
                }
            }
            first += leaf.len() as u32;
        }
        Soup { bounds: bounds(triangles), lines: all, ids, places }
    }

    fn parts(&self) -> ObjectParts<'_> {
        ObjectParts {
            bounds: Some(self.bounds),
            root: Child::Node(0).code(),
            triangles: self.places.len() as u32,
            lines: &self.lines,
            triangle_ids: &self.ids,
            places: &self.places,
            ..ObjectParts::default()
        }
    }
}

fn scene_of(matrices: &[[f64; 12]]) -> SceneParts {
    let node = |transform: &[f64; 12]| Node {
        transform: *transform,
        parent: NONE,
        flags: NODE_MATRIX,
        name: 0,
        name_length: 0,
        reserved: [0; 4],
    };
    let instance = |node: u32| Instance { node, object: 0, flags: 0, first: node };
    SceneParts {
        scene: Scene { rate: 24.0, first_frame: 0, last_frame: 0, camera: NONE, reserved: [0; 11] },
        nodes: matrices.iter().map(node).collect(),
        instances: (0..matrices.len() as u32).map(instance).collect(),
        tracks: Vec::new(),
        times: Vec::new(),
        values: Vec::new(),
        cameras: Vec::new(),
        lights: Vec::new(),
        names: Vec::new(),
        deformers: Default::default(),
    }
}
