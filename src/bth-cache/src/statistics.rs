//! Hits, misses and evictions, summed over all processes that used a store.

use crate::files::Files;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, Write};

/// A longer file is summed into one line, in bytes.
const LONG: u64 = 64 << 10;

/// Counts of events in a store. A killed process loses its own counts.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Statistics {
    /// Results that the store had, by stage.
    pub hits: BTreeMap<String, u64>,
    /// Results that the store did not have, by stage and by the component of the key that differed
    /// from the source's last key; `new` for sources never seen, `evicted` for keys that had been
    /// there.
    pub misses: BTreeMap<String, BTreeMap<String, u64>>,
    /// Hits that the shared store answered.
    pub shared_hits: u64,
    /// Contents that were written.
    pub stored: u64,
    /// Their bytes.
    pub stored_bytes: u64,
    /// Contents that were evicted.
    pub evictions: u64,
    /// Their bytes.
    pub evicted_bytes: u64,
    /// Damaged entries that were found and removed.
    pub damaged: u64,
}

impl Statistics {
    pub(crate) fn hit(&mut self, stage: &str, hits: u64) {
        *self.hits.entry(stage.to_owned()).or_default() += hits;
    }

    pub(crate) fn miss(&mut self, stage: &str, reasons: &[String]) {
        let stage = self.misses.entry(stage.to_owned()).or_default();
        for reason in reasons {
            let name = reason.split(':').next().unwrap_or_default();
            *stage.entry(name.to_owned()).or_default() += 1;
        }
    }

    fn add(&mut self, other: Statistics) {
        for (stage, count) in other.hits {
            *self.hits.entry(stage).or_default() += count;
        }
        for (stage, reasons) in other.misses {
            let mine = self.misses.entry(stage).or_default();
            for (reason, count) in reasons {
                *mine.entry(reason).or_default() += count;
            }
        }
        self.shared_hits += other.shared_hits;
        self.stored += other.stored;
        self.stored_bytes += other.stored_bytes;
        self.evictions += other.evictions;
        self.evicted_bytes += other.evicted_bytes;
        self.damaged += other.damaged;
    }

    /// Adds this to the counters of the store.
    pub(crate) fn append(&self, files: &Files) -> std::io::Result<()> {
        if *self == Self::default() {
            return Ok(());
        }
        let path = files.statistics();
        let mut file = File::options().read(true).append(true).create(true).open(path)?;
        // Without locks lines may mix; the reader skips mixed lines.
        let _ = file.lock();
        if file.metadata()?.len() > LONG {
            let mut sum = Self::sum(&mut file)?;
            sum.add(self.clone());
            file.set_len(0)?;
            return file.write_all(sum.line()?.as_bytes());
        }
        file.write_all(self.line()?.as_bytes())
    }

    /// The counters of the store.
    pub(crate) fn read(files: &Files) -> Self {
        File::open(files.statistics()).and_then(|mut file| Self::sum(&mut file)).unwrap_or_default()
    }

    fn line(&self) -> std::io::Result<String> {
        Ok(serde_json::to_string(self)? + "\n")
    }

    fn sum(file: &mut File) -> std::io::Result<Self> {
        let mut text = Vec::new();
        file.rewind()?;
        file.read_to_end(&mut text)?;
        let mut sum = Self::default();
        let lines = text.split(|b| *b == b'\n').filter_map(|line| serde_json::from_slice(line).ok());
        lines.for_each(|line| sum.add(line));
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_over_processes_and_damaged_lines_are_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let files = Files::open(folder.path()).unwrap();
        let mut one = Statistics { stored: 1, ..Statistics::default() };
        one.hit("bvh", 1);
        one.miss("tets", &["quality: fast -> best".to_owned(), "source".to_owned()]);
        let mut expected = Statistics::default();
        for round in 0..1000 {
            one.append(&files).unwrap();
            expected.add(one.clone());
            if round == 10 {
                let mut file = File::options().append(true).open(files.statistics()).unwrap();
                file.write_all(b"{\"stored\": \n").unwrap();
            }
        }
        assert_eq!(Statistics::read(&files), expected);
        assert_eq!(expected.misses["tets"]["quality"], 1000);
        assert!(std::fs::metadata(files.statistics()).unwrap().len() <= LONG + 1000);
    }
}
