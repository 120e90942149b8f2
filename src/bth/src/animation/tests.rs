//! Positions and normals against the formula, vertex by vertex, and the same bits with every
//! instruction set and number of threads.

use super::JointMatrix;
use super::morph_runs::MorphRuns;
use super::normals::corner_normal;
use super::pose::Pose;
use super::positions::{Vertices, compute};
use crate::simd::Isa;
use bth_format::DeformationView;
use bth_format::layout::{Deformation, Morph, NONE};
use bth_random::Rng;

/// An object whose vertices move in some way.
struct Sample {
    base: Vec<[f32; 3]>,
    counts: Deformation,
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
    morphs: Vec<Morph>,
    rows: Vec<u32>,
    deltas: Vec<[f32; 3]>,
    pose: Pose,
}

fn unit(rng: &mut Rng) -> f64 {
    rng.below(1 << 30) as f64 / f64::from(1 << 29) - 1.0
}

fn vector(rng: &mut Rng) -> [f32; 3] {
    [(); 3].map(|()| unit(rng) as f32)
}

impl Sample {
    /// A sample with sets of influences and targets, dense and sparse ones in turn; some joints of
    /// weight zero have no finite matrix.
    fn new(rng: &mut Rng, vertices: usize, sets: usize, targets: usize) -> Sample {
        let count = 5;
        let mut matrix = || -> JointMatrix {
            let mut columns = [[0.0; 4]; 4];
            columns.iter_mut().for_each(|column| (0..3).for_each(|k| column[k] = unit(rng)));
            columns
        };
        let mut matrices: Vec<JointMatrix> = (0..count).map(|_| matrix()).collect();
        matrices.push([[f64::INFINITY; 4]; 4]);
        let joints: Vec<[u16; 4]> =
            (0..vertices * sets).map(|_| [(); 4].map(|()| rng.below(count) as u16)).collect();
        let mut weights: Vec<[f32; 4]> =
            (0..vertices * sets).map(|_| [(); 4].map(|()| (unit(rng) as f32).max(0.0))).collect();
        let mut joints = joints;
        for (joints, weights) in joints.iter_mut().zip(&mut weights) {
            (joints[3], weights[3]) = (count as u16, 0.0);
            weights[0] += 0.25;
        }
        let (mut morphs, mut rows, mut deltas) = (Vec::new(), Vec::new(), Vec::new());
        // For positions, then for the same number of normals.
        for target in 0..2 * targets {
            let changed: Vec<u32> = (0..vertices as u32).filter(|_| rng.below(3) == 0).collect();
            let dense = target % 2 == 0;
            let first_row = if dense { NONE } else { rows.len() as u32 };
            let number = if dense { vertices } else { changed.len() };
            let first_delta = deltas.len() as u32;
            morphs.push(Morph { deltas: number as u32, first_delta, first_row, reserved: 0 });
            rows.extend(changed.iter().filter(|_| !dense));
            deltas.extend((0..number).map(|_| vector(rng)));
        }
        let pose_weights = (0..targets).map(|i| if i % 5 == 4 { 0.0 } else { unit(rng) }).collect();
        Sample {
            base: (0..vertices).map(|_| vector(rng)).collect(),
            counts: Deformation {
                joints: if sets == 0 { 0 } else { count as u32 + 1 },
                influence_sets: sets as u32,
                targets: targets as u32,
                reserved: 0,
            },
            joints,
            weights,
            morphs,
            rows,
            deltas,
            pose: Pose { weights: pose_weights, joints: (sets > 0).then_some(matrices.into()) },
        }
    }

    fn view(&self) -> DeformationView<'_> {
        DeformationView {
            rows: std::slice::from_ref(&self.counts),
            joints: &self.joints,
            weights: &self.weights,
            morphs: &self.morphs,
            morph_rows: &self.rows,
            deltas: &self.deltas,
        }
    }

    fn evaluated(&self) -> Vec<[f32; 3]> {
        let mut out = vec![[f32::NAN; 3]; self.base.len()];
        compute(Vertices { base: &self.base, deformation: self.view() }, &self.pose, &mut out);
        out
    }

    /// A row after the morphs from `first` on.
    fn morphed(&self, first: usize, row: usize, value: [f32; 3]) -> [f64; 3] {
        let mut moved = value.map(f64::from);
        for (target, weight) in self.pose.weights.iter().enumerate() {
            let morph = self.view().morph(first + target);
            let at = morph.rows.map_or(Some(row), |rows| rows.iter().position(|r| *r as usize == row));
            if let Some(delta) = at.map(|at| morph.deltas[at]) {
                (0..3).for_each(|k| moved[k] += weight * f64::from(delta[k]));
            }
        }
        moved
    }

    /// The sum over the joints of a vertex of what their matrices make of a vector with a fourth
    /// number, divided by the sum of weights.
    fn skinned(&self, row: usize, [x, y, z]: [f64; 3], w: f64) -> [f64; 3] {
        let Some(matrices) = &self.pose.joints else { return [x, y, z] };
        let sets = self.counts.influence_sets as usize;
        let (mut sum, mut total) = ([0.0; 3], 0.0);
        for set in row * sets..(row + 1) * sets {
            for i in (0..4).filter(|i| self.weights[set][*i] != 0.0) {
                let (weight, m) =
                    (f64::from(self.weights[set][i]), &matrices[usize::from(self.joints[set][i])]);
                let moved = [0, 1, 2].map(|k| m[0][k] * x + m[1][k] * y + m[2][k] * z + m[3][k] * w);
                (0..3).for_each(|k| sum[k] += weight * moved[k]);
                total += weight;
            }
        }
        sum.map(|x| x / total)
    }
}

#[test]
fn positions_are_those_of_the_formula_and_the_same_bits_everywhere() {
    let mut rng = Rng::new(22);
    for (vertices, sets, targets) in
        [(1, 1, 0), (3, 0, 3), (255, 1, 2), (256, 2, 1), (257, 2, 6), (900, 0, 1), (6000, 1, 3)]
    {
        let sample = Sample::new(&mut rng, vertices, sets, targets);
        let found = sample.evaluated();
        for (row, found) in found.iter().enumerate() {
            let moved = sample.morphed(0, row, sample.base[row]);
            let expected = sample.skinned(row, moved, 1.0);
            for (found, expected) in found.iter().zip(expected) {
                let error = (f64::from(*found) - expected).abs();
                assert!(error <= 1e-7 * (1.0 + expected.abs()), "{found} is not {expected} at {row}");
            }
        }
        let runs = MorphRuns::new(&sample.view(), &sample.pose.weights, vertices);
        let bits = |rows: &[[f32; 3]]| rows.as_flattened().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
            let mut out = vec![[f32::NAN; 3]; vertices];
            isa.run(super::positions::VertexRange {
                vertices: Vertices { base: &sample.base, deformation: sample.view() },
                pose: &sample.pose,
                runs: &runs,
                first: 0,
                out: &mut out,
            });
            assert_eq!(bits(&out), bits(&found), "{isa}");
        }
        #[cfg(feature = "rayon")]
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(bits(&pool.install(|| sample.evaluated())), bits(&found), "{threads} threads");
        }
    }
}

#[test]
fn normals_stay_perpendicular_to_what_the_joints_do() {
    let mut rng = Rng::new(23);
    for (sets, targets) in [(0, 2), (1, 0), (1, 3), (2, 1)] {
        let sample = Sample::new(&mut rng, 60, sets, targets);
        for row in 0..60 {
            let normal = vector(&mut rng);
            let found = corner_normal(&sample.view(), &sample.pose, row as u32, normal, row as u32);
            let moved = sample.morphed(targets, row, normal);
            // Two vectors of the plane of the normal before the skin remain in its plane.
            let [x, y, z] = moved;
            for tangent in [[y, -x, 0.0], [0.0, z, -y]] {
                let turned = sample.skinned(row, tangent, 0.0);
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let size = (dot(found, found) * dot(turned, turned)).sqrt();
                assert!(dot(found, turned).abs() <= 1e-9 * size, "{found:?} {turned:?}");
            }
            // And the normal stays on its side.
            let along = sample.skinned(row, moved, 0.0);
            let side = found[0] * along[0] + found[1] * along[1] + found[2] * along[2];
            assert!(side >= 0.0 || sets == 0, "{side}");
        }
    }
}
