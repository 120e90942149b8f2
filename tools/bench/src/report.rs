//! A report: the rows of a measurement, and how they become Markdown and JSON.

use crate::args::RunOptions;
use crate::machine;
use crate::markdown::{short, table};
use crate::output::{note, print_and_save, progress, write};
use crate::records::Row;
use crate::rounds::geometric_mean;
use anyhow::{Result, ensure};
use serde::Serialize;
use serde_json::Value;

/// The name of the model in rows that are geometric means over all models.
pub(crate) const MEAN: &str = "mean";

/// When, where and how a report was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Head {
    /// Name of the command, such as `speed`.
    pub(crate) measurement: &'static str,
    /// Day, UTC.
    pub(crate) date: String,
    /// The commit that was measured.
    pub(crate) commit: Option<String>,
    /// Type of machine.
    pub(crate) machine: String,
    /// Vector instructions that our kernels used.
    pub(crate) isa: String,
    /// The options that matter.
    pub(crate) options: Value,
}

impl Head {
    /// The head of a report that is made now.
    pub(crate) fn now(measurement: &'static str, isa: String, options: Value) -> Head {
        let (date, commit, machine) = (machine::today(), machine::commit(), machine::describe());
        Head { measurement, date, commit, machine, isa, options }
    }

    /// When, where and how, without a full stop.
    pub(crate) fn place(&self) -> String {
        let Head { date, machine, isa, options, .. } = self;
        let commit = self.commit.as_deref().unwrap_or("unknown");
        format!("{date}; commit {commit}. {machine}. Our kernels: {isa}. Options: `{options}`")
    }

    fn markdown(&self) -> String {
        format!("{}. Only ratios within this report mean something.\n", self.place())
    }
}

/// What some figures belong to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Subject<'a> {
    /// The tracer, or another thing that was measured.
    pub(crate) engine: &'a str,
    /// True if it ran our kernels, with the report's instruction set.
    pub(crate) ours: bool,
    /// The model or scene.
    pub(crate) model: &'a str,
    /// Threads that traced.
    pub(crate) threads: usize,
}

/// A report.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Report {
    /// When, where and how it was measured.
    pub(crate) head: Head,
    /// What the figures are, in Markdown.
    #[serde(skip)]
    pub(crate) about: &'static str,
    /// Rounds that figures are medians of.
    #[serde(skip)]
    pub(crate) rounds: usize,
    /// All figures.
    pub(crate) rows: Vec<Row>,
    /// Lines about the models, and what was not measured.
    pub(crate) notes: Vec<String>,
    /// Answers that are wrong and must be right; the command fails if there are any.
    pub(crate) wrong: Vec<String>,
}

impl Report {
    /// A report without figures.
    pub(crate) fn new(head: Head, rounds: usize, about: &'static str) -> Report {
        Report { head, about, rounds, rows: Vec::new(), notes: Vec::new(), wrong: Vec::new() }
    }

    /// Adds a figure.
    pub(crate) fn add(&mut self, of: &Subject<'_>, set: &str, value: f64, unit: &str) {
        let commit = self.head.commit.as_deref().and_then(|commit| commit.split(' ').next());
        self.rows.push(Row {
            commit: commit.unwrap_or("?").to_owned(),
            benchmark: self.head.measurement.to_owned(),
            engine: of.engine.to_owned(),
            model: of.model.to_owned(),
            set: set.to_owned(),
            threads: of.threads,
            isa: if of.ours { self.head.isa.clone() } else { "-".to_owned() },
            value,
            unit: unit.to_owned(),
            low: None,
            high: None,
            rounds: self.rounds,
        });
    }

    /// Notes something that cannot be measured.
    pub(crate) fn leave_out(&mut self, model: &str, engine: &str, why: &anyhow::Error) {
        self.notes.push(format!("{model}: {engine}: not measured: {why:#}"));
    }

    /// Adds the geometric means over the models of all figures in a unit, with the smallest and the
    /// largest.
    pub(crate) fn add_means(&mut self, unit: &str) {
        let rows = self.rows.iter().filter(|row| row.unit == unit).cloned().collect();
        self.rows.extend(means(rows));
    }

    /// Adds the geometric means over the models of the ratios to an engine's figures in a unit.
    pub(crate) fn add_ratios(&mut self, base: &str, unit: &str) {
        let figures = || self.rows.iter().filter(|row| row.unit == unit);
        let ratio = |row: &Row| {
            let place = |r: &Row| (r.model.clone(), r.set.clone(), r.threads);
            let base = figures().find(|r| r.engine == base && place(r) == place(row))?;
            (base.value > 0.0).then(|| row.value / base.value)
        };
        let ratios = figures()
            .filter_map(|row| Some(Row { value: ratio(row)?, unit: format!("times {base}"), ..row.clone() }));
        let ratios = means(ratios.collect());
        self.rows.extend(ratios);
    }

    /// The Markdown page.
    pub(crate) fn markdown(&self) -> String {
        let Head { measurement, date, .. } = &self.head;
        let mut text = format!("# {measurement}, {date}\n\n{}\n{}\n", self.head.markdown(), self.about);
        let mut models = distinct(self.rows.iter().map(|row| row.model.as_str()));
        models.sort_by_key(|model| *model != MEAN);
        for model in models {
            let rows = || self.rows.iter().filter(move |row| row.model == model);
            for threads in distinct(rows().map(|row| row.threads)) {
                let plural = if threads == 1 { "" } else { "s" };
                text.push_str(&format!("\n## {model}, {threads} thread{plural}\n\n"));
                text.push_str(&pivot(&rows().filter(|row| row.threads == threads).collect::<Vec<_>>()));
            }
        }
        if !self.notes.is_empty() {
            text.push_str(&format!("\n- {}\n", self.notes.join("\n- ")));
        }
        text
    }

    /// Prints the page, writes the files and notes what was not measured.
    pub(crate) fn finish(&self, to: &RunOptions) -> Result<()> {
        progress("");
        self.notes.iter().for_each(|line| note(line));
        print_and_save(&self.markdown(), || self.save(to))?;
        ensure!(self.wrong.is_empty(), "wrong answers: {}", self.wrong.join(", "));
        Ok(())
    }

    /// Writes the files.
    pub(crate) fn save(&self, to: &RunOptions) -> Result<()> {
        let json = format!("{:#}\n", serde_json::to_value(self)?);
        if let Some(path) = &to.json {
            write(path, &json)?;
        }
        let Some(folder) = &to.out else { return Ok(()) };
        let stem = format!("{}-{}", self.head.date, to.name.as_deref().unwrap_or(self.head.measurement));
        write(&folder.join(format!("{stem}.json")), &json)?;
        write(&folder.join(format!("{stem}.md")), &self.markdown())
    }
}

/// The distinct items, in order.
pub(crate) fn distinct<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    items.into_iter().fold(Vec::new(), |mut out, item| {
        if !out.contains(&item) {
            out.push(item);
        }
        out
    })
}

/// Geometric means over the models.
fn means(rows: Vec<Row>) -> Vec<Row> {
    let key = |r: &Row| (r.engine.clone(), r.set.clone(), r.threads, r.unit.clone());
    let mean = |wanted: (String, String, usize, String)| {
        let of: Vec<&Row> = rows.iter().filter(|row| key(row) == wanted).collect();
        let values = || of.iter().map(|row| row.value);
        Some(Row {
            model: MEAN.to_owned(),
            value: geometric_mean(values())?,
            low: values().reduce(f64::min),
            high: values().reduce(f64::max),
            ..(*of.first()?).clone()
        })
    };
    distinct(rows.iter().map(key)).into_iter().filter_map(mean).collect()
}

/// A table with a row for each engine, and a column for each set and unit.
fn pivot(rows: &[&Row]) -> String {
    let units = distinct(rows.iter().map(|row| row.unit.as_str()));
    let columns = distinct(rows.iter().map(|row| (row.set.as_str(), row.unit.as_str())));
    let name = |(set, unit): &(&str, &str)| match units[..] {
        [_] => (*set).to_owned(),
        _ => format!("{set}, {unit}"),
    };
    let head: Vec<String> = std::iter::once("engine".to_owned()).chain(columns.iter().map(name)).collect();
    let line = |engine: &str| {
        let cell = |(set, unit): &(&str, &str)| {
            let is_it = |row: &&&Row| row.engine == engine && row.set == *set && row.unit == *unit;
            rows.iter().find(is_it).map_or("-".to_owned(), |row| short(row.value))
        };
        std::iter::once(engine.to_owned()).chain(columns.iter().map(cell)).collect()
    };
    let lines: Vec<Vec<String>> =
        distinct(rows.iter().map(|row| row.engine.as_str())).into_iter().map(line).collect();
    let unit = if let [unit] = units[..] { format!("{unit}:\n\n") } else { String::new() };
    unit + &table(&head, &lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_tables_and_ratios_become_means() {
        let (date, commit) = ("2026-01-02".into(), Some("0123 with changes".into()));
        let (machine, isa) = ("A".into(), "avx2".into());
        let head = Head { measurement: "speed", date, commit, machine, isa, options: Value::Null };
        let mut report = Report::new(head, 5, "About.");
        for (model, ours, theirs) in [("a", 8.0, 4.0), ("b", 8.0, 1.0)] {
            let of = |engine, ours| Subject { engine, ours, model, threads: 1 };
            report.add(&of("bth", true), "ao", ours, "Mrays/s");
            report.add(&of("embree", false), "ao", theirs, "Mrays/s");
        }
        report.add_ratios("embree", "Mrays/s");
        let mean = &report.rows[4];
        assert_eq!((mean.value, mean.low, mean.high), (4.0, Some(2.0), Some(8.0)));
        assert_eq!(mean.line(), "0123,speed,bth,mean,ao,1,avx2,4,times embree,2,8,5");
        let page = report.markdown();
        let [means, a, b] = page.split("\n## ").skip(1).collect::<Vec<_>>()[..] else { panic!("{page}") };
        assert!(means.starts_with("mean, 1 thread\n\ntimes embree:\n\n| engine | ao |"), "{means}");
        assert!(a.contains("| bth | 8.00 |\n| embree | 4.00 |") && b.contains("| embree | 1.00 |"), "{page}");
    }
}
