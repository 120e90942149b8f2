//! Work that is shared out over machines.

/// Piece `number` of `of` pieces of work, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// 1 to `of`.
    pub number: u32,
    /// Number of pieces, at least 1.
    pub of: u32,
}

impl Shard {
    /// Returns true if the shard does this work, of a list that is counted from 0.
    #[must_use]
    pub fn has(self, work: u64) -> bool {
        work % u64::from(self.of) + 1 == u64::from(self.number)
    }

    /// The shard that has the same work of a list that begins later.
    #[must_use]
    pub fn from(self, first: u64) -> Self {
        let (number, of) = (u64::from(self.number), u64::from(self.of));
        Self { number: ((number + of - 1 - first % of) % of + 1) as u32, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_work_belongs_to_one_shard_of_a_list_and_of_its_rest() {
        for of in [1, 2, 7, u32::MAX] {
            for (first, work) in (0..20).flat_map(|first| (0..20).map(move |work| (first, work))) {
                let shards = (1..=of).take(40).map(|number| Shard { number, of });
                let has = |shard: &Shard| shard.has(first + work);
                let found: Vec<_> = shards.clone().filter(has).collect();
                assert_eq!(found.len(), 1);
                assert_eq!(shards.filter(|shard| shard.from(first).has(work)).collect::<Vec<_>>(), found);
            }
        }
    }
}
