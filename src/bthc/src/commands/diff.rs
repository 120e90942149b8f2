//! `bthc diff`: shows the differences between two compiled files.

use crate::args::Diff;
use crate::failure::Failure;
use crate::output;
use crate::table::bytes;
use bth_format::layout::{NONE, SectionEntry, kind};
use serde_json::{Value, json};
use std::collections::BTreeMap;

pub(crate) fn run(args: &Diff) -> Result<(), Failure> {
    let (first, second) = (bth_format::File::read(&args.first)?, bth_format::File::read(&args.second)?);
    let sections = sections(&first, &second);
    let options = options(&provenance(&first), &provenance(&second));
    let same_content = first.content_id() == second.content_id();
    let same = first.bytes() == second.bytes();
    if args.json {
        output::json(&json!({
            "identical": same,
            "same_content": same_content,
            "objects": [first.object_count(), second.object_count()],
            "sections": sections.iter().map(Difference::json).collect::<Vec<_>>(),
            "provenance": options.iter().map(|(name, a, b)| json!({"name": name, "first": a, "second": b}))
                .collect::<Vec<_>>(),
        }))?;
    } else {
        let mut text = String::from(match (same, same_content) {
            (true, _) => "the files are identical\n",
            (false, true) => "the content is the same; how the files came about differs\n",
            (false, false) => "the content differs\n",
        });
        if first.object_count() != second.object_count() {
            text.push_str(&format!("objects: {} and {}\n", first.object_count(), second.object_count()));
        }
        sections.iter().for_each(|difference| text.push_str(&difference.line()));
        options.iter().for_each(|(name, a, b)| text.push_str(&format!("{name}: {a} and {b}\n")));
        output::text(&text)?;
    }
    if same { Ok(()) } else { Err(Failure::Check) }
}

/// A section that differs, or that one of the files lacks.
struct Difference {
    object: u32,
    kind: u32,
    /// Bytes in the first file and in the second.
    bytes: [Option<u64>; 2],
}

impl Difference {
    fn name(&self) -> String {
        let kind = kind::name(self.kind);
        if self.object == NONE { kind.to_owned() } else { format!("object {}, {kind}", self.object) }
    }

    fn line(&self) -> String {
        let size = |n: Option<u64>| n.map_or("absent".to_owned(), bytes);
        format!("{}: {} and {}\n", self.name(), size(self.bytes[0]), size(self.bytes[1]))
    }

    fn json(&self) -> Value {
        let object = (self.object != NONE).then_some(self.object);
        json!({"object": object, "kind": kind::name(self.kind), "bytes": self.bytes})
    }
}

/// The sections that differ, by the hashes that the files store and `bthc verify` checks.
fn sections(first: &bth_format::File, second: &bth_format::File) -> Vec<Difference> {
    let mut all: BTreeMap<(u32, u32), [Option<SectionEntry>; 2]> = BTreeMap::new();
    for (side, file) in [first, second].into_iter().enumerate() {
        for entry in file.table() {
            all.entry((entry.object, entry.kind)).or_default()[side] = Some(*entry);
        }
    }
    let what = |e: &SectionEntry| (e.flags, e.stride, e.count, e.hash);
    all.into_iter()
        .filter(|(_, sides)| sides[0].as_ref().map(what) != sides[1].as_ref().map(what))
        .map(|((object, kind), sides)| Difference { object, kind, bytes: sides.map(|e| e.map(|e| e.length)) })
        .collect()
}

fn provenance(file: &bth_format::File) -> Value {
    file.provenance().and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default()
}

/// Values that differ, by their path such as `options.quality`.
fn options(first: &Value, second: &Value) -> Vec<(String, String, String)> {
    let (mut a, mut b) = (BTreeMap::new(), BTreeMap::new());
    flatten("", first, &mut a);
    flatten("", second, &mut b);
    let mut names: Vec<&String> = a.keys().chain(b.keys()).collect();
    names.sort();
    names.dedup();
    let of =
        |all: &BTreeMap<String, String>, name: &String| all.get(name).cloned().unwrap_or("absent".into());
    let rows = names.into_iter().map(|name| (name.clone(), of(&a, name), of(&b, name)));
    rows.filter(|(_, a, b)| a != b).collect()
}

fn flatten(path: &str, value: &Value, to: &mut BTreeMap<String, String>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                flatten(&path, value, to);
            }
        }
        Value::Null if path.is_empty() => {}
        Value::String(text) => drop(to.insert(path.to_owned(), text.clone())),
        value => drop(to.insert(path.to_owned(), value.to_string())),
    }
}
