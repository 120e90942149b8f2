//! A row of a record: one figure.

use anyhow::{Context, Result, bail};
use serde::Serialize;

/// The columns.
pub(crate) const HEAD: &str = "commit,benchmark,engine,model,set,threads,isa,value,unit,low,high,rounds";

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Row {
    /// The commit that was measured, 12 digits; `?` if it is not known.
    pub(crate) commit: String,
    /// Name of the benchmark's definition.
    pub(crate) benchmark: String,
    /// What was measured, such as `bth` or `embree`.
    pub(crate) engine: String,
    /// Name of the model, or `mean` of all of the definition.
    pub(crate) model: String,
    /// Name of the ray set, or of another figure.
    pub(crate) set: String,
    /// Threads that traced.
    pub(crate) threads: usize,
    /// Instruction set of our kernels, or `-`.
    pub(crate) isa: String,
    /// The figure.
    pub(crate) value: f64,
    /// Its unit, such as `ns/ray`, `Mrays/s`, `times embree`.
    pub(crate) unit: String,
    /// Smallest value or lower quartile, if known.
    pub(crate) low: Option<f64>,
    /// Largest value or upper quartile, if known.
    pub(crate) high: Option<f64>,
    /// Rounds of which the figure is the median; 0 if that is not known.
    pub(crate) rounds: usize,
}

/// Five significant digits, without an exponent.
fn number(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = (4 - x.abs().log10().floor() as i32).clamp(0, 15) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

impl Row {
    /// A line of the file. Commas within names become spaces.
    pub(crate) fn line(&self) -> String {
        let name = |text: &str| text.replace([',', '\n', '"'], " ");
        let optional = |x: Option<f64>| x.map(number).unwrap_or_default();
        [
            name(&self.commit),
            name(&self.benchmark),
            name(&self.engine),
            name(&self.model),
            name(&self.set),
            self.threads.to_string(),
            name(&self.isa),
            number(self.value),
            name(&self.unit),
            optional(self.low),
            optional(self.high),
            self.rounds.to_string(),
        ]
        .join(",")
    }

    /// Reads a line.
    pub(crate) fn parse(line: &str) -> Result<Row> {
        let cells: Vec<&str> = line.split(',').collect();
        let [commit, benchmark, engine, model, set, threads, isa, value, unit, low, high, rounds] = cells[..]
        else {
            bail!("expected 12 columns, found {}: {line}", cells.len());
        };
        let figure = |text: &str| {
            let found = text.parse::<f64>().ok().filter(|x| x.is_finite());
            found.with_context(|| format!("expected a finite number, found {text:?}"))
        };
        let optional = |text: &str| if text.is_empty() { Ok(None) } else { figure(text).map(Some) };
        Ok(Row {
            commit: commit.to_owned(),
            benchmark: benchmark.to_owned(),
            engine: engine.to_owned(),
            model: model.to_owned(),
            set: set.to_owned(),
            threads: threads.parse()?,
            isa: isa.to_owned(),
            value: figure(value)?,
            unit: unit.to_owned(),
            low: optional(low)?,
            high: optional(high)?,
            rounds: rounds.parse()?,
        })
    }
}

/// The folder of a processor's records, made of its name: `intel-xeon-family-6-model-167`.
pub(crate) fn cpu_folder(cpu: &str) -> String {
    let mut out = String::new();
    let plain = cpu.replace("(R)", "").replace("(TM)", "").replace("Processor", "");
    for c in plain.to_lowercase().chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c);
        } else if !out.ends_with('-') && !out.is_empty() {
            out.push('-');
        }
    }
    out.trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_from_their_lines() {
        let line = "0123456789ab,speed,embree hq packet16,igea,ao,1,-,12.345,Mrays/s,12,,5";
        let row = Row::parse(line).unwrap();
        assert_eq!((row.line().as_str(), row.value, row.low, row.high), (line, 12.345, Some(12.0), None));
        assert!(Row::parse("a,b").is_err());
        for wrong in ["fast", "NaN", "inf", ""] {
            assert!(Row::parse(&line.replace("12.345", wrong)).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn numbers_keep_five_digits() {
        assert_eq!([123456.7, 0.00012345678, 1.0, 0.0].map(number), ["123457", "0.00012346", "1", "0"]);
    }

    #[test]
    fn folders_name_the_processor() {
        let name = cpu_folder("Intel(R) Xeon(R) Processor (family 6, model 167)");
        assert_eq!(name, "intel-xeon-family-6-model-167");
    }
}
