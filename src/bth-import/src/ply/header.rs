//! The header of a PLY file: elements and their properties.

use crate::error::Result;
use crate::number::{Lines, integer, shown, words};
use crate::source::{MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Scalar types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn new(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary body.
    pub(super) fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Whether values are integers, as counts and indices must be.
    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// What a property means to the reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A coordinate of a position.
    Position(usize),
    /// A coordinate of a normal.
    Normal(usize),
    /// A texture coordinate.
    Uv(usize),
    /// Corners of a face, or a strip.
    Indices,
    /// Passed over.
    Other,
}

/// A property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    /// Type of a list's count; `None` for a single value.
    pub(super) list: Option<Scalar>,
    /// Type of the value or of a list's items.
    pub(super) scalar: Scalar,
    /// What it is for.
    pub(super) meaning: Meaning,
}

/// What an element is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ElementKind {
    Vertices,
    Faces,
    Strips,
    /// Edges: counted as skipped.
    Edges,
    Other,
}

/// An element: `count` rows of its properties.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) kind: ElementKind,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// A header.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Byte at which the body begins.
    pub(super) body: usize,
    /// Lines before the body.
    pub(super) lines: u64,
}

impl Header {
    /// The vertices, if the file has some.
    pub(super) fn vertices(&self) -> Option<&Element> {
        self.elements.iter().find(|element| element.kind == ElementKind::Vertices)
    }

    /// Whether vertices have all of `N` properties of a meaning.
    pub(super) fn has<const N: usize>(&self, meaning: impl Fn(usize) -> Meaning) -> bool {
        let properties = self.vertices().map_or(&[][..], |vertices| &vertices.properties);
        (0..N).all(|k| properties.iter().any(|p| p.meaning == meaning(k)))
    }
}

fn meaning(kind: ElementKind, name: &[u8], list: bool) -> Meaning {
    match (kind, name, list) {
        (ElementKind::Vertices, b"x", false) => Meaning::Position(0),
        (ElementKind::Vertices, b"y", false) => Meaning::Position(1),
        (ElementKind::Vertices, b"z", false) => Meaning::Position(2),
        (ElementKind::Vertices, b"nx", false) => Meaning::Normal(0),
        (ElementKind::Vertices, b"ny", false) => Meaning::Normal(1),
        (ElementKind::Vertices, b"nz", false) => Meaning::Normal(2),
        (ElementKind::Vertices, b"u" | b"s" | b"texture_u" | b"texture_s", false) => Meaning::Uv(0),
        (ElementKind::Vertices, b"v" | b"t" | b"texture_v" | b"texture_t", false) => Meaning::Uv(1),
        (ElementKind::Faces | ElementKind::Strips, b"vertex_indices" | b"vertex_index", true) => {
            Meaning::Indices
        }
        _ => Meaning::Other,
    }
}

/// Reads the header.
pub(super) fn read(source: &Source<'_>) -> Result<Header> {
    let mut lines = Lines::new(source.data);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut first = true;
    loop {
        let Some((number, line)) = lines.next() else {
            let message = "expected end_header, found the end of the file";
            return Err(source.error_at_line(TRUNCATED, lines.number(), message, TRUNCATED_HINT));
        };
        let malformed = |expected: &str| {
            let message = format!("expected {expected}, found \"{}\"", shown(line));
            source.error_at_line(MALFORMED, number, message, MALFORMED_HINT)
        };
        let words: Vec<&[u8]> = words(line).collect();
        if std::mem::take(&mut first) {
            if words != [b"ply"] {
                return Err(malformed("ply"));
            }
            continue;
        }
        match words[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, version] if encoding.is_none() => {
                encoding = Some(match name {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => return Err(malformed("ascii, binary_little_endian or binary_big_endian")),
                });
                if version != b"1.0" {
                    let message = format!("expected PLY version 1.0, found \"{}\"", shown(version));
                    let hint = "convert the model to PLY 1.0";
                    return Err(source.error_at_line(UNSUPPORTED, number, message, hint));
                }
            }
            [b"element", name, count] => {
                let kind = match name {
                    b"vertex" => ElementKind::Vertices,
                    b"face" => ElementKind::Faces,
                    b"tristrips" => ElementKind::Strips,
                    b"edge" => ElementKind::Edges,
                    _ => ElementKind::Other,
                };
                if kind == ElementKind::Vertices && elements.iter().any(|e| e.kind == kind) {
                    return Err(malformed("one element vertex"));
                }
                let count = integer(count).and_then(|n| u64::try_from(n).ok());
                let count = count.ok_or_else(|| malformed("a number of rows"))?;
                elements.push(Element { name: shown(name), kind, count, properties: Vec::new() });
            }
            [b"property", ref rest @ ..] => {
                let element = elements.last_mut().ok_or_else(|| malformed("element before property"))?;
                let scalar = |name| Scalar::new(name).ok_or_else(|| malformed("a PLY type"));
                let (list, item, name) = match *rest {
                    [b"list", count, item, name] => (Some(scalar(count)?), scalar(item)?, name),
                    [item, name] => (None, scalar(item)?, name),
                    _ => return Err(malformed("property type name or property list type type name")),
                };
                if list.is_some_and(|count| !count.is_integer()) {
                    return Err(malformed("an integer type for the count of a list"));
                }
                let meaning = meaning(element.kind, name, list.is_some());
                if meaning == Meaning::Indices && !item.is_integer() {
                    return Err(malformed("an integer type for indices"));
                }
                if meaning != Meaning::Other && element.properties.iter().any(|p| p.meaning == meaning) {
                    return Err(malformed("each property once"));
                }
                element.properties.push(Property { list, scalar: item, meaning });
            }
            [b"end_header"] => break,
            _ => return Err(malformed("format, element, property, comment or end_header")),
        }
    }
    let (body, lines) = (lines.position(), lines.number());
    let Some(encoding) = encoding else {
        let message = "expected a line \"format ...\" before end_header, found none";
        return Err(source.error_at_line(MALFORMED, lines, message, MALFORMED_HINT));
    };
    let header = Header { encoding, elements, body, lines };
    if header.vertices().is_some_and(|v| v.count > 0) && !header.has::<3>(Meaning::Position) {
        let message = "expected properties x, y and z of element vertex, found not all of them";
        return Err(source.error_at_line(MALFORMED, lines, message, MALFORMED_HINT));
    }
    for element in
        header.elements.iter().filter(|e| matches!(e.kind, ElementKind::Faces | ElementKind::Strips))
    {
        if element.count > 0 && element.properties.iter().all(|p| p.meaning != Meaning::Indices) {
            let message = format!("expected a list vertex_indices of element {}, found none", element.name);
            return Err(source.error_at_line(MALFORMED, lines, message, MALFORMED_HINT));
        }
    }
    Ok(header)
}
