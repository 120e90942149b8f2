//! The deformers of a scene and their skins: BTH-F180 to BTH-F184 and BTH-F186.

use super::rows::{RowResult, check_fields, check_rows, violation};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::view::SceneView;
use std::mem::offset_of;

/// Returns for an object its row of `DEFORMATION`, if it has one, and whether a deformer can move
/// it: the object is deformable or cannot be hit, and it has no frames.
pub(crate) type DeformationOf<'a> = &'a dyn Fn(u32) -> (Option<Deformation>, bool);

/// Checks the deformers and skins of a scene whose nodes have been checked; `objects` is the number
/// of objects.
pub(super) fn check(view: &SceneView<'_>, objects: u32, deformation: DeformationOf<'_>) -> Result<()> {
    skins(view)?;
    check_rows(kind::SKIN_JOINTS, view.skin_joints, |_, joint| self::joint(view, joint))?;
    deformers(view, objects, deformation)?;
    distinct_objects(view)?;
    match view.morph_weights.iter().position(|weight| !weight.is_finite()) {
        None => Ok(()),
        Some(row) => {
            let (at, found) = (8 * row as u64, format!("{}", view.morph_weights[row]));
            Err(Error::within_file(Code::MorphWeights, kind::MORPH_WEIGHTS, at, "a finite weight", found))
        }
    }
}

/// BTH-F183.
fn skins(view: &SceneView<'_>) -> Result<()> {
    let mut end = 0u64;
    for (row, skin) in view.skins.iter().enumerate() {
        let starts = u64::from(skin.first_joint) == end;
        end += u64::from(skin.joints);
        if !starts || skin.joints == 0 || end > view.skin_joints.len() as u64 || skin.reserved != [0; 2] {
            let at = (size_of::<Skin>() * row) as u64;
            let expected = "joints behind those before within SKIN_JOINTS, at least one, and zeros";
            return Err(Error::within_file(Code::Skin, kind::SKINS, at, expected, format!("{skin:?}")));
        }
    }
    cover(Code::Skin, kind::SKIN_JOINTS, size_of::<SkinJoint>(), end, view.skin_joints.len())
}

/// BTH-F184.
fn joint(view: &SceneView<'_>, joint: &SkinJoint) -> RowResult<()> {
    check_fields!(SkinJoint {
        SkinJoint node: (joint.node as usize) < view.nodes.len(), "a row of NODES", joint.node;
        SkinJoint inverse_bind: joint.inverse_bind.iter().all(|x| x.is_finite()),
            "a finite matrix", joint.inverse_bind;
        SkinJoint reserved: joint.reserved == [0; 3], "zeros", joint.reserved;
    });
    Ok(())
}

/// BTH-F180 without distinct objects, BTH-F181, BTH-F182 without the weights themselves, and
/// BTH-F186.
fn deformers(view: &SceneView<'_>, objects: u32, deformation: DeformationOf<'_>) -> Result<()> {
    let mut end = 0u64;
    check_rows(kind::DEFORMERS, view.deformers, |row, deformer| {
        let follows = row == 0 || view.deformers[row - 1].node < deformer.node;
        let there = (deformer.node as usize) < view.nodes.len() && deformer.object < objects;
        let (counts, can_move) = if there { deformation(deformer.object) } else { (None, false) };
        let Some(counts) = counts.filter(|_| follows && deformer.reserved == [0; 3]) else {
            let expected = "ascending nodes, an object with DEFORMATION, and zeros";
            return violation(Code::Deformer, 0, expected, deformer);
        };
        let joints = view.skins.get(deformer.skin as usize).map(|skin| skin.joints);
        let fits = |joints: u32| counts.joints > 0 && counts.joints <= joints;
        check_fields!(Deformer {
            DeformerObject object: can_move,
                "an object with LEAF_VERTICES and without SEQUENCE_TIMES", deformer.object;
            DeformerSkin skin: deformer.skin == NONE || joints.is_some_and(fits),
                "NONE, or a skin with the joints of an object that has some", deformer.skin;
        });
        Ok(())
    })?;
    check_rows(kind::DEFORMERS, view.deformers, |_, deformer| {
        let targets = deformation(deformer.object).0.map_or(0, |counts| counts.targets);
        check_fields!(Deformer {
            MorphWeights weights: deformer.weights == targets, "a weight for each target", deformer.weights;
        });
        Ok(())
    })?;
    for (row, deformer) in view.deformers.iter().enumerate() {
        let starts = u64::from(deformer.first_weight) == end;
        end += u64::from(deformer.weights);
        if !starts || end > view.morph_weights.len() as u64 {
            let at = (size_of::<Deformer>() * row + offset_of!(Deformer, first_weight)) as u64;
            let (expected, found) =
                ("weights behind those before within MORPH_WEIGHTS", format!("{deformer:?}"));
            return Err(Error::within_file(Code::MorphWeights, kind::DEFORMERS, at, expected, found));
        }
    }
    cover(Code::MorphWeights, kind::MORPH_WEIGHTS, 8, end, view.morph_weights.len())
}

/// BTH-F180: no two deformers have the same object.
fn distinct_objects(view: &SceneView<'_>) -> Result<()> {
    // An object in the upper half of a key, a row in the lower.
    let mut keys: Vec<u64> =
        view.deformers.iter().zip(0..).map(|(d, row)| u64::from(d.object) << 32 | row).collect();
    keys.sort_unstable();
    match keys.windows(2).find(|pair| pair[0] >> 32 == pair[1] >> 32) {
        None => Ok(()),
        Some(pair) => {
            let row = pair[1] as u32 as usize;
            let at = (size_of::<Deformer>() * row + offset_of!(Deformer, object)) as u64;
            let (expected, found) = ("an object of no other deformer", format!("{}", pair[1] >> 32));
            Err(Error::within_file(Code::Deformer, kind::DEFORMERS, at, expected, found))
        }
    }
}

/// That ranges that end at a row cover a section of the whole file.
fn cover(code: Code, kind: u32, stride: usize, end: u64, rows: usize) -> Result<()> {
    if end == rows as u64 {
        return Ok(());
    }
    let (at, expected) = (stride as u64 * end, format!("{end} rows, as the ranges have"));
    Err(Error::within_file(code, kind, at, expected, format!("{rows}")))
}
