//! What is compared: every structure, record and instruction set of ours, and the rivals.

use super::exact_answers::Geometry;
use crate::model::Model;
use crate::names::Names;
use crate::progress::Progress;
use crate::rivals::{F32_TESTS, RIVALS, Rival};
use crate::speed::results::LeftOut;
use crate::structures::{self, Compiled, Kind};
use crate::tracer::Contender;
use anyhow::Result;
use bth::Isa;
use std::rc::Rc;

/// A way to trace a model.
pub(super) struct MeasuredTracer {
    /// Its name in tables.
    pub(super) name: String,
    /// Its group, which has a colour in the charts.
    pub(super) group: &'static str,
    pub(super) contender: Rc<Contender>,
    /// The vector instructions of our structures; `None` for rivals.
    pub(super) isa: Option<Isa>,
    /// Row of [`MeasuredTracers::geometries`]: the triangles that it has.
    pub(super) geometry: usize,
    /// Whether every wrong answer is a fault.
    pub(super) exact: bool,
}

/// All tracers of a model.
pub(super) struct MeasuredTracers {
    pub(super) tracers: Vec<MeasuredTracer>,
    /// The triangles that tracers have: first those of the source, then those on grids.
    pub(super) geometries: Vec<Geometry>,
    pub(super) left_out: Vec<LeftOut>,
}

/// Groups of tracers, in the order of the legend.
pub(super) const GROUPS: [&str; 6] = ["bvh", "bth", "tets", "embree", "tinybvh", "others"];

fn group(name: &str) -> &'static str {
    GROUPS.into_iter().find(|group| name.starts_with(group)).unwrap_or("others")
}

/// Kinds that are measured with every instruction set, and not with the best only.
fn on_every_isa(kind: &Kind) -> bool {
    [structures::BVH.name, "tets link32"].contains(&kind.name)
}

/// Instruction sets of this machine, the best first.
fn isas() -> Vec<Isa> {
    Isa::ALL.into_iter().rev().filter(|isa| isa.is_available()).collect()
}

/// Our structures.
fn kinds() -> impl Iterator<Item = &'static Kind> {
    structures::KINDS.iter().chain(&structures::ON_GRID)
}

/// The rivals, and triangle tests in single precision.
fn rivals() -> impl Iterator<Item = &'static Rival> {
    RIVALS.iter().chain(&F32_TESTS)
}

/// Names of all, whether this machine has them or not.
pub(super) fn names() -> Vec<String> {
    let own = kinds().flat_map(|kind| {
        let others = Isa::ALL.into_iter().filter(|_| on_every_isa(kind));
        std::iter::once(kind.name.to_owned()).chain(others.map(|isa| format!("{} {isa}", kind.name)))
    });
    own.chain(rivals().map(|rival| rival.name.to_owned())).collect()
}

impl MeasuredTracers {
    /// Builds the selected tracers; lists those that cannot be built.
    pub(super) fn build(
        model: &Model,
        bvh: &Compiled,
        names: &Names,
        progress: &Progress,
    ) -> Result<MeasuredTracers> {
        let mut all = MeasuredTracers {
            tracers: Vec::new(),
            geometries: vec![Geometry::new(&bvh.bytes)?],
            left_out: Vec::new(),
        };
        // A model that cannot be tetrahedralized as a whole cannot with any record.
        let mut no_tets = None;
        for kind in kinds() {
            let uses = uses(kind, names);
            if uses.is_empty() {
                continue;
            }
            progress.show(format!("{}: compiling {}", model.name, kind.name));
            let compiled = match (&no_tets, kind.is_tets()) {
                (Some(why), true) => Err(anyhow::anyhow!("{why}")),
                _ if kind.name == structures::BVH.name => Ok(bvh.clone()),
                _ => structures::compile(model, kind),
            };
            match compiled {
                Ok(compiled) => all.add(kind, &compiled, uses)?,
                Err(error) => {
                    let why = format!("{error:#}");
                    if kind.is_tets() {
                        no_tets = Some(why.clone());
                    }
                    all.left_out.push(LeftOut { name: kind.name.to_owned(), why });
                }
            }
        }
        for rival in rivals().filter(|rival| names.select(rival.name)) {
            progress.show(format!("{}: building {}", model.name, rival.name));
            match rival.build(model, 1) {
                Ok(contender) => all.tracers.push(MeasuredTracer {
                    name: rival.name.to_owned(),
                    group: group(rival.name),
                    contender: Rc::new(contender),
                    isa: None,
                    geometry: 0,
                    exact: false,
                }),
                Err(error) => {
                    all.left_out.push(LeftOut { name: rival.name.to_owned(), why: format!("{error:#}") });
                }
            }
        }
        Ok(all)
    }

    fn add(&mut self, kind: &Kind, compiled: &Compiled, uses: Vec<(String, Isa)>) -> Result<()> {
        // The first is the batch.
        let Some(contender) = structures::contenders(kind, compiled)?.into_iter().next() else {
            return Ok(());
        };
        let contender = Rc::new(contender);
        if kind.is_on_grid() {
            self.geometries.push(Geometry::new(&compiled.bytes)?);
        }
        let geometry = if kind.is_on_grid() { self.geometries.len() - 1 } else { 0 };
        self.tracers.extend(uses.into_iter().map(|(name, isa)| MeasuredTracer {
            name,
            group: group(kind.name),
            contender: contender.clone(),
            isa: Some(isa),
            geometry,
            exact: true,
        }));
        Ok(())
    }
}

/// The selected ways to trace a structure: with the best instructions, and where it is to be, with the others.
fn uses(kind: &Kind, names: &Names) -> Vec<(String, Isa)> {
    let named = |(i, isa): (usize, Isa)| match i {
        0 => Some((kind.name.to_owned(), isa)),
        _ => on_every_isa(kind).then(|| (format!("{} {isa}", kind.name), isa)),
    };
    isas().into_iter().enumerate().filter_map(named).filter(|(name, _)| names.select(name)).collect()
}
