//! Batches through an object that is one special leaf. The walks are compiled once for all queries.

use super::batch::WalkBatch;
use super::leaf::SpecialLeaf;
use super::walks::{WalkLists, WalkState};
use crate::query::EitherQuery;
use crate::query::sink::Sink;
use crate::rays::Ray;
use crate::simd::Isa;
use bth_format::object::ObjectView;

/// Max number of rays that go together. It is large, because lanes are idle at the end of each
/// part.
pub(crate) const RAYS_PER_PART: usize = 2048;

/// Memory of such batches, which is reused from one to the next.
#[derive(Debug, Default)]
pub(crate) struct SpecialScratch {
    /// Indices of the rays that are left for the tree.
    pub(crate) rest: Vec<u32>,
    /// One query per ray.
    queries: Vec<EitherQuery>,
    /// The state of each ray's walk.
    states: Vec<WalkState>,
    lists: WalkLists,
}

impl SpecialLeaf {
    /// Stores the answers of at most [`RAYS_PER_PART`] rays, which all enter this leaf. Lists the
    /// rays that are left for the tree in `scratch.rest`.
    #[inline(never)]
    pub(crate) fn trace(
        self,
        object: &ObjectView<'_>,
        rays: &[Ray],
        scratch: &mut SpecialScratch,
        sink: &mut Sink<'_>,
    ) {
        let SpecialScratch { rest, queries, states, lists } = scratch;
        queries.clear();
        queries.extend(rays.iter().map(|ray| EitherQuery::new(sink.goal(), ray)));
        states.clear();
        states.resize(rays.len(), WalkState::NotWalked);
        // Elsewhere no ray is walked here: rays are faster through the tree.
        if Isa::chosen().has_long_vectors() && WalkBatch::fits(object) {
            let of = (rays, self.row());
            Isa::chosen().run(&mut WalkBatch::new(object, of, queries, states, lists));
        }
        rest.clear();
        for (index, state) in states.iter().enumerate() {
            match state {
                WalkState::NotWalked => rest.push(index as u32),
                _ => sink.query(index, &queries[index]),
            }
        }
    }
}
