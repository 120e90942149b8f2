//! Reading sequences of files.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bth_fuzz::import_frames(bytes));
