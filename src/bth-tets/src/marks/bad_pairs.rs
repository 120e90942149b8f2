//! All triangles in bad contact, for the repair of models and for cross-checks.

use super::collide::{After, Gathered};
use bth_bvh::BinaryBvh;
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The bad contacts of a model.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BadPairs {
    /// Ids of the triangles in bad contact with another one, ascending.
    pub triangles: Vec<u32>,
    /// Pairs of triangles in bad contact.
    pub pairs: u64,
    /// Pairs of triangles that were tested.
    pub tested: u64,
}

/// Finds every bad contact between triangles of the BVH (triangles of zero area are not in it).
/// The time grows with the number of overlapping boxes: quadratically for a heap of triangles.
///
/// # Errors
/// Only [`bth_import::Error::Cancelled`].
pub fn bad_pairs(mesh: &Mesh, bvh: &BinaryBvh, monitor: &dyn Monitor) -> Result<BadPairs> {
    monitor.stage("bad contacts", Some(bvh.nodes.len() as u64));
    let gathered = Gathered::new(mesh, bvh);
    let involved: Vec<AtomicBool> = bvh.order.iter().map(|_| AtomicBool::new(false)).collect();
    // The paths from the root to two different triangles separate at exactly one node.
    let (pairs, tested) = (0..bvh.nodes.len())
        .into_par_iter()
        .with_min_len(256)
        .map(|i| {
            monitor.advance(1);
            let node = &bvh.nodes[i];
            if node.is_leaf() {
                return Ok((0, 0));
            }
            let contacts = gathered.collide_in_parallel(i as u32 + 1, node.right, monitor, |a, b| {
                involved[a as usize].store(true, Relaxed);
                involved[b as usize].store(true, Relaxed);
                After::GoOn
            })?;
            Ok((contacts.bad, contacts.tested))
        })
        .try_reduce(|| (0, 0), |a, b| Ok((a.0 + b.0, a.1 + b.1)))?;
    let mut triangles: Vec<u32> =
        bvh.order.iter().zip(&involved).filter(|(_, bad)| bad.load(Relaxed)).map(|(&id, _)| id).collect();
    triangles.sort_unstable();
    Ok(BadPairs { triangles, pairs, tested })
}

#[cfg(test)]
mod tests {
    use super::super::testing::{median_bvh, planted};
    use super::super::triangle_contact::{Triangle, in_bad_contact};
    use super::*;
    use bth_bvh::testing::patch;
    use bth_import::monitor::Silent;

    #[test]
    fn finds_exactly_the_pairs_that_all_pairs_find() {
        let large = (0..60).map(|seed| patch(1000 + seed, 20 + 3 * seed as usize));
        let small = (60..3000).map(|seed| patch(1000 + seed, 4 + seed as usize % 14));
        for (seed, mesh) in large.chain(small).enumerate() {
            let bvh = median_bvh(&mesh);
            let t = |id: u32| Triangle { corners: mesh.corners(id), vertices: mesh.triangles[id as usize] };
            let mut triangles = std::collections::BTreeSet::new();
            let mut pairs = 0;
            for &i in &bvh.order {
                for &j in bvh.order.iter().filter(|&&j| j < i) {
                    if in_bad_contact(&t(i), &t(j)) {
                        pairs += 1;
                        triangles.extend([i, j]);
                    }
                }
            }
            let found = bad_pairs(&mesh, &bvh, &Silent).unwrap();
            assert_eq!(found.triangles, triangles.into_iter().collect::<Vec<_>>(), "seed {seed}");
            assert_eq!(found.pairs, pairs, "seed {seed}");
        }
    }

    #[test]
    fn every_kind_of_planted_contact_is_found_and_nothing_else() {
        let cases = planted();
        assert!(cases.len() >= 30);
        for case in cases {
            let found = bad_pairs(&case.mesh, &median_bvh(&case.mesh), &Silent).unwrap();
            assert_eq!(found.triangles, case.bad, "{}", case.name);
            assert_eq!(found.pairs, case.pairs, "{}", case.name);
        }
    }
}
