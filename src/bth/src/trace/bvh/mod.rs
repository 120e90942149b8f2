//! Rays through the wide BVH: many at once ([`batch`]) or one ([`walk`]), by the same steps ([`flight`]); where many end
//! is computed together ([`landing`]).

pub(crate) mod batch;
pub(crate) mod flight;
pub(crate) mod landing;
pub(crate) mod nodes;
pub(crate) mod stack;
pub(crate) mod walk;
