//! Schedules nodes over the workers, and replaces those that fail by smaller ones.

use std::collections::{BTreeMap, BinaryHeap};
use std::sync::{Condvar, Mutex, PoisonError};

use bth_bvh::BinaryBvh;
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;

use super::node::{NodeJob, NodeResult, NodeRunner, TimedNodes, tetrahedralize};
use super::pool::{WorkerSlot, find};
use super::report::{NodeReport, Outcome, TetReport, WorkerStatus};
use super::worker::Setup;
use super::{Leaf, TetMesh, TetOptions};

/// Tetrahedralizes the chosen nodes (ascending). The result holds, ascending by node, what was
/// built: chosen nodes, or cells below them where they failed; the rest stays in the BVH. It is
/// the same for any number of workers, as long as no deadline passes.
///
/// A missing worker is not an error: nothing is built then, and the report contains a hint on how
/// to install one.
///
/// # Errors
/// [`Error::Cancelled`]; [`Error::Limit`] when the object exceeds a limit of the format;
/// [`Error::Internal`] when `chosen` are no ascending nodes of the BVH.
pub fn build(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    chosen: &[u32],
    options: &TetOptions,
    monitor: &dyn Monitor,
) -> Result<(Vec<Leaf>, TetReport)> {
    build_through(mesh, bvh, chosen, options, &TimedNodes, monitor)
}

/// Builds like [`build`], with every node run by `runner`.
///
/// # Errors
/// The errors of [`build`].
pub fn build_through(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    chosen: &[u32],
    options: &TetOptions,
    runner: &dyn NodeRunner,
    monitor: &dyn Monitor,
) -> Result<(Vec<Leaf>, TetReport)> {
    if !chosen.is_sorted_by(|a, b| a < b) || chosen.last().is_some_and(|&n| n as usize >= bvh.nodes.len()) {
        let message = format!("chosen nodes are not ascending below {}", bvh.nodes.len());
        return Err(Error::Internal { code: "BTH-X020", message });
    }
    let size = |node: u32| bvh.nodes[node as usize].count;
    let mut report = TetReport {
        chosen: chosen.len() as u64,
        chosen_triangles: chosen.iter().map(|&n| u64::from(size(n))).sum(),
        ..TetReport::default()
    };
    if chosen.is_empty() {
        return Ok((Vec::new(), report));
    }
    monitor.stage("tets", Some(report.chosen_triangles));
    let program = match find(options) {
        Ok(program) => program,
        Err(hint) => {
            monitor.notice(&hint);
            report.worker = WorkerStatus::Missing { hint };
            return Ok((Vec::new(), none_built(report)));
        }
    };
    let setup = Setup { program, memory: options.memory };
    // One worker is started first: where it does not work, no others are started.
    let mut first = WorkerSlot::new(&setup);
    let version = match first.tetgen(monitor)? {
        Ok(tetgen) => tetgen.to_owned(),
        Err(error) => {
            monitor.notice(&error.to_string());
            report.worker = WorkerStatus::Unusable { reason: error.to_string() };
            return Ok((Vec::new(), none_built(report)));
        }
    };
    report.worker = WorkerStatus::Ready { tetgen: version.clone() };

    let workers = if options.workers > 0 { options.workers } else { rayon::current_num_threads() };
    let queue = Queue::new(chosen.iter().map(|&node| (size(node), node)));
    let results = Mutex::new(Results::default());
    let work = |mut slot: WorkerSlot<'_>| {
        while let Some(node) = queue.next() {
            let job = NodeJob { mesh, bvh, node, options, tetgen: &version };
            let done = runner.run(&job, &mut || tetrahedralize(&mut slot, &job, monitor));
            let cells = match done {
                Ok(done) => lock(&results).take(done, bvh, options, monitor),
                Err(error) => {
                    lock(&results).error = Some(error);
                    queue.stop();
                    break;
                }
            };
            queue.done(cells.into_iter().map(|cell| (size(cell), cell)));
        }
        lock(&results).workers_started += slot.started;
    };
    std::thread::scope(|scope| {
        for _ in 1..workers {
            // Where the system starts fewer threads, the others do the work.
            if std::thread::Builder::new().spawn_scoped(scope, || work(WorkerSlot::new(&setup))).is_err() {
                break;
            }
        }
        work(first);
    });
    finish(results.into_inner().unwrap_or_else(PoisonError::into_inner), report)
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn none_built(mut report: TetReport) -> TetReport {
    report.given_up = report.chosen;
    report.given_up_triangles = report.chosen_triangles;
    report
}

fn finish(results: Results, mut report: TetReport) -> Result<(Vec<Leaf>, TetReport)> {
    if let Some(error) = results.error {
        return Err(error);
    }
    let sum = |count: fn(&NodeReport) -> u32| results.nodes.values().map(|n| u64::from(count(n))).sum();
    let ended =
        |outcome: Outcome| results.nodes.values().filter(move |n| n.outcome == outcome).count() as u64;
    report.tets = sum(|n| n.tets);
    report.vertices = sum(|n| n.vertices);
    report.steiner_points = sum(|n| n.steiner_points);
    report.free_points = sum(|n| n.free_points);
    report.nudged = sum(|n| n.nudged);
    report.built = ended(Outcome::Built);
    report.split = ended(Outcome::Split);
    report.given_up = ended(Outcome::GivenUp);
    report.built_triangles = results.built.values().map(|m| m.faces.len() as u64).sum();
    report.given_up_triangles = results.left_triangles;
    report.attempts = sum(|n| n.failures.len() as u32) + report.built;
    report.failures = results.failures;
    report.workers_started = results.workers_started;
    report.nodes = results.nodes.into_values().collect();
    let limit = u64::from(bth_format::limits::MAX_TETS);
    if report.tets > limit || report.vertices > limit {
        let message =
            format!("{} tetrahedra, {} vertices, expected at most {limit}", report.tets, report.vertices);
        return Err(Error::Limit { code: "BTH-L020", message });
    }
    Ok((results.built.into_iter().collect(), report))
}

/// Results of all threads.
#[derive(Default)]
struct Results {
    built: BTreeMap<u32, TetMesh>,
    nodes: BTreeMap<u32, NodeReport>,
    failures: BTreeMap<String, u64>,
    left_triangles: u64,
    workers_started: u64,
    error: Option<Error>,
}

impl Results {
    /// Adds the result of a node. Returns the cells that replace the node if it failed.
    fn take(
        &mut self,
        NodeResult { built, mut report, no_worker, .. }: NodeResult,
        bvh: &BinaryBvh,
        options: &TetOptions,
        monitor: &dyn Monitor,
    ) -> Vec<u32> {
        let mut cells = Vec::new();
        let mut settled = report.triangles;
        for failure in &report.failures {
            let name = failure.split(':').next().unwrap_or_default();
            *self.failures.entry(name.to_owned()).or_default() += 1;
        }
        if let Some(mesh) = built {
            self.built.insert(report.node, mesh);
        } else {
            if !no_worker {
                (cells, settled) = replace(bvh, report.node, options);
            }
            if !cells.is_empty() {
                report.outcome = Outcome::Split;
            }
            self.left_triangles += u64::from(settled);
        }
        monitor.advance(u64::from(settled));
        self.nodes.insert(report.node, report);
        cells
    }
}

/// The cells that replace a node, and the triangles that no cell holds.
fn replace(bvh: &BinaryBvh, node: u32, options: &TetOptions) -> (Vec<u32>, u32) {
    let count = bvh.nodes[node as usize].count;
    let Some(most) = options.cells.iter().copied().filter(|&size| size < count).max() else {
        return (Vec::new(), count);
    };
    let mut cells = Vec::new();
    let mut left = 0;
    let mut stack = vec![node];
    while let Some(at) = stack.pop() {
        let cell = &bvh.nodes[at as usize];
        if cell.count < options.minimum.max(1) {
            left += cell.count;
        } else if cell.count <= most {
            cells.push(at);
        } else {
            stack.extend([cell.right, at + 1]);
        }
    }
    (cells, left)
}

/// Queue of nodes, the largest first so that the last one to finish is small.
struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// Size and node.
    waiting: BinaryHeap<(u32, u32)>,
    /// Nodes in work. Each may add smaller ones when it fails.
    running: usize,
    stopped: bool,
}

impl Queue {
    fn new(nodes: impl Iterator<Item = (u32, u32)>) -> Self {
        let state = State { waiting: nodes.collect(), running: 0, stopped: false };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }
    /// The next node. Waits while nodes in work may still add some; `None` when all nodes are done
    /// or the queue is stopped.
    fn next(&self) -> Option<u32> {
        let mut state = lock(&self.state);
        loop {
            if state.stopped {
                return None;
            }
            if let Some((_, node)) = state.waiting.pop() {
                state.running += 1;
                return Some(node);
            }
            if state.running == 0 {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
    fn done(&self, more: impl Iterator<Item = (u32, u32)>) {
        let mut state = lock(&self.state);
        state.running -= 1;
        state.waiting.extend(more);
        self.changed.notify_all();
    }
    fn stop(&self) {
        lock(&self.state).stopped = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_bvh::Node;

    /// A balanced BVH over `count` triangles; boxes do not matter here.
    fn tree(count: u32) -> BinaryBvh {
        fn grow(bvh: &mut BinaryBvh, first: u32, count: u32) {
            let at = bvh.nodes.len();
            bvh.nodes.push(Node { lower: [0.0; 3], upper: [0.0; 3], first, count, right: 0 });
            if count > 1 {
                grow(bvh, first, count / 2);
                bvh.nodes[at].right = bvh.nodes.len() as u32;
                grow(bvh, first + count / 2, count - count / 2);
            }
        }
        let mut bvh = BinaryBvh { nodes: Vec::new(), order: (0..count).collect() };
        grow(&mut bvh, 0, count);
        bvh
    }

    #[test]
    fn a_failed_node_is_replaced_by_the_largest_cells_of_the_next_size() {
        let bvh = tree(1000);
        let options = TetOptions { cells: vec![300, 2000], minimum: 10, ..TetOptions::default() };
        let (cells, left) = replace(&bvh, 0, &options);
        assert_eq!(left, 0);
        assert_eq!(cells.iter().map(|&c| bvh.nodes[c as usize].count).collect::<Vec<_>>(), [250; 4]);
        // Cells that are too small stay in the BVH and are counted.
        let (cells, left) = replace(&bvh, 0, &TetOptions { minimum: 251, ..options.clone() });
        assert_eq!((cells.len(), left), (0, 1000));
        // A node below the smallest size is given up.
        assert_eq!(
            replace(&bvh, cells.first().copied().unwrap_or(1), &TetOptions { cells: vec![500], ..options }).1,
            500
        );
    }
}
