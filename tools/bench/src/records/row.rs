//! A row of a record: one figure.

use serde::Serialize;
use serde_json::Value;

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
    /// Rounds that gave the median; 0 if that is not known.
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
        let values = serde_json::to_value(self).unwrap_or_default();
        let cell = |column| match &values[column] {
            Value::String(text) => text.replace([',', '\n', '"'], " "),
            Value::Number(n) => number(n.as_f64().unwrap_or(f64::NAN)),
            _ => String::new(),
        };
        HEAD.split(',').map(cell).collect::<Vec<_>>().join(",")
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
    fn a_row_is_a_line() {
        let row = Row {
            commit: "0123456789ab".to_owned(),
            benchmark: "speed".to_owned(),
            engine: "embree, hq".to_owned(),
            model: "igea".to_owned(),
            set: "ao".to_owned(),
            threads: 1,
            isa: "-".to_owned(),
            value: 12.345,
            unit: "Mrays/s".to_owned(),
            low: Some(12.0),
            high: None,
            rounds: 5,
        };
        assert_eq!(row.line(), "0123456789ab,speed,embree  hq,igea,ao,1,-,12.345,Mrays/s,12,,5");
    }

    #[test]
    fn numbers_keep_five_digits_and_folders_name_the_processor() {
        assert_eq!([123456.7, 0.00012345678, 1.0].map(number), ["123457", "0.00012346", "1"]);
        let name = cpu_folder("Intel(R) Xeon(R) Processor (family 6, model 167)");
        assert_eq!(name, "intel-xeon-family-6-model-167");
    }
}
