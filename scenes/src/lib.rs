//! Generators of the models that tests, demos and benchmarks use.
//!
//! Every generator uses only `+`, `-`, `*`, `/`, `sqrt` and `floor` on `f64`, which IEEE 754
//! defines to the last bit, so a model has the same bytes on every machine. Vectors come from
//! `glam`, whose `f64` operations are these same ones; its functions that call the system's
//! mathematics library are not used.
#![warn(missing_docs)]

pub mod animations;
pub mod blob;
pub mod catalogue;
pub mod gyroid;
pub mod hairball;
pub mod hall;
pub mod knot;
mod math;
pub mod planted;
pub mod sheet;
pub mod soup;
pub mod topology;
pub mod write;

use glam::{DVec3, Vec3};

/// An indexed triangle model; lengths have no unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Finite positions. Generators of connected surfaces share them between triangles.
    pub positions: Vec<[f32; 3]>,
    /// Rows of `positions`, counter-clockwise seen from outside where there is an outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Model {
    /// The corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// The position in a row, exactly.
    fn position(&self, row: u32) -> DVec3 {
        Vec3::from_array(self.positions[row as usize]).as_dvec3()
    }

    /// Adds a position, rounded to `f32`, and returns its row.
    fn push(&mut self, p: impl Into<DVec3>) -> u32 {
        let row = u32::try_from(self.positions.len()).expect("generators stay below 2^32 positions");
        self.positions.push(p.into().as_vec3().to_array());
        row
    }

    /// Adds a quadrilateral as two triangles, split along the diagonal from its first corner.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Appends another model without welding.
    fn append(&mut self, other: &Model) {
        let base = u32::try_from(self.positions.len()).expect("generators stay below 2^32 positions");
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
    }
}
