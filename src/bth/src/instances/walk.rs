//! The way of one ray through the top level: instance by instance, nearest boxes first.

use super::top_level::{INSTANCE, TopLevel};
use crate::layout::{NONE, WIDTH, WideNode};
use crate::rays::Ray;
use crate::simd::Simd;
use crate::trace::KEY_SLACK;

/// Pad of a plane relative to the greatest coordinate in play. Half covers the roundings of the slab test
/// (reciprocal, product, addend and sum: at most 4 · 2^-24), half the raising of small components.
const PAD: f64 = 1.0 / (1 << 20) as f64;
/// Components below this (of a greatest one in [1, 2)) are raised to it.
const LEAST_COMPONENT: f64 = 1.0 / (1 << 22) as f64;
/// Beyond this, products could overflow f32: every box is visited instead.
const LARGEST_COORDINATE: f64 = 1e30;

/// A ray on its way. Boxes are met by the slab test of Kay and Kajiya (1986) as one multiplication and one
/// addition per plane, conservatively; t is scaled by a power of two.
#[derive(Debug, Default)]
pub(crate) struct Walk {
    near: [usize; 3],
    reciprocal: [f32; 3],
    near_addend: [f32; 3],
    far_addend: [f32; 3],
    scale: f64,
    tmin: f32,
    /// Children that wait, the nearest on top: their codes,
    codes: Vec<u32>,
    /// and lower bounds of t (scaled), but for the slack of [`KEY_SLACK`].
    keys: Vec<f32>,
    /// How many wait. Beyond them both vectors have room for the children of a node.
    waiting: usize,
}

impl Walk {
    /// Starts a ray; false when it hits nothing for want of a line or of instances.
    pub(crate) fn start(&mut self, ray: &Ray, top: &TopLevel) -> bool {
        let (origin, direction) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
        let greatest = direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let finite = origin.iter().chain(&direction).all(|x| x.is_finite());
        if top.nodes.is_empty() || !finite || greatest == 0.0 {
            return false;
        }
        // Exact: the exponent of a finite non-zero f32 is that of a normal f64.
        self.scale = f64::from_bits(greatest.to_bits() & (0x7ff << 52));
        let start = origin.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let padded = f64::from(top.extent) + f64::from(top.looseness) * f64::from(top.reach);
        let extent = padded + start;
        let mut pad = PAD * extent;
        if start > f64::from(top.reach) {
            pad += f64::from(top.looseness) * start;
        }
        // A number even for a tmin of -infinity: lanes are written into the low bits of keys, which would make NaN of that.
        self.tmin = ((f64::from(ray.tmin) * self.scale) as f32).next_down().max(-f32::MAX);
        (self.reciprocal, self.near_addend) = ([0.0; 3], [f32::NEG_INFINITY; 3]);
        self.far_addend = [f32::INFINITY; 3];
        // A power of two: exact.
        let unit = 1.0 / self.scale;
        for k in 0..3 {
            let d = direction[k] * unit;
            let r = 1.0 / d.abs().max(LEAST_COMPONENT).copysign(d);
            self.near[k] = usize::from(d.is_sign_negative());
            if extent + pad < LARGEST_COORDINATE {
                self.reciprocal[k] = r as f32;
                self.near_addend[k] = (-origin[k] * r - pad * r.abs()) as f32;
                self.far_addend[k] = (-origin[k] * r + pad * r.abs()) as f32;
            }
        }
        self.waiting = 0;
        self.make_room();
        (self.codes[0], self.keys[0]) = (0, -f32::MAX);
        self.waiting = 1;
        true
    }

    /// Makes room for the children of a node.
    #[inline(always)]
    fn make_room(&mut self) {
        if self.codes.len() < self.waiting + WIDTH {
            let len = (self.waiting + WIDTH).next_multiple_of(4 * WIDTH);
            self.codes.resize(len, NONE);
            self.keys.resize(len, 0.0);
        }
    }

    /// The next instance whose box the ray may meet at a t that, rounded to f32, is at most `tmax`; `None` at the
    /// end of the way.
    #[inline(always)]
    pub(crate) fn next<S: Simd>(&mut self, s: S, top: &TopLevel, tmax: f32) -> Option<u32> {
        const SLACK: f64 = 1.0 / (1 << 22) as f64;
        let tmax = f64::from(tmax);
        let limit =
            (((tmax + tmax.abs() * SLACK + f64::from(f32::from_bits(1))) * self.scale) as f32).next_up();
        let key_limit = limit + (limit.abs() * KEY_SLACK + f32::MIN_POSITIVE);
        while self.waiting > 0 {
            self.waiting -= 1;
            let (key, code) = (self.keys[self.waiting], self.codes[self.waiting]);
            if key > key_limit {
                continue;
            }
            if code & INSTANCE != 0 {
                return Some(code & !INSTANCE);
            }
            self.open(s, &top.nodes[code as usize], limit);
        }
        None
    }

    /// Puts the children of a node that the ray may meet onto the stack.
    #[inline(always)]
    fn open<S: Simd>(&mut self, s: S, node: &WideNode, limit: f32) {
        let (mut enter, mut leave) = (s.splat(self.tmin), s.splat(limit));
        for k in 0..3 {
            let reciprocal = s.splat(self.reciprocal[k]);
            let near = s.load(&node.bounds[k][self.near[k]]);
            let far = s.load(&node.bounds[k][1 - self.near[k]]);
            enter = s.max(s.fma(near, reciprocal, s.splat(self.near_addend[k])), enter);
            leave = s.min(s.fma(far, reciprocal, s.splat(self.far_addend[k])), leave);
        }
        let child = s.load_u(&node.child);
        let met = s.and_not(s.le(enter, leave), s.eq_u(child, s.splat_u(NONE)));
        let bits = s.mask_bits(met);
        self.make_room();
        let room = self.waiting..self.waiting + WIDTH;
        let codes = (&mut self.codes[room.clone()]).try_into().expect("room for a node's children");
        let keys = (&mut self.keys[room]).try_into().expect("room for a node's children");
        self.waiting += s.compress_far_to_near(bits, enter, child, codes, keys);
    }
}
