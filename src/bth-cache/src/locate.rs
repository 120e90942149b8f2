//! The folder of the cache and its size limit.

use std::ffi::OsString;
use std::path::PathBuf;

/// Bytes that are kept by default.
pub const DEFAULT_CAP: u64 = 20 << 30;

/// The folder that the environment names: `BTH_CACHE_DIR`, else `bth` in the folder for caches
/// (`XDG_CACHE_HOME`, `~/.cache`, on Windows `LOCALAPPDATA`).
pub fn folder() -> Option<PathBuf> {
    choose(|name| std::env::var_os(name))
}

fn choose(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let set = |name: &str| variable(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    set("BTH_CACHE_DIR")
        // The specification of XDG has relative paths ignored.
        .or_else(|| set("XDG_CACHE_HOME").filter(|p| p.is_absolute()).map(|p| p.join("bth")))
        .or_else(|| set("HOME").map(|p| p.join(".cache/bth")))
        .or_else(|| set("LOCALAPPDATA").map(|p| p.join("bth")))
}

/// A number of bytes: digits, then perhaps K, M, G or T (times 1024 each) and iB or B.
///
/// # Errors
/// What was expected and found.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let wrong = || format!("expected a number of bytes such as 500M or 20GiB, found {text:?}");
    let split = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let number: u64 = text[..split].parse().map_err(|_| wrong())?;
    let unit = text[split..].trim().to_ascii_uppercase();
    let unit = unit.strip_suffix("IB").or_else(|| unit.strip_suffix('B')).unwrap_or(&unit);
    let power = match unit {
        "" => 0,
        "K" => 1,
        "M" => 2,
        "G" => 3,
        "T" => 4,
        _ => return Err(wrong()),
    };
    number.checked_mul(1 << (10 * power)).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_decides_in_order() {
        let with = |set: &[(&str, &str)]| {
            choose(|name| set.iter().find(|(n, _)| *n == name).map(|(_, v)| OsString::from(v)))
        };
        let home = ("HOME", "/home/me");
        assert_eq!(with(&[("BTH_CACHE_DIR", "here"), home]), Some("here".into()));
        assert_eq!(with(&[("XDG_CACHE_HOME", "/x"), home]), Some("/x/bth".into()));
        assert_eq!(with(&[("XDG_CACHE_HOME", "x"), home]), Some("/home/me/.cache/bth".into()));
        assert_eq!(with(&[("BTH_CACHE_DIR", ""), home]), Some("/home/me/.cache/bth".into()));
        assert_eq!(with(&[]), None);
    }

    #[test]
    fn bytes_with_units() {
        for (text, bytes) in [("0", 0), ("12", 12), ("1k", 1024), ("20GiB", 20 << 30), ("3 MB", 3 << 20)] {
            assert_eq!(parse_bytes(text), Ok(bytes));
        }
        for text in ["", "G", "1X", "-1", "1.5G", "99999999T"] {
            assert!(parse_bytes(text).is_err(), "{text}");
        }
    }
}
