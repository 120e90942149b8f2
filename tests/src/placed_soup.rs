//! Files of a few given triangles, degenerate ones included, that are written without the compiler.

use bth_compile::write::{FileBuilder, ObjectParts, SceneParts, object, scene};
use bth_format::layout::*;
use zerocopy::IntoBytes;

/// The least box around points.
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

/// A file of one object with 1 to 256 triangles, whose ids are their indices: a node over raw leaves of 16 each. With matrices,
/// rows of four, it has an instance for each of them, else no scene.
///
/// # Panics
/// If there are no triangles or too many.
pub fn placed_soup(triangles: &[[[f32; 3]; 3]], matrices: &[[f64; 12]]) -> Vec<u8> {
    let leaves: Vec<&[[[f32; 3]; 3]]> = triangles.chunks(WIDTH).collect();
    assert!((1..=WIDTH).contains(&leaves.len()));
    let mut node = WideNode { bounds: [[[f32::MAX; WIDTH], [-f32::MAX; WIDTH]]; 3], child: [NONE; WIDTH] };
    for (slot, leaf) in leaves.iter().enumerate() {
        let (lower, upper) = bounds(leaf);
        for k in 0..3 {
            (node.bounds[k][0][slot], node.bounds[k][1][slot]) = (lower[k], upper[k]);
        }
        node.child[slot] = Child::Raw((NODE_LINES + slot * RAW_LINES) as u32).code();
    }
    let mut all: Vec<CacheLine> = lines(node.as_bytes()).collect();
    for (slot, leaf) in leaves.iter().enumerate() {
        let row = |c: usize, k: usize| std::array::from_fn(|i| leaf.get(i).unwrap_or(&leaf[0])[c][k]);
        let raw = RawLeaf {
            corner: std::array::from_fn(|c| std::array::from_fn(|k| row(c, k))),
            first: (slot * WIDTH) as u32,
            triangles: leaf.len() as u32,
            reserved: [0; 14],
        };
        all.extend(lines(raw.as_bytes()));
    }
    let ids: Vec<u32> = (0..triangles.len() as u32).collect();
    let parts = ObjectParts {
        bounds: Some(bounds(triangles)),
        root: Child::Node(0).code(),
        triangles: ids.len() as u32,
        lines: &all,
        triangle_ids: &ids,
        ..ObjectParts::default()
    };
    let node = |transform: &[f64; 12]| Node {
        transform: *transform,
        parent: NONE,
        flags: NODE_MATRIX,
        name: 0,
        name_length: 0,
        reserved: [0; 4],
    };
    let instance = |node: u32| Instance { node, object: 0, flags: 0, reserved: 0 };
    let parts_of_scene = SceneParts {
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
    };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).expect("an object");
    if !matrices.is_empty() {
        scene(&mut builder, &parts_of_scene).expect("a scene");
    }
    builder.finish()
}
