//! `bthc explain`: which nodes would be tetrahedralized, which not, and why.

use super::with_threads;
use crate::args::Explain;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Table, count};
use bth_compile::costs::{self, Verdict};
use bth_compile::mesh::Keep;
use bth_compile::{bvh, marks, mesh, pipeline};
use serde_json::json;
use std::cmp::Reverse;

pub(crate) fn run(args: &Explain) -> Result<(), Failure> {
    let mut options = pipeline::Options::default();
    args.selection.apply(&mut options);
    let progress = Progress::new(args.json);
    let (triangles, choice, report) = with_threads(args.threads, || -> bth_compile::Result<_> {
        let (mesh, _) = mesh::import(&args.model, Keep::None, &progress)?;
        let (tree, _) = bvh::build(&mesh, &options.bvh, &progress)?;
        let (marks, _) = marks::mark(&mesh, &tree, &progress)?;
        let (choice, report) = costs::choose(&mesh, &tree, &marks, &options.costs, &progress)?;
        Ok((mesh.triangles.len(), choice, report))
    })??;
    drop(progress);

    let mut verdicts: Vec<&Verdict> = choice.verdicts.iter().collect();
    verdicts.sort_by_key(|v| (Reverse(v.count), v.node));
    let examined = verdicts.len();
    if args.top > 0 {
        verdicts.truncate(args.top);
    }
    if args.json {
        let report = json!({"triangles": triangles, "examined": examined, "chosen": choice.chosen.len(),
            "report": report, "nodes": verdicts});
        output::json(&report)?;
    } else {
        let note = format!(
            "{} triangles; {} of {} examined nodes chosen, the {} largest shown; costs in nanoseconds a ray\n",
            count(triangles as u64),
            count(choice.chosen.len() as u64),
            count(examined as u64),
            count(verdicts.len() as u64),
        );
        output::text(&format!("{}{note}", table(&verdicts)))?;
    }
    Ok(())
}

fn table(verdicts: &[&Verdict]) -> String {
    let mut table = Table::default();
    table.row(["node", "triangles", "steps", "cost tets", "cost BVH", "decision"]);
    for v in verdicts {
        table.row([
            &v.node.to_string(),
            &count(v.count.into()),
            &format!("{:.1}", v.n_avg),
            &format!("{:.1}", v.cost_tet),
            &format!("{:.1}", v.cost_sah),
            &v.decision.to_string(),
        ]);
    }
    table.render()
}
