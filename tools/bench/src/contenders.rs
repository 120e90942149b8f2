//! Compiles and builds the tracers of a model, and notes those that cannot be built.

use crate::model::Model;
use crate::names::Names;
use crate::output::progress;
use crate::report::{Report, Subject};
use crate::rivals::RIVALS;
use crate::structures::{self, Compiled, Kind};
use crate::tracer::Contender;
use anyhow::Result;

/// Builds the selected structures of ours and the selected rivals, which use `threads` threads if
/// they can.
pub(crate) fn build(
    model: &Model,
    kinds: &[Kind],
    bvh: &Compiled,
    names: &Names,
    threads: usize,
    report: &mut Report,
) -> Result<Vec<Contender>> {
    let mut built = Vec::new();
    // A model that cannot be tetrahedralized as a whole cannot with any record.
    let mut no_tets = false;
    for kind in kinds {
        if !kind.uses().any(|(name, _)| names.select(&name)) || no_tets && kind.is_tets() {
            continue;
        }
        progress(format!("{}: compiling {}", model.name, kind.name));
        let compiled = if kind.name == structures::BVH.name {
            Ok(bvh.clone())
        } else {
            structures::compile(model, kind)
        };
        match compiled {
            Ok(compiled) => {
                let ours = structures::contenders(kind, &compiled)?;
                built.extend(ours.into_iter().filter(|c| names.select(&c.name)));
            }
            Err(error) => {
                no_tets |= kind.is_tets();
                report.leave_out(&model.name, kind.name, &error);
            }
        }
    }
    for rival in RIVALS.iter().filter(|r| names.select(r.name)) {
        progress(format!("{}: building {}", model.name, rival.name));
        match rival.build(model, threads) {
            Ok(contender) => built.push(contender),
            Err(error) => report.leave_out(&model.name, rival.name, &error),
        }
    }
    Ok(built)
}

/// Adds what is known of contenders before they trace: seconds to build and bytes per triangle.
pub(crate) fn add_sizes(report: &mut Report, model: &Model, threads: usize, contenders: &[Contender]) {
    for contender in contenders {
        let of = contender.subject(model, threads);
        report.add(&of, "build", contender.build_s, "s");
        if let Some(bytes) = contender.bytes {
            report.add(&of, "bytes", bytes as f64 / model.triangles() as f64, "B/triangle");
        }
    }
}

impl Contender {
    /// What figures of this contender belong to.
    pub(crate) fn subject<'a>(&'a self, model: &'a Model, threads: usize) -> Subject<'a> {
        Subject { engine: &self.name, ours: self.ours, model: &model.name, threads }
    }
}
