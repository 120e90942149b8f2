//! The page: the table, what it says, what the sets are, and how each engine was asked.

use super::sets::{Query, Set};
use super::{Line, Outcome};
use crate::markdown::{count, short, table};
use crate::report::{Head, distinct};

/// The page, next to `truth.svg`.
pub(super) fn write(head: &Head, queries: usize, sets: &[Set], lines: &[Line<'_>]) -> String {
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    let names = sets.iter().map(|set| set.name);
    let columns: Vec<&str> = ["engine", "computes in"].into_iter().chain(names).collect();
    let rows: Vec<_> = lines.iter().map(row).collect();
    let about = |set: &Set| words(&[set.name, set.about, &count(set.triangles.len() as u64)]);
    let asked = |line: &Line<'_>| {
        let engine = line.engine;
        let share = if engine.one_in == 1 { "all".to_owned() } else { format!("1 in {}", engine.one_in) };
        words(&[&engine.name, &engine.source, &engine.offset_source, &share])
    };
    let said: Vec<_> = (0..sets.len()).filter_map(|i| comparison(sets[i].name, i, lines)).collect();
    let list = |of: Vec<String>| if of.is_empty() { "nobody".to_owned() } else { of.join(", ") };
    // Text is aligned left.
    let text = |head: &[&str], rows: Vec<Vec<String>>| table(&words(head), &rows).replace("---:", "---");
    include_str!("page.txt")
        .replace("{measured}", &head.place())
        .replace("{queries}", &count(queries as u64))
        .replace("{table}", &table(&words(&columns), &rows))
        .replace("{said}", &text(&["set", "not more wrong", "faster"], said))
        .replace("{one-sided}", &list(lines.iter().filter_map(|line| one_sided(line, sets)).collect()))
        .replace(
            "{missed}",
            &list(lines.iter().filter_map(|line| missed(line, sets, |set| set.single)).collect()),
        )
        .replace(
            "{leaks}",
            &list(lines.iter().filter_map(|line| missed(line, sets, |set| set.scene.is_some())).collect()),
        )
        .replace("{errors}", &list(lines.iter().filter_map(|line| error_of_t(line, sets)).collect()))
        .replace("{sets}", &text(&["set", "queries", "triangles"], sets.iter().map(about).collect()))
        .replace(
            "{engines}",
            &text(&["engine", "from", "offset from a surface", "asked"], lines.iter().map(asked).collect()),
        )
        .replace("{failures}", &lines.iter().map(|line| failures(line, sets)).collect::<String>())
}

/// A line of the table: in each cell the wrong answers per million and the nanoseconds.
fn row(line: &Line<'_>) -> Vec<String> {
    let is_missing = line.answered().next().is_none();
    let cell = |outcome: &Result<Outcome, String>| match outcome {
        Ok(Outcome { judgement, ns }) => {
            let wrong = match judgement.wrong() {
                0 => "**0**".to_owned(),
                _ => count(judgement.per_million().round() as u64),
            };
            format!("{wrong}<br>{} ns", short(*ns))
        }
        Err(_) if is_missing => "not to be had here".to_owned(),
        Err(_) => "–".to_owned(),
    };
    let name = if line.engine.is_ours() { "**bth**" } else { &line.engine.name };
    [name, &line.engine.computes]
        .map(str::to_owned)
        .into_iter()
        .chain(line.outcomes.iter().map(cell))
        .collect()
}

/// Who is as right as ours on a set, or faster; each with its time relative to ours.
fn comparison(name: &str, set: usize, lines: &[Line<'_>]) -> Option<Vec<String>> {
    let of = |line: &Line<'_>| -> Option<(f64, f64)> {
        let Outcome { judgement, ns } = line.outcomes[set].as_ref().ok()?;
        Some((judgement.per_million(), *ns))
    };
    let (wrong, ns) = of(lines.iter().find(|line| line.engine.is_ours())?)?;
    let others = |is_wanted: &dyn Fn((f64, f64)) -> bool| {
        let other = |line: &Line<'_>| {
            let other = of(line).filter(|other| is_wanted(*other))?;
            Some(format!("{} ({}×)", line.engine.name, short(other.1 / ns)))
        };
        let found: Vec<_> = lines.iter().filter(|line| !line.engine.is_ours()).filter_map(other).collect();
        if found.is_empty() { "nobody".to_owned() } else { found.join(", ") }
    };
    Some(vec![name.to_owned(), others(&|other| other.0 <= wrong), others(&|other| other.1 < ns)])
}

/// Rays of some sets that hit and found nothing, per million.
fn missed(line: &Line<'_>, sets: &[Set], is_one: fn(&Set) -> bool) -> Option<String> {
    let is_asked = |set: &Set| is_one(set) && set.query == Query::Nearest;
    let asked = sets.iter().zip(&line.outcomes).filter(|(set, _)| is_asked(set));
    let counts = asked.filter_map(|(_, outcome)| Some(outcome.as_ref().ok()?.judgement));
    let (missed, all) = counts.fold((0, 0), |(missed, all), of| (missed + of.missed, all + of.answers));
    (missed > 0).then(|| format!("{} {}", line.engine.name, count((missed as f64 * 1e6 / all as f64) as u64)))
}

/// Pairs per million with different answers in both directions.
fn one_sided(line: &Line<'_>, sets: &[Set]) -> Option<String> {
    let visible = sets.iter().position(|set| set.query == Query::Visible)?;
    let judgement = line.outcomes[visible].as_ref().ok()?.judgement;
    (judgement.one_sided > 0)
        .then(|| format!("{} {}", line.engine.name, count(judgement.one_sided_per_million() as u64)))
}

/// The largest error of t in the sets in f32.
fn error_of_t(line: &Line<'_>, sets: &[Set]) -> Option<String> {
    let single = sets.iter().zip(&line.outcomes).filter(|(set, _)| set.single);
    let errors = single.filter_map(|(_, outcome)| Some(outcome.as_ref().ok()?.judgement.error_of_t));
    errors.reduce(f64::max).map(|error| format!("{} {error:.0e}", line.engine.name))
}

/// Why an engine did not answer sets.
fn failures(line: &Line<'_>, sets: &[Set]) -> String {
    let failed =
        || sets.iter().zip(&line.outcomes).filter_map(|(set, o)| Some((set.name, o.as_ref().err()?)));
    let said = |why: &String| {
        let names: Vec<_> = failed().filter(|(_, other)| *other == why).map(|(name, _)| name).collect();
        format!("- {}, {}: {why}\n", line.engine.name, names.join(", "))
    };
    distinct(failed().map(|(_, why)| why)).into_iter().map(said).collect()
}
