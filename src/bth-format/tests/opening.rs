//! Opening a file: what damage is found, and where errors say that it is.

use bth_format::file::DeformableObject;
use bth_format::layout::{Header, NONE, SectionEntry, kind};
use bth_format::verify::verify;
use bth_format::{Code, Error, File};
use std::path::PathBuf;

/// A file of the conformance suite.
fn valid(name: &str) -> (PathBuf, Vec<u8>) {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../format-spec/conformance/valid");
    let path = folder.join(name);
    let bytes = std::fs::read(&path).unwrap();
    (path, bytes)
}

/// One triangle with its positions and a provenance.
fn triangle() -> (PathBuf, Vec<u8>) {
    valid("triangle.bth")
}

fn opened(bytes: &[u8]) -> Error {
    File::from_bytes(bytes).expect_err("the file is damaged")
}

#[test]
fn a_bit_that_changed_is_found_wherever_it_is() {
    let (_, mut bytes) = triangle();
    for at in 0..bytes.len() {
        bytes[at] ^= 1 << (at % 8);
        let found = File::from_bytes(&bytes).map_err(|e| vec![e]).and_then(|file| verify(&file));
        assert!(found.is_err(), "byte {at}");
        bytes[at] ^= 1 << (at % 8);
    }
    assert!(verify(&File::from_bytes(&bytes).unwrap()).is_ok());
}

#[test]
fn a_file_that_was_cut_or_appended_to_is_refused() {
    let (_, mut bytes) = triangle();
    for length in 0..bytes.len() {
        let expected = if length < size_of::<Header>() { Code::HeaderSize } else { Code::Length };
        assert_eq!(opened(&bytes[..length]).code(), expected, "{length} bytes");
    }
    bytes.push(0);
    assert_eq!(opened(&bytes).code(), Code::Length);
}

#[test]
fn an_error_of_the_section_table_names_section_object_and_byte() {
    let (_, mut bytes) = triangle();
    // The last entry is PROVENANCE: it gets an offset that is no multiple of 64, and hashes to
    // match.
    let entry = size_of::<Header>() + 5 * size_of::<SectionEntry>();
    bytes[entry + 16] += 1;
    let table = bth_format::file::hash128(&bytes[128..128 + 6 * 64]);
    bytes[96..112].copy_from_slice(&table);
    let header = bth_format::file::hash128(&bytes[..112]);
    bytes[112..128].copy_from_slice(&header);
    let error = opened(&bytes);
    assert_eq!(error.code(), Code::Alignment);
    assert_eq!(error.section().map(|s| (s.kind, s.object)), Some((kind::PROVENANCE, NONE)));
    assert_eq!(error.offset(), Some(entry as u64 + 12));
    assert_eq!(
        error.to_string(),
        "BTH-F011: PROVENANCE, byte 460: expected multiples of 64, found alignment 64 at offset 1025 (hint: the \
         program that wrote the file has a defect; compile it again with bthc)"
    );
}

#[test]
fn a_file_that_was_read_or_mapped_holds_the_bytes_on_disk() {
    let (path, bytes) = triangle();
    let mut files = vec![(File::read(&path).unwrap(), false)];
    // WebAssembly maps no files.
    if cfg!(not(target_family = "wasm")) {
        // SAFETY: nobody changes the committed file while the test runs.
        #[allow(unsafe_code)]
        let mapped = unsafe { File::map(&path) }.unwrap();
        files.push((mapped, true));
    }
    for (file, is_mapped) in files {
        assert_eq!(file.bytes(), bytes);
        assert_eq!(file.is_mapped(), is_mapped);
        assert_eq!(file.object_count(), 1);
        assert_eq!(file.provenance(), Some("{\"tool\":\"conformance\"}"));
        assert_eq!(file.section(0, kind::POSITIONS).unwrap().bytes.len(), 36);
        assert!(file.section(0, kind::NORMALS).is_none() && file.section(1, kind::OBJECT).is_none());
    }
}

#[test]
fn what_is_no_file_is_an_error_with_its_path() {
    for path in ["no/such/file.bth", env!("CARGO_MANIFEST_DIR")] {
        let error = File::read(path).unwrap_err();
        assert_eq!(error.code(), Code::Read);
        assert!(error.to_string().starts_with(&format!("{path}: BTH-O001: ")), "{error}");
    }
}

#[test]
fn an_object_that_does_not_exist_is_an_error() {
    let (_, bytes) = triangle();
    let file = File::from_bytes(&bytes).unwrap();
    assert_eq!(file.check(0).unwrap().header.triangles, 1);
    assert_eq!(file.object(1).unwrap_err().code(), Code::NoSuchObject);
}

#[test]
fn an_object_is_told_apart_from_all_that_were_opened_before() {
    let (_, bytes) = triangle();
    let mut seen = Vec::new();
    for _ in 0..4 {
        // The memory of the file before is free again, so its objects may lie at the same
        // addresses.
        let file = File::from_bytes(&bytes).unwrap();
        let identity = file.view(0).unwrap().identity;
        assert_eq!(file.clone().view(0).unwrap().identity, identity);
        assert!(!seen.contains(&identity), "{identity:?} in {seen:?}");
        seen.push(identity);
    }
}

#[test]
fn an_object_that_deforms_keeps_its_identity() {
    let (_, bytes) = valid("deformable.bth");
    let file = File::from_bytes(&bytes).unwrap();
    let mut object = DeformableObject::new(&file, 0).unwrap();
    let identity = object.view().identity;
    assert_ne!(identity, file.view(0).unwrap().identity);
    let mut positions = object.view().positions.to_vec();
    object.refit(&mut positions, &mut None, |_| ([[0.0; 3]; 2], ())).unwrap();
    assert_eq!(object.view().identity, identity);
}
