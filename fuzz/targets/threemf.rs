//! Reading 3MF packages whose parts are these bytes, stored.
#![no_main]
use std::io::Write;

const RELATIONSHIP: &[u8] =
    br#"<Relationship Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="a"/>"#;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut package = rawzip::ZipArchiveWriter::new(Vec::new());
    for (name, part) in [("_rels/.rels", RELATIONSHIP), ("a", bytes), ("3D/Other.model", bytes)] {
        let (mut entry, config) = package.new_file(name).start().expect("it is in memory");
        let mut writer = config.wrap(&mut entry);
        writer.write_all(part).expect("it is in memory");
        let (_, descriptor) = writer.finish().expect("it is in memory");
        entry.finish(descriptor).expect("it is in memory");
    }
    bth_fuzz::import("3mf", &package.finish().expect("it is in memory"));
});
