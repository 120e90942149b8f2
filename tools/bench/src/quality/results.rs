//! What `quality` measured, as it is written to JSON.

use crate::output::Head;
use crate::rays::View;
use crate::rounds::geometric_mean;
use serde::Serialize;
use std::collections::BTreeMap;

/// Ray sets of which the visited nodes and leaves are counted.
pub(super) const STEPS_OF: [&str; 2] = ["primary", "diffuse-beside"];

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualityResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// In the order of the command line.
    pub models: Vec<ModelQuality>,
}

/// What was measured on a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelQuality {
    /// Name without folder.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Where the cameras stand.
    pub view: View,
    /// The variations; the first is the builder that compiled files are made with.
    pub rows: Vec<VariationRow>,
}

/// What was measured of a variation of the builder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariationRow {
    /// Its name.
    pub name: String,
    /// CPU seconds to build and collapse, on one thread.
    pub seconds: f64,
    /// Nodes of the binary BVH that a random line through the box meets.
    pub visits: f64,
    /// Wide nodes and leaves that a random line through the box meets.
    pub wide_visits: [f64; 2],
    /// Children of a wide node, on average.
    pub children: f64,
    /// Triangles of a leaf, on average.
    pub triangles: f64,
    /// References in leaves over triangles.
    pub references: f64,
    /// Bytes that tracing reads, for each triangle.
    pub bytes: f64,
    /// Nodes and leaves that a camera ray and a bounce visit, each traced on its own.
    pub steps: BTreeMap<&'static str, [f64; 2]>,
    /// Nanoseconds a ray of each set, in batches.
    pub nanoseconds: BTreeMap<&'static str, f64>,
    /// Answers that differ from those of the first row in any bit.
    pub differ: usize,
}

impl QualityResults {
    /// Names of the sets that were measured.
    pub fn sets(&self) -> Vec<&'static str> {
        let mut all: Vec<&'static str> = crate::rays::NAMES.to_vec();
        let measured = |set: &&'static str| {
            self.models.iter().flat_map(|m| &m.rows).any(|row| row.nanoseconds.contains_key(set))
        };
        all.retain(measured);
        all
    }

    /// Geometric mean over the models of a figure of a row, divided by that of the first row.
    pub fn ratio(&self, row: usize, of: impl Fn(&VariationRow) -> Option<f64>) -> Option<f64> {
        let ratio = |m: &ModelQuality| Some(of(m.rows.get(row)?)? / of(m.rows.first()?)?);
        geometric_mean(self.models.iter().filter_map(ratio))
    }

    /// Geometric mean over models and sets of a row's time over that of the first.
    pub fn time_ratio(&self, row: usize) -> Option<f64> {
        geometric_mean(
            self.sets().into_iter().filter_map(|set| self.ratio(row, |r| r.nanoseconds.get(set).copied())),
        )
    }
}
