//! Choice of the nodes to tetrahedralize, by structure: none, those with a gain, or the root.

use super::traced::TracedMesh;
use crate::costs::{self, CostReport};
use crate::error::{Error, Place, Result};
use crate::marks::{self, Marks};
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::stage::Stage;
use std::path::Path;

/// Chooses the nodes, in ascending order.
pub(super) struct ChooseNodes<'a> {
    pub(super) source: &'a Path,
    pub(super) traced: &'a TracedMesh,
    /// Without marks, only what is decided without them: the empty choice where no node would be
    /// chosen even if all were free of bad contacts, as with most models and profiles.
    pub(super) marks: Option<&'a Marks>,
    pub(super) options: &'a CompileOptions,
}

impl Stage for ChooseNodes<'_> {
    type Output = Option<(Vec<u32>, Option<CostReport>)>;
    const NAME: &'static str = "costs";
    const VERSION: &'static str = "5";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { source, traced, marks, options } = self;
        let (mesh, tree) = (&traced.mesh, &traced.tree);
        let found = match (options.structure, marks) {
            (Structure::Bth, Some(marks)) => {
                let (chosen, report) = costs::choose(mesh, tree, marks, &options.costs, monitor)?;
                Some((chosen, Some(report)))
            }
            (Structure::Bth, None) if options.costs.more_suitable_gain_more() => {
                let (chosen, report) = costs::choose_of_all(mesh, tree, &options.costs, monitor)?;
                chosen.is_empty().then_some((chosen, Some(report)))
            }
            (Structure::Tets, Some(marks)) => match marks.suitable.first() {
                Some(true) => Some((vec![0], None)),
                Some(false) => {
                    return Err(bad_contacts(source, &marks::bad_pairs(mesh, tree, monitor)?, mesh));
                }
                None => Some((Vec::new(), None)),
            },
            (Structure::Bth | Structure::Tets, None) => None,
            (Structure::Bvh, _) => Some((Vec::new(), None)),
        };
        Ok(found)
    }
}

fn bad_contacts(source: &Path, contacts: &marks::BadPairs, mesh: &bth_import::Mesh) -> Error {
    let message = format!(
        "the model cannot be tetrahedralized whole: {} of its {} triangles are in {} bad contacts (they cross, overlap or touch other than at common vertices and edges)",
        contacts.triangles.len(),
        mesh.triangles.len(),
        contacts.pairs
    );
    unusable(source, message, "repair the model (`bthc marks` lists the triangles), or use --structure bth")
}

/// The error for a model that cannot be tetrahedralized whole.
pub(super) fn unusable(source: &Path, message: String, hint: &str) -> Error {
    Error::Input { code: "BTH-I080", place: Place::File(source.into()), message, hint: hint.into() }
}
