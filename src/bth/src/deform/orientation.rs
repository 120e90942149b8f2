//! Whether tetrahedra have positive orientation, exactly: a filter in f64 for several at a time, and [`side`] where it does not decide.

use crate::simd::{Isa, Kernel, Simd};
use bth_format::exact::side;
use bth_format::layout::TetVertex;
use std::cmp::Ordering;

/// Number of tetrahedra that are tested together; their operations compile to vectors.
const LANES: usize = 16;
/// Bound of the error of a volume relative to the sum of the absolute products, with a factor of 2: each product has at most 7 roundings
/// (3 differences, 2 products, 2 sums). No product of three differences of `f32` leaves the range of normal `f64`.
const ERROR: f64 = 16.0 * f64::EPSILON;
/// From this number of tetrahedra on, several threads test them.
#[cfg(feature = "rayon")]
const TASK: usize = 1 << 13;

/// Whether all tetrahedra have strictly positive orientation: whether each fourth vertex lies on the side of the plane through the first
/// three to which their normal points.
pub(super) fn all_positive(tets: &[[u32; 4]], vertices: &[TetVertex]) -> bool {
    #[cfg(feature = "rayon")]
    if tets.len() > TASK {
        use rayon::iter::ParallelIterator;
        use rayon::slice::ParallelSlice;
        return tets.par_chunks(TASK).all(|tets| Isa::chosen().run(Positive { tets, vertices }));
    }
    Isa::chosen().run(Positive { tets, vertices })
}

/// The kernel of [`all_positive`].
struct Positive<'a> {
    tets: &'a [[u32; 4]],
    vertices: &'a [TetVertex],
}

impl Kernel for Positive<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> bool {
        let Positive { tets, vertices } = self;
        let (whole, rest) = tets.as_chunks::<LANES>();
        whole.iter().all(|tets| certainly_positive(tets, vertices) || tets.iter().all(|tet| is_positive(*tet, vertices)))
            && rest.iter().all(|tet| is_positive(*tet, vertices))
    }
}

fn is_positive(tet: [u32; 4], vertices: &[TetVertex]) -> bool {
    let [a, b, c, d] = tet.map(|vertex| vertices[vertex as usize].position);
    side(a, b, c, d) == Ordering::Greater
}

/// Whether all of some tetrahedra certainly have positive orientation.
#[inline(always)]
fn certainly_positive(tets: &[[u32; 4]; LANES], vertices: &[TetVertex]) -> bool {
    let mut corners = [[[0.0f32; LANES]; 3]; 4];
    for (lane, tet) in tets.iter().enumerate() {
        for (corner, vertex) in corners.iter_mut().zip(tet) {
            let position = vertices[*vertex as usize].position;
            for k in 0..3 {
                corner[k][lane] = position[k];
            }
        }
    }
    let [a, b, c, d] = corners;
    let mut decided = true;
    for lane in 0..LANES {
        let relative = |p: &[[f32; LANES]; 3]| [0, 1, 2].map(|k| f64::from(p[k][lane]) - f64::from(a[k][lane]));
        let (u, v, w) = (relative(&b), relative(&c), relative(&d));
        let (mut volume, mut size) = (0.0, 0.0);
        for (i, j, k) in [(1, 2, 0), (2, 0, 1), (0, 1, 2)] {
            let (x, y) = (u[i] * v[j], u[j] * v[i]);
            volume += (x - y) * w[k];
            size += (x.abs() + y.abs()) * w[k].abs();
        }
        decided &= volume > ERROR * size;
    }
    decided
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    /// Vertices of a lattice and close to it, so that many tetrahedra are flat or nearly so.
    fn vertices(rng: &mut Rng) -> Vec<TetVertex> {
        let coordinate = |rng: &mut Rng| {
            let steps = (rng.next() % 5) as f32 * 0.3;
            match rng.next() % 4 {
                0 => steps.next_up(),
                1 => steps + 1e-30,
                _ => steps,
            }
        };
        let vertex = |rng: &mut Rng| TetVertex { position: [0; 3].map(|_| coordinate(rng)), reserved: 0 };
        (0..40).map(|_| vertex(rng)).collect()
    }

    #[test]
    fn agrees_with_the_exact_test_of_each_tetrahedron() {
        let mut rng = Rng::new(7);
        let (mut positive, mut flat) = (0, 0);
        for round in 0..4000 {
            let vertices = vertices(&mut rng);
            let count = 1 + (rng.next() % 40) as usize;
            let mut tets: Vec<[u32; 4]> =
                (0..count).map(|_| [0; 4].map(|_| (rng.next() % 40) as u32)).collect();
            let sides = |tet: &[u32; 4]| {
                let [a, b, c, d] = tet.map(|v| vertices[v as usize].position);
                side(a, b, c, d)
            };
            // Without the others most sets are positive but for a few.
            let least = if round % 2 == 0 { Ordering::Greater } else { Ordering::Equal };
            tets.retain(|tet| sides(tet) >= least);
            let expected = tets.iter().all(|tet| sides(tet) == Ordering::Greater);
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let found = isa.run(Positive { tets: &tets, vertices: &vertices });
                assert_eq!(found, expected, "round {round}, {isa:?}");
            }
            assert_eq!(all_positive(&tets, &vertices), expected);
            positive += usize::from(expected && tets.len() >= LANES);
            flat += usize::from(!expected);
        }
        assert!(positive > 200 && flat > 200, "{positive} positive, {flat} flat");
    }
}
