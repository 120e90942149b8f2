//! What a change of a scene did.

use crate::refit::Refitted;
use std::time::Duration;

/// Statistics of an update: of a scene's time, or of a [`commit`](crate::SceneBuilder::commit).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// Nodes of files that moved, were hidden or became visible, including all their descendants.
    pub nodes: usize,
    /// Instances that were placed again.
    pub placed: usize,
    /// Visible instances of the whole scene.
    pub visible: usize,
    /// True if the top level was built again. If instances only moved, a commit refits it, that is,
    /// keeps its nodes and computes their boxes again, as long as [`Self::cost_ratio`] permits.
    pub rebuilt: bool,
    /// Expected cost of rays through the top level relative to when it was last built: 1 right
    /// after a build, more if instances that share a node have moved apart since. It is the surface
    /// area of the boxes of all nodes, relative to the surface area of the boxes of all instances.
    /// A commit builds the top level again where this would exceed 1.5.
    pub cost_ratio: f64,
    /// Time to rebuild or refit the top level.
    pub top_level: Duration,
    /// Objects that got new positions ([`Scene::set_positions`](crate::Scene::set_positions)).
    pub deformed: usize,
    /// Expected cost of rays through a deformed object relative to that in the pose for which it
    /// was compiled, of several objects the largest: the sum of the areas of the boxes of all
    /// nodes and leaves, relative to the area of the object's box (SAH). 1 if no object was
    /// deformed. Where it grows far beyond 1, compile the object again in a pose nearer to the new
    /// one.
    pub deformed_cost_ratio: f64,
    /// Time to check the new positions and refit the objects.
    pub refit: Duration,
}

impl Update {
    /// The same update with the refit of some objects.
    pub(crate) fn with_refit(self, refitted: Refitted) -> Update {
        Update {
            deformed: refitted.objects,
            deformed_cost_ratio: refitted.cost_ratio,
            refit: refitted.time,
            ..self
        }
    }
}

impl Default for Update {
    /// An update in which nothing changed.
    fn default() -> Update {
        Update {
            nodes: 0,
            placed: 0,
            visible: 0,
            rebuilt: false,
            cost_ratio: 1.0,
            top_level: Duration::ZERO,
            deformed: 0,
            deformed_cost_ratio: 1.0,
            refit: Duration::ZERO,
        }
    }
}
