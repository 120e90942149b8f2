//! Rays through the wide BVH: batches ([`batch`]) with many on their way at once ([`flights`]), each by the steps of [`flight`],
//! and where many end computed together ([`landing`]); or one ray alone ([`walk`]), with a stack of its own ([`alone`]). Both
//! test the same boxes and triangles, and note hits alike.

pub(crate) mod alone;
pub(crate) mod batch;
pub(crate) mod flight;
mod flights;
pub(crate) mod landing;
pub(crate) mod leaf;
pub(crate) mod nodes;
pub(crate) mod stack;
pub(crate) mod walk;
