//! How many tetrahedra walks spread over.
//!
//! What a step costs depends on the caches, and so on the tetrahedra that rays come to, not on all there are: rays from outside
//! into a box with something in it all end at its walls. Of N tetrahedra that are come to equally often, V visits see
//! D = N (1 - (1 - 1/N)^V) different ones, so a sample's V and D tell N.

use super::rays::SampleRay;
use super::tet_walk::{TetWalker, Walked};

/// Visits of a tetrahedralization.
#[derive(Clone, Debug)]
pub struct Spread {
    seen: Vec<u64>,
    all: usize,
    visits: u64,
    different: u64,
}

impl Spread {
    /// No visits yet of so many tetrahedra.
    pub fn new(tetrahedra: usize) -> Spread {
        Spread { seen: vec![0; tetrahedra.div_ceil(64)], all: tetrahedra, visits: 0, different: 0 }
    }

    /// Notes the walk of a ray.
    pub fn walk(&mut self, walker: &TetWalker<'_>, ray: &SampleRay) -> Option<Walked> {
        walker.walk_through(ray, |tet| {
            let (word, bit) = (&mut self.seen[tet as usize / 64], 1 << (tet % 64));
            self.visits += 1;
            self.different += u64::from(*word & bit == 0);
            *word |= bit;
        })
    }

    /// The share of the tetrahedra that walks spread over, as if all of them were come to equally often.
    pub fn share(&self) -> f64 {
        let (different, all) = (self.different as f64, self.all as f64);
        let seen_of = |n: f64| n * (1.0 - power(1.0 - 1.0 / n, self.visits));
        if self.different == 0 || seen_of(all) <= different {
            return 1.0;
        }
        let (mut low, mut high) = (different, all);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if seen_of(middle) < different { low = middle } else { high = middle }
        }
        0.5 * (low + high) / all
    }
}

/// By squaring, to the same bits on every machine.
fn power(base: f64, mut exponent: u64) -> f64 {
    let (mut power, mut square) = (1.0, base);
    while exponent > 0 {
        if exponent & 1 != 0 {
            power *= square;
        }
        square *= square;
        exponent >>= 1;
    }
    power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::costs::Random;

    /// The share that is found when the first `used` of `all` are visited at random.
    fn found(all: usize, used: u32, visits: u32) -> f64 {
        let mut spread = Spread::new(all);
        let mut random = Random(5);
        for _ in 0..visits {
            let tet = (random.unit() * f64::from(used)) as usize;
            let seen = spread.seen[tet / 64] >> (tet % 64) & 1 != 0;
            spread.seen[tet / 64] |= 1 << (tet % 64);
            spread.visits += 1;
            spread.different += u64::from(!seen);
        }
        spread.share()
    }

    #[test]
    fn as_many_as_are_visited_are_found() {
        for (all, used, visits) in
            [(50_000, 10_000, 30_000), (50_000, 300, 30_000), (400_000, 60_000, 30_000)]
        {
            let share = found(all, used, visits);
            let expected = f64::from(used) / all as f64;
            assert!((share / expected - 1.0).abs() < 0.1, "{share} of {expected}");
        }
        assert!(found(20_000, 20_000, 30_000) > 0.95);
        assert_eq!(Spread::new(10).share(), 1.0);
    }
}
