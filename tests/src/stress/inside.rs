//! Points inside and outside of closed meshes, many of them where counting hits goes wrong: on
//! vertices and edges, or with rays that pass exactly through them.
//!
//! The winding number along an axis, from the walk for points, is compared with the crossings of a
//! ray in another direction, most often one that is aimed at a vertex or along an edge, and of
//! samples with exact arithmetic on all triangles.

use bth::rays::Ray;
use bth::{Crossings, Isa, Scene};
use bth_random::Rng;
use std::collections::HashMap;

/// Points that are asked for together.
const BATCH: usize = 1024;
/// Number of wrong answers whose points are kept.
const EXAMPLES: usize = 4;

/// The corners of a triangle.
pub type Corners = [[f32; 3]; 3];

/// What was found about points.
#[derive(Clone, Debug, Default)]
pub struct InsideStatistics {
    /// Points that were asked for.
    pub points: u64,
    /// Those with a winding number other than 0.
    pub inside: u64,
    /// Rays that pass exactly through a vertex or the middle of an edge.
    pub aimed: u64,
    /// Answers that differ along another ray, in another call, or in parity.
    pub different: u64,
    /// Points that were compared with all triangles.
    pub compared: u64,
    /// Those of them with a wrong answer.
    pub wrong: u64,
    /// Some of the rays with a different or wrong answer.
    pub examples: Vec<Ray>,
}

impl InsideStatistics {
    /// Number of wrong answers.
    pub fn defects(&self) -> u64 {
        self.different + self.wrong
    }

    fn example(&mut self, ray: &Ray) {
        if self.examples.len() < EXAMPLES {
            self.examples.push(*ray);
        }
    }
}

/// Returns true if triangles form a surface without boundary: whether every edge has as many of
/// them in one direction as in the other.
pub fn is_closed(corners: &[Corners]) -> bool {
    let mut balance: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    // Adding 0.0 makes 0.0 of -0.0.
    let key = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
    for triangle in corners {
        for i in 0..3 {
            let (p, q) = (key(triangle[i]), key(triangle[(i + 1) % 3]));
            let (edge, sign) = if p < q { ([p, q], 1) } else { ([q, p], -1) };
            *balance.entry(edge).or_default() += sign;
        }
    }
    balance.values().all(|count| *count == 0)
}

/// A seeded source of points and rays around a mesh.
struct Source<'a> {
    corners: &'a [Corners],
    lower: [f32; 3],
    upper: [f32; 3],
    rng: Rng,
}

impl Source<'_> {
    fn anywhere(&mut self) -> [f32; 3] {
        std::array::from_fn(|k| {
            let (from, to) = (f64::from(self.lower[k]), f64::from(self.upper[k]));
            self.rng.between(from - 0.01 * (to - from), to + 0.01 * (to - from)) as f32
        })
    }

    fn triangle(&mut self) -> Corners {
        let mut corners = self.corners[self.rng.below(self.corners.len() as u64) as usize];
        corners.rotate_left(self.rng.below(3) as usize);
        corners
    }

    /// A vertex, or the middle of an edge, rounded.
    fn target(&mut self) -> [f32; 3] {
        let [a, b, _] = self.triangle();
        if self.rng.below(2) == 0 { a } else { [0, 1, 2].map(|k| 0.5 * a[k] + 0.5 * b[k]) }
    }

    /// A point of one of eight kinds, and a direction for a ray from it.
    fn ray(&mut self) -> Ray {
        let [a, b, c] = self.triangle();
        let (mut point, target) = (self.anywhere(), self.target());
        match self.rng.below(8) {
            0 => {}
            1 => point = a,
            2 => point = [0, 1, 2].map(|k| 0.5 * a[k] + 0.5 * b[k]),
            3 => {
                let middle = |k: usize| ((f64::from(a[k]) + f64::from(b[k]) + f64::from(c[k])) / 3.0) as f32;
                point = [0, 1, 2].map(|k| match self.rng.below(3) {
                    0 => middle(k).next_down(),
                    1 => middle(k).next_up(),
                    _ => middle(k),
                });
            }
            4 | 5 => {
                // A ray along this axis passes exactly through the target.
                let axis = self.rng.below(3) as usize;
                point = [0, 1, 2].map(|k| if k == axis { point[k] } else { target[k] });
            }
            _ => {
                // Such that the difference to the target is an f32, and the ray passes exactly
                // through it.
                let back = [0, 1, 2].map(|k| target[k] - point[k]);
                point = [0, 1, 2].map(|k| target[k] - back[k]);
            }
        }
        let mut direction = match self.rng.below(8) {
            0 => [0, 1, 2].map(|k| b[k] - a[k]),
            1 => self.rng.unit_vector().map(|x| x as f32),
            _ => [0, 1, 2].map(|k| target[k] - point[k]),
        };
        if direction == [0.0; 3] || direction.iter().any(|x| !x.is_finite()) {
            direction = [0.0, 0.0, 1.0];
        }
        Ray::new(point, direction)
    }
}

/// Returns true if a ray passes exactly through a corner of a triangle, as far as f64 can tell: at
/// t = 1.
fn is_aimed(ray: &Ray, target: [f32; 3]) -> bool {
    (0..3).all(|k| f64::from(ray.origin[k]) + f64::from(ray.direction[k]) == f64::from(target[k]))
}

/// Asks for about `count` points of a scene with one object and these triangles, which are closed,
/// with every instruction set of this machine in turn. One of `one_in` points is compared with
/// every triangle.
pub fn run_inside(
    scene: &Scene,
    corners: &[Corners],
    count: usize,
    one_in: usize,
    seed: u64,
    statistics: &mut InsideStatistics,
) {
    let isas: Vec<Isa> = Isa::ALL.into_iter().filter(|isa| isa.is_available()).collect();
    let header = scene.object(0).header;
    let mut source =
        Source { corners, lower: header.lower, upper: header.upper, rng: Rng::new(seed ^ 0x1c0f_fee5) };
    let vertices: std::collections::HashSet<[u32; 3]> =
        corners.iter().flatten().map(|p| p.map(|x| (x + 0.0).to_bits())).collect();
    for batch in 0..count.div_ceil(BATCH) {
        let rays: Vec<Ray> = (0..BATCH.min(count - batch * BATCH)).map(|_| source.ray()).collect();
        let points: Vec<[f32; 3]> = rays.iter().map(|ray| ray.origin).collect();
        isas[(batch + seed as usize) % isas.len()].choose().expect("it is available");
        let (mut winding, mut inside) = (vec![0; points.len()], vec![false; points.len()]);
        scene.winding_batch(&points, &mut winding);
        scene.contains_batch(&points, &mut inside);
        for (i, ray) in rays.iter().enumerate() {
            let found: Crossings = scene.crossings(ray);
            let same = found.winding == winding[i]
                && found.count % 2 == winding[i].unsigned_abs() % 2
                && inside[i] == (winding[i] != 0)
                && (i % 16 != 0 || scene.winding(ray.origin) == winding[i]);
            statistics.points += 1;
            statistics.inside += u64::from(inside[i]);
            let target = [0, 1, 2].map(|k| ray.origin[k] + ray.direction[k]);
            let is_vertex = vertices.contains(&target.map(|x| (x + 0.0).to_bits()));
            statistics.aimed += u64::from(is_vertex && is_aimed(ray, target));
            statistics.different += u64::from(!same);
            if !same {
                statistics.example(ray);
            }
            if one_in > 0 && i % one_in == batch % one_in {
                statistics.compared += 1;
                if bth_oracle::crossings(corners, ray) != found {
                    statistics.wrong += 1;
                    statistics.example(ray);
                }
            }
        }
    }
    Isa::best().choose().expect("it is available");
}
