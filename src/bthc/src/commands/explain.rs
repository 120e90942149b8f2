//! `bthc explain`: shows which nodes would be tetrahedralized, which not, and why.

use super::threads::with_threads;
use crate::args::Explain;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Table, count};
use bth_compile::costs::{self, Verdict};
use bth_compile::{marks, pipeline};
use bth_import::Keep;
use serde_json::json;
use std::cmp::Reverse;

pub(crate) fn run(args: &Explain) -> Result<(), Failure> {
    let mut options = pipeline::CompileOptions { geometry: false, ..pipeline::CompileOptions::default() };
    let progress = Progress::new(args.json);
    args.selection.apply(&mut options, &progress)?;
    let (mesh, (choice, report)) = with_threads(args.threads, || -> bth_compile::Result<_> {
        let (mesh, _) = bth_import::import(&args.model, Keep::None, &progress)?;
        let (tree, _) = pipeline::build_tree(&mesh, &options, &progress)?;
        let (marks, _) = marks::mark(&mesh, &tree, &progress)?;
        let chosen = costs::choose(&mesh, &tree, &marks, &options.costs, &progress)?;
        Ok((mesh, chosen))
    })??;
    drop(progress);

    let mut verdicts: Vec<&Verdict> = choice.verdicts.iter().collect();
    verdicts.sort_by_key(|v| (Reverse(v.count), v.node));
    let examined = verdicts.len();
    if args.top > 0 {
        verdicts.truncate(args.top);
    }
    if args.json {
        let report = json!({"triangles": mesh.triangles.len(), "examined": examined,
            "chosen": choice.chosen.len(), "report": report, "nodes": verdicts});
        output::json(&report)?;
        return Ok(());
    }
    let mut text = table(&verdicts);
    text.push_str(&format!(
        "{} triangles; {} of {} examined nodes chosen, the {} largest shown; costs in nanoseconds a ray\n",
        count(mesh.triangles.len() as u64),
        count(choice.chosen.len() as u64),
        count(examined as u64),
        count(verdicts.len() as u64),
    ));
    Ok(output::text(&text)?)
}

fn table(verdicts: &[&Verdict]) -> String {
    let mut table = Table::default();
    table.row(["node", "triangles", "steps", "cost tets", "cost BVH", "gain", "decision"]);
    for v in verdicts {
        table.row([
            &v.node.to_string(),
            &count(v.count.into()),
            &format!("{:.1}", v.n_avg),
            &format!("{:.1}", v.cost_tet),
            &format!("{:.1}", v.cost_bvh),
            &format!("{:.2}", v.gain),
            &v.decision.to_string(),
        ]);
    }
    table.render()
}
