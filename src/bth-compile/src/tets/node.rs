//! One node: attempts with different points until one passes the checks.

use std::time::{Duration, Instant};

use bth_tetgen_protocol::{Job, Request};

use crate::bvh::{BinaryBvh, Node};
use crate::error::Result;
use crate::monitor::Monitor;
use bth_import::Mesh;

use super::gather::{Input, SIDES, gather};
use super::pool::Slot;
use super::report::{NodeReport, Outcome, Trouble};
use super::{Options, TetMesh, check, free_space, order};

/// What became of a node.
pub(super) struct Done {
    /// Absent when every attempt failed.
    pub(super) built: Option<TetMesh>,
    pub(super) report: NodeReport,
    /// Whether there is no worker that works: smaller nodes would fail as well.
    pub(super) hopeless: bool,
    /// Whether the same would come out again, on any machine at any time.
    pub(super) certain: bool,
}

/// The points of one attempt.
struct Attempt {
    /// Vertices that an octree cell may hold; 0 for no free-space points.
    free_space: u32,
    /// Changes the free-space points.
    seed: u64,
    /// Whether TetGen sees coordinates relative to the box.
    local: bool,
    /// As [`Options::inflation`]: TetGen takes points that nearly touch the box for coplanar with it.
    inflation: f32,
}

/// Attempts in order. Near the origin TetGen first sees the coordinates as they are. A node that can be replaced
/// by smaller cells gets two: on models that defeat TetGen, cells succeed more often than further attempts.
fn attempts(options: &Options, far: bool, triangles: u32) -> Vec<Attempt> {
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

/// Tetrahedralizes a node; the reasons are in the report when every attempt failed.
///
/// # Errors
/// Cancelled.
pub(super) fn tetrahedralize(
    slot: &mut Slot<'_>,
    mesh: &Mesh,
    bvh: &BinaryBvh,
    node: u32,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Done> {
    let start = Instant::now();
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
    let mut troubles = Vec::new();
    let mut built = None;
    let deadline = options.deadline + options.deadline_per_triangle.saturating_mul(triangles);
    let far = far(&bvh.nodes[node as usize]);
    for attempt in attempts(options, far, triangles) {
        let done = match gather(mesh, bvh, node, attempt.inflation) {
            Ok(input) => run(slot, &input, &attempt, deadline, options, node, monitor)?,
            Err(trouble) => Err(trouble),
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
            Err(trouble) => {
                let retry = trouble.retry(triangles);
                let again = troubles.last() == Some(&Trouble::TimedOut) && trouble == Trouble::TimedOut;
                troubles.push(trouble);
                if !retry || again {
                    break;
                }
            }
        }
    }
    report.failures = troubles.iter().map(Trouble::to_string).collect();
    report.seconds = start.elapsed().as_secs_f64();
    let hopeless = troubles.iter().any(|t| matches!(t, Trouble::Start(_)));
    let certain = troubles.iter().all(Trouble::is_certain);
    Ok(Done { built, report, hopeless, certain })
}

/// Whether the node lies many times its size away from the origin, where coordinates have few
/// digits left for the shape.
fn far(node: &Node) -> bool {
    let size = (0..3).map(|k| f64::from(node.upper[k]) - f64::from(node.lower[k])).fold(0.0, f64::max);
    let away = node.lower.iter().chain(&node.upper).map(|x| f64::from(x.abs())).fold(0.0, f64::max);
    away > 16.0 * size
}

/// A tetrahedralization, its free-space points and its nudged points.
type Built = (TetMesh, u32, u32);

fn run(
    slot: &mut Slot<'_>,
    input: &Input,
    attempt: &Attempt,
    deadline: Duration,
    options: &Options,
    node: u32,
    monitor: &dyn Monitor,
) -> Result<std::result::Result<Built, Trouble>> {
    let switches = match slot.tetgen(monitor)? {
        Ok(version) => switches(version),
        Err(trouble) => return Ok(Err(trouble)),
    };
    let free = free_space::points(input, attempt.free_space, attempt.seed);
    let free_points = free.len() as u32;
    let sent: Vec<[f32; 3]> = input.vertices.iter().copied().chain(input.corners()).chain(free).collect();
    let (origin, points) = relative(&sent, if attempt.local { input.lower } else { [0.0; 3] });
    let first = input.vertices.len() as u32;
    let request = match options.planted {
        Some((at, fault)) if at == node => Request::Fault(fault),
        _ => Request::Job(Job {
            switches: switches.into(),
            points,
            triangles: input.triangles.clone(),
            quads: SIDES.map(|side| side.map(|corner| corner + first)).to_vec(),
        }),
    };
    let answer = match slot.ask(&request, deadline, monitor)? {
        Ok(answer) => answer,
        Err(trouble) => return Ok(Err(trouble)),
    };
    Ok(match check::check(input, &sent, origin, answer) {
        Ok(checked) => {
            let nudged = checked.nudged;
            Ok((order::order(input, checked), free_points, nudged))
        }
        Err(defect) => Err(Trouble::Defect(defect)),
    })
}

/// The points relative to an origin, which becomes zero where the difference of coordinates of very
/// different magnitudes is no `f64`: TetGen must see the very points.
fn relative(points: &[[f32; 3]], origin: [f32; 3]) -> ([f64; 3], Vec<[f64; 3]>) {
    let origin: [f64; 3] = std::array::from_fn(|k| {
        let o = f64::from(origin[k]);
        let exact = |p: &[f32; 3]| difference_is_exact(f64::from(p[k]), o, f64::from(p[k]) - o);
        if points.iter().all(exact) { o } else { 0.0 }
    });
    (origin, points.iter().map(|p| std::array::from_fn(|k| f64::from(p[k]) - origin[k])).collect())
}

/// Whether `a - b` was computed without rounding (the error term of Knuth's TwoSum is zero).
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
        // 1.6 splits and merges facets by angle unless told otherwise.
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
