//! Closed surfaces made of instances that share borders exactly, as real numbers.

use crate::oracle::World;
use bth::rays::{Hit, PrimitiveRef};
use bth::{Scene, SceneBuilder};
use bth_compile::Silent;
use bth_compile::memory::{PositionRows, TriangleMesh, open};
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_random::Rng;
use bth_scenes::Model;
use std::collections::BTreeMap;

type Vector = [f64; 3];
type Matrix = [Vector; 3];

/// Cells along a side of a square tile.
const CELLS: usize = 8;
/// Units of a tile's coordinates along its side.
const UNITS: i32 = 1 << 10;

/// A closed surface made of instances.
#[derive(Debug)]
pub struct Tiles {
    /// What it is.
    pub kind: &'static str,
    /// The same, with the numbers that are random.
    pub name: String,
    /// Its instances.
    pub scene: Scene,
    /// The same as real numbers.
    pub world: World,
    /// For each triangle of each instance a vector perpendicular to it, away from the inside.
    outward: Vec<Vec<Vector>>,
    /// Edges that two instances share, rounded to f64.
    pub borders: Vec<[Vector; 2]>,
    /// Points inside.
    pub inside: Vec<[f32; 3]>,
    /// True if corners have so few bits that f64 has them exactly.
    pub(super) is_exact: bool,
    /// The linear part of the surface's transform.
    pub(super) linear: Matrix,
}

pub(super) fn times(m: &Matrix, p: Vector) -> Vector {
    m.map(|row| dot(row, p))
}

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] + b[k])
}

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Surfaces of every kind at random transforms, at scales from 1e-6 to 1e6.
///
/// # Panics
/// If an object does not compile.
pub fn tiles(seed: u64) -> Vec<Tiles> {
    let rng = &mut Rng::new(seed);
    let boxes = ["box of 6 tiles", "box of 24 tiles", "box of 54 tiles", "box of 96 tiles"];
    let mut all: Vec<Tiles> = (1..).zip(boxes).map(|(side, kind)| box_of_tiles(kind, side, rng)).collect();
    let (blob, inside) = (bth_scenes::blob::blob(1500), |rng: &mut Rng| rng.point_in_ball().map(|x| 0.2 * x));
    all.push(patches("bumpy sphere", &blob, 8 + rng.below(57) as usize, inside, rng));
    all.push(patches("torus", &torus(36, 24), 8 + rng.below(57) as usize, inside_torus, rng));
    all
}

/// A box of `side`² copies of a square tile on each face. The entries of all matrices have so few
/// bits that images share borders as real numbers, and that rays can be aimed at them exactly.
fn box_of_tiles(kind: &'static str, side: usize, rng: &mut Rng) -> Tiles {
    let tile = relief(rng);
    let exponent = rng.below(40) as i32 - 29;
    let unit = 2f64.powi(exponent);
    // Ten bits for each entry, and small ones off the diagonal for a box that is not flat.
    let mut digits = |limit: u64| rng.below(2 * limit + 1) as f64 - limit as f64;
    let mut linear: Matrix = [(); 3].map(|()| [(); 3].map(|()| unit * digits(100)));
    (0..3).for_each(|k| linear[k][k] = unit * (if digits(1) < 0.0 { -400.0 } else { 400.0 } + digits(111)));
    let reach = [1u64 << 20, 1 << 12][usize::from(digits(1) > 0.0)];
    let moved = [(); 3].map(|()| unit * digits(reach));
    let (n, last) = (side as f64, side - 1);
    let mut matrices = Vec::new();
    for (axis, end, i, j) in
        (0..3).flat_map(|axis| [0.0, n].map(|end| (axis, end))).flat_map(|(axis, end)| {
            (0..=last).flat_map(move |i| (0..=last).map(move |j| (axis, end, i as f64, j as f64)))
        })
    {
        // A symmetry of the square, and the face.
        let [swap, flip, flop] = [(); 3].map(|()| rng.below(2) as usize);
        let (u, v) = ((axis + 1 + swap) % 3, (axis + 2 - swap) % 3);
        let mut rows: [[f64; 4]; 3] = [[0.0; 4]; 3];
        let cells = if swap == 0 { [i, j] } else { [j, i] };
        for (column, (row, is_flipped)) in [(u, flip), (v, flop)].into_iter().enumerate() {
            rows[row][column] = [1.0, -1.0][is_flipped];
            rows[row][3] = cells[column] + is_flipped as f64;
        }
        rows[axis][2] = if end > 0.0 { 1.0 } else { -1.0 };
        rows[axis][3] = end;
        let column = |c: usize| times(&linear, rows.map(|row| row[c]));
        let [a, b, c, d] = [0, 1, 2, 3].map(column);
        let d = add(d, moved);
        matrices.push([0, 1, 2].map(|k| [a[k], b[k], c[k], d[k]]));
    }
    let inside = (0..64).map(|_| {
        let half = [(); 3].map(|()| n * (3.0 + rng.below(3) as f64) / 8.0);
        add(times(&linear, half), moved)
    });
    let inside = inside.collect();
    let name = format!("{kind}, scale 2^{}", exponent + 9);
    Tiles::new((kind, name), &[tile], &matrices, inside, (linear, true))
}

/// A square tile with a relief, flat at its border.
fn relief(rng: &mut Rng) -> Model {
    let row = |i: usize, j: usize| (i * (CELLS + 1) + j) as u32;
    let mut model = Model::default();
    for (i, j) in (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| (i, j))) {
        let room = i.min(j).min(CELLS - i).min(CELLS - j) as i32;
        let height = room * (rng.below(65) as i32 - 32);
        let step = UNITS / CELLS as i32;
        model.positions.push([i as i32 * step, j as i32 * step, height].map(|x| x as f32 / UNITS as f32));
    }
    for (i, j) in (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j))) {
        let [a, b, c, d] = [row(i, j), row(i + 1, j), row(i + 1, j + 1), row(i, j + 1)];
        model.triangles.extend([[a, b, c], [a, c, d]]);
    }
    model
}

/// The circle in a torus, and the radius of its tube.
fn ring(angle: f64) -> Vector {
    [angle.cos(), angle.sin(), 0.0]
}

fn torus(segments: u32, sides: u32) -> Model {
    let mut model = Model::default();
    for (i, j) in (0..segments).flat_map(|i| (0..sides).map(move |j| (i, j))) {
        let angle = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let (center, around) = (ring(angle(i, segments)), angle(j, sides));
        let p = add(center.map(|x| x * (1.0 + 0.4 * around.cos())), [0.0, 0.0, 0.4 * around.sin()]);
        model.positions.push(p.map(|x| x as f32));
        let row = |i: u32, j: u32| i % segments * sides + j % sides;
        let [a, b, c, d] = [row(i, j), row(i + 1, j), row(i + 1, j + 1), row(i, j + 1)];
        model.triangles.extend([[a, b, c], [a, c, d]]);
    }
    model
}

fn inside_torus(rng: &mut Rng) -> Vector {
    let center = ring(std::f64::consts::TAU * rng.unit_f64());
    add(center, rng.point_in_ball().map(|x| 0.2 * x))
}

/// A closed mesh cut into patches, which all have the same random transform.
fn patches(
    kind: &'static str,
    mesh: &Model,
    count: usize,
    inside: impl Fn(&mut Rng) -> Vector,
    rng: &mut Rng,
) -> Tiles {
    let middle = |row: usize| mesh.corners(row).into_iter().map(|p| p.map(f64::from)).fold([0.0; 3], add);
    let seeds: Vec<_> = (0..count).map(|_| middle(rng.below(mesh.triangles.len() as u64) as usize)).collect();
    let mut patches = vec![Model::default(); count];
    for (row, triangle) in mesh.triangles.iter().enumerate() {
        let distance = |seed: &Vector| dot(sub(*seed, middle(row)), sub(*seed, middle(row)));
        let nearest = (0..count).min_by(|a, b| distance(&seeds[*a]).total_cmp(&distance(&seeds[*b])));
        let patch = &mut patches[nearest.expect("a patch")];
        let first = patch.positions.len() as u32;
        patch.positions.extend(triangle.map(|v| mesh.positions[v as usize]));
        patch.triangles.push([first, first + 1, first + 2]);
    }
    patches.retain(|patch| !patch.triangles.is_empty());
    let scale = 10f64.powf(rng.between(-6.0, 6.0));
    let mut number = |x: f64| f64::from((scale * x * (rng.unit_f64() - 0.5)) as f32);
    let mut rows: [[f64; 4]; 3] = [(); 3].map(|()| [number(1.0), number(1.0), number(1.0), number(50.0)]);
    (0..3).for_each(|k| rows[k][k] += if rows[k][3] < 0.0 { -scale } else { scale } as f32 as f64);
    let rows = rows.map(|row| row.map(|x| f64::from(x as f32)));
    let linear = rows.map(|[a, b, c, _]| [a, b, c]);
    let inside = (0..64).map(|_| add(times(&linear, inside(rng)), rows.map(|row| row[3]))).collect();
    let name = format!("{kind} of {} patches, scale {scale:.0e}", patches.len());
    Tiles::new((kind, name), &patches, &vec![rows; patches.len()], inside, (linear, false))
}

impl Tiles {
    /// Instances of the objects in turn.
    fn new(
        (kind, name): (&'static str, String),
        objects: &[Model],
        matrices: &[[[f64; 4]; 3]],
        inside: Vec<Vector>,
        (linear, is_exact): (Matrix, bool),
    ) -> Tiles {
        let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
        let mut builder = SceneBuilder::new();
        for Model { positions, triangles } in objects {
            let compiled =
                open(TriangleMesh { positions: PositionRows::F32(positions), triangles }, &options, &Silent);
            builder.add(&compiled.expect("an object"));
        }
        let (mut outward, mut borders) = (Vec::new(), Vec::new());
        for (instance, rows) in matrices.iter().enumerate() {
            let object = instance % objects.len();
            let transform: Vec<f32> = rows.as_flattened().iter().map(|x| *x as f32).collect();
            assert!(
                transform.iter().zip(rows.as_flattened()).all(|(x, exact)| f64::from(*x) == *exact),
                "{name}"
            );
            builder
                .instance(object as u32, transform.as_slice().try_into().expect("three rows"))
                .expect("an instance");
            let linear = rows.map(|[a, b, c, _]| [a, b, c]);
            let sign = dot(linear[0], cross(linear[1], linear[2])).signum();
            let model = &objects[object];
            let away = |row: usize| {
                let [a, b, c] = model.corners(row).map(|p| times(&linear, p.map(f64::from)));
                cross(sub(b, a), sub(c, a)).map(|x| sign * x)
            };
            outward.push((0..model.triangles.len()).map(away).collect());
            let place = |p: [f32; 3]| add(times(&linear, p.map(f64::from)), rows.map(|row| row[3]));
            borders.extend(border(model).into_iter().map(|edge| edge.map(place)));
        }
        builder.commit().expect("transforms that can be used");
        let scene = builder.into_scene();
        let inside = inside.into_iter().map(|p| p.map(|x| x as f32)).collect();
        Tiles { kind, name, world: World::new(&scene), scene, outward, borders, inside, linear, is_exact }
    }

    /// Returns true if a direction surely leads inside from within the triangle of a hit.
    pub(super) fn leads_inside(&self, hit: &Hit, direction: Vector) -> bool {
        let PrimitiveRef { instance, triangle } = hit.primitive;
        let outward = self.outward[instance as usize][triangle as usize];
        // The dot product and the vector have relative errors of about 1e-15.
        let sure = 1e-9 * (dot(outward, outward) * dot(direction, direction)).sqrt();
        hit.u > 0.0 && hit.v > 0.0 && hit.u + hit.v < 1.0 && dot(outward, direction) < -sure
    }
}

/// The edges of a mesh that one triangle has.
fn border(model: &Model) -> Vec<[[f32; 3]; 2]> {
    let mut edges = BTreeMap::new();
    for row in 0..model.triangles.len() {
        let corners = model.corners(row);
        for k in 0..3 {
            let edge = [corners[k], corners[(k + 1) % 3]];
            let mut key = edge.map(|p| p.map(f32::to_bits));
            key.sort_unstable();
            edges.entry(key).or_insert_with(|| (edge, 0)).1 += 1;
        }
    }
    edges.into_values().filter(|(_, count)| *count == 1).map(|(edge, _)| edge).collect()
}
