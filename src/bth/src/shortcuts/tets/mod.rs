//! Walks of rays through the tetrahedra of tet leaves.
//!
//! The rest of the runtime sees a [`SpecialLeaf`](leaf::SpecialLeaf). [`walk`] follows a ray in
//! f64. Where that does not decide, [`flood`] visits all tetrahedra near its line.

mod flood;
pub(super) mod leaf;
mod walk;
