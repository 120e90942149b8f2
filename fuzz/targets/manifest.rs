//! Scene manifests: what is read is written so that it reads back equal.
#![no_main]
use bth_scene::parse;
use std::path::Path;

libfuzzer_sys::fuzz_target!(|text: &str| {
    let path = Path::new("fuzz.manifest");
    let Ok(manifest) = parse(text, path) else { return };
    let written = manifest.to_toml();
    let again = parse(&written, path).expect("what is written can be read");
    assert!(again == manifest, "{written}");
});
