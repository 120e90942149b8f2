//! Instances of a scene at a time, and rays through them.
//!
//! An update of the time ([`file_scene`]) evaluates the nodes of the scene ([`crate::nodes`]), computes the inverse transform and
//! the world box of each instance that moved ([`placement`]), and rebuilds the BVH over the boxes ([`top_level`]). In a scene that
//! the caller builds, a commit ([`caller`]) does the same for the instances that the caller has changed, and may refit the BVH
//! instead. Rays meet the result ([`world`]) in the same way. A batch of rays ([`batch`]) traverses that BVH, coherent rays as
//! packets ([`packets`]), of the others those that meet few boxes by lists ([`listed_rays`], through few boxes sixteen rays together:
//! [`met_by_lanes`]) and the rest with stacks ([`traverse`]); the answers so far end them ([`progress`]). Each visit of an instance by a
//! ray is queued ([`visit_queue`]); the rays of an object's visits are transformed into its space ([`enter_object`]) and traced there
//! together, with t unchanged. A single ray ([`one_ray`]), and one whose query reports several hits, goes through the top level alone
//! ([`enumerate`], [`instance_list`]).

mod batch;
mod box_tests;
mod caller;
mod caller_instances;
mod deformed;
mod enter_object;
mod enumerate;
#[cfg(test)]
pub(crate) mod exact_loop;
mod file_scene;
mod instance_list;
mod listed_rays;
mod met_by_lanes;
mod one_ray;
mod packets;
mod placement;
mod progress;
mod refit;
mod scene_batch;
mod scene_query;
#[cfg(test)]
mod test_worlds;
mod top_level;
mod top_nodes;
mod traverse;
mod visit_queue;
mod world;

pub(crate) use caller::NewInstance;
pub(crate) use caller_instances::InstanceRow;
#[cfg(test)]
pub(crate) use placement::PartBoxes;
pub(crate) use placement::Placement;
#[cfg(test)]
pub(crate) use top_level::TopLevel;
#[cfg(test)]
pub(crate) use top_nodes::INSTANCE;
pub(crate) use world::{Placed, World};
