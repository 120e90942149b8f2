//! The page of `scenes`.

use super::results::{PARTS, SceneTimes, ScenesResults};
use crate::markdown::{cells, count, table, two_decimals};

/// The page below its head.
pub fn markdown(results: &ScenesResults) -> String {
    let mut text = String::from(
        "One thread, its CPU clock; medians of interleaved rounds, means over the frames. A frame is its update (tracks and top level; \
         for Embree the transforms, which are given to it, and the commit) and its rays: `camera`; `diffuse`: one cosine-weighted bounce; `later`: \
         the bounces after it; `path`: all of these. Rays are the same for all, and ours know where they start. `bth` is compiled \
         with the defaults, `bvh` with `--structure bvh`, so `bth`/`bvh` is the paper's BVH-BTH over BVH-BVH; `bth, paper's rule` takes \
         tetrahedra as the paper does; `bth single` is one ray a call, as `embree` is. `differ`: answers other than those of `bvh`, for ours in any bit, for Embree in whether or, by \
         more than 1e-4 of t, where they hit. Ratios above 1: the first is faster.\n\n## Ratios\n\n",
    );
    let pairs = [
        ("bth", "bvh"),
        ("bth, paper's rule", "bvh"),
        ("bth", "embree"),
        ("bth", "embree hq packet16"),
        ("bth single", "embree"),
    ];
    let head: Vec<String> = std::iter::once("scene".to_owned())
        .chain(pairs.iter().flat_map(|(of, over)| PARTS.map(|part| format!("{of} / {over}: {part}"))))
        .collect();
    let ratios = |scene: &SceneTimes| {
        let ratio = |of: &str, over: &str, part: usize| two_decimals(scene.speedup(of, over, part));
        std::iter::once(scene.name.clone())
            .chain(pairs.iter().flat_map(|(of, over)| [0, 1, 2].map(|part| ratio(of, over, part))))
            .collect()
    };
    text.push_str(&table(&head, &results.scenes.iter().map(ratios).collect::<Vec<_>>()));
    results.scenes.iter().for_each(|scene| text.push_str(&page(scene)));
    text
}

fn page(scene: &SceneTimes) -> String {
    let frames: Vec<String> = scene.frames.iter().map(i32::to_string).collect();
    let [camera, diffuse, later] = scene.rays.map(|n| count(n / scene.frames.len().max(1) as u64));
    let mut text = format!(
        "\n## {}\n\n{} instances of {} objects, {} triangles in all; frames {}; a frame has {camera} camera, {diffuse} diffuse and \
         {later} later rays.\n\n",
        scene.name,
        scene.instances,
        scene.objects,
        count(scene.triangles),
        frames.join(", "),
    );
    let head = cells(&[
        "",
        "build s",
        "in tets",
        "update ms",
        "camera ms",
        "diffuse ms",
        "later ms",
        "path frame ms",
        "differ",
    ]);
    let rows: Vec<Vec<String>> = scene
        .rows
        .iter()
        .map(|r| {
            let [update, camera, diffuse, later] = r.milliseconds;
            vec![
                r.name.clone(),
                format!("{:.2}", r.build_s),
                format!("{:.0} %", 100.0 * r.in_tets),
                format!("{update:.3}"),
                format!("{camera:.1}"),
                format!("{diffuse:.1}"),
                format!("{later:.1}"),
                format!("{:.1}", r.frame(2)),
                count(r.differ),
            ]
        })
        .collect();
    text.push_str(&table(&head, &rows));
    for why in &scene.left_out {
        text.push_str(&format!("\nNot built: {why}.\n"));
    }
    text
}
