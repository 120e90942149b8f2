//! The committed conformance files are those that the generators make, and the reader accepts the
//! valid ones and rejects each invalid one with its code.

use bth_tests::conformance::{Case, invalid, valid};
use std::collections::BTreeSet;
use std::path::PathBuf;

fn folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../format-spec/conformance").join(name)
}

/// Opens, checks and verifies; the code of the first error.
fn code(bytes: &[u8]) -> Option<String> {
    let file = match bth_format::File::from_bytes(bytes) {
        Ok(file) => file,
        Err(e) => return Some(e.code().to_string()),
    };
    bth_format::verify::verify(&file).err().map(|all| all[0].code().to_string())
}

fn assert_committed(name: &str, cases: &[Case]) {
    let folder = folder(name);
    if std::env::var_os("BTH_BLESS").is_some() {
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        for case in cases {
            std::fs::write(folder.join(format!("{}.bth", case.name)), &case.bytes).unwrap();
        }
    }
    let made: BTreeSet<_> = cases.iter().map(|c| format!("{}.bth", c.name)).collect();
    assert_eq!(made.len(), cases.len(), "names are unique");
    let committed: BTreeSet<_> =
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    assert_eq!(made, committed, "files of {}", folder.display());
    for case in cases {
        let bytes = std::fs::read(folder.join(format!("{}.bth", case.name))).unwrap();
        assert!(bytes == case.bytes, "{} differs from what is made", case.name);
    }
}

#[test]
fn committed_files_are_those_made_here() {
    assert_committed("valid", &valid());
    assert_committed("invalid", &invalid());
}

#[test]
fn valid_files_are_accepted() {
    for case in valid() {
        assert_eq!(code(&case.bytes), None, "{}", case.name);
    }
}

#[test]
fn invalid_files_are_refused_with_their_code() {
    let wrong: Vec<_> = invalid()
        .into_iter()
        .filter(|case| code(&case.bytes).as_deref() != Some(&case.code()))
        .map(|case| format!("{}: {:?}", case.name, code(&case.bytes)))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_invariant_has_an_invalid_file() {
    let covered: BTreeSet<_> = invalid().iter().map(Case::code).collect();
    let missing: Vec<_> = bth::Code::ALL
        .iter()
        .map(|c| c.as_str())
        .filter(|c| c.starts_with("BTH-F") && !covered.contains(*c))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn files_read_and_mapped_hold_the_same() {
    for case in valid() {
        let path = folder("valid").join(format!("{}.bth", case.name));
        let read = bth_format::File::read(&path).unwrap();
        // SAFETY: no process changes the committed files while the test runs.
        #[allow(unsafe_code)]
        let mapped = unsafe { bth_format::File::map(&path) }.unwrap();
        assert_eq!(read.bytes(), mapped.bytes());
        assert_eq!(read.content_id(), mapped.content_id());
    }
}

#[test]
fn errors_name_file_section_byte_and_hint() {
    let path = folder("invalid").join("F113-17-triangles.bth");
    let file = bth_format::File::read(&path).unwrap();
    let error = file.check(0).unwrap_err();
    let section = file.section(0, bth_format::layout::kind::LINES).unwrap().entry.offset;
    assert_eq!(error.offset(), Some(section + 1152 + 580));
    let text = error.to_string();
    assert!(
        text.contains("BTH-F113: LINES of object 0, byte ") && text.contains("found 17 (hint: "),
        "{text}"
    );

    let missing = bth_format::File::read("no/such/file.bth").unwrap_err();
    assert_eq!(missing.code().as_str(), "BTH-O001");
    assert!(missing.to_string().starts_with("no/such/file.bth: BTH-O001: "), "{missing}");
    assert_eq!(bth_format::File::read(env!("CARGO_MANIFEST_DIR")).unwrap_err().code().as_str(), "BTH-O001");
}
