//! The page of `animation`.

use super::AnimationTimes;
use crate::markdown::{cells, count, table, two_decimals};
use crate::scenes::SETS;

/// The tables of all scenes.
pub(super) fn markdown(scenes: &[AnimationTimes]) -> String {
    let mut head = cells(&["scene", "triangles", "tracer", "ready, ms"]);
    head.extend(SETS.map(|set| format!("{set}, ns/ray")));
    head.push("differ".to_owned());
    let rows = scenes.iter().flat_map(|scene| {
        scene.rows.iter().map(|row| {
            let first = [scene.name.clone(), count(scene.triangles as u64), row.tracer.to_owned()];
            let times = std::iter::once(format!("{:.3}", row.ready_ms));
            let times = times.chain(row.ns_per_ray.map(|ns| format!("{ns:.1}")));
            first.into_iter().chain(times).chain([count(row.differ)]).collect()
        })
    });
    let traced = table(&head, &rows.collect::<Vec<_>>());
    format!(
        "Means over the frames. `bth` is the compiled scene, refitted; `bth anew` a file without tetrahedra that is compiled for the triangles \
         of each frame and placed as an instance; `embree refit` and `embree anew` the commit of a scene of quality REFIT and of medium \
         quality. `ready`: for `bth` to compute the positions, refit and place; for the others, to build for given positions; one thread. \
         Rays are the camera's and those of diffuse bounces, by one thread.\n\n{traced}\n{}\n{}",
        ratios(scenes),
        updates(scenes)
    )
}

/// The ratios of interest.
fn ratios(scenes: &[AnimationTimes]) -> String {
    let mut head = cells(&["scene", "ratio"]);
    head.extend(SETS.map(str::to_owned));
    let mut rows = Vec::new();
    for scene in scenes {
        let ratio = |a: usize, b: usize| {
            let of = |k: usize| scene.rows[a].ns_per_ray[k] / scene.rows[b].ns_per_ray[k];
            [0, 1, 2].map(of)
        };
        for (name, values) in [
            ("bth to bth anew", ratio(0, 1)),
            ("embree refit to bth", ratio(2, 0)),
            ("embree anew to bth anew", ratio(3, 1)),
        ] {
            let first = [scene.name.clone(), name.to_owned()];
            rows.push(first.into_iter().chain(values.map(|x| two_decimals(Some(x)))).collect());
        }
    }
    table(&head, &rows)
}

/// The updates of our scenes.
fn updates(scenes: &[AnimationTimes]) -> String {
    let head = cells(&["scene", "threads", "update, ms", "positions and refit, ms", "least", "cost ratio"]);
    let rows = scenes.iter().flat_map(|scene| {
        scene.updates.iter().map(|times| {
            let numbers = [times.mean_ms, times.refit_ms, times.least_refit_ms].map(|ms| format!("{ms:.3}"));
            let first = [scene.name.clone(), times.threads.to_string()];
            let last = [two_decimals(Some(scene.cost_ratio))];
            first.into_iter().chain(numbers).chain(last).collect()
        })
    });
    let rows: Vec<Vec<String>> = rows.collect();
    format!(
        "Updates: medians of the rounds, means over the frames; one thread by its CPU clock, several by the wall clock, as positions and refit \
         are always. `least`: the quickest round of each frame.\n\n{}",
        table(&head, &rows)
    )
}
