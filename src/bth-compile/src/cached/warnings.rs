//! Warnings about what is compiled, kept with the results in the cache, so that who takes a result
//! from there gets them, too.

use crate::monitor::{Monitor, Recording};
use serde::Serialize;
use serde_json::Value;

/// Where a report in the cache has the warnings.
const KEY: &str = "warnings";

/// A report as JSON with the warnings that were given meanwhile.
pub(crate) fn with_warnings(report: &impl Serialize, recording: &Recording<'_>) -> serde_json::Result<Value> {
    let mut report = serde_json::to_value(report)?;
    let warnings = recording.warnings();
    if !warnings.is_empty()
        && let Some(fields) = report.as_object_mut()
    {
        fields.insert(KEY.to_owned(), warnings.into());
    }
    Ok(report)
}

/// Gives again the warnings that are kept with a report.
pub(crate) fn replay(report: &Value, monitor: &dyn Monitor) {
    let warnings = report[KEY].as_array().into_iter().flatten().filter_map(Value::as_str);
    warnings.for_each(|message| monitor.warn(message));
}
