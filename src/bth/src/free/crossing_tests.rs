//! Crossings in f32 against exact arithmetic: corners, origins and directions are integers times powers of two.

use super::crossings::Crossings;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_random::Rng;

type Integers = [i128; 3];

/// What lanes say about sixteen rays and triangles.
struct CrossingsKernel<'a> {
    corners: &'a [[[f32; LANES]; 3]; 3],
    rays: &'a [Ray; LANES],
}

impl Kernel for CrossingsKernel<'_> {
    /// Bits of the rays that leave to the front, and to the back, and the lower bounds of t.
    type Output = ([u32; 2], [f32; LANES]);
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let fields = crate::intersect::prepare::load_rays(s, self.rays);
        let (mut bits, mut starts) = ([0; 2], [0.0; LANES]);
        for i in 0..S::PIECES {
            let p = s.piece(i);
            let fields = crate::intersect::prepare::pick_rays::<S>(p, &fields);
            let crossings = Crossings::new(p, self.corners, fields);
            bits[0] |= crossings.front;
            bits[1] |= crossings.back;
            crate::simd::Lanewise::store(p, crossings.start, &mut starts);
        }
        (bits, starts)
    }
}

/// An integer from -limit to limit.
fn integer(random: &mut Rng, limit: u64) -> i128 {
    i128::from(random.below(2 * limit + 1)) - i128::from(limit)
}

fn integers(random: &mut Rng, limit: u64) -> Integers {
    [0; 3].map(|_: i128| integer(random, limit))
}

fn minus(a: Integers, b: Integers) -> Integers {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn cross(a: Integers, b: Integers) -> Integers {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Integers, b: Integers) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Whether a line crosses a triangle within its edges, upwards or downwards, and there the numerator and the denominator of t.
fn exact(corners: [Integers; 3], origin: Integers, direction: Integers) -> Option<(bool, i128, i128)> {
    let r = corners.map(|corner| minus(corner, origin));
    let sides = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| dot(direction, cross(r[i], r[j])));
    let (up, down) = (sides.iter().all(|s| *s > 0), sides.iter().all(|s| *s < 0));
    (up || down).then(|| (up, dot(r[0], cross(r[1], r[2])), sides.iter().sum()))
}

/// A triangle and a ray that starts close to it, or to one of its edges or corners, by less than `off`.
fn close_start(random: &mut Rng, off: u64) -> ([Integers; 3], Integers, Integers) {
    let center = integers(random, 1 << 19);
    let size = 1 << (integer(random, 6) + 10);
    let corners = [0; 3].map(|_| {
        let from = integers(random, size);
        [0, 1, 2].map(|k| center[k] + from[k])
    });
    // Weights of zero are those of edges and corners.
    let weights = [0; 3].map(|_: i128| (integer(random, 8) - 1).max(0));
    let sum = weights.iter().sum::<i128>().max(1);
    let near = integers(random, off);
    let origin = [0, 1, 2].map(|k| (0..3).map(|c| weights[c] * corners[c][k]).sum::<i128>() / sum + near[k]);
    (corners, origin, integers(random, 1 << 12))
}

#[test]
fn what_is_said_of_crossings_is_true() {
    let mut random = Rng::new(31);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        let (mut said, mut true_ones) = (0, 0);
        for round in 0..4000 {
            let scale = 2f32.powi((integer(&mut random, 20) - 10) as i32);
            let (mut corners, mut rays) = ([[[0.0; LANES]; 3]; 3], [Ray::new([0.0; 3], [0.0; 3]); LANES]);
            let mut starts = [Default::default(); LANES];
            for lane in 0..LANES {
                let off = [0, 1, 16, 1 << 10][round % 4];
                let (triangle, origin, direction) = close_start(&mut random, off);
                let tmin = integer(&mut random, 1 << 10) as f32 / 1024.0;
                starts[lane] = (triangle, origin, direction, tmin);
                for c in 0..3 {
                    for k in 0..3 {
                        corners[c][k][lane] = triangle[c][k] as f32 * scale;
                    }
                }
                let [o, d] = [origin, direction].map(|p| p.map(|x| x as f32 * scale));
                rays[lane] = Ray { origin: o, tmin, direction: d, tmax: f32::INFINITY };
            }
            let ([front, back], bounds) = isa.run(CrossingsKernel { corners: &corners, rays: &rays });
            assert_eq!(front & back, 0);
            for lane in 0..LANES {
                let (triangle, origin, direction, tmin) = starts[lane];
                let truth = exact(triangle, origin, direction);
                let is_before = |&(_, t, of): &(bool, i128, i128)| (t as f64 / of as f64) < f64::from(tmin);
                let truth = truth.filter(is_before);
                let usable = direction.map(|x| x.abs() as f32 * scale).iter().any(|x| *x > 0.01);
                true_ones += u32::from(truth.is_some() && usable);
                if (front | back) >> lane & 1 == 0 {
                    continue;
                }
                let case = || format!("{isa}: {triangle:?} {origin:?} {direction:?} {tmin}");
                let (up, t, of) = truth.unwrap_or_else(|| panic!("{}", case()));
                assert_eq!(up, front >> lane & 1 == 1, "{}", case());
                // The quotient is rounded by far less than the bounds are apart.
                assert!(f64::from(bounds[lane]) <= t as f64 / of as f64, "{} {}", bounds[lane], case());
                assert!(f64::from(bounds[lane]) > -1e6);
                said += 1;
            }
        }
        assert!(said > 5000 && said * 10 > true_ones * 9, "{isa}: {said} of {true_ones}");
    }
}
