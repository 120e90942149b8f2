//! Warns of geometry and attributes of a PLY file that are not kept.

use crate::mesh::{Keep, Wanted};
use crate::ply::header::{Element, ElementKind, Header, Meaning, Property, meaning};
use crate::source::Source;

/// Names of lists that hold the texture coordinates of the corners of faces.
const FACE_COORDINATES: [&str; 4] = ["texcoord", "texcoords", "texture_coordinates", "texture_uv"];

/// Warns of lists of vertex indices in elements that are not read, and of texture coordinates and colours that are
/// not kept where they are wanted.
pub(super) fn warn(source: &Source<'_>, header: &Header, wanted: Wanted) {
    for element in header.elements.iter().filter(|element| element.count > 0) {
        let Element { name, count, kind, properties } = element;
        let named = |found: fn(&Element, &Property) -> bool| {
            let found: Vec<&str> =
                properties.iter().filter(|p| found(element, p)).map(|p| p.name.as_str()).collect();
            (!found.is_empty()).then(|| found.join(", "))
        };
        let tell = |what: String| source.monitor.warn(&format!("{count} rows of element {name}: {what}"));
        if let Some(names) = named(has_indices).filter(|_| *kind == ElementKind::Other) {
            tell(format!(
                "{names} is not read; polygons are those of element face, strips those of tristrips"
            ));
        }
        if let Some(names) = named(has_colors).filter(|_| wanted.materials) {
            let kept = match kind {
                ElementKind::Vertices => {
                    "of vertices the first red, green and blue of one type are, uchar, ushort or float"
                }
                _ => "only those of vertices are",
            };
            tell(format!("the colours {names} are not kept, {kept}"));
        }
        if wanted.attributes != Keep::All {
            continue;
        }
        if let Some(names) = named(has_face_coordinates) {
            tell(format!("the texture coordinates {names} are not kept, only those of vertices are"));
        }
        if let Some(names) = named(has_second_coordinates) {
            tell(format!("the texture coordinates {names} are not kept, only the first ones are"));
        }
    }
}

/// Whether a property of any element looks like the corners of faces or strips.
fn has_indices(_: &Element, property: &Property) -> bool {
    let as_of_face = meaning(ElementKind::Faces, property.name.as_bytes(), property.list.is_some());
    as_of_face == Meaning::Indices && property.scalar.is_integer()
}

fn has_face_coordinates(element: &Element, property: &Property) -> bool {
    element.kind == ElementKind::Faces
        && property.list.is_some()
        && FACE_COORDINATES.contains(&property.name.as_str())
}

/// Whether a property is a component of a colour that is not read. Other elements name such components as vertices do.
fn has_colors(_: &Element, property: &Property) -> bool {
    let of_vertices = meaning(ElementKind::Vertices, property.name.as_bytes(), property.list.is_some());
    property.meaning == Meaning::Other && matches!(of_vertices, Meaning::Color(_))
}

/// Whether a property would be a texture coordinate of vertices if there were none before it.
fn has_second_coordinates(element: &Element, property: &Property) -> bool {
    let alone = meaning(element.kind, property.name.as_bytes(), property.list.is_some());
    property.meaning == Meaning::Other && matches!(alone, Meaning::Uv(_))
}
