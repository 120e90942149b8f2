//! Rays through the wide BVH: batches ([`batch`]) with many on their way at once ([`flights`]), or one ray ([`walk`], with a
//! stack of its own, [`alone`]), by the same steps ([`flight`]); where many end is computed together ([`landing`]).

pub(crate) mod alone;
pub(crate) mod batch;
pub(crate) mod flight;
mod flights;
pub(crate) mod landing;
pub(crate) mod nodes;
pub(crate) mod stack;
pub(crate) mod walk;
