//! Reading FBX files.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bth_fuzz::import("fbx", bytes));
