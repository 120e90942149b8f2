//! Compiles and builds the tracers that are measured on a model.

use crate::model::Model;
use crate::names::Names;
use crate::progress::Progress;
use crate::rivals::RIVALS;
use crate::speed::results::{CompiledFile, LeftOut};
use crate::structures::{self, Compiled, KINDS, Kind};
use crate::tracer::Contender;
use anyhow::Result;

/// What was compiled, and what could not be built.
pub(super) struct BuildNotes {
    pub(super) structures: Vec<CompiledFile>,
    pub(super) left_out: Vec<LeftOut>,
}

/// Builds the selected tracers; lists those that cannot be built.
pub(super) fn build(
    model: &Model,
    bvh: Compiled,
    names: &Names,
    threads: usize,
    progress: &Progress,
) -> Result<(Vec<Contender>, BuildNotes)> {
    let mut built = Vec::new();
    let mut notes = BuildNotes { structures: Vec::new(), left_out: Vec::new() };
    let selected = |k: &&Kind| k.uses().any(|(name, _)| names.select(&name));
    // A model that cannot be tetrahedralized as a whole cannot with any record.
    let mut no_tets = None;
    for kind in KINDS.iter().filter(selected) {
        progress.show(format!("{}: compiling {}", model.name, kind.name));
        let compiled = match (&no_tets, kind.is_tets()) {
            (Some(why), true) => Err(anyhow::anyhow!("{why}")),
            _ if kind.name == structures::BVH.name => Ok(bvh.clone()),
            _ => structures::compile(model, kind),
        };
        match compiled {
            Ok(compiled) => {
                notes.structures.push(CompiledFile::of(kind, &compiled));
                built.extend(
                    structures::contenders(kind, &compiled)?.into_iter().filter(|c| names.select(&c.name)),
                );
            }
            Err(error) => {
                let why = format!("{error:#}");
                if kind.is_tets() {
                    no_tets = Some(why.clone());
                }
                notes.left_out.push(LeftOut { name: kind.name.to_owned(), why });
            }
        }
    }
    for rival in RIVALS.iter().filter(|r| names.select(r.name)) {
        progress.show(format!("{}: building {}", model.name, rival.name));
        match rival.build(model, threads) {
            Ok(contender) => built.push(contender),
            Err(error) => {
                notes.left_out.push(LeftOut { name: rival.name.to_owned(), why: format!("{error:#}") });
            }
        }
    }
    Ok((built, notes))
}
