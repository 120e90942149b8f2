//! Walks of rays through the tetrahedra of tet leaves, in either record ([`records`]).
//!
//! The rest of the runtime sees a [`SpecialLeaf`](leaf::SpecialLeaf). A ray is walked in f64
//! ([`walk`]), and where that does not decide, all tetrahedra near its line are visited ([`flood`]).

mod flood;
pub(super) mod leaf;
mod records;
mod walk;
