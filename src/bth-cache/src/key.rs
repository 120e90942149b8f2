//! Keys of results.

use crate::Digest;
use serde::{Deserialize, Serialize};

/// A stage, and by name all that its result depends on: content hashes, canonical options,
/// versions. Never paths, times or the order of arguments.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Key {
    stage: String,
    components: Vec<(String, String)>,
}

impl Key {
    /// A key without components.
    pub fn new(stage: impl Into<String>) -> Self {
        Self { stage: stage.into(), components: Vec::new() }
    }

    /// Adds a component.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, value: impl Into<String>) -> Self {
        self.components.push((name.into(), value.into()));
        self
    }

    /// Adds several.
    #[must_use]
    pub fn with_all<N: Into<String>, V: Into<String>>(
        mut self,
        components: impl IntoIterator<Item = (N, V)>,
    ) -> Self {
        self.components.extend(components.into_iter().map(|(n, v)| (n.into(), v.into())));
        self
    }

    /// The stage.
    pub fn stage(&self) -> &str {
        &self.stage
    }

    /// Names and values.
    pub fn components(&self) -> &[(String, String)] {
        &self.components
    }

    /// Hash of stage and components, each with its length before it, so that no two keys are
    /// written alike.
    pub fn id(&self) -> Digest {
        let mut hasher = blake3::Hasher::new();
        let mut add = |text: &str| {
            hasher.update(&(text.len() as u64).to_le_bytes()).update(text.as_bytes());
        };
        add("bth-cache key 1");
        add(&self.stage);
        for (name, value) in &self.components {
            add(name);
            add(value);
        }
        hasher.finalize().into()
    }

    /// What differs from an earlier key, as `name: old -> new`; hashes and long values are only
    /// named.
    pub fn differences(&self, earlier: &Key) -> Vec<String> {
        let find = |key: &Key, name: &str| -> Option<String> {
            key.components.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone())
        };
        let mut found = Vec::new();
        for (name, value) in &self.components {
            match find(earlier, name) {
                Some(old) if old == *value => {}
                Some(old) if is_short(&old) && is_short(value) => {
                    found.push(format!("{name}: {old} -> {value}"))
                }
                _ => found.push(name.clone()),
            }
        }
        let gone = earlier.components.iter().filter(|(name, _)| find(self, name).is_none());
        found.extend(gone.map(|(name, _)| name.clone()));
        found
    }
}

fn is_short(value: &str) -> bool {
    value.len() <= 24
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_id_depends_on_every_name_and_value_and_where_they_end() {
        let keys = [
            Key::new("a"),
            Key::new("b"),
            Key::new("a").with("x", "1"),
            Key::new("a").with("x", "2"),
            Key::new("a").with("y", "1"),
            Key::new("a").with("x1", ""),
            Key::new("a").with("", "x1"),
            Key::new("a").with("x", "1").with("y", "2"),
            Key::new("ax").with("1", ""),
        ];
        let mut ids: Vec<_> = keys.iter().map(Key::id).collect();
        ids.sort();
        ids.dedup();
        assert_eq!(ids.len(), keys.len());
        assert_eq!(Key::new("a").with("x", "1").id(), keys[2].id());
    }

    #[test]
    fn differences_name_what_changed() {
        let long = "0".repeat(64);
        let old = Key::new("a").with("quality", "fast").with("source", long.clone()).with("gone", "1");
        let new =
            Key::new("a").with("quality", "best").with("source", long.replace('0', "1")).with("new", "1");
        assert_eq!(new.differences(&old), ["quality: fast -> best", "source", "new", "gone"]);
        assert!(new.differences(&new).is_empty());
    }
}
