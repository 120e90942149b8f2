//! Options as text, for the components of keys.

use serde::Serialize;
use serde_json::Value;

/// The canonical text of an option: numbers with the fewest digits that parse to the same value.
pub(crate) fn text(value: &impl Serialize) -> String {
    match json(value) {
        Value::String(text) => text,
        value => value.to_string(),
    }
}

/// The fields of a structure of options, each with its name behind `name`, so that an explanation
/// of a miss names the one that differs.
pub(crate) fn fields(name: &str, value: &impl Serialize) -> Vec<(String, String)> {
    let json = json(value);
    let fields = json.as_object().into_iter().flatten();
    fields.map(|(field, value)| (format!("{name} {field}"), text(value))).collect()
}

fn json(value: &impl Serialize) -> Value {
    // Options consist of numbers, strings and structures of these, which JSON can express.
    serde_json::to_value(value).unwrap_or_else(|e| unreachable!("an option that is no JSON: {e}"))
}
