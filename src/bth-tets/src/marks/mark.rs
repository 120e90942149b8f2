//! Bottom-up marking of the suitable nodes.

use super::Marks;
use super::collide::{After, Contacts, Gathered};
use bth_bvh::BinaryBvh;
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Max number of triangles of a subtree that one thread marks.
const GRAIN: u32 = 4096;

/// Report of the marking stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkReport {
    /// Triangles in the BVH; triangles of zero area are not.
    pub triangles: u64,
    /// Nodes of the BVH.
    pub nodes: u64,
    /// Nodes without bad contacts, leaves included.
    pub suitable: u64,
    /// Triangles of the largest suitable node.
    pub largest: u64,
    /// Pairs of triangles that were tested.
    pub pairs_tested: u64,
    /// Tested pairs in bad contact; the test of a node stops at the first one.
    pub pairs_bad: u64,
    /// Share of the triangles in maximal suitable nodes of at least some sizes.
    pub coverage: Vec<Coverage>,
}

/// How much of a model its large suitable nodes cover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Min size of a node that counts, triangles.
    pub at_least: u32,
    /// Maximal suitable nodes (suitable nodes whose parent is not) of at least that size.
    pub nodes: u64,
    /// Share of all triangles that are in these nodes, 0 to 1.
    pub share: f64,
}

/// Marks the nodes whose triangles are free of bad contacts, children before parents. A node is
/// suitable when both children are and no triangle of one is in bad contact with one of the other;
/// a triangle of zero area, as deformable objects may have, is not.
///
/// # Errors
/// Only [`bth_import::Error::Cancelled`].
pub fn mark(mesh: &Mesh, bvh: &BinaryBvh, monitor: &dyn Monitor) -> Result<(Marks, MarkReport)> {
    monitor.stage("marks", Some(bvh.order.len() as u64));
    let gathered = Gathered::new(mesh, bvh);
    let mut suitable = vec![false; bvh.nodes.len()];

    // Small subtrees, each a range of nodes, in parallel.
    let (upper, roots) = split_at_grain(bvh);
    let mut parts = Vec::with_capacity(roots.len());
    let (mut rest, mut at) = (suitable.as_mut_slice(), 0);
    for &root in &roots {
        let size = 2 * bvh.nodes[root as usize].count as usize - 1;
        let part;
        (part, rest) = rest.split_at_mut(root as usize - at).1.split_at_mut(size);
        at = root as usize + size;
        parts.push((root, part));
    }
    let mut contacts = parts
        .into_par_iter()
        .map(|(root, marks)| mark_subtree(&gathered, root, marks, monitor))
        .try_reduce(Contacts::default, |a, b| Ok(sum(a, b)))?;

    // Then the nodes above them, level by level from the bottom.
    for level in levels_from_below(bvh, &upper) {
        monitor.check()?;
        let results = level
            .par_iter()
            .map(|&i| mark_inner(&gathered, i, &|child| suitable[child as usize], monitor))
            .collect::<Result<Vec<_>>>()?;
        for (&i, (marked, c)) in level.iter().zip(results) {
            suitable[i as usize] = marked;
            contacts = sum(contacts, c);
        }
    }

    let marks = Marks { suitable };
    let report = summarize(bvh, &marks, contacts);
    Ok((marks, report))
}

fn sum(a: Contacts, b: Contacts) -> Contacts {
    Contacts { tested: a.tested + b.tested, bad: a.bad + b.bad }
}

/// The nodes of more than `GRAIN` triangles, and the largest ones below them, both ascending.
fn split_at_grain(bvh: &BinaryBvh) -> (Vec<u32>, Vec<u32>) {
    let (mut upper, mut roots) = (Vec::new(), Vec::new());
    let mut i = 0;
    while i < bvh.nodes.len() {
        let count = bvh.nodes[i].count;
        if count > GRAIN {
            upper.push(i as u32);
            i += 1;
        } else {
            roots.push(i as u32);
            i += 2 * count as usize - 1;
        }
    }
    (upper, roots)
}

/// Groups nodes so that a node comes in a later group than the nodes below it.
fn levels_from_below(bvh: &BinaryBvh, upper: &[u32]) -> Vec<Vec<u32>> {
    let mut height = std::collections::HashMap::new();
    let mut levels: Vec<Vec<u32>> = Vec::new();
    for &i in upper.iter().rev() {
        let below = |child: u32| height.get(&child).map_or(0, |h| h + 1);
        let h = below(i + 1).max(below(bvh.nodes[i as usize].right));
        height.insert(i, h);
        if levels.len() <= h {
            levels.resize(h + 1, Vec::new());
        }
        levels[h].push(i);
    }
    levels
}

/// Marks all nodes of a small subtree; `marks[k]` is the mark of node `root + k`.
fn mark_subtree(
    gathered: &Gathered<'_>,
    root: u32,
    marks: &mut [bool],
    monitor: &dyn Monitor,
) -> Result<Contacts> {
    monitor.check()?;
    let mut contacts = Contacts::default();
    for k in (0..marks.len()).rev() {
        let i = root + k as u32;
        let (marked, c) = mark_inner(gathered, i, &|child| marks[(child - root) as usize], monitor)?;
        marks[k] = marked;
        contacts = sum(contacts, c);
    }
    monitor.advance(u64::from(gathered.bvh.nodes[root as usize].count));
    Ok(contacts)
}

/// Marks one inner node whose children have been marked.
fn mark_inner(
    gathered: &Gathered<'_>,
    i: u32,
    suitable: &dyn Fn(u32) -> bool,
    monitor: &dyn Monitor,
) -> Result<(bool, Contacts)> {
    let node = &gathered.bvh.nodes[i as usize];
    if node.is_leaf() {
        return Ok((!gathered.is_flat(node.first), Contacts::default()));
    }
    let (left, right) = (i + 1, node.right);
    if !suitable(left) || !suitable(right) {
        return Ok((false, Contacts::default()));
    }
    let contacts = gathered.collide_in_parallel(left, right, monitor, |_, _| After::Stop)?;
    Ok((contacts.bad == 0, contacts))
}

fn summarize(bvh: &BinaryBvh, marks: &Marks, contacts: Contacts) -> MarkReport {
    let mut sizes = Vec::new();
    let mut i = 0;
    while i < bvh.nodes.len() {
        let count = bvh.nodes[i].count;
        if marks.suitable[i] {
            sizes.push(count);
            i += 2 * count as usize - 1;
        } else {
            i += 1;
        }
    }
    let total = bvh.order.len();
    let coverage = [256, 1024, 4096, 16384].map(|at_least| {
        let large = sizes.iter().filter(|&&s| s >= at_least);
        let covered: u64 = large.clone().map(|&s| u64::from(s)).sum();
        Coverage { at_least, nodes: large.count() as u64, share: covered as f64 / (total.max(1)) as f64 }
    });
    MarkReport {
        triangles: total as u64,
        nodes: bvh.nodes.len() as u64,
        suitable: marks.suitable.iter().filter(|&&s| s).count() as u64,
        largest: sizes.iter().copied().max().unwrap_or(0).into(),
        pairs_tested: contacts.tested,
        pairs_bad: contacts.bad,
        coverage: coverage.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::median_bvh;
    use super::super::triangle_contact::{Triangle, in_bad_contact};
    use super::*;
    use bth_bvh::testing::{patch, sphere};
    use bth_import::monitor::Silent;

    fn brute_force(mesh: &Mesh, bvh: &BinaryBvh) -> Vec<bool> {
        let triangle =
            |&id: &u32| Triangle { corners: mesh.corners(id), vertices: mesh.triangles[id as usize] };
        bvh.nodes
            .iter()
            .map(|n| {
                let ids = &bvh.order[n.first as usize..(n.first + n.count) as usize];
                let t: Vec<_> = ids.iter().map(triangle).collect();
                (0..t.len()).all(|i| (0..i).all(|j| !in_bad_contact(&t[i], &t[j])))
            })
            .collect()
    }

    #[test]
    fn marks_equal_all_pairs_in_every_node() {
        // A few large patches and thousands of small ones. Many of their nodes are suitable.
        let large = (0..60).map(|seed| patch(seed, 30 + seed as usize * 2));
        let small = (60..3000).map(|seed| patch(seed, 4 + seed as usize % 14));
        for (seed, mesh) in large.chain(small).enumerate() {
            let bvh = median_bvh(&mesh);
            let (marks, report) = mark(&mesh, &bvh, &Silent).unwrap();
            assert_eq!(marks.suitable, brute_force(&mesh, &bvh), "seed {seed}");
            assert_eq!(report.suitable, marks.suitable.iter().filter(|&&s| s).count() as u64);
        }
    }

    #[test]
    fn a_clean_closed_surface_is_suitable_as_a_whole_and_a_crossing_one_is_not() {
        let clean = sphere(120, [0.0; 3]);
        let bvh = median_bvh(&clean);
        let (marks, report) = mark(&clean, &bvh, &Silent).unwrap();
        assert!(marks.suitable.iter().all(|&s| s));
        assert_eq!(report.largest, bvh.order.len() as u64);
        assert!(report.coverage.iter().all(|c| c.share == 1.0 && c.nodes == 1));

        let mut two = clean.clone();
        let other = sphere(120, [0.7, 0.1, 0.2]);
        let offset = two.positions.len() as u32;
        two.positions.extend(other.positions);
        two.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
        let (marks, report) = mark(&two, &median_bvh(&two), &Silent).unwrap();
        assert!(!marks.suitable[0]);
        assert!(report.pairs_bad > 0 && report.largest < two.triangles.len() as u64);
    }

    #[test]
    fn any_number_of_threads_gives_the_same_marks_and_counts() {
        let mut mesh = sphere(160, [0.0; 3]);
        let other = sphere(160, [0.9, 0.9, 0.9]);
        let offset = mesh.positions.len() as u32;
        mesh.positions.extend(other.positions);
        mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
        let bvh = median_bvh(&mesh);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (marks, report) = pool.install(|| mark(&mesh, &bvh, &Silent)).unwrap();
            (marks, report)
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(7));
    }

    #[test]
    fn an_empty_bvh_has_no_marks() {
        let (marks, report) = mark(&Mesh::default(), &BinaryBvh::default(), &Silent).unwrap();
        assert!(marks.suitable.is_empty());
        assert_eq!(report.largest, 0);
    }

    #[test]
    fn marking_stops_when_cancelled() {
        struct Stop;
        impl Monitor for Stop {
            fn cancelled(&self) -> bool {
                true
            }
        }
        let mesh = sphere(20, [0.0; 3]);
        assert!(matches!(mark(&mesh, &median_bvh(&mesh), &Stop), Err(bth_import::Error::Cancelled)));
    }
}
