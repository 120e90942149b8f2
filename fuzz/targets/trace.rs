//! A file that passes the checks is traced safely: open, check, 64 rays.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| bth_fuzz::open_and_trace(bytes));
