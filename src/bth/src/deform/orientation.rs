//! Whether tetrahedra have positive orientation, exactly: a filter in f32 for sixteen at a time, and [`side`] where it does not decide.

use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_format::exact::side;
use bth_format::layout::TetVertex;
use std::cmp::Ordering;
use zerocopy::{FromBytes, IntoBytes};

/// Bound of the error of a volume relative to the sum of the absolute products, with a factor of 2: each product has at most 7 roundings
/// of 2^-24 (3 differences, 2 products, 2 sums).
const ERROR: f32 = 8.0 * f32::EPSILON;
/// From this number of blocks on, several threads test them.
#[cfg(feature = "rayon")]
const TASK: usize = 1 << 9;

/// Tetrahedra that are tested together.
#[derive(Debug)]
pub(super) struct Tetrahedra {
    /// Blocks of sixteen: rows of first, second, third and fourth vertices. The last one is filled with its first tetrahedron.
    blocks: Vec<[[u32; LANES]; 4]>,
}

impl Tetrahedra {
    /// Tetrahedra of given vertices.
    pub(super) fn new(tets: &[[u32; 4]]) -> Tetrahedra {
        let block = |tets: &[[u32; 4]]| {
            [0, 1, 2, 3].map(|k| std::array::from_fn(|lane| tets.get(lane).unwrap_or(&tets[0])[k]))
        };
        Tetrahedra { blocks: tets.chunks(LANES).map(block).collect() }
    }

    /// Whether all tetrahedra have strictly positive orientation: whether each fourth vertex lies on the side of the plane through the
    /// first three to which their normal points. `length` is the greatest difference of coordinates of two vertices.
    pub(super) fn all_positive(&self, vertices: &[TetVertex], length: f32) -> bool {
        // A product of two differences that leaves the normal range has an error of at most 2^-150, and so has one of three, which also
        // has that of its factor: in the sum of six less than (2 · length + 1) · 3 · 2^-150.
        let least = (length + 1.0) * f32::from_bits(1 << 4);
        let test = |blocks: &[[[u32; LANES]; 4]]| Isa::chosen().run(Positive { blocks, vertices, least });
        #[cfg(feature = "rayon")]
        if self.blocks.len() > TASK {
            use rayon::iter::ParallelIterator;
            use rayon::slice::ParallelSlice;
            return self.blocks.par_chunks(TASK).all(test);
        }
        test(&self.blocks)
    }
}

/// The kernel of [`Tetrahedra::all_positive`].
struct Positive<'a> {
    blocks: &'a [[[u32; LANES]; 4]],
    vertices: &'a [TetVertex],
    /// Volumes up to this are not decided.
    least: f32,
}

impl Kernel for Positive<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let Positive { blocks, vertices, least } = self;
        if !S::HAS_VECTORS {
            return blocks.iter().all(|block| rest_is_positive(block, 0, vertices));
        }
        let rows = <[[f32; 4]]>::ref_from_bytes(vertices.as_bytes()).ok().expect("a vertex is four words");
        let (all, least, error) = (s.mask(0xffff), s.splat(least), s.splat(ERROR));
        for block in blocks {
            let [ax, ay, az, _] = s.rows4(all, rows, s.load_u(&block[0]));
            let [bx, by, bz, _] = s.rows4(all, rows, s.load_u(&block[1]));
            let [cx, cy, cz, _] = s.rows4(all, rows, s.load_u(&block[2]));
            let [dx, dy, dz, _] = s.rows4(all, rows, s.load_u(&block[3]));
            let u = [s.sub(bx, ax), s.sub(by, ay), s.sub(bz, az)];
            let v = [s.sub(cx, ax), s.sub(cy, ay), s.sub(cz, az)];
            let w = [s.sub(dx, ax), s.sub(dy, ay), s.sub(dz, az)];
            let (mut volume, mut size) = (s.splat(0.0), s.splat(0.0));
            for (i, j, k) in [(1, 2, 0), (2, 0, 1), (0, 1, 2)] {
                let (x, y) = (s.mul(u[i], v[j]), s.mul(u[j], v[i]));
                volume = s.add(volume, s.mul(s.sub(x, y), w[k]));
                size = s.add(size, s.mul(s.add(s.abs(x), s.abs(y)), s.abs(w[k])));
            }
            let bound = s.add(s.mul(error, size), least);
            let decided = s.mask_bits(s.lt(bound, volume));
            if decided != 0xffff && !rest_is_positive(block, decided, vertices) {
                return false;
            }
        }
        true
    }
}

/// Whether those tetrahedra of a block have positive orientation whose bit is not set.
#[inline(never)]
fn rest_is_positive(block: &[[u32; LANES]; 4], decided: u32, vertices: &[TetVertex]) -> bool {
    (0..LANES).filter(|lane| decided >> lane & 1 == 0).all(|lane| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k: usize| vertices[block[k][lane] as usize].position);
        side(a, b, c, d) == Ordering::Greater
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    const VERTICES: u64 = 40;

    /// Vertices of a lattice and close to it, so that many tetrahedra are flat or nearly so, of any size.
    fn vertices(rng: &mut Rng) -> Vec<TetVertex> {
        let scale = 2f32.powi(rng.below(250) as i32 - 140);
        let coordinate = |rng: &mut Rng| {
            let steps = rng.below(5) as f32 * 0.3 * scale;
            match rng.below(4) {
                0 => steps.next_up(),
                1 => steps + f32::from_bits(1),
                _ => steps,
            }
        };
        let vertex = |rng: &mut Rng| TetVertex { position: [0; 3].map(|_| coordinate(rng)), reserved: 0 };
        (0..VERTICES).map(|_| vertex(rng)).collect()
    }

    #[test]
    fn agrees_with_the_exact_test_of_each_tetrahedron() {
        let mut rng = Rng::new(7);
        let (mut positive, mut flat) = (0, 0);
        for round in 0..8000 {
            let vertices = vertices(&mut rng);
            let count = 1 + rng.below(40) as usize;
            let mut tets: Vec<[u32; 4]> =
                (0..count).map(|_| [0; 4].map(|_| rng.below(VERTICES) as u32)).collect();
            let side_of = |tet: &[u32; 4]| {
                let [a, b, c, d] = tet.map(|v| vertices[v as usize].position);
                side(a, b, c, d)
            };
            // Half of the sets have positive ones only, and a quarter one that is not.
            tets.retain(|tet| side_of(tet) == Ordering::Greater);
            if round % 4 == 0 {
                tets.insert(rng.below(tets.len() as u64 + 1) as usize, [0, 1, 2, rng.below(VERTICES) as u32]);
            }
            let expected = tets.iter().all(|tet| side_of(tet) == Ordering::Greater);
            let length = vertices.iter().flat_map(|v| v.position).fold(0.0, f32::max);
            let blocks = Tetrahedra::new(&tets);
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let kernel =
                    Positive { blocks: &blocks.blocks, vertices: &vertices, least: (length + 1.0) * 2e-44 };
                assert_eq!(isa.run(kernel), expected, "round {round}, {isa:?}");
            }
            assert_eq!(blocks.all_positive(&vertices, length), expected);
            positive += usize::from(expected && tets.len() >= LANES);
            flat += usize::from(!expected);
        }
        assert!(positive > 200 && flat > 200, "{positive} positive, {flat} flat");
    }

    #[test]
    fn every_tetrahedron_counts() {
        let vertices: Vec<TetVertex> =
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0]]
                .map(|position| TetVertex { position, reserved: 0 })
                .into();
        for count in 1..70 {
            let tets = vec![[0, 1, 2, 3]; count];
            assert!(Tetrahedra::new(&tets).all_positive(&vertices, 1.0));
            for at in 0..count {
                for wrong in [[1, 0, 2, 3], [0, 1, 2, 4]] {
                    let mut tets = tets.clone();
                    tets[at] = wrong;
                    assert!(
                        !Tetrahedra::new(&tets).all_positive(&vertices, 1.0),
                        "{wrong:?} at {at} of {count}"
                    );
                }
            }
        }
    }
}
