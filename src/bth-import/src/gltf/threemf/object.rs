//! The objects of a 3MF package, each a mesh or an assembly of others.

use std::collections::{BTreeMap, HashMap};

use crate::error::Result;
use crate::gltf::made::{Made, center};
use crate::gltf::schema::{GltfMesh, Primitive};
use crate::materials::linear;
use crate::raw::{check_rows, check_triangles};

pub(super) const WHITE: [u8; 4] = [255; 4];

/// An object by the numbers of its part and in it.
pub(super) type Key = (usize, u32);

/// An object at a place: a component of another, or an item that is built.
pub(super) struct Placed {
    pub(super) key: Key,
    /// The matrix of a node in glTF, by columns.
    pub(super) matrix: [f64; 16],
}

#[derive(Default)]
pub(super) struct Object {
    pub(super) name: String,
    /// The group and the row in it that its triangles have by default.
    pub(super) property: Option<(u32, u32)>,
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) components: Vec<Placed>,
    /// Its mesh, once it is finished, and the middle that positions are relative to.
    pub(super) mesh: Option<usize>,
    pub(super) center: Option<[f64; 3]>,
    /// Triangles by their materials.
    primitives: BTreeMap<Option<usize>, VertexRows>,
}

/// How a triangle looks: its material and the colours of its corners.
pub(super) struct Look {
    pub(super) material: Option<usize>,
    pub(super) colors: [[u8; 4]; 3],
}

impl Default for Look {
    fn default() -> Self {
        Look { material: None, colors: [WHITE; 3] }
    }
}

/// VertexRows of vertices with colours, and triangles.
#[derive(Default)]
struct VertexRows {
    numbers: HashMap<(u32, [u8; 4]), u32>,
    rows: Vec<(u32, [u8; 4])>,
    indices: Vec<u32>,
}

impl Object {
    pub(super) fn new(name: String, property: Option<(u32, u32)>) -> Self {
        Object { name, property, ..Object::default() }
    }

    /// Adds a triangle of vertices that exist.
    pub(super) fn push(&mut self, corners: [u32; 3], look: Look) -> Result<()> {
        let to = self.primitives.entry(look.material).or_default();
        for key in corners.into_iter().zip(look.colors) {
            let next = to.rows.len() as u32;
            let row = *to.numbers.entry(key).or_insert(next);
            if row == next {
                to.rows.push(key);
            }
            to.indices.push(row);
        }
        check_rows(to.rows.len() as u64)?;
        check_triangles(to.indices.len() as u64 / 3)
    }

    /// Makes the mesh.
    pub(super) fn finish(&mut self, made: &mut Made) -> Result<()> {
        let (vertices, primitives) =
            (std::mem::take(&mut self.vertices), std::mem::take(&mut self.primitives));
        if primitives.is_empty() {
            return Ok(());
        }
        self.center = center(vertices.iter().copied());
        let middle = self.center.unwrap_or_default();
        let primitive = |(material, rows): (Option<usize>, VertexRows)| {
            let mut primitive = Primitive { material, ..Primitive::default() };
            let position = |row: &(u32, [u8; 4])| {
                let p = vertices[row.0 as usize];
                [0, 1, 2].map(|k| (p[k] - middle[k]) as f32)
            };
            primitive.attributes.insert("POSITION".to_owned(), made.floats(rows.rows.iter().map(position)));
            if rows.rows.iter().any(|row| row.1 != WHITE) {
                let colors = made.floats(rows.rows.iter().map(|row| floats(row.1)));
                primitive.attributes.insert("COLOR_0".to_owned(), colors);
            }
            primitive.indices = Some(made.indices(rows.indices));
            primitive
        };
        let primitives = primitives.into_iter().map(primitive).collect();
        self.mesh = Some(made.document.meshes.len());
        made.document.meshes.push(GltfMesh { name: self.name.clone(), primitives, weights: None });
        Ok(())
    }
}

/// A colour in sRGB, linear.
pub(super) fn floats([r, g, b, a]: [u8; 4]) -> [f32; 4] {
    let part = |x: u8| f32::from(x) / 255.0;
    [linear(part(r)), linear(part(g)), linear(part(b)), part(a)]
}
