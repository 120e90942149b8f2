//! A file whose instances are placed as a whole.

use crate::nodes::{Affine, NodeHierarchy};
use crate::objects::Objects;
use bth_format::SceneView;
use bth_format::layout::NONE;

/// Where a subscene is, at which time, and whether it is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    pub(super) transform: [f32; 12],
    pub(super) seconds: f64,
    pub(super) visible: bool,
}

/// A file whose instances are placed as a whole.
#[derive(Debug)]
pub(super) struct Subscene {
    /// Index in the scene of the first object of the file.
    pub(super) first_object: u32,
    /// For each instance of the file its id in the scene.
    pub(super) ids: Vec<u32>,
    /// The nodes of the file as at `evaluated`; `None` for a file without scene sections.
    hierarchy: Option<NodeHierarchy>,
    /// What the caller wants.
    pub(super) pose: Pose,
    /// What the nodes were evaluated for; `None` before the first time.
    evaluated: Option<Pose>,
}

impl Subscene {
    /// A subscene of the file that begins with an object. It has no ids yet.
    pub(super) fn new(objects: &Objects, first_object: u32, transform: [f32; 12]) -> Subscene {
        let view = scene(objects, first_object);
        let seconds = view.map_or(0.0, |view| f64::from(view.scene[0].first_frame) / view.scene[0].rate);
        Subscene {
            first_object,
            ids: Vec::new(),
            hierarchy: view.map(|view| NodeHierarchy::new(&view)),
            pose: Pose { transform, seconds, visible: true },
            evaluated: None,
        }
    }

    /// For each instance of the file the index in the scene of its object, and its node or `NONE`.
    pub(super) fn instances(objects: &Objects, first_object: u32) -> Vec<(u32, u32)> {
        match scene(objects, first_object) {
            Some(view) => view.instances.iter().map(|row| (first_object + row.object, row.node)).collect(),
            None => {
                let (file, _) = objects.locate(first_object).expect("an object of the scene");
                (first_object..first_object + file.object_count()).map(|object| (object, NONE)).collect()
            }
        }
    }

    /// Evaluates the nodes for the pose, and calls `moved` with the id of each instance that has to be placed again. Returns the
    /// number of nodes that moved.
    pub(super) fn evaluate(&mut self, objects: &Objects, mut moved: impl FnMut(u32)) -> usize {
        let former = self.evaluated.replace(self.pose);
        if former == Some(self.pose) {
            return 0;
        }
        let all = former.is_none_or(|former| Pose { seconds: self.pose.seconds, ..former } != self.pose);
        let (Some(view), Some(hierarchy)) = (scene(objects, self.first_object), &mut self.hierarchy) else {
            self.ids.iter().filter(|_| all).for_each(|id| moved(*id));
            return 0;
        };
        let nodes = hierarchy.update(&view, self.pose.seconds, all);
        let ids = self.ids.iter().zip(view.instances);
        ids.filter(|(_, row)| hierarchy.moved(row.node)).for_each(|(id, _)| moved(*id));
        nodes
    }

    /// The nodes of the file as evaluated, and the time of that; `None` for a file without scene sections.
    pub(super) fn evaluated(&self) -> Option<(&NodeHierarchy, f64)> {
        Some((self.hierarchy.as_ref()?, self.pose.seconds))
    }

    /// The transform of a node of the file to world space as evaluated, and whether it is visible. An object that is `skinned` is not
    /// moved by its node.
    pub(super) fn node(&self, objects: &Objects, node: u32, skinned: bool) -> (Affine, bool) {
        let outer = Affine::from_f32(&self.pose.transform);
        match (scene(objects, self.first_object), &self.hierarchy) {
            (_, Some(hierarchy)) if skinned => (outer, self.pose.visible && !hierarchy.invisible(node)),
            (Some(view), Some(hierarchy)) => {
                let inner = hierarchy.to_world(&view, node);
                // The product with the identity may change the sign of a zero.
                let to_world = if outer == Affine::IDENTITY { inner } else { outer.times(&inner) };
                (to_world, self.pose.visible && !hierarchy.hidden(node))
            }
            _ => (outer, self.pose.visible),
        }
    }
}

/// The scene sections of the file of an object.
fn scene(objects: &Objects, object: u32) -> Option<SceneView<'_>> {
    objects.locate(object).and_then(|(file, _)| file.scene())
}
