//! A map from objects to what deforms them. Rows stand in the order of objects: they are few or come in this order, so a tree or a hash
//! table would gain nothing.

/// A map from indices of objects.
#[derive(Debug)]
pub(super) struct ByObject<T> {
    /// Sorted by the object; each occurs once.
    rows: Vec<(u32, T)>,
}

// Not derived, as `T` needs no default.
impl<T> Default for ByObject<T> {
    fn default() -> Self {
        ByObject { rows: Vec::new() }
    }
}

impl<T> ByObject<T> {
    /// Sets the value of an object.
    pub(super) fn insert(&mut self, object: u32, value: T) {
        match self.rows.binary_search_by_key(&object, |row| row.0) {
            Ok(at) => self.rows[at].1 = value,
            Err(at) => self.rows.insert(at, (object, value)),
        }
    }

    /// Sets the values of objects.
    pub(super) fn extend(&mut self, rows: impl IntoIterator<Item = (u32, T)>) {
        for (object, value) in rows {
            self.insert(object, value);
        }
    }

    /// The value of an object.
    pub(super) fn get(&self, object: u32) -> Option<&T> {
        let at = self.rows.binary_search_by_key(&object, |row| row.0).ok()?;
        Some(&self.rows[at].1)
    }

    /// All objects with their values, in the order of objects.
    pub(super) fn rows(&self) -> &[(u32, T)] {
        &self.rows
    }

    /// The objects from `first` to before `end`.
    pub(super) fn range(&self, first: u32, end: u32) -> &[(u32, T)] {
        let at = |object: u32| self.rows.partition_point(|row| row.0 < object);
        &self.rows[at(first)..at(end.max(first))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;
    use std::collections::BTreeMap;

    #[test]
    fn rows_are_those_of_an_ordered_map() {
        let mut rng = Rng::new(5);
        for _ in 0..if cfg!(miri) { 3 } else { 50 } {
            let (mut map, mut expected) = (ByObject::default(), BTreeMap::new());
            for value in 0..rng.below(60) {
                let object = rng.below(40) as u32;
                map.insert(object, value);
                expected.insert(object, value);
                assert_eq!(map.rows(), expected.iter().map(|(k, v)| (*k, *v)).collect::<Vec<_>>());
            }
            let mut extended = ByObject::default();
            extended.extend(map.rows().iter().rev().copied());
            assert_eq!(extended.rows(), map.rows());
            for object in 0..41 {
                assert_eq!(map.get(object), expected.get(&object));
                let end = object + rng.below(20) as u32;
                let range: Vec<_> = expected.range(object..end).map(|(k, v)| (*k, *v)).collect();
                assert_eq!(map.range(object, end), range);
            }
            assert_eq!(map.range(7, 3), []);
        }
    }
}
