//! Which nodes of a glTF scene are animated, and which deform.

use crate::gltf::schema::Animation;

/// A node whose mesh deforms; its deformer is added when all nodes are there.
pub(super) struct Deforming {
    /// Number of the node in the document.
    pub(super) node: usize,
    /// Row of the node and of its object in the manifest.
    pub(super) row: usize,
    pub(super) object: usize,
    pub(super) weights: Vec<f64>,
}

/// Which nodes the chosen animations change.
#[derive(Default)]
pub(super) struct Animated {
    /// For each node of the document whether its transform changes.
    pub(super) transforms: Vec<bool>,
    /// For each node of the document whether its morph weights change.
    pub(super) weights: Vec<bool>,
}

impl Animated {
    /// The nodes that animations change.
    pub(super) fn of(animations: &[(usize, Animation)], nodes: usize) -> Animated {
        let mut animated = Animated { transforms: vec![false; nodes], weights: vec![false; nodes] };
        for channel in animations.iter().flat_map(|(_, animation)| &animation.channels) {
            let is_weights = channel.target.path == "weights";
            let list = if is_weights { &mut animated.weights } else { &mut animated.transforms };
            channel.target.node.and_then(|node| list.get_mut(node)).into_iter().for_each(|x| *x = true);
        }
        animated
    }
}
