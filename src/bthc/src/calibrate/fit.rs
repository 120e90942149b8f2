//! Fits costs to measured times and steps.

use super::subject::{Timed, Times};
use bth_compile::costs::{self, BvhCosts, Profile, TetCosts, Walk};
use bth_format::layout::RecordKind;
use std::collections::BTreeMap;

/// Measurements on models whose tetrahedra fit the caches, on models whose tetrahedra do not, and
/// on a model of a single leaf.
pub(crate) struct Measured {
    pub(crate) small: Vec<Times>,
    pub(crate) large: Vec<Times>,
    /// Nanoseconds of a ray into a BVH that is one leaf.
    pub(crate) leaf: f64,
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Entry, hit and the two costs of a step that fit the times of these rays best; none below 0.
fn walk<'a>(times: impl Iterator<Item = (&'a Timed, bool)>, time: impl Fn(&Timed) -> f64) -> Walk {
    let rows: Vec<([f64; 4], f64)> = times
        .map(|(t, large)| {
            let steps = if large { [0.0, t.steps] } else { [t.steps, 0.0] };
            ([1.0, t.hits, steps[0], steps[1]], time(t))
        })
        .filter(|(_, time)| *time > 0.0 && time.is_finite())
        .collect();
    let [entry, hit, small, large] = costs::fit(&rows).unwrap_or([0.0; 4]).map(|x| x.max(0.0));
    // A step in a larger tetrahedralization is never cheaper; a fit that tells otherwise is noise.
    Walk { entry, hit, step: [small, large.max(small)] }
}

/// Fits rays traced one a call, which take ten times as long. The cost of a hit is too small next
/// to that to be fitted, and is part of the entry.
fn alone<'a>(times: impl Iterator<Item = (&'a Timed, bool)>, time: impl Fn(&Timed) -> f64) -> Walk {
    let rows: Vec<([f64; 3], f64)> = times
        .map(|(t, large)| (if large { [1.0, 0.0, t.steps] } else { [1.0, t.steps, 0.0] }, time(t)))
        .filter(|(_, time)| *time > 0.0 && time.is_finite())
        .collect();
    let [entry, small, large] = costs::fit(&rows).unwrap_or([0.0; 3]).map(|x| x.max(0.0));
    Walk { entry, hit: 0.0, step: [small, large.max(small)] }
}

/// The profile.
pub(crate) fn fit(measured: &Measured, isa: &str) -> Profile {
    let all = || measured.small.iter().chain(&measured.large);
    let ray = all().map(|t| t.nothing).fold(f64::INFINITY, f64::min);
    // Small and large models alike, since the number of visits grows with the logarithm of the
    // size.
    let a_visit = |t: &Timed| ((t.bvh - ray) / t.visits.max(1.0)).max(0.0);
    let block = (measured.leaf - ray).max(0.0);
    let node = |t: &Times| ((t.outside.bvh - ray - block * t.wide[1]) / t.wide[0].max(1.0)).max(0.0);
    let bvh = BvhCosts {
        ray,
        outside: mean(all().map(|t| a_visit(&t.outside))),
        surface: mean(all().flat_map(|t| t.bounces.iter().chain([&t.short]).map(a_visit))),
        node: mean(all().map(node)),
        block,
    };
    let small = measured.small.iter().map(|t| (t, false));
    let sized: Vec<(&Times, bool)> = small.chain(measured.large.iter().map(|t| (t, true))).collect();
    let record = |row: usize| {
        let from_surfaces = || sized.iter().flat_map(|(t, large)| t.bounces.iter().map(move |b| (b, *large)));
        let surface = walk(from_surfaces(), |t| t.tets[row]);
        let alone = alone(from_surfaces(), |t| t.single[row]);
        // Rays from outside differ only in finding the first tetrahedron.
        let entry = |walk: &Walk, time: fn(&Timed, usize) -> f64| {
            mean(measured.small.iter().map(|t| {
                let t = &t.outside;
                (time(t, row) - walk.hit * t.hits - walk.step[0] * t.steps).max(0.0)
            }))
        };
        // Rays for ambient occlusion count as much as bounces do.
        let short = mean(measured.small.iter().map(|t| {
            let t = &t.short;
            (t.tets[row] - surface.hit * t.hits - surface.step[0] * t.steps).max(0.0)
        }));
        TetCosts {
            outside: Walk { entry: entry(&surface, |t, row| t.tets[row]), ..surface },
            alone: Walk { entry: entry(&alone, |t, row| t.single[row]), ..alone },
            surface: Walk { entry: 0.5 * (surface.entry + short), ..surface },
        }
    };
    let tets: BTreeMap<String, TetCosts> =
        RecordKind::ALL.iter().enumerate().map(|(row, kind)| (kind.name().to_owned(), record(row))).collect();
    let bytes = |times: &[Times]| mean(times.iter().map(|t| t.bytes[0]));
    let small = bytes(&measured.small);
    Profile {
        profile: 1,
        isa: isa.to_owned(),
        bvh,
        tets,
        bytes: [small, bytes(&measured.large).max(2.0 * small)],
        // Small models are tetrahedralized several times.
        tetrahedralize: mean(measured.small.iter().map(|t| t.tetrahedralize)),
    }
    .rounded()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times that follow given costs exactly.
    fn exact(step: f64, bytes: f64) -> Times {
        let timed = |steps: f64, hits: f64, visits: f64, visit: f64, entry: f64| Timed {
            bvh: 14.0 + visit * visits,
            visits,
            tets: [entry + 100.0 * hits + step * steps; RecordKind::ALL.len()],
            single: [300.0 + 20.0 * steps; RecordKind::ALL.len()],
            steps,
            hits,
        };
        Times {
            nothing: 14.0,
            outside: timed(31.0, 0.5, 50.0, 1.5, 45.0),
            bounces: [
                timed(12.0, 0.0, 35.0, 2.5, 30.0),
                timed(30.0, 0.0, 45.0, 2.5, 30.0),
                timed(21.0, 1.0, 40.0, 2.5, 30.0),
                timed(52.0, 1.0, 42.0, 2.5, 30.0),
            ],
            short: timed(19.0, 0.25, 30.0, 2.5, 30.0),
            wide: [4.0, 2.0],
            bytes: [bytes; RecordKind::ALL.len()],
            tetrahedralize: 12.0,
        }
    }

    #[test]
    fn exact_times_give_their_costs_back() {
        let (small, large) = (vec![exact(2.0, 1e6)], vec![exact(3.0, 4e7)]);
        let profile = fit(&Measured { small, large, leaf: 26.0 }, "avx512");
        let bvh = profile.bvh;
        assert_eq!([bvh.ray, bvh.outside, bvh.surface, bvh.block], [14.0, 1.5, 2.5, 12.0]);
        assert_eq!(bvh.node, (50.0 * 1.5 - 2.0 * 12.0) / 4.0);
        let near = |walk: Walk, entry: f64, hit: f64, step: [f64; 2]| {
            let found = [walk.entry, walk.hit, walk.step[0], walk.step[1]];
            let exact = [entry, hit, step[0], step[1]];
            assert!(found.iter().zip(exact).all(|(f, e)| (f - e).abs() < 2e-3), "{walk:?}");
        };
        for costs in profile.tets.values() {
            near(costs.surface, 30.0, 100.0, [2.0, 3.0]);
            near(costs.outside, 45.0, 100.0, [2.0, 3.0]);
            near(costs.alone, 300.0, 0.0, [20.0, 20.0]);
        }
        assert_eq!(profile.bytes, [1e6, 4e7]);
    }
}
