//! The pose of an object at a time: matrices of its joints, weights of its morph targets.

use super::JointMatrix;
use crate::nodes::{Affine, NodeHierarchy, tracks};
use bth_format::SceneView;
use bth_format::layout::*;
use std::sync::Arc;

/// What deforms an object at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pose {
    /// Weights of the morph targets.
    pub(crate) weights: Vec<f64>,
    /// For each joint of the skin its matrix, which all objects of the skin share; `None` without a
    /// skin.
    pub(crate) joints: Option<Arc<[JointMatrix]>>,
}

/// The matrices of the joints of skins at a time, each skin computed when it is asked for.
pub(crate) struct SkinMatrices<'a> {
    view: &'a SceneView<'a>,
    hierarchy: &'a NodeHierarchy,
    /// By the row of the skin.
    skins: Vec<Option<Arc<[JointMatrix]>>>,
}

impl<'a> SkinMatrices<'a> {
    /// Those of a checked scene, with the nodes where the hierarchy has them.
    pub(crate) fn new(view: &'a SceneView<'a>, hierarchy: &'a NodeHierarchy) -> Self {
        SkinMatrices { view, hierarchy, skins: vec![None; view.skins.len()] }
    }

    /// The matrices of the skin in a row; `None` if there is no such row.
    fn of(&mut self, row: u32) -> Option<Arc<[JointMatrix]>> {
        let SkinMatrices { view, hierarchy, skins } = self;
        let (skin, matrices) = (view.skins.get(row as usize)?, &mut skins[row as usize]);
        let joints = &view.skin_joints[skin.first_joint as usize..][..skin.joints as usize];
        let matrix = |joint: &SkinJoint| joint_matrix(joint, &hierarchy.to_world(view, joint.node));
        Some(matrices.get_or_insert_with(|| joints.iter().map(matrix).collect()).clone())
    }
}

impl Pose {
    /// The pose that a deformer gives its object at the time of the matrices, which is given in
    /// seconds.
    pub(crate) fn of(matrices: &mut SkinMatrices<'_>, deformer: &Deformer, seconds: f64) -> Pose {
        Pose { weights: weights(matrices.view, deformer, seconds), joints: matrices.of(deformer.skin) }
    }

    /// Bytes on the heap, including shared matrices.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.weights.as_slice())
            + self.joints.as_ref().map_or(0, |joints| size_of_val(&joints[..]))
    }
}

/// The weights of a deformer at a time: from the track of its node if there is one, else the
/// constant weights of the deformer.
fn weights(view: &SceneView<'_>, deformer: &Deformer, seconds: f64) -> Vec<f64> {
    let count = deformer.weights as usize;
    let key = (deformer.node, Property::Weights as u32);
    if let Ok(row) = view.tracks.binary_search_by_key(&key, |track| (track.node, track.property)) {
        return tracks::values(view, &view.tracks[row], count, seconds);
    }
    view.morph_weights[deformer.first_weight as usize..][..count].to_vec()
}

/// The matrix of a joint, whose node has a transform to world space.
fn joint_matrix(joint: &SkinJoint, to_world: &Affine) -> JointMatrix {
    let b = &joint.inverse_bind;
    let row = |i: usize| [b[4 * i], b[4 * i + 1], b[4 * i + 2]];
    let bind = Affine { linear: [row(0), row(1), row(2)], translation: [b[3], b[7], b[11]] };
    let Affine { linear, translation } = to_world.times(&bind);
    let column = |c: usize| [linear[0][c], linear[1][c], linear[2][c], 0.0];
    let [x, y, z] = translation;
    [column(0), column(1), column(2), [x, y, z, 0.0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_of_one_skin_share_its_matrices() {
        let transform = [1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let node =
            Node { transform, parent: NONE, flags: NODE_MATRIX, name: 0, name_length: 0, reserved: [0; 4] };
        let joint = SkinJoint { inverse_bind: transform, node: 0, reserved: [0; 3] };
        let skin = |first_joint, joints| Skin { first_joint, joints, reserved: [0; 2] };
        let deformer =
            |object, skin| Deformer { node: 0, object, skin, weights: 0, first_weight: 0, reserved: [0; 3] };
        let view = SceneView {
            nodes: &[node],
            skins: &[skin(0, 1), skin(1, 2)],
            skin_joints: &[joint; 3],
            ..SceneView::default()
        };
        let mut hierarchy = NodeHierarchy::new(&view, 0);
        hierarchy.update(&view, 0.0, true);
        let mut matrices = SkinMatrices::new(&view, &hierarchy);
        let mut joints = |object, skin| Pose::of(&mut matrices, &deformer(object, skin), 0.0).joints;
        let (a, b, c) = (joints(0, 1).unwrap(), joints(1, 1).unwrap(), joints(2, 0).unwrap());
        assert!(Arc::ptr_eq(&a, &b) && !Arc::ptr_eq(&a, &c));
        assert_eq!((a.len(), c.len(), a[1][3]), (2, 1, [10.0, 0.0, 0.0, 0.0]));
        assert!(joints(3, NONE).is_none());
    }
}
