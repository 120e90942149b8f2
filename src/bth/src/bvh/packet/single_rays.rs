//! Tests of the rays of a packet one at a time, against all children of a node or all triangles of
//! a leaf, where few rays are left.
//!
//! Half of the leaves that sixteen rays of ambient occlusion enter are hit by one of them only
//! (docs/notes/packets.md). Testing one ray against sixteen triangles at once is then far faster
//! than testing sixteen rays against each triangle in turn.

use super::bounds::PacketBounds;
use super::entry::{GROUPS, StackEntry};
use super::ray_group::RayGroup;
use crate::intersect::exact_lanes::F32Lanes;
use crate::intersect::filter::{Candidates, TriangleBlock};
use crate::intersect::prepare::{Prepared, PreparedRay};
use crate::simd::{LANES, Lanewise, Part, Simd};
use bth_format::layout::{WIDTH, WideNode};
use bth_format::object::ObjectBounds;

/// Largest number of rays of a group that are tested one at a time in a leaf, by measurement.
pub(crate) const FEW_OF_GROUP: u32 = 6;
/// Largest number of rays of a packet that are tested one at a time in a node, by measurement.
pub(crate) const FEW_OF_PACKET: u32 = 24;

/// The rays of a packet as prepared single rays. Groups are converted at their first use.
#[derive(Debug)]
pub(crate) struct SingleRays {
    group: [Prepared; GROUPS],
    /// For each group the smallest and the largest depth of hits that can change the rays' results,
    /// at the time of conversion.
    depths: [[F32Lanes; 2]; GROUPS],
    /// A bit for each converted group.
    ready: u32,
}

/// The conversion of a group, as a part of kernels.
struct Convert<'a, S: Simd> {
    group: &'a RayGroup<S>,
    prepared: &'a mut Prepared,
    depths: &'a mut [F32Lanes; 2],
    for_boxes: bool,
}

impl<S: Simd> Part<S> for Convert<'_, S> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let Convert { group, prepared, depths, for_boxes } = self;
        let lines = if for_boxes { 0..2 } else { 1..2 };
        prepared.clear();
        for i in 0..S::PIECES {
            let p = s.piece(i);
            prepared.write::<S>(p, &group.lanes(p), p.splat_u(0), lines.clone());
        }
        s.store(group.first, &mut depths[0]);
        s.store(group.limit, &mut depths[1]);
    }
}

impl SingleRays {
    pub(crate) const NONE: SingleRays = SingleRays {
        group: [const { Prepared::new() }; GROUPS],
        depths: [[[0.0; LANES]; 2]; GROUPS],
        ready: 0,
    };

    /// Removes all rays.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.ready = 0;
    }

    /// Converts the rays of a group unless this has been done. Values for box tests are written
    /// only if `for_boxes`, because no other use of them follows.
    #[inline(always)]
    fn convert<S: Simd>(&mut self, s: S, group: &RayGroup<S>, at: usize, for_boxes: bool) {
        if self.ready >> at & 1 == 0 {
            self.ready |= 1 << at;
            let convert = Convert {
                group,
                prepared: &mut self.group[at % GROUPS],
                depths: &mut self.depths[at % GROUPS],
                for_boxes,
            };
            if for_boxes { convert.inline_or_share(s) } else { convert.inline_or_call(s) }
        }
    }

    /// A prepared ray, by the index of its group and its lane.
    #[inline(always)]
    fn prepared(&self, at: usize, lane: usize) -> &PreparedRay {
        self.group[at % GROUPS].prepared(lane).expect("packets are made of rays that are prepared")
    }

    /// The triangles of a leaf that a ray of a group may hit; parameters as for its
    /// [filter](crate::intersect::filter::TriangleFilter).
    #[inline(always)]
    pub(crate) fn candidates<S: Simd, H: PacketBounds<S>>(
        &mut self,
        s: S,
        group: &RayGroup<S>,
        (at, lane): (usize, usize),
        block: (&impl TriangleBlock, u32),
        bounds: &ObjectBounds,
    ) -> Candidates<S> {
        self.convert(s, group, at, H::MIXED_OCTANTS);
        let [first, last] = &self.depths[at % GROUPS];
        let (first, last) = (first[lane % LANES], last[lane % LANES]);
        self.prepared(at, lane).filter.candidates(s, block, first, last, bounds)
    }

    /// Writes the stack entries of the children of a node that any of the given rays may hit;
    /// returns their number.
    #[inline(always)]
    pub(crate) fn children<S: Simd>(
        &mut self,
        s: S,
        groups: &[RayGroup<S>],
        mut rays: u64,
        (parent, node): (u32, &WideNode),
        entries: &mut [StackEntry; WIDTH],
    ) -> usize {
        // A lane for each child, with a bit for each ray that may hit it: the first word for rays 0
        // to 31, the second for the others.
        let (mut meeting, mut children) = ([s.splat_u(0); 2], 0);
        while rays != 0 {
            let ray = rays.trailing_zeros() as usize;
            rays &= rays - 1;
            let (at, lane) = (ray / LANES, ray % LANES);
            self.convert(s, &groups[at % groups.len()], at, true);
            let slabs = &self.prepared(at, lane).slabs;
            let (bits, _) = slabs.children(s, node, slabs.last);
            children |= bits;
            let half = &mut meeting[ray / 32];
            *half = s.select_u(s.mask(bits), s.or_u(*half, s.splat_u(1 << (ray % 32))), *half);
        }
        let mut words = [[0; WIDTH]; 2];
        s.store_u(meeting[0], &mut words[0]);
        s.store_u(meeting[1], &mut words[1]);
        let mut count = 0;
        while children != 0 {
            let slot = children.trailing_zeros() as usize % WIDTH;
            children &= children - 1;
            let rays = u64::from(words[0][slot]) | u64::from(words[1][slot]) << 32;
            entries[count % WIDTH] = StackEntry { rays, parent, slot: slot as u32, key: f32::NEG_INFINITY };
            count += 1;
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::box_oracle::meets;
    use crate::bvh::packet::entry::PACKET;
    use crate::bvh::packet::prepare_group::PrepareGroup;
    use crate::bvh::packet::segment_box::SegmentBox;
    use crate::rays::Ray;
    use crate::simd::{Isa, Kernel};
    use bth_format::layout::NONE;
    use bth_format::object::ObjectBounds;
    use bth_random::Rng;

    /// For each child the rays that may hit it, one bit per ray. The last field holds the rays to
    /// test.
    struct Children<'a>(&'a [Ray], &'a WideNode, u64);

    impl Kernel for Children<'_> {
        type Output = [u64; WIDTH];
        const SCALAR: bool = false;
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> [u64; WIDTH] {
            let Children(rays, node, tested) = self;
            let mut groups = [RayGroup::vacant(s); GROUPS];
            for (group, rays) in groups.iter_mut().zip(rays.chunks(LANES)) {
                assert!(
                    PrepareGroup::<S, SegmentBox<S>>::of(group, &ObjectBounds::around(8.0), rays, false)
                        .run(s)
                );
            }
            let groups = &groups[..rays.len().div_ceil(LANES)];
            let (mut single_rays, mut entries) = (SingleRays::NONE, [StackEntry::default(); WIDTH]);
            let count = single_rays.children(s, groups, tested, (7, node), &mut entries);
            let mut out = [0; WIDTH];
            for entry in &entries[..count] {
                assert!(entry.parent == 7 && entry.rays != 0, "{entry:?}");
                assert_eq!(out[entry.slot as usize], 0, "each child once");
                out[entry.slot as usize] = entry.rays;
            }
            out
        }
    }

    #[test]
    fn children_are_met_by_the_same_rays_as_in_f64() {
        let mut rng = Rng::new(31);
        let mut unit = || rng.below(1 << 20) as f32 / (1 << 19) as f32 - 1.0;
        let (mut met, mut missed) = (0, 0);
        for round in 0..200 {
            // Some packets have a last group that is not full, or only one group.
            let rays: Vec<Ray> = (0..PACKET - round % 60)
                .map(|_| {
                    let [origin, direction] = [(); 2].map(|()| [(); 3].map(|()| 8.0 * unit()));
                    Ray { origin, tmin: 0.0, direction, tmax: 0.4 + unit().abs() }
                })
                .collect();
            let mut node =
                WideNode { bounds: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], child: [NONE; WIDTH] };
            for slot in 0..WIDTH - round % 3 {
                for k in 0..3 {
                    let (middle, size) = (4.0 * unit(), 4.0 * unit().abs());
                    (node.bounds[k][0][slot], node.bounds[k][1][slot]) = (middle - size, middle + size);
                }
            }
            let tested = (0..rays.len()).fold(0u64, |tested, i| tested | u64::from(unit() > 0.5) << i);
            for isa in Isa::ALL {
                // There are no packets in scalar code.
                if isa == Isa::Scalar || !isa.is_available() {
                    continue;
                }
                let found = isa.run(Children(&rays, &node, tested));
                for (slot, &found) in found.iter().enumerate() {
                    let [lower, upper] = [0, 1].map(|end| [0, 1, 2].map(|k| node.bounds[k][end][slot]));
                    for (i, ray) in rays.iter().enumerate() {
                        let is_found = found >> i & 1 != 0;
                        let is_tested = tested >> i & 1 != 0;
                        assert!(is_tested || !is_found, "{isa}: only tested rays are found");
                        if is_tested && meets(ray, lower, upper, 0.0) {
                            assert!(is_found, "{isa}: {ray:?} meets {lower:?}, {upper:?}");
                            met += 1;
                        }
                        if is_tested && !meets(ray, lower, upper, 1e-4) {
                            assert!(!is_found, "{isa}: {ray:?} misses {lower:?}, {upper:?}");
                            missed += 1;
                        }
                    }
                    assert_eq!(found.checked_shr(rays.len() as u32).unwrap_or(0), 0);
                }
            }
        }
        assert!(Isa::best() == Isa::Scalar || met > 1000 && missed > 1000, "{met}, {missed}");
    }
}
