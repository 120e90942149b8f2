//! Optimization of the tree by reinsertion: subtrees move to the positions of smallest cost.
//!
//! After "Parallel Reinsertion for Bounding Volume Hierarchy Optimization" (Meister and Bittner
//! 2018): the best places of a batch of subtrees are searched in parallel in the unchanged tree.
//! The moves are then made one after the other, each undone if it does not pay after the ones
//! before it, so that the cost never rises and the result is the same at any number of threads.

use super::extent::Extent;
use super::linked_tree::LinkedTree;
use bth_format::layout::NONE;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use rayon::prelude::*;

/// Size of the first batch. It is small because it holds the largest nodes, whose moves affect each
/// other most.
const FIRST_BATCH: usize = 16;
/// Later batches have this share of what was tried before, so that there are few of them.
const BATCH_GROWTH: usize = 16;

/// Tries to move the given share of the nodes, largest area first. Returns how many moved.
pub(super) fn pass<E: Extent>(tree: &mut LinkedTree<E>, share: f64, monitor: &dyn Monitor) -> Result<u64> {
    let candidates = largest(tree, share);
    let mut moved = 0;
    let mut done = 0;
    while done < candidates.len() {
        monitor.check()?;
        let batch = &candidates[done..candidates.len().min(done + FIRST_BATCH + done / BATCH_GROWTH)];
        done += batch.len();
        let mut moves: Vec<Move> = batch
            .par_iter()
            .with_min_len(16)
            .map_init(Vec::new, |stack, &subtree| search(tree, subtree, stack))
            .flatten_iter()
            .collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.subtree.cmp(&b.subtree)));
        for Move { subtree, target, .. } in moves {
            if !tree.can_move(subtree, target) {
                continue;
            }
            let sibling = tree.sibling(subtree);
            if tree.move_beside(subtree, target) < 0.0 {
                moved += 1;
            } else {
                tree.move_beside(subtree, sibling);
            }
        }
        monitor.advance(batch.len() as u64);
    }
    Ok(moved)
}

/// Smallest nodes whose areas one task counts.
const COUNTED_AT_ONCE: usize = 1 << 14;
/// Bits of an area that do not count where areas are counted.
const LESS_BITS: u32 = 20;

/// The power of two by which areas are multiplied, exactly, so that f32 holds the areas of meshes
/// of any size.
fn scale<E: Extent>(tree: &LinkedTree<E>) -> f64 {
    let greatest = (0..tree.len() as u32)
        .find(|&at| tree.node(at).parent == NONE)
        .map(|at| tree.node(at).bounds.half_area());
    match greatest.unwrap_or(0.0) {
        area if area > 0.0 && area.is_finite() => (-area.log2().floor()).exp2(),
        _ => 1.0,
    }
}

/// The nodes with a grandparent of the largest areas.
fn largest<E: Extent>(tree: &LinkedTree<E>, share: f64) -> Vec<u32> {
    let scale = scale(tree);
    let keyed = (0..tree.len() as u32).into_par_iter().with_min_len(COUNTED_AT_ONCE).filter_map(|at| {
        let node = tree.node(at);
        let may_move = node.parent != NONE && tree.node(node.parent).parent != NONE;
        may_move.then(|| ((node.bounds.half_area() * scale) as f32, at))
    });
    // Areas are counted by their leading bits, which are ordered as they are, so that not all of
    // them need be sorted.
    let leading = |area: f32| (area.to_bits() >> LESS_BITS) as usize;
    let none = || vec![0u32; 1 << (u32::BITS - LESS_BITS)];
    let add = |mut counts: Vec<u32>, (area, _): (f32, u32)| {
        counts[leading(area)] += 1;
        counts
    };
    let join = |mut a: Vec<u32>, b: Vec<u32>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let counts = keyed.clone().fold(none, add).reduce(none, join);
    let all: usize = counts.iter().map(|count| *count as usize).sum();
    let wanted = ((all as f64 * share).ceil() as usize).min(all);
    let (mut least, mut from_there) = (counts.len(), 0);
    while from_there < wanted {
        least -= 1;
        from_there += counts[least] as usize;
    }
    let mut large: Vec<(f32, u32)> = keyed.filter(|(area, _)| leading(*area) >= least).collect();
    large.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    large.truncate(wanted);
    large.into_iter().map(|(_, at)| at).collect()
}

/// A move that lowers the sum of all areas by `gain`.
#[derive(Clone, Copy, Debug)]
struct Move {
    subtree: u32,
    target: u32,
    gain: f64,
}

/// The best new sibling of a subtree that has a grandparent.
fn search<E: Extent>(tree: &LinkedTree<E>, subtree: u32, stack: &mut Vec<(u32, f64)>) -> Option<Move> {
    let bounds = tree.node(subtree).bounds;
    let area = bounds.half_area();
    let parent = tree.node(subtree).parent;
    let mut best = Move { subtree, target: NONE, gain: 0.0 };
    // The area that removing the subtree saves: its parent's, and the decrease of each ancestor
    // below the one under which it is inserted again.
    let mut saved = tree.node(parent).bounds.half_area();
    let mut remaining = E::EMPTY;
    let mut below = subtree;
    loop {
        let beside = tree.sibling(below);
        stack.push((beside, saved));
        while let Some((at, saved)) = stack.pop() {
            // A new parent has at least the area of what moves.
            if saved - area <= best.gain {
                continue;
            }
            let node = tree.node(at);
            let joined = node.bounds.union(&bounds).half_area();
            if saved - joined > best.gain {
                best.target = at;
                best.gain = saved - joined;
            }
            let further = saved - (joined - node.bounds.half_area());
            if !node.is_leaf() && further - area > best.gain {
                stack.push((node.left, further));
                stack.push((node.right, further));
            }
        }
        remaining.grow(&tree.node(beside).bounds);
        let ancestor = tree.node(below).parent;
        if ancestor != parent {
            saved += tree.node(ancestor).bounds.half_area() - remaining.half_area();
        }
        if tree.node(ancestor).parent == NONE {
            break;
        }
        below = ancestor;
    }
    // At the present position the gain is nothing but rounding.
    (best.target != NONE && best.target != tree.sibling(subtree)).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::super::samples::{grid, soup};
    use super::super::{BvhOptions, build};
    use super::*;
    use bth_import::monitor::Silent;

    #[test]
    fn the_largest_nodes_do_not_depend_on_the_scale() {
        let mesh = soup(400, 2);
        let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
        let at = |scale: f32| {
            let mut bvh = bvh.clone();
            for node in &mut bvh.nodes {
                (node.lower, node.upper) = (node.lower.map(|x| x * scale), node.upper.map(|x| x * scale));
            }
            largest(&LinkedTree::new(&bvh), 0.3)
        };
        for exponent in [-100, -70, 70, 100] {
            assert_eq!(at(f32::powi(2.0, exponent)), at(1.0), "{exponent}");
        }
    }

    #[test]
    fn the_largest_nodes_are_those_of_sorting_all() {
        for mesh in [soup(1, 1), soup(2, 1), soup(400, 2), grid(30, 0.0, 3), grid(150, 5.0, 4)] {
            let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
            let tree = LinkedTree::new(&bvh);
            let mut all: Vec<(f32, u32)> = Vec::new();
            for at in 0..tree.len() as u32 {
                let parent = tree.node(at).parent;
                if parent != NONE && tree.node(parent).parent != NONE {
                    all.push(((tree.node(at).bounds.half_area() * scale(&tree)) as f32, at));
                }
            }
            all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for share in [0.0, 1e-4, 0.01, 0.3, 0.999, 1.0] {
                let wanted = (all.len() as f64 * share).ceil() as usize;
                let expected: Vec<u32> = all[..wanted].iter().map(|(_, at)| *at).collect();
                assert_eq!(largest(&tree, share), expected, "{} nodes, {share}", tree.len());
            }
        }
    }
}
