//! Selections of tracers and ray sets by name (`--tracer`, `--set`).

use std::str::FromStr;

/// Names separated by commas; one that ends in a star stands for all that begin so.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Names(Vec<String>);

impl FromStr for Names {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(Names(text.split(',').map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect()))
    }
}

impl Names {
    /// Returns true if the name is selected. An empty selection selects everything.
    pub(crate) fn select(&self, name: &str) -> bool {
        self.0.is_empty() || self.0.iter().any(|pattern| matches(pattern, name))
    }

    /// Selected names that match none of `all`, most likely because they are misspelled.
    pub(crate) fn unknown<'a>(&'a self, all: &[&str]) -> Vec<&'a str> {
        let known = |pattern: &&String| all.iter().any(|name| matches(pattern, name));
        self.0.iter().filter(|p| !known(p)).map(String::as_str).collect()
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
        assert_eq!(names.unknown(&all), ["tinybv"]);
        assert!(Names::default().select("embree"));
    }
}
