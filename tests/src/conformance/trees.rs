//! Files with trees over the rows of groups (F212, F213).

use super::Case;
use super::edit::{Editor, Seal};
use super::scenes::{builder_of, groups};
use bth_compile::write::SceneParts;
use bth_format::layout::*;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// Two groups and the world, in which nothing moves.
fn still() -> SceneParts {
    SceneParts { tracks: Vec::new(), times: Vec::new(), values: Vec::new(), ..groups() }
}

/// A file with a scene and the first `trees` trees of the still one. `first` is true if the feature
/// of files with trees of the first groups is noted.
fn file(parts: &SceneParts, trees: usize, first: bool) -> Vec<u8> {
    let still = still();
    let bytes = builder_of(2, &still).finish();
    let file = bth_format::File::from_bytes(&bytes).expect("a valid file");
    let mut all = bth::check_first_frame(&file).expect("instances that can be placed");
    assert_eq!(all.trees.len(), 3);
    all.trees.truncate(trees);
    let lines = all.trees.iter().map(|tree| tree.lines as usize).sum();
    let mut builder = builder_of(2, parts);
    builder.rows(kind::TREES, NONE, &all.trees).expect("once");
    builder.rows(kind::TREE_LINES, NONE, &all.lines[..lines]).expect("once");
    if first {
        builder.require(FEATURE_FIRST_TREES);
    }
    builder.finish()
}

/// The same with a track of a node.
fn moving(node: u32) -> SceneParts {
    let parts = SceneParts { nodes: still().nodes, ..groups() };
    let track = Track { node, ..parts.tracks[0] };
    SceneParts { tracks: vec![track], ..parts }
}

pub(super) fn valid() -> Vec<Case> {
    vec![
        Case::new("scene-trees", file(&still(), 3, false)),
        Case::new("scene-trees-of-groups", file(&moving(3), 2, false)),
        Case::new("scene-trees-of-first-groups", file(&moving(2), 1, true)),
    ]
}

pub(super) fn invalid() -> Vec<Case> {
    let changed = |name: &str, kind: u32, at: usize, value: u32| {
        let mut editor = Editor::new(&file(&still(), 3, false));
        let start = editor.bytes_at(editor.entry_at(NONE, kind) + offset_of!(SectionEntry, offset));
        editor.put(start + at, value.as_bytes());
        Case::new(name, editor.seal(Seal::Sections))
    };
    let (child, high_of_magnitude) = (offset_of!(WideNode, child), offset_of!(Tree, magnitude) + 4);
    let lines_only = || {
        let still = still();
        let mut builder = builder_of(2, &still);
        builder.section(kind::TREE_LINES, NONE, 64, vec![0; 64]).expect("once");
        builder.finish()
    };
    vec![
        changed("F212-row-twice", kind::TREE_LINES, child + 4, Child::LEAF_BIT),
        changed("F212-row-of-another-group", kind::TREE_LINES, child, Child::LEAF_BIT | 2),
        changed("F212-loop", kind::TREE_LINES, child, 0),
        changed("F212-hole", kind::TREE_LINES, child + 8, Child::LEAF_BIT),
        changed("F212-visible", kind::TREES, offset_of!(Tree, visible), 1),
        changed("F212-depth", kind::TREES, offset_of!(Tree, depth), 2),
        changed("F212-instances", kind::TREES, offset_of!(Tree, instances), 3),
        changed("F212-nodes", kind::TREES, offset_of!(Tree, end_node), 1),
        changed("F212-reserved", kind::TREES, offset_of!(Tree, reserved), 1),
        Case::new("F212-lines-alone", lines_only()),
        Case::new("F212-trees-missing", file(&still(), 1, false)),
        Case::new("F212-feature-not-needed", file(&still(), 3, true)),
        Case::new("F212-moves", file(&groups(), 3, false)),
        Case::new("F212-first-group-moves", file(&moving(1), 1, true)),
        changed("F213-box", kind::TREE_LINES, 0, 1e9f32.to_bits()),
        changed("F213-magnitude", kind::TREES, high_of_magnitude, 0),
        changed("F213-condition", kind::TREES, 64 + offset_of!(Tree, condition) + 4, 0x3ff0_0000),
        changed("F213-extent", kind::TREES, 128 + offset_of!(Tree, extent), 0),
        changed("F213-origin-slack", kind::TREES, offset_of!(Tree, origin_slack), 0),
    ]
}
