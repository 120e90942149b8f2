//! Triangles and rays in integer coordinates times a power of two.

use bth::rays::Ray;
use bth_scenes::Model;

/// A point or vector in units of the grid.
pub type Point = [i32; 3];

/// Magnitudes that products of three coordinates and their sums keep within i128, and f32 within
/// its precision.
pub const LIMIT: i32 = 1 << 24;

/// A mesh whose coordinates are multiples of 2^`exponent`.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    /// Coordinates, below [`LIMIT`].
    pub positions: Vec<Point>,
    /// Rows of `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// The unit is 2^this.
    pub exponent: i32,
}

/// A ray in units of the grid.
#[derive(Clone, Copy, Debug)]
pub struct GridRay {
    /// Start.
    pub origin: Point,
    /// Direction, in units of 2^`exponent`.
    pub direction: Point,
    /// Unit of the direction. It differs from the grid where rays are stretched, which shrinks
    /// their t.
    pub exponent: i32,
    /// Range of t.
    pub range: [f32; 2],
    /// Components of a zero direction that are -0.
    pub negative_zero: bool,
}

/// An exact quotient times a power of two: t of a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quotient {
    numerator: i128,
    denominator: i128,
    exponent: i32,
}

impl Quotient {
    /// The quotient, off by at most 2^-51 of itself.
    pub fn value(&self) -> f64 {
        self.numerator as f64 / self.denominator as f64 * 2f64.powi(self.exponent)
    }
}

fn sub(a: Point, b: Point) -> [i128; 3] {
    [0, 1, 2].map(|k| i128::from(a[k]) - i128::from(b[k]))
}

fn determinant(a: [i128; 3], b: [i128; 3], c: [i128; 3]) -> i128 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// A grid number in f32, exact.
fn float(x: i32, exponent: i32) -> f32 {
    // Two steps, as neither power need be an f32.
    let value = f64::from(x) * 2f64.powi(exponent);
    assert!(f64::from(value as f32) == value, "{x} times 2^{exponent} is no f32");
    value as f32
}

impl Grid {
    /// The mesh as a model.
    pub fn model(&self) -> Model {
        let positions = self.positions.iter().map(|p| p.map(|x| float(x, self.exponent))).collect();
        Model { positions, triangles: self.triangles.clone() }
    }

    /// A ray of the grid as it is traced.
    pub fn ray(&self, ray: &GridRay) -> Ray {
        let direction = ray.direction.map(|x| match x {
            0 if ray.negative_zero => -0.0,
            x => float(x, ray.exponent),
        });
        let [tmin, tmax] = ray.range;
        Ray { origin: ray.origin.map(|x| float(x, self.exponent)), tmin, direction, tmax }
    }

    /// The t at which the line of a ray hits a triangle; `None` if it misses or lies in the plane
    /// of the triangle.
    pub fn intersection(&self, ray: &GridRay, triangle: u32) -> Option<Quotient> {
        let [a, b, c] =
            self.triangles[triangle as usize].map(|v| sub(self.positions[v as usize], ray.origin));
        let d = ray.direction.map(i128::from);
        let sides = [determinant(d, a, b), determinant(d, b, c), determinant(d, c, a)];
        let (positive, negative) = (sides.iter().any(|s| *s > 0), sides.iter().any(|s| *s < 0));
        (positive != negative).then(|| Quotient {
            numerator: determinant(a, b, c),
            denominator: sides.iter().sum(),
            exponent: self.exponent - ray.exponent,
        })
    }
}
