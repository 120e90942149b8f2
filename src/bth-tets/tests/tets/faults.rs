//! Workers that crash, hang, exceed their memory or do not exist.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use bth_import::{Error, Monitor, Silent};
use bth_tetgen_protocol::{Failure, Fault};
use bth_tets::{TetOptions, TetReport, WorkerStatus, build};

use crate::meshes::{bvh, cube, nodes_of_at_most, torus};
use crate::oracle::assert_holds;
use crate::with_worker;

/// Plants a fault at one node of several; the others must come out whole.
fn one_node_is_lost(options: TetOptions, fault: Fault) -> TetReport {
    let mesh = torus(40, 20);
    let bvh = bvh(&mesh);
    let chosen = nodes_of_at_most(&bvh, 250);
    let options = TetOptions { planted: Some((chosen[3], fault)), workers: 2, ..options };
    let (built, report) = build(&mesh, &bvh, &chosen, &options, &Silent).unwrap();
    assert_eq!(built.len(), chosen.len() - 1);
    assert!(built.iter().all(|(node, _)| *node != chosen[3]));
    for (node, tets) in &built {
        assert_holds(&mesh, &bvh, *node, tets);
    }
    assert_eq!((report.given_up, report.split), (1, 0));
    report
}

#[test]
fn a_crash_costs_one_node() {
    let Some(options) = with_worker("crash") else { return };
    let report = one_node_is_lost(options, Fault::Crash);
    assert_eq!(report.failures["worker_died"], 4);
    let text = &report.nodes.iter().find(|n| !n.failures.is_empty()).unwrap().failures[0];
    assert!(text.contains("signal"), "{text}");
}

#[test]
fn a_hang_costs_one_node_and_two_deadlines() {
    let Some(options) = with_worker("hang") else { return };
    let options = TetOptions { deadline: Duration::from_secs(2), ..options };
    let report = one_node_is_lost(options, Fault::Hang);
    assert_eq!(report.failures["timed_out"], 2);
}

#[test]
fn a_memory_hog_costs_one_node() {
    let Some(options) = with_worker("hog") else { return };
    let report = one_node_is_lost(TetOptions { memory: 512 << 20, ..options }, Fault::Hog);
    assert_eq!(report.failures["out_of_memory"], 1);
}

/// Whatever a worker answers costs its node, is counted under its own name, and is tried again
/// where that may help.
#[test]
fn every_answer_that_is_none_costs_one_node_and_is_named() {
    let Some(options) = with_worker("every failure") else { return };
    let cases = [
        (Fault::Garble, "bad_answer", 4),
        (Fault::Greet, "bad_answer", 4),
        (Fault::Invent, "points_moved", 4),
        (Fault::Fail(Failure::Request), "tetgen_other", 4),
        (Fault::Fail(Failure::Memory), "out_of_memory", 1),
        (Fault::Fail(Failure::Internal), "tetgen_internal", 4),
        (Fault::Fail(Failure::Intersection), "tetgen_intersection", 4),
        (Fault::Fail(Failure::TooSmall), "tetgen_too_small", 4),
        (Fault::Fail(Failure::Input), "tetgen_other", 4),
        (Fault::Fail(Failure::Other), "tetgen_other", 4),
    ];
    for (fault, name, attempts) in cases {
        let report = one_node_is_lost(options.clone(), fault);
        assert_eq!(report.failures.get(name), Some(&attempts), "{fault:?}: {:?}", report.failures);
        assert_eq!(report.failures.values().sum::<u64>(), attempts, "{fault:?}: {:?}", report.failures);
    }
}

#[test]
fn no_worker_is_no_error_and_tells_how_to_get_one() {
    let options = TetOptions { worker: Some("does/not/exist".into()), ..TetOptions::default() };
    let mesh = cube();
    let (built, report) = build(&mesh, &bvh(&mesh), &[0], &options, &Silent).unwrap();
    assert!(built.is_empty());
    let WorkerStatus::Missing { hint } = report.worker else { panic!("{report:?}") };
    assert!(hint.contains("does/not/exist"));
    assert_eq!((report.given_up, report.given_up_triangles), (1, 12));
}

#[test]
fn a_program_that_is_no_worker_is_unusable() {
    for program in ["/bin/true", "/bin/cat", "/bin/echo"] {
        if !std::path::Path::new(program).is_file() {
            continue;
        }
        let options = TetOptions { worker: Some(program.into()), ..TetOptions::default() };
        let mesh = cube();
        let (built, report) = build(&mesh, &bvh(&mesh), &[0], &options, &Silent).unwrap();
        assert!(built.is_empty());
        assert!(matches!(report.worker, WorkerStatus::Unusable { .. }), "{:?}", report.worker);
    }
}

/// Cancels after a few checks.
struct Impatient(AtomicU32);

impl Monitor for Impatient {
    fn cancelled(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) > 8
    }
}

#[test]
fn cancelling_ends_a_worker_that_hangs() {
    let Some(options) = with_worker("cancel") else { return };
    let mesh = cube();
    let options = TetOptions { planted: Some((0, Fault::Hang)), ..options };
    let start = Instant::now();
    let result = build(&mesh, &bvh(&mesh), &[0], &options, &Impatient(AtomicU32::new(0)));
    assert!(matches!(result, Err(Error::Cancelled)));
    assert!(start.elapsed() < Duration::from_secs(15));
}
