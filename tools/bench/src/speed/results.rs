//! What `speed` measured, as it is written to JSON.

use crate::clock::Clock;
use crate::output::Head;
use crate::rays::View;
use crate::rivals::embree;
use crate::rounds::geometric_mean;
use crate::structures::{Compiled, Kind};
use crate::tracer::Contender;
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpeedResults {
    /// When and where.
    #[serde(flatten)]
    pub head: Head,
    /// In the order of the command line.
    pub models: Vec<ModelSpeeds>,
}

/// What was measured on a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelSpeeds {
    /// Name without folder.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Where the cameras stood; absent if the rays are those of a renderer.
    pub view: Option<View>,
    /// Rays of each set that was timed.
    pub rays: BTreeMap<&'static str, usize>,
    /// Of sets that start at hits: how many rays hit the triangle that they start on; of a set for any hit: how many hit
    /// nothing else.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub own_hits: BTreeMap<&'static str, usize>,
    /// Our compiled files.
    pub structures: Vec<CompiledFile>,
    /// What could not be measured, and why.
    pub left_out: Vec<LeftOut>,
    /// One for each number of threads.
    pub runs: Vec<ThreadsRun>,
}

/// A compiled file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CompiledFile {
    /// Its name in the tables.
    pub name: &'static str,
    /// Wall-clock seconds of the compiler, all cores.
    pub compile_s: f64,
    /// Bytes of the file.
    pub file_bytes: usize,
    /// Share of the model's triangles that are in tetrahedralizations.
    pub in_tets: f64,
}

impl CompiledFile {
    pub(super) fn of(kind: &Kind, compiled: &Compiled) -> CompiledFile {
        let (compile_s, in_tets) = (compiled.seconds, compiled.in_tets);
        CompiledFile { name: kind.name, compile_s, file_bytes: compiled.bytes.len(), in_tets }
    }
}

/// Something that could not be measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOut {
    /// Its name in the tables.
    pub name: String,
    /// The reason.
    pub why: String,
}

/// All tracers on so many threads.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ThreadsRun {
    /// Threads that traced.
    pub threads: usize,
    /// What a second is.
    pub clock: Clock,
    /// In the order of the tables.
    pub tracers: Vec<TracerSpeeds>,
}

/// A tracer's figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TracerSpeeds {
    /// Its name.
    pub name: String,
    /// Whether it is ours.
    pub ours: bool,
    /// Wall-clock seconds to compile or build.
    pub build_s: f64,
    /// Bytes that traversal reads, where that is known.
    pub bytes: Option<u64>,
    /// Millions of rays per second, by set; sets that it does not run are absent.
    pub mrays_per_s: BTreeMap<&'static str, f64>,
    /// Rays that it answers otherwise than the plain BVH, by set: for ours in any bit, for rivals in
    /// whether something is hit.
    pub differ: BTreeMap<&'static str, usize>,
    /// Rays of a renderer that hit another triangle than in the answer of the plain BVH, by set. A ray that passes through
    /// an edge may hit either triangle.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub other: BTreeMap<&'static str, usize>,
}

impl ThreadsRun {
    /// The contenders, without figures yet.
    pub(super) fn new(threads: usize, contenders: &[Contender]) -> ThreadsRun {
        let row = |c: &Contender| TracerSpeeds {
            name: c.name.clone(),
            ours: c.ours,
            build_s: c.build_s,
            bytes: c.bytes,
            mrays_per_s: BTreeMap::new(),
            differ: BTreeMap::new(),
            other: BTreeMap::new(),
        };
        ThreadsRun {
            threads,
            clock: Clock::for_threads(threads),
            tracers: contenders.iter().map(row).collect(),
        }
    }

    fn rate(&self, tracer: &str, set: &str) -> Option<f64> {
        self.tracers.iter().find(|t| t.name == tracer)?.mrays_per_s.get(set).copied()
    }

    /// A tracer's speed over that of Embree's single rays, if both ran.
    pub(super) fn ratio(&self, tracer: &str, set: &str) -> Option<f64> {
        Some(self.rate(tracer, set)? / self.rate(embree::NAME, set)?)
    }

    /// Names of our tracers with wrong answers.
    pub(super) fn wrong(&self) -> impl Iterator<Item = &str> {
        self.tracers.iter().filter(|t| t.ours && t.differ.values().any(|n| *n > 0)).map(|t| t.name.as_str())
    }
}

impl SpeedResults {
    /// Numbers of threads that were measured.
    pub(super) fn threads(&self) -> Vec<usize> {
        self.models.first().map_or(Vec::new(), |m| m.runs.iter().map(|r| r.threads).collect())
    }

    /// Runs of all models on so many threads.
    pub(super) fn runs(&self, threads: usize) -> impl Iterator<Item = &ThreadsRun> {
        self.models.iter().flat_map(|m| &m.runs).filter(move |r| r.threads == threads)
    }

    /// Names of the tracers that ran on any model, in the order of the tables.
    pub(super) fn tracers(&self, threads: usize) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for run in self.runs(threads) {
            // A tracer that earlier models lack comes after the one that precedes it here.
            let mut place = 0;
            for tracer in &run.tracers {
                match names.iter().position(|n| *n == tracer.name) {
                    Some(at) => place = at + 1,
                    None => {
                        names.insert(place, &tracer.name);
                        place += 1;
                    }
                }
            }
        }
        names
    }

    /// Geometric mean over the models of a tracer's ratio to Embree, and over how many models.
    pub(super) fn mean_ratio(&self, threads: usize, tracer: &str, set: &str) -> Option<(f64, usize)> {
        let ratios: Vec<f64> = self.runs(threads).filter_map(|r| r.ratio(tracer, set)).collect();
        Some((geometric_mean(ratios.iter().copied())?, ratios.len()))
    }
}
