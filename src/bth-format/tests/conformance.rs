//! The committed conformance files: the valid ones pass all checks, the invalid ones fail with the
//! code in their name.

use bth_format::File;
use bth_format::verify::verify;
use std::path::PathBuf;

/// Names and bytes of the files in a folder of `format-spec/conformance`, by name.
fn files(folder: &str) -> Vec<(String, Vec<u8>)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../format-spec/conformance").join(folder);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.file_stem().unwrap().to_str().unwrap().to_owned(), std::fs::read(&path).unwrap()))
        .collect();
    files.sort();
    assert!(!files.is_empty());
    files
}

/// Opens and verifies; the code of the first error.
fn code(bytes: &[u8]) -> Option<String> {
    let errors = match File::from_bytes(bytes) {
        Ok(file) => verify(&file).err()?,
        Err(error) => vec![error],
    };
    Some(errors[0].code().to_string())
}

#[test]
fn valid_files_pass() {
    for (name, bytes) in files("valid") {
        assert_eq!(code(&bytes), None, "{name}");
    }
}

#[test]
fn invalid_files_fail_with_the_code_in_their_name() {
    for (name, bytes) in files("invalid") {
        let expected = format!("BTH-{}", name.split('-').next().unwrap());
        assert_eq!(code(&bytes), Some(expected), "{name}");
    }
}
