//! Makes the rows of deformers and skins from a manifest, and checks that they fit the objects that
//! they deform.

use crate::error::{Error, Place, Result};
use crate::write::DeformerParts;
use bth_format::layout::{Deformation, Deformer, NONE, Skin, SkinJoint};
use bth_scene::Manifest;
use std::path::Path;

/// The identity, as rows of four.
const IDENTITY: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Encodes the deformers of objects that are in the file, with all skins if there are any such.
/// `row_of` gives the rows of nodes, `objects` the numbers of objects in the file.
pub(super) fn encode(manifest: &Manifest, row_of: &[u32], objects: &[Option<u32>]) -> DeformerParts {
    let used = manifest.deformers.iter().filter_map(|d| Some((d, objects[d.object]?)));
    let mut used: Vec<_> = used.collect();
    used.sort_by_key(|(deformer, _)| row_of[deformer.node]);
    let mut parts = DeformerParts::default();
    if used.is_empty() {
        return parts;
    }
    for (deformer, object) in used {
        parts.deformers.push(Deformer {
            node: row_of[deformer.node],
            object,
            skin: deformer.skin.map_or(NONE, |skin| skin as u32),
            weights: deformer.weights.len() as u32,
            first_weight: parts.weights.len() as u32,
            reserved: [0; 3],
        });
        parts.weights.extend(&deformer.weights);
    }
    for skin in &manifest.skins {
        let (first_joint, joints) = (parts.joints.len() as u32, skin.joints.len() as u32);
        parts.skins.push(Skin { first_joint, joints, reserved: [0; 2] });
        for (joint, node) in skin.joints.iter().enumerate() {
            let rows = skin.inverse_binds.as_ref().map_or(IDENTITY, |all| all[joint]);
            let mut inverse_bind = [0.0; 12];
            inverse_bind.copy_from_slice(rows.as_flattened());
            parts.joints.push(SkinJoint { inverse_bind, node: row_of[*node], reserved: [0; 3] });
        }
    }
    parts
}

/// Refuses deformers that do not fit their objects. `deformation` gives for an object of the file
/// what can move its vertices; `name` is the scene's name in messages.
///
/// # Errors
/// `BTH-I052`, with the node of the deformer.
pub(super) fn check(
    manifest: &Manifest,
    objects: &[Option<u32>],
    name: &Path,
    deformation: &dyn Fn(u32) -> Option<Deformation>,
) -> Result<()> {
    for deformer in &manifest.deformers {
        let Some(number) = objects[deformer.object] else { continue };
        let object = &manifest.objects[deformer.object].name;
        let refused = |message: String, hint: &str| {
            let part = format!("deformer of node \"{}\"", manifest.nodes.name(deformer.node).escape_debug());
            let place = Place::Part(name.to_owned(), part);
            Err(Error::Input { code: "BTH-I052", place, message, hint: hint.to_owned() })
        };
        let Some(counts) = deformation(number) else {
            let message = format!("expected an object whose vertices can be moved, found \"{object}\"");
            return refused(message, "give the object the key `deforms`");
        };
        let (given, targets) = (deformer.weights.len(), counts.targets);
        if given as u64 != u64::from(targets) {
            let message = format!("expected a weight for each of {targets} morph targets, found {given}");
            return refused(message, "give as many weights as the object has targets");
        }
        let joints = deformer.skin.map_or(0, |skin| manifest.skins[skin].joints.len());
        let (needed, skinned) = (counts.joints, deformer.skin.is_some());
        if skinned && (needed == 0 || joints < needed as usize) {
            let message = format!(
                "expected a skin that fits the joints of \"{object}\", whose vertices refer to {needed}; it has {joints}"
            );
            return refused(message, "export the model again, or compile it at rest with --at-rest");
        }
    }
    Ok(())
}
