//! Any bytes: header, section table, every view and index, hashes and geometry.
#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(file) = bth_format::File::from_bytes(bytes) else { return };
    file.resident_bytes();
    file.provenance();
    for object in 0..file.object_count() {
        let _ = file.check(object);
    }
    let _ = bth_format::verify::verify(&file);
});
