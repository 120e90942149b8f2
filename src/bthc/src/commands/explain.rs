//! `bthc explain`: shows which nodes would be tetrahedralized, which not, and why; and which
//! surfaces have free directions.

use super::threads::with_threads;
use crate::args::Explain;
use crate::explain::{Explained, MeasuredNode, free_picture, measure, picture};
use crate::failure::Failure;
use crate::output;
use crate::overwrite;
use crate::progress::Progress;
use crate::table::{Table, count};
use bth_compile::costs::{self, Verdict};
use bth_compile::free::{self, FreeOptions, FreeReport, KeepFree, Kept};
use bth_compile::{Error, Monitor, bvh, marks, pipeline, tets, write};
use bth_format::layout::{FreeDirections, FreeDistances};
use bth_import::{Keep, Mesh};
use serde_json::{Value, json};
use std::cmp::Reverse;
use std::path::Path;

pub(crate) fn run(args: &Explain) -> Result<(), Failure> {
    let mut options = pipeline::CompileOptions { geometry: false, ..pipeline::CompileOptions::default() };
    for picture in args.picture.iter().chain(&args.free_picture) {
        overwrite::check(picture, [&args.model].into_iter().chain(&args.selection.rays))?;
    }
    if let (Some(picture), Some(other)) = (&args.picture, &args.free_picture)
        && overwrite::place(picture) == overwrite::place(other)
    {
        let message = format!("both pictures would be written to {}", picture.display());
        return Err(Failure::Usage { message, hint: "name another file with --free-picture" });
    }
    let progress = Progress::new(args.json);
    args.selection.apply(&mut options, &progress)?;
    let ((mesh, tree), (choice, report)) = with_threads(args.threads, || -> bth_compile::Result<_> {
        let (mesh, _) = bth_import::import(&args.model, Keep::None, &progress)?;
        let (tree, _) = pipeline::build_tree(&mesh, &options, &progress)?;
        let (marks, _) = marks::mark(&mesh, &tree, &progress)?;
        let storage = pipeline::storage(&mesh, &tree, &options, &progress)?;
        let chosen = costs::choose(&mesh, &tree, &marks, &options.costs, storage, &progress)?;
        Ok(((mesh, tree), chosen))
    })??;
    let built = match args.measure || args.picture.is_some() {
        true => built((&mesh, &tree), &choice, args, &options, &progress)?,
        false => Built::default(),
    };
    let free = match &args.free_picture {
        Some(path) => {
            Some(with_threads(args.threads, || free_directions((&mesh, &tree), &options, path, &progress))??)
        }
        None => None,
    };
    drop(progress);

    let mut verdicts: Vec<&Verdict> = choice.verdicts.iter().collect();
    verdicts.sort_by_key(|v| (Reverse(v.count), v.node));
    let examined = verdicts.len();
    if args.top > 0 {
        verdicts.truncate(args.top);
    }
    if args.json {
        let mut report = json!({"triangles": mesh.triangles.len(), "examined": examined,
            "chosen": choice.chosen.len(), "report": report, "nodes": verdicts});
        if let Value::Object(report) = &mut report {
            report.extend(built.measured.map(|nodes| ("measured".to_owned(), json!(nodes))));
            report.extend(free.map(|free| ("free_directions".to_owned(), json!(free))));
        }
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
    if let Some(nodes) = &built.measured {
        text.push_str(&measured_table(nodes));
    }
    if let (Some(path), Some(most)) = (&args.picture, built.brightest) {
        text.push_str(&picture_line(path, most));
    }
    if let (Some(path), Some(free)) = (&args.free_picture, free) {
        text.push_str(&free_line(path, &free));
    }
    Ok(output::text(&text)?)
}

/// What is known only once the chosen nodes are tetrahedralized.
#[derive(Default)]
struct Built {
    /// Costs of the largest nodes, where `--measure` asks for them.
    measured: Option<Vec<MeasuredNode>>,
    /// Nanoseconds of the brightest pixels of the picture, where one is drawn.
    brightest: Option<f64>,
}

/// Tetrahedralizes the chosen nodes, measures what rays cost in them and draws the picture, as far
/// as the options ask for it.
fn built(
    (mesh, tree): (&Mesh, &bvh::BinaryBvh),
    choice: &costs::Choice,
    args: &Explain,
    options: &pipeline::CompileOptions,
    progress: &Progress,
) -> Result<Built, Failure> {
    let (tets, _) =
        with_threads(args.threads, || tets::build(mesh, tree, &choice.chosen, &options.tets, progress))??;
    let scene = |tets: &[(u32, tets::TetMesh)]| -> Result<bth::Scene, Failure> {
        Ok(bth::from_bytes(&pipeline::assemble(mesh, tree, tets, options, progress)?.bytes)?)
    };
    let explained = Explained {
        mesh,
        tree,
        choice,
        costs: &options.costs,
        built: &tets,
        compiled: &scene(&tets)?,
        plain: &scene(&[])?,
    };
    let mut built = Built::default();
    if args.measure {
        progress.stage("measure", None);
        let most = if args.top == 0 { usize::MAX } else { args.top };
        built.measured = Some(measure(&explained, most, || progress.cancelled()).ok_or(Error::Cancelled)?);
    }
    if let Some(path) = &args.picture {
        progress.stage("picture", None);
        let (png, most) = picture(&explained)?;
        write::write_atomically(path, &png)?;
        built.brightest = Some(most);
    }
    Ok(built)
}

/// What the picture shows.
fn picture_line(path: &Path, most: f64) -> String {
    format!(
        "wrote {}: left what triangles are in (green: tetrahedra; blue-grey: a BVH that is cheaper; grey: too few \
         triangles; orange: bad contacts), right what a bounce costs, to {most:.0} ns\n",
        path.display()
    )
}

/// Decides free directions, and draws which surfaces have them.
fn free_directions(
    (mesh, tree): (&Mesh, &bvh::BinaryBvh),
    options: &pipeline::CompileOptions,
    path: &Path,
    progress: &Progress,
) -> Result<FreeReport, Failure> {
    let all = FreeOptions { keep: KeepFree::All, ..FreeOptions::default() };
    let (free, mut report) = free::find(mesh, tree, &all, progress)?;
    let (kept, worth) = free::worthwhile(mesh, tree, &all, progress)?;
    (report.kept, report.worth) = (kept, Some(worth));
    progress.stage("picture", None);
    let scene = bth::from_bytes(&pipeline::assemble(mesh, tree, &[], options, progress)?.bytes)?;
    write::write_atomically(path, &free_picture((mesh, tree), &scene, &free)?)?;
    Ok(report)
}

/// A distance in units of the model, whose size may be anything, to at least three digits.
fn distance_text(distance: f32) -> String {
    match distance {
        0.0 => "0".to_owned(),
        d if (0.1..1e6).contains(&d) => format!("{d:.3}"),
        d => format!("{d:.2e}"),
    }
}

/// What free directions bring and cost.
fn free_line(path: &Path, free: &FreeReport) -> String {
    let bytes = |row: usize| count(free.triangles * row as u64);
    format!(
        "wrote {}: from dark, where rays of no direction are known to meet nothing, to yellow, where all are; directions that are free up to a \
         distance count in part\n{:.0} % of directions free; up to the distances {} {:.0} %, {:.0} %, {:.0} %\n\
         {}: {} by --free-directions auto\n",
        path.display(),
        100.0 * free.free,
        free.levels.map(distance_text).join(", "),
        100.0 * free.beyond[0],
        100.0 * free.beyond[1],
        100.0 * free.beyond[2],
        free.worth.unwrap_or_default(),
        match free.kept {
            Kept::None => "not kept".to_owned(),
            Kept::Distances => format!("distances kept, {} bytes,", bytes(size_of::<FreeDistances>())),
            Kept::Directions => format!("kept, {} bytes,", bytes(size_of::<FreeDirections>())),
        },
    )
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

/// Predicted and measured values side by side.
fn measured_table(nodes: &[MeasuredNode]) -> String {
    if nodes.is_empty() {
        return "no node became a tet leaf, so there is nothing to measure\n".to_owned();
    }
    let mut table = Table::default();
    table.row(["node", "triangles", "steps", "counted", "with tets", "measured", "BVH alone", "measured"]);
    // A missing prediction is NaN.
    let number = |x: f64| if x.is_nan() { "-".to_owned() } else { format!("{x:.1}") };
    for n in nodes {
        table.row([
            &n.node.to_string(),
            &count(n.triangles.into()),
            &number(n.steps[0]),
            &number(n.steps[1]),
            &number(n.cost_tet[0]),
            &number(n.cost_tet[1]),
            &number(n.cost_bvh[0]),
            &number(n.cost_bvh[1]),
        ]);
    }
    table.render()
}
