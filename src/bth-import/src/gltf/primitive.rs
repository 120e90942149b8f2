//! The rows and corners of one glTF primitive in its mesh's own space, from accessors or from a
//! Draco stream.

use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::gltf::draco::DracoPrimitive;
use crate::gltf::extensions::{DRACO, unsupported_extension};
use crate::gltf::file::GltfFile;
use crate::gltf::schema::Primitive;
use crate::gltf::uv_set::UvSet;
use crate::mesh::Keep;
use crate::raw::{check_rows, strip};
use crate::source::{INDEX, INDEX_HINT, MALFORMED};

/// Primitive modes (glTF 2.0 specification, §3.7.2.1) up to this one make points and lines.
const LAST_LINE_MODE: u64 = 3;
const TRIANGLES: u64 = 4;
const TRIANGLE_STRIP: u64 = 5;
const TRIANGLE_FAN: u64 = 6;

/// The accessors of what is kept of a primitive.
pub(super) struct KeptAttributes {
    pub(super) positions: usize,
    pub(super) normals: Option<usize>,
    pub(super) uvs: Option<usize>,
    uv_set: Option<UvSet>,
}

impl KeptAttributes {
    /// Takes this set of texture coordinates instead of the material's choice.
    pub(super) fn take_uvs(&mut self, primitive: &Primitive, uv_set: UvSet) {
        self.uvs = primitive.attributes.get(&uv_set.attribute()).copied();
        self.uv_set = Some(uv_set);
    }
}

/// The vertices and triangles of a primitive. All corners are rows of `positions`, and so are
/// `normals` and `uvs`.
pub(super) struct Triangles {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) corners: Vec<[u32; 3]>,
    pub(super) normals: Option<Vec<[f32; 3]>>,
    pub(super) uvs: Option<Vec<[f32; 2]>>,
    /// Faces that their indices leave incomplete.
    pub(super) skipped: u64,
    /// The stream from which attributes were read.
    draco: Option<DracoPrimitive>,
}

/// A primitive of a document and its name for messages.
pub(super) struct PrimitiveReader<'p, 'a> {
    pub(super) file: &'p GltfFile<'a>,
    pub(super) primitive: &'p Primitive,
    pub(super) part: String,
}

impl<'p, 'a> PrimitiveReader<'p, 'a> {
    /// Returns readers of the primitives of a mesh, none for a mesh that does not exist.
    pub(super) fn of_mesh(file: &'p GltfFile<'a>, mesh: usize) -> impl Iterator<Item = Self> {
        let found = file.document.meshes.get(mesh);
        // Only numbers tell glTF meshes apart. What other formats call a mesh has its name.
        let name = found.map_or("", |mesh| mesh.name.as_str());
        let name = if file.is_made() { format!("mesh \"{name}\"") } else { format!("mesh {mesh}") };
        let primitives = found.map_or(&[][..], |mesh| &mesh.primitives);
        primitives.iter().enumerate().map(move |(index, primitive)| PrimitiveReader {
            file,
            primitive,
            part: format!("{name} primitive {index}"),
        })
    }
}

impl PrimitiveReader<'_, '_> {
    /// Finds the attributes to keep; `None` for a primitive without positions.
    ///
    /// # Errors
    /// `BTH-I011` where positions are compressed in a way that is not read, `BTH-I002` for a
    /// malformed material.
    pub(super) fn kept(&self, keep: Keep) -> Result<Option<KeptAttributes>> {
        let attributes = &self.primitive.attributes;
        let positions = attributes.get("POSITION").copied();
        let unread =
            self.primitive.extensions.keys().find(|name| name.contains("compression") && *name != DRACO);
        if let Some(name) = unread.filter(|_| positions.is_none_or(|p| !self.file.has_data(p))) {
            return Err(unsupported_extension(self.file.source, name));
        }
        let Some(positions) = positions else { return Ok(None) };
        let normals = attributes.get("NORMAL").copied().filter(|_| keep != Keep::None);
        let mut kept = KeptAttributes { positions, normals, uvs: None, uv_set: None };
        if keep == Keep::All {
            kept.take_uvs(self.primitive, self.file.kept_uvs(self.primitive.material)?);
        }
        Ok(Some(kept))
    }

    /// The accessors of the morph targets by the names of attributes.
    ///
    /// # Errors
    /// `BTH-I002` for a malformed target.
    pub(super) fn targets(&self) -> Result<Vec<BTreeMap<String, usize>>> {
        let target = |value: &Value| {
            BTreeMap::deserialize(value).map_err(|e| {
                let message = format!("expected the accessors of a morph target, found: {e}");
                self.file.error(MALFORMED, self.part.as_str(), message)
            })
        };
        self.primitive.targets.iter().map(target).collect()
    }

    /// The rows of a further attribute of vertices that were read; `None` if the primitive does not
    /// have it.
    pub(super) fn optional<const N: usize>(
        &self,
        triangles: &Triangles,
        name: &str,
    ) -> Result<Option<Vec<[f32; N]>>> {
        let (draco, rows) = (triangles.draco.as_ref(), triangles.positions.len() as u64);
        let accessor = self.primitive.attributes.get(name).copied();
        accessor.map(|accessor| self.attribute(draco, name, accessor, rows)).transpose()
    }

    /// How many points or lines a primitive of them has; `None` for triangles. Lines count each
    /// segment.
    pub(super) fn points_or_lines(&self, kept: &KeptAttributes) -> Result<Option<u64>> {
        let mode = self.mode();
        if mode > LAST_LINE_MODE {
            return Ok(None);
        }
        let count = self.file.count(self.primitive.indices.unwrap_or(kept.positions))?;
        Ok(Some(match mode {
            1 => count / 2,
            3 => count.saturating_sub(1),
            _ => count,
        }))
    }

    /// Reads the vertices and triangles; `rows_before` are those that the model has already.
    pub(super) fn read(&self, kept: &KeptAttributes, rows_before: usize) -> Result<Triangles> {
        let draco = self.draco(kept)?;
        // Refuse before anything large is made.
        let rows = match &draco {
            Some(draco) => draco.rows(),
            None => self.file.count(kept.positions)?,
        };
        check_rows((rows_before as u64).saturating_add(rows))?;
        let positions = self.attribute(draco.as_ref(), "POSITION", kept.positions, rows)?;
        let (indices, mode) = match (&draco, self.primitive.indices) {
            (Some(draco), _) => (draco.indices(), TRIANGLES),
            (None, Some(accessor)) => (self.file.indices(accessor)?, self.mode()),
            (None, None) => ((0..rows as u32).collect(), self.mode()),
        };
        self.check_indices(&indices, rows)?;
        let corners = corners(mode, &indices).ok_or_else(|| {
            let message = format!("expected a mode from 0 to 6, found {mode}");
            self.file.error(MALFORMED, self.part.as_str(), message)
        })?;
        let normals = kept.normals.map(|a| self.attribute(draco.as_ref(), "NORMAL", a, rows)).transpose()?;
        let mut uvs = None;
        if let (Some(accessor), Some(uv_set)) = (kept.uvs, &kept.uv_set) {
            let mut rows = self.attribute(draco.as_ref(), &uv_set.attribute(), accessor, rows)?;
            uv_set.apply(&mut rows);
            uvs = Some(rows);
        }
        Ok(Triangles { positions, corners, normals, uvs, skipped: incomplete(mode, indices.len()), draco })
    }

    /// Reads the colours of vertices (`COLOR_0`), linear, if there are some.
    pub(super) fn colors(&self, triangles: &Triangles) -> Result<Option<Vec<[f32; 4]>>> {
        let Some(accessor) = self.primitive.attributes.get("COLOR_0") else { return Ok(None) };
        if self.file.document.accessors.get(*accessor).is_some_and(|a| a.shape == "VEC3") {
            let colors = self.optional::<3>(triangles, "COLOR_0")?;
            return Ok(colors.map(|colors| colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()));
        }
        self.optional::<4>(triangles, "COLOR_0")
    }

    /// The Draco stream of a primitive, if its rows are there and nowhere else.
    fn draco(&self, kept: &KeptAttributes) -> Result<Option<DracoPrimitive>> {
        match self.primitive.extensions.get(DRACO) {
            Some(value) if !self.file.has_data(kept.positions) => {
                DracoPrimitive::decode(self.file, value, &self.part).map(Some)
            }
            _ => Ok(None),
        }
    }

    fn mode(&self) -> u64 {
        self.primitive.mode.unwrap_or(TRIANGLES)
    }

    /// An attribute's rows, from the Draco stream if it has them.
    fn attribute<const N: usize>(
        &self,
        draco: Option<&DracoPrimitive>,
        name: &str,
        accessor: usize,
        rows: u64,
    ) -> Result<Vec<[f32; N]>> {
        let decoded = draco.map(|d| d.attribute(self.file, name, accessor, &self.part)).transpose()?;
        if let Some(values) = decoded.flatten() {
            return Ok(values);
        }
        self.rows(accessor, rows)
    }

    /// Reads the rows of a vertex attribute; there must be one for each position.
    pub(super) fn rows<const N: usize>(&self, accessor: usize, rows: u64) -> Result<Vec<[f32; N]>> {
        let found = self.file.count(accessor)?;
        if found != rows {
            return Err(
                self.index_error(accessor, format!("expected {rows} rows as in POSITION, found {found}"))
            );
        }
        self.file.vectors(accessor)
    }

    fn check_indices(&self, indices: &[u32], rows: u64) -> Result<()> {
        let Some((at, found)) = indices.iter().enumerate().find(|(_, row)| u64::from(**row) >= rows) else {
            return Ok(());
        };
        let place = match self.primitive.indices {
            Some(accessor) => format!("{} accessor {accessor} row {at}", self.part),
            None => self.part.clone(),
        };
        let message = format!("expected an index below {rows}, found {found}");
        Err(self.file.source.error_in_part(INDEX, place, message, INDEX_HINT))
    }

    fn index_error(&self, accessor: usize, message: String) -> Error {
        let place = format!("{} accessor {accessor}", self.part);
        self.file.source.error_in_part(INDEX, place, message, INDEX_HINT)
    }
}

/// Triangles of a primitive; `None` for an unknown mode.
fn corners(mode: u64, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    Some(match mode {
        TRIANGLES => indices.as_chunks::<3>().0.to_vec(),
        TRIANGLE_STRIP => strip(indices).collect(),
        TRIANGLE_FAN => {
            let first = indices.first().copied().unwrap_or_default();
            indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], first]).collect()
        }
        _ => return None,
    })
}

/// Incomplete faces of a primitive of triangles: 0 or 1.
fn incomplete(mode: u64, indices: usize) -> u64 {
    u64::from(if mode == TRIANGLES { !indices.is_multiple_of(3) } else { (1..3).contains(&indices) })
}
