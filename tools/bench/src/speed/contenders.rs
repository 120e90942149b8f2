//! Compiles and builds all that is to be measured on a model.

use crate::model::Model;
use crate::names::Names;
use crate::ours::{self, Compiled, KINDS, Kind};
use crate::progress::Progress;
use crate::rivals::RIVALS;
use crate::speed::record::{LeftOut, Structure};
use crate::tracer::Contender;
use anyhow::Result;

/// What there is to say besides the figures.
pub(super) struct Notes {
    pub(super) structures: Vec<Structure>,
    pub(super) left_out: Vec<LeftOut>,
}

/// Builds the selected ones. What cannot be built is left out and noted.
pub(super) fn build(
    model: &Model,
    bvh: Compiled,
    names: &Names,
    threads: usize,
    progress: &Progress,
) -> Result<(Vec<Contender>, Notes)> {
    let mut built = Vec::new();
    let mut notes = Notes { structures: Vec::new(), left_out: Vec::new() };
    let selected = |k: &&Kind| k.uses().any(|(name, _)| names.select(&name));
    // A model without one tetrahedralization of the whole has it with no record.
    let mut no_tets = None;
    for kind in KINDS.iter().filter(selected) {
        progress.say(format!("{}: compiling {}", model.name, kind.name));
        let compiled = match (&no_tets, kind.is_tets()) {
            (Some(why), true) => Err(anyhow::anyhow!("{why}")),
            _ if kind.name == ours::BVH.name => Ok(bvh.clone()),
            _ => ours::compile(model, kind),
        };
        match compiled {
            Ok(compiled) => {
                notes.structures.push(Structure::of(kind, &compiled));
                built
                    .extend(ours::contenders(kind, &compiled)?.into_iter().filter(|c| names.select(&c.name)));
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
        progress.say(format!("{}: building {}", model.name, rival.name));
        match rival.build(model, threads) {
            Ok(contender) => built.push(contender),
            Err(error) => {
                notes.left_out.push(LeftOut { name: rival.name.to_owned(), why: format!("{error:#}") });
            }
        }
    }
    Ok((built, notes))
}
