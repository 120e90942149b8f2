//! A file that opens is written again section by section: reading that and writing once more gives
//! equal bytes, and each section is what it was.
#![no_main]
use bth_fuzz::write::FileBuilder;

fn write(file: &bth_format::File) -> Vec<u8> {
    let mut builder = FileBuilder::new();
    for section in file.sections() {
        let e = section.entry;
        if e.stride != 0 {
            builder
                .section(e.kind, e.object, e.stride, section.bytes)
                .expect("sections of a file that opened");
        }
    }
    builder.finish()
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(first) = bth_format::File::from_bytes(bytes) else { return };
    let written = write(&first);
    let second = bth_format::File::from_bytes(&written).expect("what is written can be read");
    assert!(write(&second) == written);
    let kept: Vec<_> = first.sections().filter(|s| s.entry.stride != 0).collect();
    assert_eq!(kept.len(), second.sections().len());
    for (a, b) in kept.into_iter().zip(second.sections()) {
        assert!(a.entry.kind == b.entry.kind && a.entry.object == b.entry.object && a.bytes == b.bytes);
    }
});
