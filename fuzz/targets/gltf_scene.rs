//! Reading glTF and GLB files as scenes: hierarchy, animations, skins, morph targets.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bth_fuzz::import_scene(bytes));
