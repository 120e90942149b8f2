//! Wrong answers against time, for engines from package registries.
//!
//! `sets`, `aimed_rays` and `instances` make the queries. `exact` answers them by rational
//! arithmetic. `engines` knows the engines and how each leaves a surface, `process` talks to those
//! that are programs, `judge` compares, and `page` and `chart` show it.

mod aimed_rays;
mod chart;
mod engines;
mod exact;
mod instances;
mod judge;
mod page;
mod process;
mod sets;

use crate::args::{RunOptions, at_least_one};
use crate::isa;
use crate::names::Names;
use crate::output::{self, progress};
use crate::report::{Head, Report, Subject};
use crate::rounds::{geometric_mean, least};
use anyhow::Result;
use clap::Args;
use engines::{Asked, Engine, Running};
use judge::{EngineAnswer, Judgement, judge};
use serde_json::json;
use sets::{Query, Set};
use std::cell::RefCell;
use std::path::PathBuf;

/// `truth`.
#[derive(Debug, Args)]
pub(crate) struct Truth {
    /// Queries of a set, about.
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = at_least_one)]
    pub(crate) queries: usize,
    /// Rounds, after one that warms up; the fastest counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Only these engines; a star at the end matches any ending.
    #[arg(long = "engine", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) engines: Names,
    /// Only these sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) sets: Names,
    /// Write the page TRUTH.md and its chart truth.svg into this folder, unless the run is quick.
    #[arg(long, value_name = "DIR")]
    pub(crate) page: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
Wrong answers per million, by exact rational arithmetic on the numbers that all engines are given, and processor time for a \
query, the fastest of interleaved rounds. `error of t`: the largest, relative, where the triangle is right. `one-sided`: pairs \
of points that see each other in one direction only.";

/// Queries of a set in a quick run.
const QUICK_QUERIES: usize = 300;

/// What an engine did with a set.
struct Outcome {
    judgement: Judgement,
    /// Nanoseconds of processor time for a query.
    ns: f64,
}

/// What an engine did with all sets; or why it did nothing with one.
struct Line<'a> {
    /// Number in the chart.
    number: usize,
    engine: &'a Engine,
    outcomes: Vec<Result<Outcome, String>>,
}

/// Asks all engines all sets.
pub(crate) fn measure(arguments: &Truth) -> Result<Report> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let engines = Engine::all()?;
    let names: Vec<&str> = engines.iter().map(|engine| &*engine.name).collect();
    arguments.engines.check("--engine", &names)?;
    let rounds = arguments.run.rounds(arguments.rounds);
    let queries = if arguments.run.quick { QUICK_QUERIES } else { arguments.queries };
    let head = Head::now("truth", isa, json!({ "queries": queries, "rounds": rounds }));
    let mut report = Report::new(head, rounds, ABOUT);

    progress("making the queries and their exact answers");
    let mut sets = sets::all(queries);
    arguments.sets.check("--set", &sets.iter().map(|set| set.name).collect::<Vec<_>>())?;
    sets.retain(|set| arguments.sets.select(set.name));
    let chosen = engines.iter().enumerate().filter(|(_, engine)| arguments.engines.select(&engine.name));
    let line = |(row, engine)| Line { number: row + 1, engine, outcomes: Vec::new() };
    let mut lines: Vec<Line<'_>> = chosen.map(line).collect();
    let mut running: Vec<_> = lines.iter().map(|line| line.engine.start().map_err(reason)).collect();
    for set in &sets {
        ask(set, &mut lines, &mut running, rounds);
    }
    for line in &lines {
        for (set, outcome) in sets.iter().zip(&line.outcomes) {
            add(&mut report, line.engine, set, outcome);
        }
    }
    if let Some(folder) = arguments.page.as_ref().filter(|_| !arguments.run.quick) {
        output::write(&folder.join("truth.svg"), &chart::draw(&sets, &lines))?;
        output::write(&folder.join("TRUTH.md"), &page::write(&report.head, queries, &sets, &lines))?;
    }
    Ok(report)
}

fn reason(error: anyhow::Error) -> String {
    format!("{error:#}")
}

/// Asks all engines one set, in interleaved rounds.
fn ask(set: &Set, lines: &mut [Line<'_>], running: &mut [Result<Box<dyn Running>, String>], rounds: usize) {
    let mut loaded = Vec::new();
    for (line, engine) in lines.iter().zip(running) {
        progress(format!("{}: {}", set.name, line.engine.name));
        let asked = line.engine.asked(set);
        loaded.push(RefCell::new(match engine {
            Ok(engine) => match engine.load(set, &asked) {
                Ok(()) => Ok((engine, asked, Vec::new())),
                Err(why) => Err(reason(why)),
            },
            Err(why) => Err(why.clone()),
        }));
    }
    let seconds = least(&loaded, rounds, |round, of| {
        let mut of = of.borrow_mut();
        let (engine, _, answers) = of.as_mut().ok()?;
        progress(format!("{}: round {round}", set.name));
        match engine.run() {
            Ok((seconds, found)) => {
                *answers = found;
                Some(seconds)
            }
            Err(why) => {
                *of = Err(reason(why));
                None
            }
        }
    });
    for ((line, of), seconds) in lines.iter_mut().zip(loaded).zip(seconds) {
        let outcome = of.into_inner().map(|(_, asked, answers): (_, Vec<Asked>, Vec<EngineAnswer>)| {
            let ns = seconds.unwrap_or(f64::NAN) * 1e9 / answers.len().max(1) as f64;
            Outcome { judgement: judge(set, asked.iter().map(|asked| asked.row), &answers), ns }
        });
        line.outcomes.push(outcome);
    }
}

/// Adds the figures of an engine and a set.
fn add(report: &mut Report, engine: &Engine, set: &Set, outcome: &Result<Outcome, String>) {
    let Outcome { judgement, ns } = match outcome {
        Ok(outcome) => outcome,
        Err(why) => return report.leave_out(set.name, &engine.name, &anyhow::anyhow!("{why}")),
    };
    let ours = engine.is_ours();
    let of = Subject { engine: &engine.name, ours, model: "all", threads: 1 };
    report.add(&of, set.name, judgement.per_million(), "wrong per million");
    report.add(&of, set.name, *ns, "ns/query");
    if set.query == Query::Visible {
        report.add(&of, set.name, judgement.one_sided_per_million(), "one-sided per million");
    } else if judgement.error_of_t > 0.0 {
        report.add(&of, set.name, judgement.error_of_t, "error of t");
    }
    if ours && judgement.wrong() > 0 {
        report.wrong.push(format!("{} of {} on {}", judgement.wrong(), judgement.answers, set.name));
    }
}

impl Line<'_> {
    fn answered(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter_map(|outcome| outcome.as_ref().ok())
    }

    /// Wrong answers per million and nanoseconds for a query, of the sets in f32, each counting the
    /// same; `None` without an answer.
    fn mean(&self, sets: &[Set]) -> Option<(f64, f64)> {
        let of = || sets.iter().zip(&self.outcomes).filter(|(set, _)| set.single);
        let answered = || of().filter_map(|(_, outcome)| outcome.as_ref().ok());
        let wrong: f64 = answered().map(|o| o.judgement.per_million()).sum();
        let ns = geometric_mean(answered().map(|o| o.ns))?;
        Some((wrong / answered().count() as f64, ns))
    }
}
