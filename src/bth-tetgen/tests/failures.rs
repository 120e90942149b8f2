//! Provokes every kind of failure in TetGen itself, except internal errors and what it calls wrong
//! input. No known input provokes these without ending the process, so `bth-tets` injects them
//! (tests/tets/faults.rs).

use bth_random::Rng;
use bth_tetgen_protocol::{Failure, Job, Reply, Request, read_frame, write_frame};
use std::process::{Command, Stdio};

/// As the compiler calls it.
const SWITCHES: &str = "pzYMQJT1e-15";
const GIBIBYTE: u64 = 1 << 30;

/// What a fresh worker answers to the bytes of a request; nothing if it dies of it.
fn answer(bytes: &[u8], memory: u64) -> Option<Reply> {
    let mut worker = Command::new(env!("CARGO_BIN_EXE_bth-tetgen"))
        .args(["--memory", &memory.to_string(), "--parent", &std::process::id().to_string()])
        .current_dir(env!("CARGO_TARGET_TMPDIR"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the worker starts");
    let (mut to, mut from) = (worker.stdin.take().unwrap(), worker.stdout.take().unwrap());
    assert!(matches!(Reply::from_bytes(&read_frame(&mut from).unwrap()), Ok(Reply::Hello { .. })));
    write_frame(&mut to, bytes).unwrap();
    let reply = read_frame(&mut from).ok().map(|frame| Reply::from_bytes(&frame).unwrap());
    drop(to);
    worker.wait().unwrap();
    reply
}

#[track_caller]
fn fails(request: &Request, memory: u64, expected: Failure) {
    match answer(&request.to_bytes(), memory) {
        Some(Reply::Failed { failure, text }) => {
            assert_eq!(failure, expected, "{text}");
            assert!(!text.is_empty());
        }
        other => panic!("{expected:?} was expected, and not {other:?}"),
    }
}

/// Triangles within a closed box.
fn boxed(switches: &str, mut points: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Request {
    let first = points.len() as u32;
    points.extend((0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.5 } else { -0.5 })));
    let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let quads = quads.map(|quad| quad.map(|corner| first + corner)).to_vec();
    Request::Job(Job { switches: switches.into(), points, triangles, quads })
}

#[test]
fn triangles_that_do_not_touch_are_done() {
    let request = boxed(SWITCHES, vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    let reply = answer(&request.to_bytes(), GIBIBYTE);
    assert!(matches!(&reply, Some(Reply::Done(done)) if !done.tets.is_empty()), "{reply:?}");
}

#[test]
fn what_is_no_request() {
    for bytes in [&b""[..], &[9], &[1, 255, 255, 255, 255], &[2, 0]] {
        let reply = answer(bytes, GIBIBYTE);
        assert!(
            matches!(reply, Some(Reply::Failed { failure: Failure::Request, .. })),
            "{bytes:?}: {reply:?}"
        );
    }
    let switches = "Q".repeat(251);
    fails(&boxed(&switches, Vec::new(), Vec::new()), GIBIBYTE, Failure::Request);
}

#[test]
fn memory_runs_out() {
    let mut random = Rng::new(1);
    let points = (0..200_000).map(|_| [(); 3].map(|()| random.unit_f64())).collect();
    fails(&boxed(SWITCHES, points, Vec::new()), 96 << 20, Failure::Memory);
}

#[test]
fn triangles_cross() {
    let points = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.25, 0.25, -0.25],
        [0.25, 0.25, 0.25],
        [0.75, 0.8, 0.0],
    ];
    fails(&boxed(SWITCHES, points, vec![[0, 1, 2], [3, 4, 5]]), GIBIBYTE, Failure::Intersection);
}

/// Two triangles that are flat but for 1e-16, with Steiner points allowed on their edges.
#[test]
fn a_feature_is_too_small() {
    let points = vec![
        [0.891_911_731_239_038_8, 0.998_062_138_267_065_2, 6.170_226_871_940_975e-16],
        [0.990_100_031_817_644_9, 0.185_851_371_394_950_67, 7.767_796_987_303_183e-16],
        [0.080_183_891_731_511_19, 0.485_997_732_093_191_75, 6.416_881_733_296_125e-16],
        [0.685_867_719_917_179_1, 0.952_270_641_209_789_2, 7.362_571_635_240_445e-16],
    ];
    fails(&boxed("pzQ", points, vec![[3, 1, 2], [3, 2, 0]]), GIBIBYTE, Failure::TooSmall);
}

/// TetGen 1.5 gives up here in a way that ends it, too.
#[test]
fn all_points_lie_in_a_plane() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.5, 0.25, 0.0]];
    let job = Job { switches: SWITCHES.into(), points, triangles: vec![[0, 1, 2]], quads: Vec::new() };
    let reply = answer(&Request::Job(job).to_bytes(), GIBIBYTE);
    assert!(matches!(reply, None | Some(Reply::Failed { .. })), "{reply:?}");
}

#[test]
fn there_is_no_result() {
    // d looks for triangles that cross, and makes no tetrahedra.
    let request = boxed("pdzQ", vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    fails(&request, GIBIBYTE, Failure::Other);
}

/// Eight thin triangles through one another, on which TetGen 1.5 dies; another version may say why
/// it fails.
#[test]
fn a_death_is_no_answer_and_no_reply_is_made_up() {
    let points = vec![
        [0.126_759_068_567_603_33, 0.966_595_024_443_266_6, 5.985_285_453_274_728e-5],
        [0.802_448_819_086_595_4, 0.484_129_588_340_727_83, 1.208_005_597_258_115e-5],
        [0.405_652_463_157_276_65, 0.394_180_485_232_136_45, 6.245_972_900_630_672e-5],
        [0.174_223_651_839_476_63, 0.256_301_404_519_680_53, 9.907_749_745_955_512e-5],
        [0.383_693_093_851_691_7, 0.319_004_036_773_908_43, 8.729_335_032_634_123e-5],
        [0.815_265_504_947_842, 0.525_708_654_454_799_1, 6.396_632_926_935_285e-5],
        [0.922_268_022_836_065_2, 0.651_005_957_174_181_7, 2.238_049_776_463_727_7e-5],
        [0.297_375_111_653_870_4, 0.341_948_521_537_345_1, 2.570_849_857_510_357_8e-5],
        [0.114_267_165_991_801_09, 0.168_366_675_690_263_1, 1.774_809_163_411_112e-5],
    ];
    let triangles =
        vec![[1, 2, 6], [8, 6, 2], [6, 3, 1], [1, 7, 0], [7, 4, 2], [3, 4, 6], [0, 6, 5], [8, 2, 7]];
    let reply = answer(&boxed(SWITCHES, points, triangles).to_bytes(), GIBIBYTE);
    assert!(matches!(reply, None | Some(Reply::Failed { .. })), "{reply:?}");
}
