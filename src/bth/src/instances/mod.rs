//! Instances of a scene at a time, and rays through them.
//!
//! Placing: a file's scene at a time ([`by_file`]) or a commit of a scene builder ([`by_caller`])
//! gives each instance that moved its inverse transform and its world box ([`placement`]), and
//! builds or refits the BVH over the boxes ([`top_level`], [`refit`]), whose leaves are instances.
//! Queries see the result ([`world`]).
//!
//! There are three ways through the top level:
//! - one ray ([`enumerate`], [`one_ray`]), which enters one instance after the other;
//! - in a batch ([`batch`]), packets of coherent rays ([`packets`]);
//! - in a batch, lists of the instances that each of the other rays may enter ([`lists`]). Rays
//!   that reach too many boxes for a list go one by one.
//!
//! An object in world space that is alone needs no top level; where f32 does not hold it or its
//! rays, they go through it as lines ([`in_place`]).
//!
//! Of what does not move, a file may hold the trees ([`trees`], [`stored`]).
//!
//! Rows of groups ([`groups`]) lead into trees of the groups. Rays through them go one by one
//! ([`group_walk`]).
//!
//! A batch ([`scene_batch`]) queues the visits of instances by rays ([`visit_queue`]), transforms
//! the rays of an object's visits into its space ([`enter_object`]), and traces them there
//! together, with t unchanged.

mod batch;
mod box_tests;
mod by_caller;
mod by_file;
mod enter_object;
mod enumerate;
#[cfg(test)]
pub(crate) mod exact_loop;
mod group_row;
mod group_walk;
mod groups;
pub(crate) mod in_place;
mod instance_list;
mod lines;
mod lists;
mod one_ray;
mod packets;
mod placement;
mod refit;
mod scene_batch;
mod scene_query;
mod stored;
#[cfg(test)]
mod test_worlds;
mod top_level;
mod top_nodes;
mod trees;
mod unplaced;
mod visit_queue;
mod world;

pub(crate) use group_row::object_of_group;
pub use groups::InstancePath;

pub(crate) use lines::RayInInstance;
#[cfg(test)]
pub(crate) use placement::PartBoxes;
pub(crate) use placement::Placement;
pub(crate) use scene_batch::WorldRays;
#[cfg(test)]
pub(crate) use top_level::TopLevel;
#[cfg(test)]
pub(crate) use top_nodes::INSTANCE;
pub use trees::Trees;
pub(crate) use unplaced::UnplacedRay;
pub(crate) use world::{InstanceRow, NewInstance, World};
