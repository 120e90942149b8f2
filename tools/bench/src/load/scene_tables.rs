//! Tables and chart of `load-scenes`.

use super::results::{StartsRun, Times};
use super::scene_results::{SceneLoadResults, SceneStarts};
use super::tables::{factor, on_threads};
use crate::chart::{BarChart, Scale, Series};
use crate::markdown::{cells, count, seconds, table};
use crate::output::Chart;
use crate::rivals::embree;

/// What the charts show.
const SHOWN: [&str; 4] = ["bth map warm", "bth map cold", "bth read warm", "bth read cold"];

pub(super) fn markdown(results: &SceneLoadResults) -> String {
    let mut text = format!(
        "Wall-clock time from before the file is opened, or from before Embree builds all objects (several at once) and their \
         instances from triangles in memory, until the first {} camera rays are traced, each in a process of its own; \
         medians of interleaved rounds. `picture`: {} camera rays, the faster of two rounds after that. `even after`: pictures \
         after which a program that built at its start has caught up by faster tracing; `never` where ours traces as \
         fast. `pays after`: starts after which compiling without a cache has paid.\n\n",
        count(results.rays as u64),
        count(results.picture as u64)
    );
    for scene in &results.scenes {
        text.push_str(&page(scene));
    }
    text
}

fn page(scene: &SceneStarts) -> String {
    let kinds = scene.file_bytes.iter().zip(scene.compile_s.values());
    let kinds: Vec<String> = kinds
        .map(|((name, bytes), s)| {
            format!("{name} {:.1} MiB, compiled in {}", *bytes as f64 / 1048576.0, seconds(Some(*s)))
        })
        .collect();
    let mut text = format!(
        "## {} ({} objects, {} instances, {} triangles)\n\nFiles: {}.\n\n",
        scene.name,
        count(scene.objects.into()),
        count(scene.instances.into()),
        count(scene.triangles),
        kinds.join("; ")
    );
    let head = [
        "start",
        "ready",
        "first hit",
        "first rays",
        "CPU",
        "than Embree's build",
        "picture",
        "even after",
        "pays after",
    ];
    for run in &scene.runs {
        let rows: Vec<_> = run.starts.iter().map(|(name, times)| row(scene, run, name, times)).collect();
        text.push_str(&format!("{}:\n\n{}\n", on_threads(run.threads), table(&cells(&head), &rows)));
    }
    text
}

fn row(scene: &SceneStarts, run: &StartsRun, name: &str, times: &Times) -> Vec<String> {
    let base = run.starts.iter().find(|(name, _)| name == embree::NAME).map(|(_, times)| times);
    let ours = scene.compile_s.iter().find(|(kind, _)| name.starts_with(&format!("{kind} ")));
    let compared = base
        .zip(ours)
        .map(|(base, (_, compile_s))| (even_after(times, base), pays_after(*compile_s, times, base)));
    let (even, pays) = compared.unwrap_or_default();
    vec![
        name.to_owned(),
        seconds(Some(times.ready_s)),
        seconds(Some(times.first_hit_s)),
        seconds(Some(times.total_s)),
        seconds(Some(times.cpu_s)),
        factor(run.faster(name)),
        seconds(times.frame_s),
        even,
        pays,
    ]
}

/// Pictures after which the one that starts later has caught up.
fn even_after(ours: &Times, base: &Times) -> String {
    let (Some(mine), Some(theirs)) = (ours.frame_s, base.frame_s) else { return String::new() };
    let ahead = base.total_s - ours.total_s;
    match (ahead > 0.0, mine > theirs) {
        (true, false) => "never".to_owned(),
        (true, true) => count((ahead / (mine - theirs)).ceil() as u64),
        (false, _) => "at once".to_owned(),
    }
}

/// Starts after which compiling has paid.
fn pays_after(compile_s: f64, ours: &Times, base: &Times) -> String {
    let ahead = base.total_s - ours.total_s;
    if ahead > 0.0 { count((compile_s / ahead).ceil() as u64) } else { "never".to_owned() }
}

/// A chart for each number of threads; none where Embree did not run.
pub(super) fn draw(results: &SceneLoadResults) -> Vec<Chart> {
    let threads = results.scenes.first().map_or(Vec::new(), |s| s.runs.iter().map(|r| r.threads).collect());
    let mut charts = Vec::new();
    for threads in threads {
        let run = |scene: &'_ SceneStarts| scene.runs.iter().find(|r| r.threads == threads).cloned();
        let runs: Vec<(String, StartsRun)> =
            results.scenes.iter().filter_map(|s| Some((s.name.clone(), run(s)?))).collect();
        if runs.iter().any(|(_, run)| run.faster(embree::NAME).is_none()) {
            continue;
        }
        let series = |name: &&str| Series {
            name: (*name).to_owned(),
            values: runs.iter().map(|(_, run)| run.faster(name)).collect(),
        };
        let chart = BarChart {
            title: format!("Load against rebuild of scenes, {}", on_threads(threads)),
            unit: format!(
                "times faster than Embree's build of all objects, first {} rays included; logarithmic",
                count(results.rays as u64)
            ),
            groups: runs.iter().map(|(name, _)| name.clone()).collect(),
            series: SHOWN.iter().map(series).collect(),
            scale: Scale::Logarithmic,
            line: Some(1.0),
        };
        charts.push(Chart { name: on_threads(threads).replace(' ', "-"), svg: chart.svg() });
    }
    charts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(total_s: f64, frame_s: f64) -> Times {
        let frame_s = Some(frame_s);
        Times {
            ready_s: total_s,
            first_hit_s: total_s,
            total_s,
            cpu_s: total_s,
            storage_bytes: None,
            frame_s,
        }
    }

    #[test]
    fn who_starts_later_catches_up_by_faster_tracing_only() {
        let embree = times(1.0, 0.25);
        assert_eq!(even_after(&times(0.5, 0.5), &embree), "2");
        assert_eq!(even_after(&times(0.5, 0.25), &embree), "never");
        assert_eq!(even_after(&times(2.0, 0.1), &embree), "at once");
        assert_eq!(pays_after(5.0, &times(0.5, 0.5), &embree), "10");
        assert_eq!(pays_after(5.0, &times(1.5, 0.5), &embree), "never");
    }
}
