//! Warnings about what is compiled, kept with the results in the cache, so that who takes a result from there gets them, too.

use crate::monitor::Monitor;
use serde::Serialize;
use serde_json::Value;
use std::sync::{Mutex, PoisonError};

/// Where a report in the cache has the warnings.
const KEY: &str = "warnings";

/// A monitor that also keeps the warnings that it passes on.
pub(crate) struct Recording<'a> {
    to: &'a dyn Monitor,
    warnings: Mutex<Vec<String>>,
}

impl<'a> Recording<'a> {
    pub(crate) fn new(to: &'a dyn Monitor) -> Self {
        Self { to, warnings: Mutex::default() }
    }

    /// A report as JSON with the warnings so far.
    pub(crate) fn with_report(&self, report: &impl Serialize) -> serde_json::Result<Value> {
        let mut report = serde_json::to_value(report)?;
        let warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        if !warnings.is_empty()
            && let Some(fields) = report.as_object_mut()
        {
            fields.insert(KEY.to_owned(), warnings.clone().into());
        }
        Ok(report)
    }
}

impl Monitor for Recording<'_> {
    fn stage(&self, name: &'static str, total: Option<u64>) {
        self.to.stage(name, total);
    }
    fn advance(&self, units: u64) {
        self.to.advance(units);
    }
    fn cancelled(&self) -> bool {
        self.to.cancelled()
    }
    fn warn(&self, message: &str) {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(message.to_owned());
        self.to.warn(message);
    }
    fn notice(&self, message: &str) {
        self.to.notice(message);
    }
}

/// Gives again the warnings that are kept with a report.
pub(crate) fn replay(report: &Value, monitor: &dyn Monitor) {
    let warnings = report[KEY].as_array().into_iter().flatten();
    warnings.filter_map(Value::as_str).for_each(|message| monitor.warn(message));
}
