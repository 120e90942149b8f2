//! The catalogue of closed surfaces that are hard to trace.

use super::grid::{Grid, LIMIT, Point};
use bth_random::Rng;
use bth_scenes::Model;
use std::collections::BTreeMap;

/// A closed surface.
#[derive(Clone, Debug)]
pub struct Shape {
    /// The name, which describes the difficulty.
    pub name: &'static str,
    /// Its triangles.
    pub grid: Grid,
    /// Points inside the surface, from which every ray must hit.
    pub inside: Vec<Point>,
    /// Bounds, in units of the grid.
    pub bounds: [Point; 2],
    /// Triangles at each vertex.
    pub around: Vec<Vec<u32>>,
    /// True if the whole shape can be tetrahedralized at once, having no bad contacts.
    pub whole: bool,
}

impl Shape {
    fn new(name: &'static str, grid: Grid, inside: Vec<Point>, whole: bool) -> Shape {
        let least = |k: usize| grid.positions.iter().map(|p| p[k]).min().expect("a vertex");
        let most = |k: usize| grid.positions.iter().map(|p| p[k]).max().expect("a vertex");
        let mut around = vec![Vec::new(); grid.positions.len()];
        for (row, triangle) in grid.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| around[*v as usize].push(row as u32));
        }
        let bounds = [std::array::from_fn(least), std::array::from_fn(most)];
        assert!(bounds.iter().flatten().all(|x| x.abs() < LIMIT));
        Shape { name, grid, inside, bounds, around, whole }
    }

    /// Moved by a vector and in other units.
    fn placed(mut self, name: &'static str, by: Point, exponent: i32) -> Shape {
        let moved = |p: Point| [0, 1, 2].map(|k| p[k] + by[k]);
        self.grid.positions = self.grid.positions.into_iter().map(moved).collect();
        self.grid.exponent = exponent;
        let inside = self.inside.into_iter().map(moved).collect();
        Shape::new(name, self.grid, inside, self.whole)
    }
}

/// Every shape; `size` scales the number of triangles (1 for a few thousand in all).
pub fn shapes(size: i32) -> Vec<Shape> {
    let s = size;
    vec![
        cube("coplanar faces, all of them", 8 * s, 2),
        cube("coplanar faces", 6 * s, 2).placed("coplanar faces, scale 2^-120", [0; 3], -120),
        cube("coplanar faces", 6 * s, 2).placed("coplanar faces, scale 2^80", [0; 3], 80),
        sphere("cospherical points", 12 * s, 1 << 18),
        sphere("", 10 * s, 1 << 18).placed("sphere, scale 2^-118 (1e-30)", [0; 3], -118),
        sphere("", 10 * s, 1 << 18).placed("sphere, scale 2^82 (1e30)", [0; 3], 82),
        sphere("", 8 * s, 64).placed("sphere 1e5 radii away", [6_400_000, -6_400_000, 6_400_000], -10),
        cube("", 1, 2).placed("cube 1e7 radii away", [10_000_000, 10_000_001, -10_000_002], 3),
        model("", &bth_scenes::blob::blob(900 * s as u32), 1 << 17, vec![[0; 3]], true).placed(
            "bumpy sphere 60 radii away along two axes",
            [8_000_000, 10_000, -8_000_000],
            -16,
        ),
        bipyramid("slivers of aspect 1e7, high valence", 4, 1, LIMIT - 2),
        bipyramid("needle fans of high valence", 64 * s, 1 << 16, 1 << 21),
        bipyramid("nearly flat", 32 * s, 1 << 20, 2),
        nested("nested spheres", 8 * s),
        scattered("many cubes apart", 40 * s),
        sheet("sheet of no thickness", 6 * s),
        model("bumpy sphere", &bth_scenes::blob::blob(900 * s as u32), 1 << 19, vec![[0; 3]], true),
        model("knot", &bth_scenes::knot::torus_knot(900 * s as u32), 1 << 19, Vec::new(), true),
    ]
}

/// The surface of a cube of `cells`, each `step` wide, around the origin.
fn cube(name: &'static str, cells: i32, step: i32) -> Shape {
    let mut grid = Grid::default();
    let mut rows = BTreeMap::new();
    for axis in 0..3 {
        for (side, cell) in [0, cells].into_iter().flat_map(|side| (0..cells * cells).map(move |c| (side, c)))
        {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(di, dj)| {
                let mut p = [side; 3];
                p[(axis + 1) % 3] = cell / cells + di;
                p[(axis + 2) % 3] = cell % cells + dj;
                vertex(&mut grid, &mut rows, p.map(|x| step * x - cells * step / 2))
            });
            grid.triangles.extend(if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
        }
    }
    Shape::new(name, grid, vec![[0; 3]], true)
}

fn vertex(grid: &mut Grid, rows: &mut BTreeMap<Point, u32>, p: Point) -> u32 {
    *rows.entry(p).or_insert_with(|| {
        grid.positions.push(p);
        grid.positions.len() as u32 - 1
    })
}

/// A model rounded to even numbers of a grid in which its largest coordinate is about `radius`.
fn model(name: &'static str, model: &Model, radius: i32, inside: Vec<Point>, whole: bool) -> Shape {
    let greatest = model.positions.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
    let even = |x: f32| 2 * (f64::from(x) / f64::from(greatest) * f64::from(radius) / 2.0).round() as i32;
    let positions: Vec<Point> = model.positions.iter().map(|p| p.map(even)).collect();
    Shape::new(name, Grid { positions, triangles: model.triangles.clone(), exponent: -16 }, inside, whole)
}

/// A sphere of circles of latitude.
fn sphere(name: &'static str, segments: i32, radius: i32) -> Shape {
    let mut grid = Grid { exponent: -16, ..Grid::default() };
    let mut rows = BTreeMap::new();
    let point = |ring: i32, i: i32| {
        let (up, around) = (
            std::f64::consts::PI * f64::from(ring) / f64::from(segments),
            std::f64::consts::TAU * f64::from(i % (2 * segments)) / f64::from(2 * segments),
        );
        let p = [up.sin() * around.cos(), up.sin() * around.sin(), up.cos()];
        p.map(|x| 2 * (x * f64::from(radius) / 2.0).round() as i32)
    };
    for (ring, i) in (0..segments).flat_map(|ring| (0..2 * segments).map(move |i| (ring, i))) {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
            .map(|(dr, di)| vertex(&mut grid, &mut rows, point(ring + dr, i + di)));
        grid.triangles.extend(
            [[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
        );
    }
    Shape::new(name, grid, vec![[0; 3]], true)
}

/// Two apexes above and below a ring of `n` vertices; `height` makes it as thin as needed.
fn bipyramid(name: &'static str, n: i32, radius: i32, height: i32) -> Shape {
    let mut grid = Grid { exponent: -20, ..Grid::default() };
    grid.positions = vec![[0, 0, height], [0, 0, -height]];
    for i in 0..n {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let at = |x: f64| (x * f64::from(radius)).round() as i32;
        grid.positions.push([at(angle.cos()), at(angle.sin()), 0]);
        let (a, b) = (2 + i as u32, 2 + ((i + 1) % n) as u32);
        grid.triangles.extend([[a, b, 0], [b, a, 1]]);
    }
    Shape::new(name, grid, vec![[0; 3]], true)
}

/// Three nested spheres, the second slightly smaller than the first.
fn nested(name: &'static str, segments: i32) -> Shape {
    let mut grid = Grid { exponent: -16, ..Grid::default() };
    for radius in [1 << 18, (1 << 18) - (1 << 14), 1 << 16] {
        append(&mut grid, &sphere("", segments, radius).grid, [0; 3]);
    }
    Shape::new(name, grid, vec![[0; 3]], true)
}

fn append(grid: &mut Grid, other: &Grid, by: Point) {
    let base = grid.positions.len() as u32;
    grid.positions.extend(other.positions.iter().map(|p| [0, 1, 2].map(|k| p[k] + by[k])));
    grid.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
}

/// Small cubes at random places, which may overlap.
fn scattered(name: &'static str, count: i32) -> Shape {
    let (mut grid, mut rng) = (Grid { exponent: -8, ..Grid::default() }, Rng::new(77));
    let small = cube("", 1, 1024).grid;
    let mut inside = Vec::new();
    for _ in 0..count {
        let by = [(); 3].map(|()| 2 * (rng.below(1 << 16) as i32 - (1 << 15)));
        append(&mut grid, &small, by);
        inside.push(by);
    }
    Shape::new(name, grid, inside, false)
}

/// A square twice, facing both ways: a closed surface around nothing.
fn sheet(name: &'static str, cells: i32) -> Shape {
    let (mut grid, mut rows) = (Grid { exponent: -4, ..Grid::default() }, BTreeMap::new());
    for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
            .map(|(di, dj)| vertex(&mut grid, &mut rows, [2 * (i + di), 2 * (j + dj), 2 * (i + di) + 4]));
        grid.triangles.extend([[a, b, c], [a, c, d], [a, c, b], [a, d, c]]);
    }
    Shape::new(name, grid, Vec::new(), false)
}
