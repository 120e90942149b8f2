//! The tetrahedralization of one node: attempts with different free-space points until one passes
//! the checks.

use std::time::{Duration, Instant};

use bth_tetgen_protocol::{Job, Request};

use bth_bvh::{BinaryBvh, Node};
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;

use super::failure::AttemptError;
use super::gather::{NodeInput, SIDES, gather};
use super::pool::WorkerSlot;
use super::report::{NodeReport, Outcome};
use super::{TetMesh, TetOptions, check, free_space, order};

/// A node that is to be tetrahedralized.
#[derive(Clone, Copy)]
pub struct NodeJob<'a> {
    /// The mesh that holds the triangles.
    pub mesh: &'a Mesh,
    /// Its binary BVH.
    pub bvh: &'a BinaryBvh,
    /// Row of the BVH.
    pub node: u32,
    /// How to tetrahedralize.
    pub options: &'a TetOptions,
    /// Version of TetGen.
    pub tetgen: &'a str,
}

impl NodeJob<'_> {
    /// The triangles of the node in the smallest box; `None` when even that leaves the range of
    /// `f32`.
    pub fn input(&self) -> Option<NodeInput> {
        gather(self.mesh, self.bvh, self.node, 0.0).ok()
    }
}

/// Wraps the work on single nodes from outside: returns an earlier result, or calls `build` and
/// keeps what it returns.
pub trait NodeRunner: Sync {
    /// The result for a node.
    ///
    /// # Errors
    /// The errors of `build`.
    fn run(&self, job: &NodeJob<'_>, build: &mut dyn FnMut() -> Result<NodeResult>) -> Result<NodeResult>;
}

/// Builds every node and stores the wall-clock time of its attempts in its report.
pub struct TimedNodes;

impl NodeRunner for TimedNodes {
    fn run(&self, _: &NodeJob<'_>, build: &mut dyn FnMut() -> Result<NodeResult>) -> Result<NodeResult> {
        let start = Instant::now();
        let mut result = build()?;
        result.report.seconds = start.elapsed().as_secs_f64();
        Ok(result)
    }
}

/// Result of a node.
pub struct NodeResult {
    /// Absent when every attempt failed.
    pub built: Option<TetMesh>,
    /// The attempts.
    pub report: NodeReport,
    /// True if no worker could be started: smaller nodes would fail as well.
    pub no_worker: bool,
    /// True if the result would be the same on any machine at any time: no deadline passed and no
    /// worker died.
    pub reproducible: bool,
}

/// The points of one attempt.
struct Attempt {
    /// Vertices that an octree cell may hold; 0 for no free-space points.
    free_space: u32,
    /// Seed of the free-space points.
    seed: u64,
    /// True if TetGen is given coordinates relative to the box.
    local: bool,
    /// [`TetOptions::inflation`] for this attempt: TetGen takes points that nearly touch the box
    /// for coplanar with it.
    inflation: f32,
}

/// Attempts in order. Near the origin TetGen is first given the coordinates as they are. A node
/// that can be replaced by smaller cells gets two attempts, because on models on which TetGen fails
/// cells succeed more often than further attempts.
fn attempts(options: &TetOptions, far: bool, triangles: u32) -> Vec<Attempt> {
    let m = options.free_space;
    let more = if m == 0 { 64 } else { m.saturating_mul(4) };
    let wide = options.inflation.max(1.0 / 256.0);
    let inflation = options.inflation;
    let mut attempts = vec![
        Attempt { free_space: m, seed: 0, local: far, inflation },
        Attempt { free_space: m, seed: 1, local: !far, inflation },
        Attempt { free_space: more, seed: 2, local: far, inflation: 2.0 * wide },
        Attempt { free_space: 0, seed: 3, local: true, inflation: 4.0 * wide },
    ];
    if options.cells.iter().any(|&size| size < triangles) {
        attempts.truncate(2);
    }
    attempts
}

/// Tetrahedralizes a node. When every attempt fails, the report contains the reasons.
///
/// # Errors
/// Cancelled.
pub(super) fn tetrahedralize(
    slot: &mut WorkerSlot<'_>,
    job: &NodeJob<'_>,
    monitor: &dyn Monitor,
) -> Result<NodeResult> {
    let NodeJob { mesh, bvh, node, options, .. } = *job;
    let triangles = bvh.nodes[node as usize].count;
    let mut report = NodeReport {
        node,
        triangles,
        outcome: Outcome::GivenUp,
        failures: Vec::new(),
        tets: 0,
        vertices: 0,
        steiner_points: 0,
        free_points: 0,
        nudged: 0,
        seconds: 0.0,
    };
    let mut errors = Vec::new();
    let mut built = None;
    let deadline = options.deadline + options.deadline_per_triangle.saturating_mul(triangles);
    let far = far(&bvh.nodes[node as usize]);
    for attempt in attempts(options, far, triangles) {
        let done = match gather(mesh, bvh, node, attempt.inflation) {
            Ok(input) => run(slot, job, &input, &attempt, deadline, monitor)?,
            Err(error) => Err(error),
        };
        match done {
            Ok((tets, free_points, nudged)) => {
                report.outcome = Outcome::Built;
                report.tets = tets.tets.len() as u32;
                report.vertices = tets.vertices.len() as u32;
                report.steiner_points = tets.steiner_points;
                report.free_points = free_points;
                report.nudged = nudged;
                built = Some(tets);
                break;
            }
            Err(error) => {
                let retry = error.retry(triangles);
                let again = errors.last() == Some(&AttemptError::TimedOut) && error == AttemptError::TimedOut;
                errors.push(error);
                if !retry || again {
                    break;
                }
            }
        }
    }
    report.failures = errors.iter().map(AttemptError::to_string).collect();
    let no_worker = errors.iter().any(|t| matches!(t, AttemptError::Start(_)));
    let reproducible = errors.iter().all(AttemptError::is_reproducible);
    Ok(NodeResult { built, report, no_worker, reproducible })
}

/// Returns true if the node lies many times its size away from the origin, where coordinates have
/// few digits left for the shape.
fn far(node: &Node) -> bool {
    let size = (0..3).map(|k| f64::from(node.upper[k]) - f64::from(node.lower[k])).fold(0.0, f64::max);
    let away = node.lower.iter().chain(&node.upper).map(|x| f64::from(x.abs())).fold(0.0, f64::max);
    away > 16.0 * size
}

/// A tetrahedralization, its number of free-space points, and the number of points moved by
/// `nudge`.
type AttemptResult = (TetMesh, u32, u32);

/// Makes one attempt. The inner error is the reason for which the attempt failed.
fn run(
    slot: &mut WorkerSlot<'_>,
    job: &NodeJob<'_>,
    input: &NodeInput,
    attempt: &Attempt,
    deadline: Duration,
    monitor: &dyn Monitor,
) -> Result<std::result::Result<AttemptResult, AttemptError>> {
    let switches = match slot.tetgen(monitor)? {
        Ok(version) => switches(version),
        Err(error) => return Ok(Err(error)),
    };
    let free = free_space::points(input, attempt.free_space, attempt.seed);
    let free_points = free.len() as u32;
    let sent: Vec<[f32; 3]> = input.vertices.iter().copied().chain(input.corners()).chain(free).collect();
    let (origin, points) = relative(&sent, if attempt.local { input.lower } else { [0.0; 3] });
    let first = input.vertices.len() as u32;
    let request = match job.options.planted {
        Some((at, fault)) if at == job.node => Request::Fault(fault),
        _ => Request::Job(Job {
            switches: switches.into(),
            points,
            triangles: input.triangles.clone(),
            quads: SIDES.map(|side| side.map(|corner| corner + first)).to_vec(),
        }),
    };
    let answer = match slot.ask(&request, deadline, monitor)? {
        Ok(answer) => answer,
        Err(error) => return Ok(Err(error)),
    };
    Ok(match check::check(input, &sent, origin, answer) {
        Ok(checked) => {
            let nudged = checked.nudged;
            Ok((order::order(input, checked), free_points, nudged))
        }
        Err(defect) => Err(AttemptError::Defect(defect)),
    })
}

/// The points relative to an origin. On an axis where a difference would be rounded the origin
/// becomes zero, because TetGen must be given the exact points.
fn relative(points: &[[f32; 3]], origin: [f32; 3]) -> ([f64; 3], Vec<[f64; 3]>) {
    let origin: [f64; 3] = std::array::from_fn(|k| {
        let o = f64::from(origin[k]);
        let exact = |p: &[f32; 3]| difference_is_exact(f64::from(p[k]), o, f64::from(p[k]) - o);
        if points.iter().all(exact) { o } else { 0.0 }
    });
    (origin, points.iter().map(|p| std::array::from_fn(|k| f64::from(p[k]) - origin[k])).collect())
}

/// Returns true if `a - b` was computed without rounding (the error term of Knuth's TwoSum is
/// zero).
fn difference_is_exact(a: f64, b: f64, difference: f64) -> bool {
    let b_virtual = a - difference;
    let a_virtual = difference + b_virtual;
    (a - a_virtual) + (b_virtual - b) == 0.0
}

/// TetGen's switches: p a PLC, z rows from 0, Y keep facets whole, M no merging of close points
/// or coplanar facets, Q quiet, J keep unused points, T the tolerance for coplanarity.
fn switches(version: &str) -> &'static str {
    if version.starts_with("1.5") {
        "pzYMQJT1e-15"
    } else {
        // TetGen 1.6 by default splits and merges facets by angle; these switches disable that.
        "pzYMQJT1e-15p179.9/0.1/15/179.9999"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_differences_are_told_from_rounded_ones() {
        for (a, b) in [(1.0f32, 0.5f32), (1e6, 1e6 + 0.25), (3.5e-3, -7.25), (0.0, 1e-30)] {
            let (a, b) = (f64::from(a), f64::from(b));
            assert!(difference_is_exact(a, b, a - b), "{a} {b}");
        }
        let (a, b) = (1e10f64, f64::from(1e-20f32));
        assert!(!difference_is_exact(a, b, a - b));
    }
}
