//! Selections of tracers and ray sets by name (`--tracer`, `--set`).

use std::str::FromStr;

/// Names separated by commas; one that ends in a star stands for all that begin so.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names(Vec<String>);

impl FromStr for Names {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(Names(text.split(',').map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect()))
    }
}

impl Names {
    /// Whether the name is selected. An empty selection selects everything.
    pub fn select(&self, name: &str) -> bool {
        self.0.is_empty() || self.0.iter().any(|pattern| matches(pattern, name))
    }

    /// Selected names that match none of `all`, most likely because they are misspelled.
    pub fn unknown<'a>(&'a self, all: &[&str]) -> Vec<&'a str> {
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
    fn no_names_select_everything() {
        assert!(Names::default().select("embree"));
    }

    #[test]
    fn a_star_stands_for_any_ending() {
        let names: Names = "embree, bth*".parse().unwrap();
        let selected = ["embree", "embree robust", "bth", "bth start", "bvh"].map(|n| names.select(n));
        assert_eq!(selected, [true, false, true, true, false]);
    }

    #[test]
    fn misspelled_names_are_found() {
        let names: Names = "embre,bth*".parse().unwrap();
        assert_eq!(names.unknown(&["embree", "bth", "bth start"]), ["embre"]);
    }
}
