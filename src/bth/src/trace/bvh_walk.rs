//! The walk through the wide BVH, nearest child first, one ray at a time.

use super::line::Line;
use super::query::{Count, Query};
use super::slabs::Slabs;
use crate::layout::{Child, IndexedLeaf, NONE, RawLeaf, WIDTH};
use crate::object::ObjectView;

/// Children that wait: a lower bound of t, and the code. The nearest lies on top.
pub(crate) type Stack = Vec<(f32, u32)>;

/// Walks from the root. Tet leaves are handed to `tets` with their row; it returns true to end the
/// traversal, or the code of a subtree to walk instead.
pub(crate) fn walk<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    line: &Line,
    slabs: &Slabs,
    stack: &mut Stack,
    query: &mut Q,
    count: &mut C,
    mut tets: impl FnMut(u32, &mut Q, &mut C) -> TetOutcome,
) -> bool {
    stack.clear();
    stack.push((f32::NEG_INFINITY, object.header.root));
    let mut limit = slabs.limit(query.limit());
    while let Some((enter, code)) = stack.pop() {
        if enter > limit {
            continue;
        }
        let done = match Child::from_code(code) {
            Some(Child::Node(at)) => {
                count.node();
                let mut found = [(0.0, NONE); WIDTH];
                let hits = slabs.children(object.node(at), limit, &mut found);
                push_nearest_last(stack, &found[..hits]);
                continue;
            }
            Some(Child::Indexed(at)) => indexed_leaf(object, object.indexed_leaf(at), line, query, count),
            Some(Child::Raw(at)) => raw_leaf(object, object.raw_leaf(at), line, query, count),
            Some(Child::Tets(row)) => match tets(row, query, count) {
                TetOutcome::Done => true,
                TetOutcome::GoOn => false,
                TetOutcome::Instead(code) => {
                    stack.push((enter, code));
                    false
                }
            },
            None => false,
        };
        if done {
            return true;
        }
        limit = slabs.limit(query.limit());
    }
    false
}

/// What a tet leaf made of a ray.
pub(crate) enum TetOutcome {
    /// The query has what it wants.
    Done,
    /// The walk goes on with the other children.
    GoOn,
    /// This subtree over the same triangles is to be walked.
    Instead(u32),
}

fn push_nearest_last(stack: &mut Stack, found: &[(f32, u32)]) {
    let base = stack.len();
    stack.extend_from_slice(found);
    // Insertion sort into descending order; at most sixteen, usually two or three.
    let pushed = &mut stack[base..];
    for i in 1..pushed.len() {
        let mut at = i;
        while at > 0 && pushed[at - 1].0 < pushed[at].0 {
            pushed.swap(at - 1, at);
            at -= 1;
        }
    }
}

fn indexed_leaf<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    leaf: &IndexedLeaf,
    line: &Line,
    query: &mut Q,
    count: &mut C,
) -> bool {
    count.leaf();
    count.triangles(leaf.triangles);
    let point = |i: usize| leaf.vertex.map(|row| row[i]);
    let projected = line.project_rows(&leaf.vertex);
    for i in 0..(leaf.triangles as usize).min(WIDTH) {
        let corner = leaf.corner.map(|row| usize::from(row[i]) % WIDTH);
        let Some(near) = projected.near(corner) else { continue };
        let crossing = line.crossing(|| corner.map(point), near.each_ref());
        if let Some(crossing) = crossing
            && query.offer(object.triangle_ids[leaf.first as usize + i], crossing)
        {
            return true;
        }
    }
    false
}

fn raw_leaf<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    leaf: &RawLeaf,
    line: &Line,
    query: &mut Q,
    count: &mut C,
) -> bool {
    count.leaf();
    count.triangles(leaf.triangles);
    for i in 0..(leaf.triangles as usize).min(WIDTH) {
        let corners = leaf.corner.map(|axes| axes.map(|row| row[i]));
        let projected = corners.map(|p| line.project(p));
        if let Some(crossing) = line.crossing(|| corners, projected.each_ref())
            && query.offer(object.triangle_ids[leaf.first as usize + i], crossing)
        {
            return true;
        }
    }
    false
}
