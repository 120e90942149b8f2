//! Joints and morph targets of the vertices of a primitive (glTF 2.0 specification, §3.7.2.2 and
//! §3.7.3.3).

use std::collections::BTreeMap;

use crate::deformation::{Influences, MOST_INFLUENCES, RawDeformation};
use crate::error::{Error, Result};
use crate::gltf::file::{GRAPH, WEIGHTS};
use crate::gltf::primitive::{PrimitiveReader, Triangles};
use crate::source::{INDEX, UNSUPPORTED};

/// Rows of morph targets that any model may store. A model with more rows may store at most one per
/// byte read.
const FREE_ROWS: u64 = 1 << 24;

impl PrimitiveReader<'_, '_> {
    /// Appends what moves the vertices of a primitive. `first` are the rows of its first position
    /// and its first normal.
    ///
    /// # Errors
    /// `BTH-I017` for weights that are negative or not finite and for more joints or morph targets
    /// than can be used, `BTH-I005` for joints that are no integers, `BTH-I012` where primitives of
    /// a mesh differ in their number of targets, and the errors of accessors.
    pub(super) fn deformation(
        &self,
        triangles: &Triangles,
        first: [usize; 2],
        into: &mut RawDeformation,
    ) -> Result<()> {
        self.influences(triangles, first[0], into)?;
        let targets = self.targets()?;
        if first[0] > 0 && targets.len() != into.positions.len() {
            let message = format!(
                "expected {} morph targets as in the primitives before, found {}",
                into.positions.len(),
                targets.len()
            );
            return Err(self.deformation_error(GRAPH, message));
        }
        into.positions.resize_with(targets.len(), Default::default);
        into.normals.resize_with(targets.len(), Default::default);
        for (number, target) in targets.iter().enumerate() {
            self.check_target_rows(triangles, targets.len(), into)?;
            if let Some(deltas) = self.target_rows(triangles, target, "POSITION")? {
                into.positions[number].append(first[0], &deltas);
            }
            if triangles.normals.is_some()
                && let Some(deltas) = self.target_rows(triangles, target, "NORMAL")?
            {
                into.normals[number].append(first[1], &deltas);
            }
        }
        Ok(())
    }

    /// What each target adds to the normals of vertices, of those that do.
    ///
    /// # Errors
    /// As for [`Self::deformation`].
    pub(super) fn target_normals(&self, triangles: &Triangles) -> Result<Vec<Vec<[f32; 3]>>> {
        let of_target = |target| self.target_rows(triangles, target, "NORMAL").transpose();
        self.targets()?.iter().filter_map(of_target).collect()
    }

    /// Refuses more rows of targets than the bytes that were read can hold.
    fn check_target_rows(
        &self,
        triangles: &Triangles,
        targets: usize,
        so_far: &RawDeformation,
    ) -> Result<()> {
        let bytes = self.file.bytes_read();
        let stored = so_far.positions.iter().chain(&so_far.normals).map(|m| m.rows.len() as u64).sum::<u64>();
        let read = triangles.positions.len() as u64 * targets as u64;
        if stored <= FREE_ROWS.max(bytes) && read <= FREE_ROWS.max(64 * bytes) {
            return Ok(());
        }
        let message = format!("its {targets} morph targets have more rows than {bytes} bytes can hold");
        Err(self.deformation_error(WEIGHTS, message))
    }

    /// What a target adds to an attribute; `None` if it has no such.
    fn target_rows(
        &self,
        triangles: &Triangles,
        target: &BTreeMap<String, usize>,
        name: &str,
    ) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(&accessor) = target.get(name) else { return Ok(None) };
        let deltas: Vec<[f32; 3]> = self.rows(accessor, triangles.positions.len() as u64)?;
        if deltas.as_flattened().iter().all(|x| x.is_finite()) {
            return Ok(Some(deltas));
        }
        let message = format!("expected finite numbers in the morph target of accessor {accessor}");
        Err(self.deformation_error(WEIGHTS, message))
    }

    /// Appends the joints of the vertices and their weights.
    fn influences(&self, triangles: &Triangles, first: usize, into: &mut RawDeformation) -> Result<()> {
        let sets_before = into.sets;
        let mut sets = 0;
        into.influences.resize(first + triangles.positions.len(), Influences::default());
        for set in 0.. {
            let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
            let [has_joints, has_weights] =
                names.each_ref().map(|name| self.primitive.attributes.contains_key(name));
            if !has_joints && !has_weights {
                break;
            }
            if has_joints != has_weights {
                let message = format!("expected both {} and {}, found one of them", names[0], names[1]);
                return Err(self.deformation_error(INDEX, message));
            }
            if 4 * set >= MOST_INFLUENCES {
                let message =
                    format!("expected up to {MOST_INFLUENCES} joints for a vertex, found {}", names[0]);
                return Err(self.deformation_error(UNSUPPORTED, message));
            }
            let (Some(joints), Some(weights)) =
                (self.optional::<4>(triangles, &names[0])?, self.optional::<4>(triangles, &names[1])?)
            else {
                break;
            };
            sets = set + 1;
            for (row, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
                let wrong = |joint: &f32| joint.fract() != 0.0 || !(0.0..65536.0).contains(joint);
                if let Some(joint) = joints.iter().find(|joint| wrong(joint)) {
                    let message = format!("row {row}: expected a joint below 65536, found {joint}");
                    return Err(self.deformation_error(INDEX, message));
                }
                if let Some(weight) = weights.iter().find(|w| !(w.is_finite() && **w >= 0.0)) {
                    let message = format!("row {row}: expected weights from 0, found {weight}");
                    return Err(self.deformation_error(WEIGHTS, message));
                }
                let influences = &mut into.influences[first + row];
                for k in 0..4 {
                    influences.joints[4 * set + k] = joints[k] as u16;
                    influences.weights[4 * set + k] = weights[k] + 0.0;
                    into.joint_count = into.joint_count.max(joints[k] as u32 + 1);
                }
            }
        }
        if first > 0 && (sets_before == 0) != (sets == 0) {
            let message = "expected JOINTS_0 in all primitives of a mesh or in none".to_owned();
            return Err(self.deformation_error(INDEX, message));
        }
        into.sets = into.sets.max(sets);
        // A vertex without weights follows its first joint.
        for influences in &mut into.influences[first..] {
            if influences.weights == [0.0; MOST_INFLUENCES] {
                influences.weights[0] = 1.0;
            }
        }
        Ok(())
    }

    fn deformation_error(&self, code: &'static str, message: String) -> Error {
        let hint = "export the model again, or compile it at rest with --at-rest";
        self.file.source.error_in_part(code, self.part.as_str(), message, hint)
    }
}
