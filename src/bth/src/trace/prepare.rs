//! Sixteen rays prepared for the BVH at once, in f32 lanes.
//!
//! To the bounds that [`Slabs`] and [`Sight`] demand, though not to the same bits as their own constructors, which
//! compute in f64. Rays that f32 can't prepare so are left to those.

use super::sight::{self, Sight};
use super::slabs::{self, Slabs};
use crate::layout::Object;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use zerocopy::IntoBytes;

/// Directions of this size or its inverse, and coordinates up to it, are prepared in f32.
const LARGEST: f32 = (1u64 << 60) as f32;
/// What lower bounds of a few f32 roundings are multiplied by, to bound from above.
const UP: f32 = 1.0 + 1.0 / (1 << 20) as f32;
/// Floats of a [`Ray`].
const STRIDE: u32 = (size_of::<Ray>() / size_of::<f32>()) as u32;

/// What is the same for all rays through an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    lower: [f32; 3],
    upper: [f32; 3],
    farthest: f32,
}

impl Frame {
    pub(crate) fn new(object: &Object) -> Frame {
        let corners = object.lower.iter().chain(&object.upper);
        let farthest = corners.fold(0.0, |m: f32, x| m.max(x.abs()));
        Frame { lower: object.lower, upper: object.upper, farthest }
    }
}

/// Sixteen rays, prepared.
#[derive(Debug)]
pub(crate) struct Prepared {
    reciprocal: [[f32; LANES]; 3],
    near_addend: [[f32; LANES]; 3],
    far_addend: [[f32; LANES]; 3],
    origin: [[f32; LANES]; 3],
    shear: [[f32; LANES]; 2],
    depth_to_t: [f32; LANES],
    error: [[f32; LANES]; 2],
    scale: [f32; LANES],
    tmin: [f32; LANES],
    first: [f32; LANES],
    last: [f32; LANES],
    limit: [f32; LANES],
    /// The axis along the ray, and two bits higher each whether a component of the direction is negative.
    axes: [u32; LANES],
    /// Lanes that are prepared; the others need the constructors.
    ready: u32,
}

/// The lane of the axis along the ray, of the one after and of the one before.
#[inline(always)]
fn choose<S: Simd>(s: S, is_x: S::M, is_y: S::M, [x, y, z]: [S::F; 3]) -> S::F {
    s.select(is_x, x, s.select(is_y, y, z))
}

impl Prepared {
    pub(crate) fn new() -> Prepared {
        Prepared {
            reciprocal: [[0.0; LANES]; 3],
            near_addend: [[0.0; LANES]; 3],
            far_addend: [[0.0; LANES]; 3],
            origin: [[0.0; LANES]; 3],
            shear: [[0.0; LANES]; 2],
            depth_to_t: [0.0; LANES],
            error: [[0.0; LANES]; 2],
            scale: [0.0; LANES],
            tmin: [0.0; LANES],
            first: [0.0; LANES],
            last: [0.0; LANES],
            limit: [0.0; LANES],
            axes: [0; LANES],
            ready: 0,
        }
    }

    /// Prepares the rays at these places, as many as `count`.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        s: S,
        frame: &Frame,
        rays: &[Ray],
        at: &[u32; LANES],
        count: usize,
    ) {
        let wanted = s.mask(((1u64 << count) - 1) as u32);
        let floats: &[f32] =
            zerocopy::FromBytes::ref_from_bytes(rays.as_bytes()).expect("rays are made of f32");
        let index = s.load_u(at);
        let index = s.shl_u::<{ STRIDE.trailing_zeros() }>(index);
        let at = [
            index,
            s.add_u(index, s.splat_u(1)),
            s.add_u(index, s.splat_u(2)),
            s.add_u(index, s.splat_u(3)),
            s.add_u(index, s.splat_u(4)),
            s.add_u(index, s.splat_u(5)),
            s.add_u(index, s.splat_u(6)),
            s.add_u(index, s.splat_u(7)),
        ];
        let mut field = [s.splat(0.0); 8];
        for k in 0..8 {
            field[k] = s.gather(wanted, floats, at[k]);
        }
        let [ox, oy, oz, tmin, dx, dy, dz, tmax] = field;
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let size = [s.abs(dx), s.abs(dy), s.abs(dz)];
        let zero = s.splat(0.0);
        let is_x = s.and(s.lt(size[1], size[0]), s.lt(size[2], size[0]));
        let is_y = s.and_not(s.lt(size[2], size[1]), is_x);
        let greatest = s.max(s.max(size[0], size[1]), size[2]);

        // Exact: a power of two.
        let exponent = s.and_u(s.bits(greatest), s.splat_u(0xff << 23));
        let scale = s.from_bits(exponent);
        let inverse_scale = s.from_bits(s.sub_u(s.splat_u(254 << 23), exponent));
        let mut reach = zero;
        let mut farthest = zero;
        let mut finite = s.and(s.lt(s.splat(1.0 / LARGEST), greatest), s.lt(greatest, s.splat(LARGEST)));
        let mut axes = s.splat_u(2);
        axes = s.select_u(is_y, s.splat_u(1), axes);
        axes = s.select_u(is_x, s.splat_u(0), axes);
        let mut scaled = [zero; 3];
        for k in 0..3 {
            let far = s.max(
                s.abs(s.sub(s.splat(frame.lower[k]), o[k])),
                s.abs(s.sub(s.splat(frame.upper[k]), o[k])),
            );
            reach = s.max(far, reach);
            farthest = s.max(s.abs(o[k]), farthest);
            // Also false for NaN, which `max` may drop.
            finite = s.and(finite, s.and(s.lt(far, s.splat(LARGEST)), s.lt(size[k], s.splat(LARGEST))));
            scaled[k] = s.mul(d[k], inverse_scale);
            let negative = s.lt_u(s.splat_u(i32::MAX as u32), s.bits(d[k]));
            axes = s.or_u(axes, s.select_u(negative, s.splat_u(4 << k), s.splat_u(0)));
        }
        let extent = s.mul(s.add(s.splat(frame.farthest), farthest), s.splat(UP));
        finite = s.and(finite, s.lt(extent, s.splat(LARGEST)));
        let pad = s.mul(extent, s.splat(slabs::PAD as f32));
        for k in 0..3 {
            let size = s.max(s.abs(scaled[k]), s.splat(slabs::LEAST_COMPONENT as f32));
            let magnitude = s.div(s.splat(1.0), size);
            let sign = s.and_u(s.bits(d[k]), s.splat_u(1 << 31));
            let reciprocal = s.from_bits(s.or_u(s.bits(magnitude), sign));
            let (middle, pad) = (s.mul(o[k], reciprocal), s.mul(pad, magnitude));
            s.store(reciprocal, &mut self.reciprocal[k]);
            s.store(s.sub(zero, s.add(middle, pad)), &mut self.near_addend[k]);
            s.store(s.sub(pad, middle), &mut self.far_addend[k]);
        }

        let depth = choose(s, is_x, is_y, scaled);
        let backward = s.lt(depth, zero);
        let (p, q) = ([scaled[1], scaled[2], scaled[0]], [scaled[2], scaled[0], scaled[1]]);
        let (p, q) = (choose(s, is_x, is_y, p), choose(s, is_x, is_y, q));
        let depth_to_t = s.div(s.splat(1.0), depth);
        s.store(s.div(s.select(backward, q, p), depth), &mut self.shear[0]);
        s.store(s.div(s.select(backward, p, q), depth), &mut self.shear[1]);
        s.store(depth_to_t, &mut self.depth_to_t);
        let (p, q) = ([o[1], o[2], o[0]], [o[2], o[0], o[1]]);
        let (p, q) = (choose(s, is_x, is_y, p), choose(s, is_x, is_y, q));
        s.store(s.select(backward, q, p), &mut self.origin[0]);
        s.store(s.select(backward, p, q), &mut self.origin[1]);
        s.store(choose(s, is_x, is_y, o), &mut self.origin[2]);

        let reach = s.mul(reach, s.splat(UP));
        let delta = s.mul(reach, s.splat(sight::PROJECTION_ERROR as f32));
        s.store(s.mul(delta, s.splat(4.0)), &mut self.error[0]);
        let square = s.mul(s.mul(delta, delta), s.splat(4.0 * UP));
        s.store(s.add(square, s.splat(f32::MIN_POSITIVE)), &mut self.error[1]);

        // What rounding and underflow can take from t, in scaled units.
        let least = s.fma(scale, s.splat(f32::MIN_POSITIVE), s.splat(f32::MIN_POSITIVE));
        let ulps = s.splat(4.0 / (1 << 24) as f32);
        let scaled_tmin = s.max(s.mul(tmin, scale), s.splat(-f32::MAX));
        let slack = s.fma(s.abs(scaled_tmin), ulps, least);
        s.store(s.sub(scaled_tmin, slack), &mut self.tmin);
        s.store(s.add(scaled_tmin, slack), &mut self.first);
        let scaled_tmax = s.mul(tmax, scale);
        let slack = s.fma(s.abs(scaled_tmax), ulps, least);
        s.store(s.add(scaled_tmax, slack), &mut self.limit);
        let highest = s.min(s.mul(s.min(tmax, s.splat(f32::MAX)), scale), s.splat(f32::MAX));
        s.store(s.sub(highest, s.fma(s.abs(highest), ulps, least)), &mut self.last);
        s.store(scale, &mut self.scale);
        s.store_u(axes, &mut self.axes);
        let usable = s.and(s.and(wanted, finite), s.le(tmin, tmax));
        self.ready = s.mask_bits(usable);
    }

    /// Writes what a lane holds: the ray prepared for boxes and for triangles, and the limit of its scaled t. False if
    /// it is not prepared. Written in place, a word at a time: copies of freshly written structures stall.
    #[inline(always)]
    pub(crate) fn write(&self, lane: usize, slabs: &mut Slabs, sight: &mut Sight, limit: &mut f32) -> bool {
        let i = lane % LANES;
        if self.ready >> i & 1 == 0 {
            return false;
        }
        let axes = self.axes[i];
        for k in 0..3 {
            slabs.near[k] = axes >> (2 + k) & 1;
            slabs.reciprocal[k] = self.reciprocal[k][i];
            slabs.near_addend[k] = self.near_addend[k][i];
            slabs.far_addend[k] = self.far_addend[k][i];
            sight.origin[k] = self.origin[k][i];
        }
        slabs.scale = self.scale[i];
        slabs.tmin = self.tmin[i];
        // The axes of the plane: in cyclic order for a ray that goes up along the third, else the other way round.
        let z = axes & 3;
        let flip = axes >> (2 + z) & 1;
        let (x, y) = (0b00_10_01 >> (2 * z) & 3, 0b01_00_10 >> (2 * z) & 3);
        sight.axis[0] = if flip == 0 { x } else { y };
        sight.axis[1] = if flip == 0 { y } else { x };
        sight.axis[2] = z;
        for k in 0..2 {
            sight.shear[k] = self.shear[k][i];
            sight.error[k] = self.error[k][i];
        }
        sight.floor = f32::MIN_POSITIVE;
        sight.depth_to_t = self.depth_to_t[i];
        sight.first = self.first[i];
        sight.last = self.last[i];
        *limit = self.limit[i];
        true
    }
}
