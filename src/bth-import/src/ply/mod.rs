//! PLY: vertices with faces or triangle strips, in text or binary of either byte order.

mod ascii;
mod binary;
mod header;

use self::header::{Encoding, Header, Kind, Meaning};
use crate::mesh::Keep;
use crate::raw::{Raw, check_rows, check_triangles, strip};
use crate::source::Source;

use crate::error::{Error, Place, Result};

/// Values of a vertex that are kept: position, normal, texture coordinate.
pub(in crate::ply) type Vertex = [f32; 8];

/// Where a property goes in a [`Vertex`].
pub(in crate::ply) fn slot(meaning: Meaning) -> Option<usize> {
    match meaning {
        Meaning::Position(k) => Some(k),
        Meaning::Normal(k) => Some(3 + k),
        Meaning::Uv(k) => Some(6 + k),
        Meaning::Indices | Meaning::Other => None,
    }
}

/// Takes the rows that the text and the binary reader find.
pub(in crate::ply) struct Sink<'a> {
    pub(in crate::ply) raw: Raw<'a>,
    normals: bool,
    uvs: bool,
    vertices: u64,
    face: Vec<u32>,
}

/// An index that names no vertex.
pub(in crate::ply) struct BadIndex {
    pub(in crate::ply) found: i64,
    pub(in crate::ply) vertices: u64,
}

/// What the sink refuses.
pub(in crate::ply) enum Refused {
    Index(BadIndex),
    Limit(Error),
}

impl Sink<'_> {
    /// A vertex.
    #[inline]
    pub(in crate::ply) fn vertex(&mut self, [x, y, z, nx, ny, nz, u, v]: Vertex) {
        self.raw.positions.push([x, y, z]);
        if self.normals {
            self.raw.normals.push([nx, ny, nz]);
        }
        if self.uvs {
            self.raw.uvs.push([u, v]);
        }
    }

    /// A face, or strips separated by -1.
    #[inline]
    pub(in crate::ply) fn list(&mut self, kind: Kind, indices: &[i64]) -> std::result::Result<(), Refused> {
        if kind == Kind::Faces {
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

    #[inline]
    fn rows(&mut self, indices: &[i64]) -> std::result::Result<(), Refused> {
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

/// Reads a PLY file. Edges count as skipped.
pub(crate) fn read<'a>(source: &'a Source<'_>, keep: Keep) -> Result<Raw<'a>> {
    let header = header::read(source)?;
    let vertices = header.vertices().map_or(0, |v| v.count);
    check_rows(vertices)?;
    let mut sink = Sink {
        raw: Raw::new("ply", Box::new(|_, _| Place::File(source.path.to_owned()))),
        normals: keep != Keep::None && header.has::<3>(Meaning::Normal),
        uvs: keep == Keep::All && header.has::<2>(Meaning::Uv),
        vertices,
        face: Vec::new(),
    };
    for element in header.elements.iter().filter(|e| e.kind == Kind::Edges) {
        sink.raw.skipped = sink.raw.skipped.saturating_add(element.count);
    }
    match header.encoding {
        Encoding::Ascii => ascii::read(source, &header, &mut sink)?,
        Encoding::Little => binary::read::<false>(source, &header, &mut sink)?,
        Encoding::Big => binary::read::<true>(source, &header, &mut sink)?,
    }
    let Sink { mut raw, normals, uvs, .. } = sink;
    if normals {
        raw.normal_rows = raw.triangles.clone();
    }
    if uvs {
        raw.uv_rows = raw.triangles.clone();
    }
    // Normals and texture coordinates stand in the vertex's row.
    Ok(Raw { locate: Box::new(move |_, row| place_of_vertex(source, &header, row)), ..raw })
}

fn place_of_vertex(source: &Source<'_>, header: &Header, row: usize) -> Place {
    match header.encoding {
        Encoding::Ascii => source.line(ascii::line_of_vertex(source, header, row)),
        Encoding::Little => source.byte(binary::byte_of_vertex::<false>(source, header, row)),
        Encoding::Big => source.byte(binary::byte_of_vertex::<true>(source, header, row)),
    }
}
