//! Collects the rows that the text and the binary reader of PLY bodies read.

use crate::error::Error;
use crate::mesh::{Keep, Wanted};
use crate::ply::header::{ElementKind, Header, Meaning};
use crate::raw::{Raw, check_triangles, strip};

/// Values of a vertex that are kept: position, normal, texture coordinate, colour.
pub(super) type Vertex = [f32; 11];

/// The index of a property in a [`Vertex`].
pub(super) fn slot(meaning: Meaning) -> Option<usize> {
    match meaning {
        Meaning::Position(k) => Some(k),
        Meaning::Normal(k) => Some(3 + k),
        Meaning::Uv(k) => Some(6 + k),
        Meaning::Color(k) => Some(8 + k),
        Meaning::Indices | Meaning::Other => None,
    }
}

/// A raw mesh that grows by vertices and faces.
pub(super) struct Sink<'a> {
    pub(super) raw: Raw<'a>,
    normals: bool,
    uvs: bool,
    /// Greatest value of a component of the colours, if they are kept.
    color_scale: Option<f32>,
    /// Rows of the colours of vertices.
    colors: Vec<u32>,
    vertices: u64,
    face: Vec<u32>,
}

/// An index of no vertex.
pub(super) struct BadIndex {
    pub(super) found: i64,
    pub(super) vertices: u64,
}

/// Why the sink refuses a row.
pub(super) enum Refused {
    Index(BadIndex),
    Limit(Error),
}

impl<'a> Sink<'a> {
    /// An empty sink for the vertices that the header announces.
    pub(super) fn new(
        raw: Raw<'a>,
        header: &Header,
        Wanted { attributes: keep, materials, .. }: Wanted,
    ) -> Self {
        Sink {
            color_scale: header.color_scale().filter(|_| materials),
            colors: Vec::new(),
            raw,
            normals: keep != Keep::None && header.has::<3>(Meaning::Normal),
            uvs: keep == Keep::All && header.has::<2>(Meaning::Uv),
            vertices: header.vertices().map_or(0, |v| v.count),
            face: Vec::new(),
        }
    }

    /// What was collected. Normals and texture coordinates are in the vertices' rows.
    pub(super) fn finish(self) -> Raw<'a> {
        let Sink { mut raw, normals, uvs, colors, .. } = self;
        if !colors.is_empty() {
            let corners = raw.triangles.iter().map(|corners| corners.map(|row| colors[row as usize]));
            raw.materials.colors.add(0, corners);
        }
        if normals {
            raw.normal_rows = raw.triangles.clone();
        }
        if uvs {
            raw.uv_rows = raw.triangles.clone();
        }
        raw
    }

    /// Adds a vertex.
    #[inline]
    pub(super) fn vertex(&mut self, [x, y, z, nx, ny, nz, u, v, red, green, blue]: Vertex) {
        self.raw.positions.push([x, y, z]);
        if self.normals {
            self.raw.normals.push([nx, ny, nz]);
        }
        if self.uvs {
            self.raw.uvs.push([u, v]);
        }
        if let Some(scale) = self.color_scale {
            self.colors.push(self.raw.materials.colors.srgb_row([red, green, blue].map(|x| x / scale)));
        }
    }

    /// Adds a face, or strips separated by -1.
    #[inline]
    pub(super) fn list(&mut self, kind: ElementKind, indices: &[i64]) -> Result<(), Refused> {
        if kind == ElementKind::Faces {
            self.rows(indices)?;
            self.raw.push_face(&self.face).map_err(Refused::Limit)?;
            return Ok(());
        }
        for piece in indices.split(|index| *index == -1).filter(|piece| !piece.is_empty()) {
            self.rows(piece)?;
            self.raw.skipped += u64::from(piece.len() < 3);
            self.raw.triangles.extend(strip(&self.face));
            check_triangles(self.raw.triangles.len() as u64).map_err(Refused::Limit)?;
        }
        Ok(())
    }

    /// Brings indices to `face`, checked.
    #[inline]
    fn rows(&mut self, indices: &[i64]) -> Result<(), Refused> {
        self.face.clear();
        for &index in indices {
            if index < 0 || index as u64 >= self.vertices {
                return Err(Refused::Index(BadIndex { found: index, vertices: self.vertices }));
            }
            self.face.push(index as u32);
        }
        Ok(())
    }
}
