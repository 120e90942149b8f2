//! The specification and the JSON Schema list the same keys as the reader.

use bth_scene::{KEYS, parse};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

fn spec(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../format-spec").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn schema_has_the_keys_of_the_reader() {
    let schema: Value = serde_json::from_str(&spec("scene-manifest.schema.json")).unwrap();
    for (name, keys) in KEYS {
        let table = if *name == "scene" { &schema } else { &schema["$defs"][name] };
        let properties = table["properties"].as_object().unwrap_or_else(|| panic!("no table {name}"));
        let said: BTreeSet<_> = properties.keys().map(String::as_str).collect();
        assert_eq!(said, keys.iter().copied().collect(), "{name}");
        assert_eq!(table["additionalProperties"], false, "{name}");
    }
    assert_eq!(schema["$defs"].as_object().unwrap().len() + 1, KEYS.len());
}

#[test]
fn page_has_a_row_for_each_key_of_the_reader() {
    let page = spec("scene-manifest.md");
    for (name, keys) in KEYS {
        let start = page.find(&format!("\n## {name}\n")).unwrap_or_else(|| panic!("no section {name}"));
        let section = &page[start + 4..];
        let section = &section[..section.find("\n## ").unwrap_or(section.len())];
        let rows = section.lines().filter_map(|l| l.strip_prefix("| ")).filter(|l| !l.starts_with("key |"));
        let said: BTreeSet<_> = rows.flat_map(|l| l.split(" | ").next().unwrap().split(", ")).collect();
        assert_eq!(said, keys.iter().copied().collect(), "{name}");
    }
}

#[test]
fn example_of_the_page_is_read() {
    let page = spec("scene-manifest.md");
    let example = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let scene = parse(example, Path::new("scene-manifest.md")).unwrap();
    assert_eq!((scene.nodes.len(), scene.tracks[0].times.len()), (3, 3));
}
