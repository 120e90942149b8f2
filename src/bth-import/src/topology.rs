//! Counts degenerate and duplicate triangles, boundary and non-manifold edges, and components.

use rayon::prelude::*;

use crate::disjoint_sets::DisjointSets;
use crate::mesh::Mesh;

/// Counts of a welded mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Topology {
    /// Triangles of exactly zero area.
    pub(super) degenerate: u64,
    /// Triangles with the same three positions as an earlier one.
    pub(super) duplicate: u64,
    /// Edges of one triangle.
    pub(super) boundary_edges: u64,
    /// Edges of more than two triangles.
    pub(super) non_manifold_edges: u64,
    /// Components connected by shared positions.
    pub(super) components: u64,
}

/// Counts in time and memory proportional to the mesh. A triangle that repeats a position counts as
/// degenerate only: it has no edges and is no duplicate.
pub(super) fn topology(mesh: &Mesh) -> Topology {
    let ((degenerate, components), ((boundary_edges, non_manifold_edges), duplicate)) = rayon::join(
        || (degenerate(mesh), components(mesh)),
        || rayon::join(|| edges(mesh), || duplicates(mesh)),
    );
    Topology { degenerate, duplicate, boundary_edges, non_manifold_edges, components }
}

fn degenerate(mesh: &Mesh) -> u64 {
    let ids = (0..mesh.triangles.len() as u32).into_par_iter().with_min_len(1 << 14);
    ids.filter(|id| mesh.has_zero_area(*id)).count() as u64
}

/// Triangles of three distinct positions.
fn proper(mesh: &Mesh) -> impl Iterator<Item = [u32; 3]> + Clone + '_ {
    mesh.triangles.iter().copied().filter(|[a, b, c]| a != b && b != c && c != a)
}

/// Boundary and non-manifold edges.
fn edges(mesh: &Mesh) -> (u64, u64) {
    let sides =
        proper(mesh).flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)].map(|(i, j)| (i.min(j), i.max(j))));
    let (mut boundary, mut non_manifold) = (0, 0);
    for_each_run(mesh.positions.len(), sides, |count| {
        boundary += u64::from(count == 1);
        non_manifold += u64::from(count > 2);
    });
    (boundary, non_manifold)
}

fn duplicates(mesh: &Mesh) -> u64 {
    let keys = proper(mesh).map(|mut corners| {
        corners.sort_unstable();
        (corners[0], u64::from(corners[1]) << 32 | u64::from(corners[2]))
    });
    let mut duplicate = 0;
    for_each_run(mesh.positions.len(), keys, |count| duplicate += count - 1);
    duplicate
}

/// Calls `run` with the number of occurrences of each distinct pair, by a counting sort of the
/// first values (which are below `buckets`) and a sort inside each bucket.
fn for_each_run<T: Ord + Copy + Default>(
    buckets: usize,
    pairs: impl Iterator<Item = (u32, T)> + Clone,
    mut run: impl FnMut(u64),
) {
    let mut ends = vec![0usize; buckets + 1];
    for (bucket, _) in pairs.clone() {
        ends[bucket as usize + 1] += 1;
    }
    for bucket in 0..buckets {
        ends[bucket + 1] += ends[bucket];
    }
    let mut values = vec![T::default(); ends[buckets]];
    for (bucket, value) in pairs {
        let end = &mut ends[bucket as usize];
        values[*end] = value;
        *end += 1;
    }
    // `ends[i]` is now where bucket i ends.
    let mut first = 0;
    for &end in &ends[..buckets] {
        let bucket = &mut values[first..end];
        bucket.sort_unstable();
        bucket.chunk_by(|a, b| a == b).for_each(|same| run(same.len() as u64));
        first = end;
    }
}

/// Counts components.
fn components(mesh: &Mesh) -> u64 {
    let mut sets = DisjointSets::new(mesh.positions.len());
    let gone: u64 = mesh.triangles.iter().map(|triangle| sets.join(*triangle)).sum();
    mesh.positions.len() as u64 - gone
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weld::{equal_positions, number};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn slow_topology(mesh: &Mesh) -> Topology {
        let proper = |t: &&[u32; 3]| t.iter().collect::<BTreeSet<_>>().len() == 3;
        let triangles: Vec<_> = mesh.triangles.iter().filter(proper).copied().collect();
        let sorted = |t: &[u32; 3]| {
            let mut t = *t;
            t.sort();
            t
        };
        let duplicate = (0..triangles.len())
            .filter(|&i| (0..i).any(|j| sorted(&triangles[i]) == sorted(&triangles[j])))
            .count() as u64;
        let (mut boundary_edges, mut non_manifold_edges) = (0, 0);
        for i in 0..mesh.positions.len() as u32 {
            for j in i + 1..mesh.positions.len() as u32 {
                let uses = |t: &[u32; 3]| {
                    (0..3).filter(|&k| [[i, j], [j, i]].contains(&[t[k], t[(k + 1) % 3]])).count()
                };
                match triangles.iter().map(uses).sum::<usize>() {
                    0 | 2 => {}
                    1 => boundary_edges += 1,
                    _ => non_manifold_edges += 1,
                }
            }
        }
        let mut labels: Vec<usize> = (0..mesh.positions.len()).collect();
        for _ in 0..labels.len() {
            for t in &mesh.triangles {
                let low = t.map(|v| labels[v as usize]).into_iter().min().unwrap();
                t.iter().for_each(|&v| labels[v as usize] = low);
            }
        }
        let degenerate = (0..mesh.triangles.len() as u32).filter(|&t| mesh.has_zero_area(t)).count() as u64;
        let components = labels.into_iter().collect::<BTreeSet<_>>().len() as u64;
        Topology { degenerate, duplicate, boundary_edges, non_manifold_edges, components }
    }

    proptest! {
        #[test]
        fn topology_agrees_with_the_definitions(
            positions in prop::collection::vec(prop::array::uniform3(-2i8..3), 1..14),
            faces in prop::collection::vec(prop::array::uniform3(0usize..1000), 0..40),
        ) {
            let mut triangles: Vec<_> =
                faces.iter().map(|f| f.map(|v| (v % positions.len()) as u32)).collect();
            let positions: Vec<_> = positions.iter().map(|p| p.map(f32::from)).collect();
            let kept = number(&equal_positions(&positions), &mut triangles);
            let positions = kept.iter().map(|row| positions[*row as usize]).collect();
            let mesh = Mesh { positions, triangles, ..Mesh::default() };
            prop_assert_eq!(topology(&mesh), slow_topology(&mesh));
        }
    }

    #[test]
    fn a_mesh_without_triangles_has_nothing_to_count() {
        assert_eq!(topology(&Mesh::default()), Topology::default());
    }

    #[test]
    fn topology_is_the_same_at_any_thread_count() {
        let positions = (0..60_000).map(|i| [i as f32, (i % 97) as f32, 0.0]).collect();
        let triangles = (0..60_000u32).map(|i| [i, (i * 7 + 1) % 60_000, (i * 13 + 2) % 60_000]).collect();
        let mesh = Mesh { positions, triangles, ..Mesh::default() };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| topology(&mesh))
        };
        assert_eq!(with(1), with(4));
    }
}
