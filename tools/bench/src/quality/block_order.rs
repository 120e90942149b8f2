//! The blocks of a wide BVH in other orders than the compiler's, which is depth first with nodes before leaves.

use bth_compile::bvh::Wide;
use bth_format::layout::{CacheLine, Child, INDEXED_LINES, NODE_LINES, NONE, RAW_LINES, WideNode};
use bth_random::Rng;
use std::collections::HashMap;
use zerocopy::{FromBytes, IntoBytes};

/// Where blocks lie. Parents always lie before their children, which the format demands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlockOrder {
    /// The order of the compiler.
    DepthFirst,
    /// Depth first, each node followed by the leaves that are its children.
    LeavesBesideNodes,
    /// Nodes level by level, then leaves in the order of their nodes.
    BreadthFirst,
    /// Nodes in any order, then leaves in any order.
    Random,
}

/// The same tree in another order.
pub(super) fn reordered(wide: &Wide, order: BlockOrder) -> Wide {
    let blocks = match order {
        BlockOrder::DepthFirst => return wide.clone(),
        BlockOrder::LeavesBesideNodes => beside(wide),
        BlockOrder::BreadthFirst => frontier(wide, |_| 0),
        BlockOrder::Random => {
            let mut rng = Rng::new(1);
            let mut blocks = frontier(wide, |len| rng.below(len as u64) as usize);
            let nodes =
                blocks.partition_point(|code| matches!(Child::from_code(*code), Some(Child::Node(_))));
            for i in (nodes + 1..blocks.len()).rev() {
                let other = nodes + rng.below((i - nodes + 1) as u64) as usize;
                blocks.swap(i, other);
            }
            blocks
        }
    };
    moved(wide, &blocks)
}

/// Child codes of the node at a line.
fn children(wide: &Wide, line: u32) -> impl Iterator<Item = u32> + use<> {
    let bytes = wide.lines[line as usize..].as_bytes();
    let node = WideNode::ref_from_prefix(bytes).expect("a whole node").0;
    node.child.into_iter().filter(|code| *code != NONE)
}

/// Depth first, each node followed by its leaves.
fn beside(wide: &Wide) -> Vec<u32> {
    let (mut blocks, mut pending) = (Vec::new(), vec![wide.root]);
    while let Some(code) = pending.pop() {
        blocks.push(code);
        if let Some(Child::Node(line)) = Child::from_code(code) {
            let is_node = |code: &u32| matches!(Child::from_code(*code), Some(Child::Node(_)));
            let (nodes, leaves): (Vec<u32>, Vec<u32>) = children(wide, line).partition(is_node);
            blocks.extend(leaves);
            pending.extend(nodes.into_iter().rev());
        }
    }
    blocks
}

/// Nodes, then leaves in the order of their nodes. The next node is one of those whose parents are placed; `pick` chooses one
/// of so many.
fn frontier(wide: &Wide, mut pick: impl FnMut(usize) -> usize) -> Vec<u32> {
    let (mut nodes, mut leaves) = (Vec::new(), Vec::new());
    let mut pending = std::collections::VecDeque::from([wide.root]);
    while !pending.is_empty() {
        let at = pick(pending.len());
        pending.swap(0, at);
        let code = pending.pop_front().expect("not empty");
        match Child::from_code(code) {
            Some(Child::Node(line)) => {
                nodes.push(code);
                pending.extend(children(wide, line));
            }
            _ => leaves.push(code),
        }
    }
    nodes.extend(leaves);
    nodes
}

/// The blocks in this order, with codes to match.
fn moved(wide: &Wide, blocks: &[u32]) -> Wide {
    let mut next = 0;
    let mut codes = HashMap::new();
    for &old in blocks {
        let line = next as u32;
        let (new, lines) = match Child::from_code(old) {
            Some(Child::Node(_)) => (Child::Node(line), NODE_LINES),
            Some(Child::Indexed(_)) => (Child::Indexed(line), INDEXED_LINES),
            Some(Child::Raw(_)) => (Child::Raw(line), RAW_LINES),
            other => unreachable!("no block of a plain BVH: {other:?}"),
        };
        codes.insert(old, new.code());
        next += lines;
    }
    let mut lines: Vec<CacheLine> = Vec::with_capacity(next);
    for &old in blocks {
        match Child::from_code(old) {
            Some(Child::Node(line)) => {
                let bytes = wide.lines[line as usize..][..NODE_LINES].as_bytes();
                let mut node = WideNode::read_from_bytes(bytes).expect("a node");
                node.child = node.child.map(|code| codes.get(&code).copied().unwrap_or(NONE));
                let at = lines.len();
                lines.resize(at + NODE_LINES, CacheLine([0; 16]));
                lines[at..].as_mut_bytes().copy_from_slice(node.as_bytes());
            }
            Some(Child::Indexed(line)) => lines.extend(&wide.lines[line as usize..][..INDEXED_LINES]),
            Some(Child::Raw(line)) => lines.extend(&wide.lines[line as usize..][..RAW_LINES]),
            _ => {}
        }
    }
    Wide { lines, root: codes[&wide.root], ..wide.clone() }
}
