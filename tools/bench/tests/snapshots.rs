//! What fixed figures look like: tables, charts and JSON. After a wanted change: `INSTA_UPDATE=always`.

use bth_bench::clock::Clock;
use bth_bench::load::{self, LoadResults, ModelStarts, Times};
use bth_bench::machine::Machine;
use bth_bench::output::Head;
use bth_bench::rays::View;
use bth_bench::speed::results::{CompiledFile, LeftOut, TracerSpeeds};
use bth_bench::speed::{self, ModelSpeeds, SpeedResults};
use serde_json::json;
use std::collections::BTreeMap;

fn head(measurement: &'static str) -> Head {
    Head {
        measurement,
        date: "2026-01-02".to_owned(),
        commit: Some("0123456789ab".to_owned()),
        machine: Machine {
            cpu: "A processor".to_owned(),
            isa: vec!["avx2".to_owned(), "sse4.2".to_owned()],
            logical_cores: 2,
            os: "linux".to_owned(),
        },
        isa: "avx2".to_owned(),
        options: json!({"rays": 2000, "rounds": 5}),
    }
}

fn tracer(name: &str, ours: bool, rates: &[(&'static str, f64)]) -> TracerSpeeds {
    TracerSpeeds {
        name: name.to_owned(),
        ours,
        build_s: 0.25,
        bytes: ours.then_some(36_000),
        mrays_per_s: rates.iter().copied().collect(),
        other: BTreeMap::new(),
        differ: rates.iter().map(|(set, _)| (*set, usize::from(!ours))).collect(),
    }
}

fn speed_record() -> SpeedResults {
    let model = |name: &str, view, factor: f64, tets: bool| {
        let mut tracers = vec![
            tracer("bth", true, &[("primary", 8.0 * factor), ("diffuse", 3.0)]),
            tracer("bth start", true, &[("diffuse", 6.0 * factor)]),
            tracer("embree", false, &[("primary", 4.0), ("diffuse", 3.0)]),
        ];
        if tets {
            tracers.insert(2, tracer("tets link32", true, &[("primary", 1.0), ("diffuse", 0.5)]));
        }
        ModelSpeeds {
            name: name.to_owned(),
            triangles: 1200,
            view: Some(view),
            own_hits: BTreeMap::new(),
            rays: BTreeMap::from([("primary", 2000), ("diffuse", 1100)]),
            structures: vec![CompiledFile { name: "bth", compile_s: 0.25, file_bytes: 50_000, in_tets: 0.5 }],
            left_out: vec![LeftOut { name: "tinybvh bvh8 hq".to_owned(), why: "not installed".to_owned() }],
            runs: vec![speed::ThreadsRun { threads: 1, clock: Clock::ThreadCpu, tracers }],
        }
    };
    let models = vec![model("a", View::Outside, 1.0, false), model("b", View::Inside, 4.0, true)];
    SpeedResults { head: head("speed"), models }
}

fn load_record() -> LoadResults {
    let times = |total: f64, storage: Option<u64>| Times {
        ready_s: total / 10.0,
        first_hit_s: total / 5.0,
        total_s: total,
        cpu_s: 0.9 * total,
        storage_bytes: storage,
        frame_s: None,
    };
    let starts = vec![
        ("bth map warm".to_owned(), times(4e-4, Some(0))),
        ("bth map cold".to_owned(), times(2e-3, Some(3 << 20))),
        ("bth read warm".to_owned(), times(8e-2, Some(0))),
        ("embree".to_owned(), times(4e-2, None)),
    ];
    let model = ModelStarts {
        name: "a".to_owned(),
        triangles: 1200,
        view: View::Outside,
        file_bytes: BTreeMap::from([("bth", 3 << 20), ("bvh", 1 << 20)]),
        left_out: vec![("embree robust".to_owned(), "not wanted".to_owned())],
        runs: vec![load::StartsRun { threads: 2, starts }],
    };
    LoadResults { head: head("load"), rays: 1000, models: vec![model] }
}

#[test]
fn head_of_a_record() {
    insta::assert_snapshot!(head("speed").markdown());
}

#[test]
fn tables_of_speed() {
    insta::assert_snapshot!(speed::markdown(&speed_record()));
}

#[test]
fn json_of_speed() {
    insta::assert_snapshot!(format!("{:#}", serde_json::to_value(speed_record()).unwrap()));
}

#[test]
fn charts_of_speed() {
    let charts = speed::draw(&speed_record());
    let names: Vec<&str> = charts.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["means-1-thread", "a-1-thread", "b-1-thread"]);
    insta::assert_snapshot!(charts[0].svg);
}

#[test]
fn tables_of_load() {
    insta::assert_snapshot!(load::markdown(&load_record()));
}

#[test]
fn json_of_load() {
    insta::assert_snapshot!(format!("{:#}", serde_json::to_value(load_record()).unwrap()));
}

#[test]
fn charts_of_load() {
    let charts = load::draw(&load_record());
    assert_eq!(charts.len(), 1);
    insta::assert_snapshot!(charts[0].svg);
}
