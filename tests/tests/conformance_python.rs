//! The reader in `tools/bth_dump`, written from the specification alone, accepts and rejects the
//! same files.
#![allow(clippy::print_stdout)] // Tests that cannot run print why.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What the reader prints for each file in a folder: name, validity and code. `None` without
/// Python.
fn read_all(folder: &Path) -> Option<Vec<(String, bool, String)>> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let mut python = Command::new("python3");
    python.arg("-B").arg(root.join("tools/bth_dump/bth_dump.py")).arg("--json").args(&files);
    let output = match python.output() {
        Ok(output) => output,
        Err(e) => {
            println!("SKIPPED: python3 cannot be started: {e}");
            return None;
        }
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    let lines = String::from_utf8(output.stdout).unwrap();
    let read: Vec<_> = lines
        .lines()
        .map(|line| {
            let said: serde_json::Value = serde_json::from_str(line).unwrap();
            let name =
                Path::new(said["file"].as_str().unwrap()).file_name().unwrap().to_str().unwrap().to_owned();
            (name, said["valid"].as_bool().unwrap(), said["code"].as_str().unwrap_or_default().to_owned())
        })
        .collect();
    assert_eq!(read.len(), files.len(), "a line for each file; {errors}");
    assert_eq!(output.status.code(), Some(i32::from(read.iter().any(|r| !r.1))), "{errors}");
    Some(read)
}

fn folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../format-spec/conformance").join(name)
}

#[test]
fn python_reader_accepts_valid_files() {
    for (name, valid, code) in read_all(&folder("valid")).unwrap_or_default() {
        assert!(valid, "{name}: {code}");
    }
}

#[test]
fn python_reader_refuses_invalid_files_with_their_code() {
    for (name, valid, code) in read_all(&folder("invalid")).unwrap_or_default() {
        let expected = format!("BTH-{}", name.split('-').next().unwrap());
        assert_eq!((valid, code), (false, expected), "{name}");
    }
}

#[test]
fn python_reader_hashes_as_blake3_does() {
    let script = "import sys; sys.path.insert(0, sys.argv[1]); from bth_blake3 import plain_blake3\n\
                  data = bytes(i % 251 for i in range(5000))\n\
                  for n in (0, 1, 63, 64, 65, 1023, 1024, 1025, 2048, 3073, 5000): print(plain_blake3(data[:n]).hex())";
    let tool = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tools/bth_dump");
    let output = match Command::new("python3").args(["-B", "-c", script]).arg(tool).output() {
        Ok(output) => output,
        Err(e) => return println!("SKIPPED: python3 cannot be started: {e}"),
    };
    let hashes = String::from_utf8(output.stdout).unwrap();
    let data: Vec<u8> = (0..5000).map(|i| (i % 251) as u8).collect();
    let lengths = [0, 1, 63, 64, 65, 1023, 1024, 1025, 2048, 3073, 5000];
    assert_eq!(hashes.lines().count(), lengths.len(), "{}", String::from_utf8_lossy(&output.stderr));
    for (line, n) in hashes.lines().zip(lengths) {
        let hex: String = bth_format::file::hash128(&data[..n]).iter().map(|b| format!("{b:02x}")).collect();
        assert!(line.starts_with(&hex), "{n} bytes");
    }
}
