//! Names of the things of one kind in a manifest, none of which comes twice.

use std::collections::{HashMap, HashSet};

/// The names of one kind that are taken.
#[derive(Default)]
pub(super) struct Names {
    taken: HashSet<String>,
    /// For names that came again the number that is tried next behind them; with those below they are taken. Documents may have
    /// thousands of nodes of one name, for each of which trying all numbers would take long.
    next: HashMap<String, u64>,
}

impl Names {
    /// The given name or else the fallback, without control characters and with a number if it is taken already. From now on it
    /// is taken.
    pub(super) fn unique(&mut self, given: &str, fallback: String) -> String {
        let base: String = given.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let base = if base.is_empty() { fallback } else { base };
        if self.taken.insert(base.clone()) {
            return base;
        }
        let mut number = self.next.get(&base).copied().unwrap_or(2);
        loop {
            let name = format!("{base} {number}");
            if self.taken.insert(name.clone()) {
                self.next.insert(base, number + 1);
                return name;
            }
            number += 1;
        }
    }

    /// Gives a name free.
    pub(super) fn remove(&mut self, name: &str) {
        self.taken.remove(name);
        self.next.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_taken_get_the_least_number_that_is_free() {
        let mut names = Names::default();
        let mut of = |given: &str| names.unique(given, "mesh 0".to_owned());
        assert_eq!(
            ["a", "a 3", "a", "a", "a", "a 2"].map(&mut of),
            ["a", "a 3", "a 2", "a 4", "a 5", "a 2 2"]
        );
        assert_eq!(["", "", "b\n", "b "].map(&mut of), ["mesh 0", "mesh 0 2", "b ", "b  2"]);
        names.remove("a 4");
        assert_eq!([names.unique("a", String::new()), names.unique("a", String::new())], ["a 4", "a 6"]);
    }

    #[test]
    fn many_equal_names_are_quick() {
        let mut names = Names::default();
        let start = std::time::Instant::now();
        for _ in 0..100_000 {
            names.unique("Body", String::new());
        }
        assert_eq!(names.unique("Body", String::new()), "Body 100001");
        // Trying all numbers for each takes minutes.
        assert!(start.elapsed().as_secs() < 10);
    }
}
