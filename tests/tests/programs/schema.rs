//! Holds what `bthc` prints with `--json` to `docs/bthc.schema.json`.

use serde_json::{Value, json};

/// The commands whose output the schema describes.
const COMMANDS: [&str; 4] = ["compile", "info", "verify", "cache"];

/// Panics if the schema does not allow what a command of `bthc` printed.
#[track_caller]
pub(crate) fn check(command: &str, found: &Value) {
    if let Some(wrong) = wrong(command, found) {
        panic!("bthc {command} --json: {wrong}\n{found:#}");
    }
}

/// Why the schema does not allow an output; `None` if it does, or if it does not know the command.
fn wrong(command: &str, found: &Value) -> Option<String> {
    COMMANDS.contains(&command).then_some(())?;
    let text = include_str!("../../../docs/bthc.schema.json");
    let schema: Value = serde_json::from_str(text).expect("the schema is JSON");
    let of = |name: &str| json!({"$ref": format!("#/$defs/{name}")});
    // What succeeds comes first, since its mismatch is the one that helps.
    mismatch(&of(command), &schema, found, "$")
        .filter(|_| mismatch(&of("failure"), &schema, found, "$").is_some())
}

/// Where a value is not as a part of the schema wants it. Knows the keywords that the schema uses.
fn mismatch(wanted: &Value, schema: &Value, found: &Value, at: &str) -> Option<String> {
    let check = |wanted: &Value, found: &Value, at: &str| mismatch(wanted, schema, found, at);
    for (keyword, value) in wanted.as_object().expect("a schema is an object") {
        let wrong = match (keyword.as_str(), found) {
            ("description", _) => None,
            ("$ref", _) => check(&schema["$defs"][value.as_str()?.rsplit('/').next()?], found, at),
            ("anyOf", _) => {
                let all = value.as_array()?.iter().map(|one| check(one, found, at));
                all.collect::<Option<Vec<_>>>().map(|all| all.join("\n or "))
            }
            ("const", _) => (found != value).then(|| format!("{at} is not {value}")),
            ("enum", _) => (!value.as_array()?.contains(found)).then(|| format!("{at} is not of {value}")),
            ("type", _) => (!is_of_type(value, found)).then(|| format!("{at} is not of type {value}")),
            ("minimum", Value::Number(number)) => {
                (number.as_f64() < value.as_f64()).then(|| format!("{at} is below {value}"))
            }
            ("required", Value::Object(fields)) => {
                let missing =
                    value.as_array()?.iter().find(|name| !fields.contains_key(name.as_str().unwrap()));
                missing.map(|name| format!("{at} lacks {name}"))
            }
            ("properties", Value::Object(fields)) => fields.iter().find_map(|(name, found)| {
                value.get(name).and_then(|wanted| check(wanted, found, &format!("{at}.{name}")))
            }),
            ("additionalProperties", Value::Object(fields)) => {
                let is_known = |name: &String| wanted["properties"].get(name).is_some();
                fields.iter().filter(|(name, _)| !is_known(name)).find_map(|(name, found)| match value {
                    Value::Bool(false) => Some(format!("{at} has {name}, which the schema does not list")),
                    wanted => check(wanted, found, &format!("{at}.{name}")),
                })
            }
            ("items", Value::Array(all)) => {
                all.iter().enumerate().find_map(|(i, found)| check(value, found, &format!("{at}[{i}]")))
            }
            ("minimum" | "required" | "properties" | "additionalProperties" | "items", _) => None,
            _ => panic!("the schema has the keyword {keyword}, which this test does not know"),
        };
        if wrong.is_some() {
            return wrong;
        }
    }
    None
}

fn is_of_type(wanted: &Value, found: &Value) -> bool {
    match wanted {
        Value::Array(any) => any.iter().any(|one| is_of_type(one, found)),
        one => match one.as_str().expect("a type") {
            "object" => found.is_object(),
            "array" => found.is_array(),
            "string" => found.is_string(),
            "boolean" => found.is_boolean(),
            "null" => found.is_null(),
            "integer" => found.is_u64() || found.is_i64(),
            "number" => found.is_number(),
            other => panic!("the schema has the type {other}"),
        },
    }
}

#[test]
fn what_the_schema_does_not_list_is_found() {
    let path = |more: Value| {
        let mut found = json!({"folder": "a"});
        found.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        wrong("cache", &found)
    };
    assert_eq!(path(json!({})), None);
    assert!(path(json!({"more": 1})).is_some() && path(json!({"path": 1})).is_some());
    let failed = json!({"jobs": [{"model": "a", "error": {"code": 5}}]});
    assert!(wrong("compile", &failed).is_some_and(|wrong| wrong.contains("code")));
    assert!(wrong("compile", &json!({})).is_some() && wrong("marks", &json!({})).is_none());
}
