//! Selections of tracers and ray sets by name (`--tracer`, `--set`).

use anyhow::{Result, ensure};
use std::str::FromStr;

/// Names separated by commas; a star at the end matches any ending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Names(Vec<String>);

impl FromStr for Names {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> std::result::Result<Self, Self::Err> {
        Ok(Names(text.split(',').map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect()))
    }
}

impl Names {
    /// Returns true if the name is selected. An empty selection selects everything.
    pub(crate) fn select(&self, name: &str) -> bool {
        self.0.is_empty() || self.0.iter().any(|pattern| matches(pattern, name))
    }

    /// Fails for a selected name that matches none of `all`, most likely because it is misspelled.
    pub(crate) fn check(&self, option: &str, all: &[&str]) -> Result<()> {
        let is_known = |pattern: &&String| all.iter().any(|name| matches(pattern, name));
        let unknown = self.0.iter().find(|pattern| !is_known(pattern));
        ensure!(unknown.is_none(), "{option} {}: there are {}", unknown.map_or("", |n| n), all.join(", "));
        Ok(())
    }
}

fn matches(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => pattern == name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_ending_and_misspelled_names_are_found() {
        let names: Names = "embree, bth*, tinybv".parse().unwrap();
        let all = ["embree", "embree robust", "bth", "bth start", "bvh"];
        assert_eq!(all.map(|n| names.select(n)), [true, false, true, true, false]);
        assert!(
            names.check("--tracer", &all).unwrap_err().to_string().starts_with("--tracer tinybv: there are")
        );
        assert!(Names::default().select("embree"));
    }
}
