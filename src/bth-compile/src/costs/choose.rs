//! Top-down selection: the first suitable nodes for which tetrahedra are the cheaper structure.

use super::Estimator;
use super::subtree_sums::{half_area, subtree_sums};
use crate::bvh::BinaryBvh;
use crate::error::{Error, Result};
use crate::marks::Marks;
use crate::mesh::Mesh;
use crate::monitor::Monitor;
use serde::Serialize;
use std::time::Instant;

/// Nodes between two looks at whether the user asked to stop.
const NODES_BETWEEN_CHECKS: usize = 1 << 14;

/// What the structures cost, and which nodes are considered. Times are of one ray on one thread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Options {
    /// How to estimate the steps through a tetrahedralization.
    pub estimator: Estimator,
    /// C_tet: a step from one tetrahedron to the next, nanoseconds.
    pub c_tet: f64,
    /// C_t: a visit of an inner node of the *binary* BVH, nanoseconds; several make one of a wide node.
    pub c_t: f64,
    /// C_i: a visit of a leaf of the binary BVH, nanoseconds a triangle; several share one test.
    pub c_i: f64,
    /// Getting a ray into a tet leaf and out of it again, on average over rays that come from outside
    /// and rays that start on one of its triangles, nanoseconds.
    pub entry: f64,
    /// Nodes of fewer triangles stay BVH.
    pub minimum_triangles: u32,
    /// Nodes of more triangles are not taken whole.
    pub maximum_triangles: u32,
    /// Least saving for which any node is chosen, as a share of the cost of the model's BVH: tet leaves
    /// take several times the memory, and a few small ones in a large scene save next to nothing.
    pub minimum_gain: f64,
}

impl Default for Options {
    /// Fitted to measurements on one machine (AVX-512, one thread). A tet step took 1.8 ns on camera
    /// rays, 3.2 on bounces and 3.5 on ambient occlusion: 2.8 on average. The BVH took 107 ns a ray
    /// on the Stanford bunny (122 on bounces, 93 on ambient occlusion), whose binary tree costs 32.5
    /// visits after the surface area heuristic: 3.4 ns a visit. On scans whole models pay off by 0 to
    /// 25 %, below some thousand triangles nodes do not.
    fn default() -> Self {
        Options {
            estimator: Estimator::FaceCount,
            c_tet: 2.8,
            c_t: 3.4,
            c_i: 3.4,
            entry: 6.0,
            minimum_triangles: 2048,
            maximum_triangles: 1 << 20,
            minimum_gain: 0.02,
        }
    }
}

/// Why a node was or was not chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decision {
    /// It becomes a tet leaf.
    Chosen,
    /// Its BVH is estimated to be the cheaper.
    RefusedCost,
    /// It has fewer triangles than the minimum.
    RefusedSmall,
    /// It has more triangles than the maximum.
    RefusedLarge,
    /// It would be chosen, but all such nodes together save too small a share of the model's cost.
    RefusedGain,
    /// Some of its triangles are in bad contact.
    Unsuitable,
}

impl std::fmt::Display for Decision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Decision::Chosen => "chosen",
            Decision::RefusedCost => "no: the BVH costs less",
            Decision::RefusedSmall => "no: too few triangles",
            Decision::RefusedLarge => "no: too many triangles",
            Decision::RefusedGain => "no: too little gained on the whole",
            Decision::Unsuitable => "no: bad contacts",
        })
    }
}

/// What was found of one node.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Index in the binary BVH.
    pub node: u32,
    /// Triangles below it.
    pub count: u32,
    /// Whether they are free of bad contacts.
    pub suitable: bool,
    /// Estimated cost of its tetrahedralization, nanoseconds a ray that meets its box.
    pub cost_tet: f64,
    /// Cost of its BVH after the surface area heuristic, nanoseconds a ray that meets its box.
    pub cost_sah: f64,
    /// Estimated steps of a ray through its tetrahedralization.
    pub n_avg: f64,
    /// What follows.
    pub decision: Decision,
}

/// The selection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choice {
    /// Nodes that become tet leaves, ascending; none lies below another.
    pub chosen: Vec<u32>,
    /// The nodes that were examined, ascending: neither below a chosen one nor below a small one.
    pub verdicts: Vec<Verdict>,
}

/// What the selection came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// The costs and limits that were used.
    pub options: Options,
    /// Nodes examined.
    pub examined: u64,
    /// Nodes chosen.
    pub chosen: u64,
    /// Triangles in chosen nodes.
    pub triangles: u64,
    /// Those over all triangles of the BVH, 0 to 1.
    pub share: f64,
    /// Suitable nodes of fitting size that were refused for their cost.
    pub refused_for_cost: u64,
    /// Cost of the whole BVH after the surface area heuristic, nanoseconds a ray that meets its box.
    pub cost_sah: f64,
    /// The same with the chosen nodes tetrahedralized.
    pub cost_with_tets: f64,
    /// Wall time, seconds.
    pub seconds: f64,
}

/// Chooses nodes from the root down: a suitable node of fitting size becomes a tet leaf if
/// `C_tet N_avg + entry` (the paper's equation 2, and the cost of getting in) is below the cost of
/// its BVH, and else its children are examined. Unless all of them together save the least gain,
/// none is taken.
///
/// # Errors
/// [`Error::Cancelled`]; `BTH-X030` when `marks` belongs to another BVH.
pub fn choose(
    _mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<(Choice, Report)> {
    let start = Instant::now();
    monitor.stage("costs", None);
    if marks.suitable.len() != bvh.nodes.len() {
        let message = format!("{} marks for {} nodes", marks.suitable.len(), bvh.nodes.len());
        return Err(Error::Internal { code: "BTH-X030", message });
    }
    let sums = subtree_sums(bvh);
    let mut choice = Choice::default();
    let mut report = Report { options: *options, ..Report::default() };
    let mut saved = 0.0;
    let mut i = 0;
    // In preorder, what lies below a node follows it: leaving a subtree out is a jump.
    while i < bvh.nodes.len() {
        if choice.verdicts.len().is_multiple_of(NODES_BETWEEN_CHECKS) {
            monitor.check()?;
        }
        let (node, sum) = (&bvh.nodes[i], &sums[i]);
        let suitable = marks.suitable[i];
        let area = half_area(node);
        let n_avg = options.estimator.steps(node.count, sum.depth as f64 / f64::from(node.count));
        let cost_tet = options.c_tet * n_avg + options.entry;
        let cost_sah = (options.c_t * sum.inner_area + options.c_i * sum.leaf_area) / area;
        let decision = if node.count < options.minimum_triangles {
            Decision::RefusedSmall
        } else if !suitable {
            Decision::Unsuitable
        } else if node.count > options.maximum_triangles {
            Decision::RefusedLarge
        } else if cost_tet < cost_sah {
            Decision::Chosen
        } else {
            Decision::RefusedCost
        };
        let verdict =
            Verdict { node: i as u32, count: node.count, suitable, cost_tet, cost_sah, n_avg, decision };
        choice.verdicts.push(verdict);
        match decision {
            Decision::Chosen => {
                choice.chosen.push(i as u32);
                report.triangles += u64::from(node.count);
                saved += area * (cost_sah - cost_tet);
            }
            Decision::RefusedCost => report.refused_for_cost += 1,
            _ => {}
        }
        i += match decision {
            Decision::Chosen | Decision::RefusedSmall => 2 * node.count as usize - 1,
            _ => 1,
        };
    }
    if let (Some(root), Some(verdict)) = (bvh.nodes.first(), choice.verdicts.first()) {
        report.cost_sah = verdict.cost_sah;
        saved /= half_area(root);
        if saved < options.minimum_gain * report.cost_sah {
            for verdict in choice.verdicts.iter_mut().filter(|v| v.decision == Decision::Chosen) {
                verdict.decision = Decision::RefusedGain;
            }
            choice.chosen.clear();
            (saved, report.triangles) = (0.0, 0);
        }
        report.share = report.triangles as f64 / f64::from(root.count);
        report.cost_with_tets = report.cost_sah - saved;
    }
    report.examined = choice.verdicts.len() as u64;
    report.chosen = choice.chosen.len() as u64;
    report.seconds = start.elapsed().as_secs_f64();
    Ok((choice, report))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Node;
    use crate::monitor::Silent;

    /// A tree of random shape over boxes that shrink from parent to child.
    fn tree(seed: u64, leaves: u32) -> BinaryBvh {
        fn grow(nodes: &mut Vec<Node>, seed: &mut u64, first: u32, count: u32, size: f32) {
            let i = nodes.len();
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            nodes.push(Node {
                lower: [0.0; 3],
                upper: [size, size * 0.5, size * 0.25],
                first,
                count,
                right: 0,
            });
            if count > 1 {
                let left = 1 + (*seed >> 33) as u32 % (count - 1);
                grow(nodes, seed, first, left, size * 0.72);
                nodes[i].right = nodes.len() as u32;
                grow(nodes, seed, first + left, count - left, size * 0.78);
            }
        }
        let mut bvh = BinaryBvh { nodes: Vec::new(), order: (0..leaves).collect() };
        let mut seed = seed;
        grow(&mut bvh.nodes, &mut seed, 0, leaves, 1.0);
        bvh
    }

    /// Suitable where the first triangle is past the given row: closed under descending.
    fn marks_beyond(bvh: &BinaryBvh, row: u32) -> Marks {
        Marks { suitable: bvh.nodes.iter().map(|n| n.first >= row || n.count == 1).collect() }
    }

    /// The cost after the surface area heuristic, and the sum of depths, by plain recursion.
    fn cost_and_depths(bvh: &BinaryBvh, i: usize, depth: u32, options: &Options) -> (f64, u32) {
        let node = &bvh.nodes[i];
        if node.is_leaf() {
            return (options.c_i, depth);
        }
        let share = |child: usize| half_area(&bvh.nodes[child]) / half_area(node);
        let (l, r) = (i + 1, node.right as usize);
        let (a, b) =
            (cost_and_depths(bvh, l, depth + 1, options), cost_and_depths(bvh, r, depth + 1, options));
        (options.c_t + share(l) * a.0 + share(r) * b.0, a.1 + b.1)
    }

    fn by_recursion(bvh: &BinaryBvh, marks: &Marks, i: usize, options: &Options, chosen: &mut Vec<u32>) {
        let node = &bvh.nodes[i];
        if node.count < options.minimum_triangles {
            return;
        }
        let (sah, depths) = cost_and_depths(bvh, i, 0, options);
        let steps = options.estimator.steps(node.count, f64::from(depths) / f64::from(node.count));
        if marks.suitable[i]
            && node.count <= options.maximum_triangles
            && options.c_tet * steps + options.entry < sah
        {
            chosen.push(i as u32);
        } else if !node.is_leaf() {
            by_recursion(bvh, marks, i + 1, options, chosen);
            by_recursion(bvh, marks, node.right as usize, options, chosen);
        }
    }

    #[test]
    fn chooses_what_the_papers_recursion_chooses() {
        let mut outcomes = [0; 2];
        for seed in 0..200 {
            let bvh = tree(seed, 50 + 3 * seed as u32);
            let marks = marks_beyond(&bvh, (seed % 40) as u32);
            for estimator in [Estimator::FaceCount, Estimator::AverageDepth] {
                let options = Options {
                    estimator,
                    minimum_triangles: 8,
                    maximum_triangles: 200,
                    c_tet: 0.5 + (seed % 7) as f64 * 0.2,
                    minimum_gain: 0.0,
                    ..Options::default()
                };
                let (choice, report) = choose(&Mesh::default(), &bvh, &marks, &options, &Silent).unwrap();
                let mut expected = Vec::new();
                by_recursion(&bvh, &marks, 0, &options, &mut expected);
                assert_eq!(choice.chosen, expected, "seed {seed}");
                assert_eq!(report.chosen, expected.len() as u64);
                outcomes[0] += report.chosen;
                outcomes[1] += report.refused_for_cost;
            }
        }
        assert!(outcomes.iter().all(|&n| n > 200), "{outcomes:?}");
    }

    #[test]
    fn costs_of_verdicts_are_those_of_the_definition() {
        let bvh = tree(3, 300);
        let options = Options { minimum_triangles: 1, c_tet: 1e9, c_t: 2.0, c_i: 5.0, ..Options::default() };
        let marks = marks_beyond(&bvh, 0);
        let (choice, _) = choose(&Mesh::default(), &bvh, &marks, &options, &Silent).unwrap();
        assert_eq!(choice.verdicts.len(), bvh.nodes.len());
        for v in &choice.verdicts {
            let (sah, _) = cost_and_depths(&bvh, v.node as usize, 0, &options);
            assert!((v.cost_sah - sah).abs() < 1e-9 * sah);
            assert_eq!(v.decision, Decision::RefusedCost);
        }
    }

    #[test]
    fn chosen_nodes_are_ascending_disjoint_and_suitable() {
        let bvh = tree(5, 2000);
        let marks = marks_beyond(&bvh, 3);
        let options = Options {
            minimum_triangles: 2,
            c_tet: 1e-3,
            entry: 0.0,
            minimum_gain: 0.0,
            ..Options::default()
        };
        let (choice, report) = choose(&Mesh::default(), &bvh, &marks, &options, &Silent).unwrap();
        assert!(!choice.chosen.is_empty());
        let mut end = 0;
        for &i in &choice.chosen {
            assert!(i >= end && marks.suitable[i as usize]);
            end = i + 2 * bvh.nodes[i as usize].count - 1;
        }
        assert!(report.cost_with_tets < report.cost_sah);
    }

    #[test]
    fn nothing_is_chosen_for_a_gain_below_the_least_one() {
        let bvh = tree(5, 2000);
        let marks = marks_beyond(&bvh, 3);
        let options = Options { minimum_triangles: 2, c_tet: 1e-3, minimum_gain: 1.0, ..Options::default() };
        let (choice, report) = choose(&Mesh::default(), &bvh, &marks, &options, &Silent).unwrap();
        assert!(choice.chosen.is_empty() && report.triangles == 0);
        assert!(choice.verdicts.iter().any(|v| v.decision == Decision::RefusedGain));
        assert_eq!(report.cost_with_tets, report.cost_sah);
    }

    #[test]
    fn an_empty_bvh_chooses_nothing_and_foreign_marks_are_an_error() {
        let (mesh, options) = (Mesh::default(), Options::default());
        let (choice, _) = choose(&mesh, &BinaryBvh::default(), &Marks::default(), &options, &Silent).unwrap();
        assert_eq!(choice, Choice::default());
        let error = choose(&mesh, &tree(1, 9), &Marks::default(), &options, &Silent).unwrap_err();
        assert!(error.to_string().contains("BTH-X030"));
    }
}
