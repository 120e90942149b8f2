//! Reading glTF and GLB files: the reader tells them apart by their first bytes.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bth_fuzz::import("gltf", bytes));
