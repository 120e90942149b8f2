//! What `accuracy` measured, as it is written to JSON.

use super::defects::{Defects, ErrorQuantiles};
use crate::output::Head;
use crate::rounds::geometric_mean;
use crate::speed::results::LeftOut;
use serde::Serialize;
use std::collections::BTreeMap;

/// Ordinary sets: the run time of a tracer is the geometric mean over these.
pub const ORDINARY: [&str; 3] = ["primary", "diffuse-beside", "random"];
/// Sets of rays that pass exactly through vertices and edges.
pub const AIMED: [&str; 2] = ["vertices", "edges"];

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AccuracyResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// In the order of the command line.
    pub models: Vec<ModelErrors>,
}

/// What was measured on a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelErrors {
    /// Its name.
    pub name: String,
    /// Its triangles.
    pub triangles: usize,
    /// Rays of the sets.
    pub rays: BTreeMap<&'static str, usize>,
    /// The tracers.
    pub tracers: Vec<Errors>,
    /// What could not be measured.
    pub left_out: Vec<LeftOut>,
}

/// A tracer's run time and errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Its name.
    pub name: String,
    /// Its group, which has a colour in the charts.
    pub group: &'static str,
    /// Bytes that traversal reads, per triangle, where that is known.
    pub bytes_per_triangle: Option<f64>,
    /// Nanoseconds a ray, by set.
    pub nanoseconds: BTreeMap<&'static str, f64>,
    /// Wrong answers to ordinary rays, against the geometry that is stored.
    pub ordinary: Defects,
    /// Wrong answers to aimed rays.
    pub aimed: Defects,
    /// Errors of t against the source, relative to t.
    pub t_relative: ErrorQuantiles,
    /// The same errors in units of the last place.
    pub t_ulp: ErrorQuantiles,
    /// Root mean square error of the picture, of a brightness from 0 to 1.
    pub rmse: f64,
    /// 1 - SSIM of the picture.
    pub dissimilarity: f64,
}

impl Errors {
    /// Geometric mean of nanoseconds over the ordinary sets.
    pub fn mean_nanoseconds(&self) -> f64 {
        let sets = ORDINARY.iter().filter_map(|set| self.nanoseconds.get(set)).copied();
        geometric_mean(sets).unwrap_or(f64::NAN)
    }
}

/// A tracer over all models that it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct TracerSummary<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its group, which has a colour in the charts.
    pub group: &'static str,
    /// Number of models.
    pub models: usize,
    /// Geometric means.
    pub nanoseconds: f64,
    /// Geometric mean, where known on all.
    pub bytes_per_triangle: Option<f64>,
    /// Sums over the models.
    pub ordinary: Defects,
    /// Sums over the models.
    pub aimed: Defects,
    /// The greatest of the models' 99 %.
    pub t_relative: f64,
    /// The greatest of all, in units of the last place.
    pub t_ulp: f64,
    /// The greatest of the models.
    pub rmse: f64,
    /// The greatest of the models.
    pub dissimilarity: f64,
}

impl AccuracyResults {
    /// Every tracer over all models, in the order of the first that has it.
    pub fn summaries(&self) -> Vec<TracerSummary<'_>> {
        let mut names: Vec<&str> = Vec::new();
        for tracer in self.models.iter().flat_map(|m| &m.tracers) {
            if !names.contains(&tracer.name.as_str()) {
                names.push(&tracer.name);
            }
        }
        names.into_iter().filter_map(|name| self.summary(name)).collect()
    }

    fn summary<'a>(&'a self, name: &'a str) -> Option<TracerSummary<'a>> {
        let rows: Vec<&Errors> =
            self.models.iter().flat_map(|m| &m.tracers).filter(|t| t.name == name).collect();
        let most = |value: fn(&Errors) -> f64| rows.iter().map(|r| value(r)).fold(0.0, f64::max);
        let sum = |defects: fn(&Errors) -> &Defects| {
            let mut sum = Defects::default();
            rows.iter().for_each(|row| sum.add(defects(row)));
            sum
        };
        let bytes: Option<Vec<f64>> = rows.iter().map(|r| r.bytes_per_triangle).collect();
        Some(TracerSummary {
            name,
            group: rows.first()?.group,
            models: rows.len(),
            nanoseconds: geometric_mean(rows.iter().map(|r| r.mean_nanoseconds()))?,
            bytes_per_triangle: bytes.and_then(geometric_mean),
            ordinary: sum(|r| &r.ordinary),
            aimed: sum(|r| &r.aimed),
            t_relative: most(|r| r.t_relative.most),
            t_ulp: most(|r| r.t_ulp.max),
            rmse: most(|r| r.rmse),
            dissimilarity: most(|r| r.dissimilarity),
        })
    }
}
