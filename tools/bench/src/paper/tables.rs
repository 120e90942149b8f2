//! The page of `paper`.

use super::published;
use super::results::{PaperResults, PaperScene};
use crate::markdown::{cells, count, table, two_decimals};

/// The page below its head.
pub fn markdown(results: &PaperResults) -> String {
    let mut text = String::from(
        "Camera rays only, 16×16 tiles, all threads, least of the rounds; CPU time of all threads over their number, which is the time \
         on the wall clock of a machine that does nothing else. Construction on one thread, wall clock. The first six rows are the paper's structures with one scalar traversal: a binary BVH as in pbrt with up to four triangles a leaf (BVH), \
         the same with tetrahedralizations where the paper's rule takes them (BTH), the whole model tetrahedralized (Tet), and a k-d \
         tree. The others are our files in our SIMD traversal. Paper: the figures of its Tables 1 and 2, on another machine with six \
         cores and from other cameras, some on other versions of a model; only ratios can be compared.\n\n",
    );
    let costs = &results.profile;
    text.push_str(&format!(
        "Costs of the scalar traversals, ns: {:.2} a node of the binary BVH",
        costs.bvh.outside
    ));
    for name in ["tet32", "tet20"] {
        if let Some(walk) = costs.tets.get(name).map(|c| c.outside) {
            let [small, large] = walk.step;
            text.push_str(&format!("; {name} {:.0} to enter, {small:.2} to {large:.2} a step", walk.entry));
        }
    }
    text.push_str(".\n\n## Ratios\n\n");
    text.push_str(&ratios(results));
    for scene in &results.scenes {
        text.push_str(&page(scene));
    }
    text
}

/// Ours beside the paper's.
fn ratios(results: &PaperResults) -> String {
    let head = cells(&[
        "scene",
        "BTH20/BVH far",
        "close",
        "paper",
        "BTH20/Tet20 far",
        "close",
        "paper",
        "construction BTH20/Tet20",
        "paper",
        "BTH20/k-d far",
        "paper",
    ]);
    let rows: Vec<Vec<String>> = results
        .scenes
        .iter()
        .map(|s| {
            let paper = |of: &str, to: &str, which: usize| {
                published::of(&s.name).and_then(|p| p.ratio(of, to, which))
            };
            vec![
                s.name.clone(),
                two_decimals(s.ratio("BTH20", "BVH", 0)),
                two_decimals(s.ratio("BTH20", "BVH", 1)),
                two_decimals(paper("BTH20", "BVH", 1)),
                two_decimals(s.ratio("BTH20", "Tet20", 0)),
                two_decimals(s.ratio("BTH20", "Tet20", 1)),
                two_decimals(paper("BTH20", "Tet20", 1)),
                two_decimals(s.construction_ratio("BTH20", "Tet20")),
                two_decimals(paper("BTH20", "Tet20", 0)),
                two_decimals(s.ratio("BTH20", "k-d tree", 0)),
                two_decimals(paper("BTH20", "k-d tree", 1)),
            ]
        })
        .collect();
    table(&head, &rows)
}

fn page(scene: &PaperScene) -> String {
    let paper = published::of(&scene.name);
    let seen =
        serde_json::to_value(scene.view).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let mut text =
        format!("\n## {} ({} triangles, seen from {seen})\n\n", scene.name, count(scene.triangles as u64));
    if let Some(paper) = paper {
        text.push_str(&format!("Paper: {} of {} faces.\n\n", paper.name, count(paper.faces)));
    }
    let head = cells(&[
        "structure",
        "construction s",
        "paper s",
        "far ms",
        "close ms",
        "paper ms",
        "B/tri",
        "in tets",
        "tet leaves",
        "differ",
    ]);
    let rows: Vec<Vec<String>> = scene
        .rows
        .iter()
        .map(|r| {
            let figure = paper.and_then(|p| p.figure(&r.structure));
            vec![
                r.structure.clone(),
                format!("{:.3}", r.construction),
                two_decimals(figure.map(|f| f[0] / 1e3)),
                format!("{:.1}", r.milliseconds[0]),
                format!("{:.1}", r.milliseconds[1]),
                two_decimals(figure.map(|f| f[1])),
                format!("{:.0}", r.bytes as f64 / scene.triangles.max(1) as f64),
                format!("{:.0} %", 100.0 * r.in_tets),
                count(r.leaves as u64),
                (r.differ[0] + r.differ[1]).to_string(),
            ]
        })
        .collect();
    text.push_str(&table(&head, &rows));
    for why in &scene.left_out {
        text.push_str(&format!("\nNot built: {why}.\n"));
    }
    text
}
