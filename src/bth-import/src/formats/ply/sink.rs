//! Collects the rows of PLY bodies, and warns of geometry and attributes that are not kept.

use crate::error::{Place, Result};
use crate::formats::ply::header::{Element, ElementKind, Header, Meaning, Property, meaning};
use crate::mesh::{Keep, Wanted};
use crate::raw::{Raw, check_triangles, strip};
use crate::source::{INDEX, INDEX_HINT, Source, input_error};

/// Values of a vertex that are kept: position, normal, texture coordinate, colour.
pub(super) type Vertex = [f64; 11];

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
    /// The positions in f64 if the file has more digits than f32.
    exact: Option<Vec<[f64; 3]>>,
    normals: bool,
    uvs: bool,
    /// Largest value of a component of the colours, if they are kept.
    color_scale: Option<f32>,
    /// Rows of the colours of vertices.
    colors: Vec<u32>,
    vertices: u64,
    face: Vec<u32>,
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
            exact: header.has_long_positions().then(Vec::new),
            raw,
            normals: keep != Keep::None && header.has::<3>(Meaning::Normal),
            uvs: keep == Keep::All && header.has::<2>(Meaning::Uv),
            vertices: header.vertices().map_or(0, |v| v.count),
            face: Vec::new(),
        }
    }

    /// What was collected. Normals and texture coordinates are in the vertices' rows.
    pub(super) fn finish(self) -> Raw<'a> {
        let Sink { mut raw, exact, normals, uvs, colors, .. } = self;
        if let Some(exact) = exact {
            raw.exact = Some(Box::new(move || exact.clone()));
        }
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
    pub(super) fn vertex(&mut self, vertex: Vertex) {
        if let (Some(exact), [x, y, z, ..]) = (&mut self.exact, vertex) {
            exact.push([x, y, z]);
        }
        let [x, y, z, nx, ny, nz, u, v, red, green, blue] = vertex.map(|x| x as f32);
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
    ///
    /// # Errors
    /// `BTH-I005` for an index of no vertex, at the place that `place` returns with a text for the
    /// message; `BTH-L001` for too many triangles.
    #[inline]
    pub(super) fn list(
        &mut self,
        kind: ElementKind,
        indices: &[i64],
        place: impl Fn() -> (Place, String),
    ) -> Result<()> {
        if kind == ElementKind::Faces {
            self.rows(indices, place)?;
            return self.raw.push_face(&self.face);
        }
        for piece in indices.split(|index| *index == -1).filter(|piece| !piece.is_empty()) {
            self.rows(piece, &place)?;
            self.raw.skipped += u64::from(piece.len() < 3);
            self.raw.triangles.extend(strip(&self.face));
            check_triangles(self.raw.triangles.len() as u64)?;
        }
        Ok(())
    }

    /// Brings indices to `face`, checked.
    #[inline]
    fn rows(&mut self, indices: &[i64], place: impl Fn() -> (Place, String)) -> Result<()> {
        self.face.clear();
        for &index in indices {
            if index < 0 || index as u64 >= self.vertices {
                let (place, of_row) = place();
                let vertices = self.vertices;
                let message = format!("expected an index from 0 and below {vertices}, found {index}{of_row}");
                return Err(input_error(INDEX, place, message, INDEX_HINT));
            }
            self.face.push(index as u32);
        }
        Ok(())
    }
}

/// Names of lists that hold the texture coordinates of the corners of faces.
const FACE_COORDINATES: [&str; 4] = ["texcoord", "texcoords", "texture_coordinates", "texture_uv"];

/// Warns of lists of vertex indices in elements that are not read, and of texture coordinates and
/// colours that are not kept where they are wanted.
pub(super) fn warn_left_out(source: &Source<'_>, header: &Header, wanted: Wanted) {
    for element in header.elements.iter().filter(|element| element.count > 0) {
        let Element { name, count, kind, properties } = element;
        let named = |found: fn(&Element, &Property) -> bool| {
            let found: Vec<&str> =
                properties.iter().filter(|p| found(element, p)).map(|p| p.name.as_str()).collect();
            (!found.is_empty()).then(|| found.join(", "))
        };
        let tell = |what: String| source.monitor.warn(&format!("{count} rows of element {name}: {what}"));
        if let Some(names) = named(has_indices).filter(|_| *kind == ElementKind::Other) {
            tell(format!("{names} is not read; polygons come from element face, strips from tristrips"));
        }
        if let Some(names) = named(has_colors).filter(|_| wanted.materials) {
            let kept = match kind {
                ElementKind::Vertices => {
                    "a vertex keeps its first red, green and blue of one type: uchar, ushort or float"
                }
                _ => "only vertices keep colours",
            };
            tell(format!("the colours {names} are not kept; {kept}"));
        }
        if wanted.attributes != Keep::All {
            continue;
        }
        if let Some(names) = named(has_face_coordinates) {
            tell(format!(
                "the texture coordinates {names} are not kept; only vertices keep texture coordinates"
            ));
        }
        if let Some(names) = named(has_second_coordinates) {
            tell(format!("the texture coordinates {names} are not kept; only the first ones are"));
        }
    }
}

/// Returns true if a property of any element looks like the corners of faces or strips.
fn has_indices(_: &Element, property: &Property) -> bool {
    let as_of_face = meaning(ElementKind::Faces, property.name.as_bytes(), property.list.is_some());
    as_of_face == Meaning::Indices && property.scalar.is_integer()
}

fn has_face_coordinates(element: &Element, property: &Property) -> bool {
    element.kind == ElementKind::Faces
        && property.list.is_some()
        && FACE_COORDINATES.contains(&property.name.as_str())
}

/// Returns true if a property is a component of a colour that is not read. Other elements name such
/// components as vertices do.
fn has_colors(_: &Element, property: &Property) -> bool {
    let of_vertices = meaning(ElementKind::Vertices, property.name.as_bytes(), property.list.is_some());
    property.meaning == Meaning::Other && matches!(of_vertices, Meaning::Color(_))
}

/// Returns true if a property would be a texture coordinate of vertices if there were none before
/// it.
fn has_second_coordinates(element: &Element, property: &Property) -> bool {
    let alone = meaning(element.kind, property.name.as_bytes(), property.list.is_some());
    property.meaning == Meaning::Other && matches!(alone, Meaning::Uv(_))
}
