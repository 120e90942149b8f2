//! The header of a PLY file: elements and their properties.

use crate::error::{Error, Result};
use crate::source::{MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};
use crate::text::{self, Lines, shown, words};

/// How the body is encoded.
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

    /// Returns true if values are integers, as counts and indices must be.
    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// What the reader uses a property for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A coordinate of a position.
    Position(usize),
    /// A coordinate of a normal.
    Normal(usize),
    /// A texture coordinate.
    Uv(usize),
    /// A component of a colour.
    Color(usize),
    /// Vertex indices of a face or of strips.
    Indices,
    /// Skipped.
    Other,
}

/// A property of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Property {
    /// Its name, as messages show it.
    pub(super) name: String,
    /// Type of a list's count; `None` for a single value.
    pub(super) list: Option<Scalar>,
    /// Type of the value or of a list's items.
    pub(super) scalar: Scalar,
    /// What it is used for.
    pub(super) meaning: Meaning,
}

/// What an element is used for.
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

/// The header of a file.
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
    /// The element of vertices, if the file has one.
    pub(super) fn vertices(&self) -> Option<&Element> {
        self.elements.iter().find(|element| element.kind == ElementKind::Vertices)
    }

    /// Returns true if coordinates of positions may have more digits than f32 keeps.
    pub(super) fn has_long_positions(&self) -> bool {
        let is_long = |scalar| matches!(scalar, Scalar::F64 | Scalar::I32 | Scalar::U32);
        let is_position = |p: &&Property| matches!(p.meaning, Meaning::Position(_));
        self.vertices().is_some_and(|v| v.properties.iter().filter(is_position).any(|p| is_long(p.scalar)))
    }

    /// The largest value of a component of vertex colours, 1 for numbers with a fraction; `None`
    /// without all three of one type.
    pub(super) fn color_scale(&self) -> Option<f32> {
        let properties = self.vertices()?.properties.iter();
        let mut types = properties.filter(|p| matches!(p.meaning, Meaning::Color(_))).map(|p| p.scalar);
        let first = types.next()?;
        let scale = match first {
            Scalar::U8 => f32::from(u8::MAX),
            Scalar::U16 => f32::from(u16::MAX),
            Scalar::F32 | Scalar::F64 => 1.0,
            Scalar::I8 | Scalar::I16 | Scalar::I32 | Scalar::U32 => return None,
        };
        (types.filter(|scalar| *scalar == first).count() == 2).then_some(scale)
    }

    /// Skips vertex colours.
    pub(super) fn skip_colors(&mut self) {
        for property in self.elements.iter_mut().flat_map(|element| &mut element.properties) {
            if matches!(property.meaning, Meaning::Color(_)) {
                property.meaning = Meaning::Other;
            }
        }
    }

    /// Returns true if vertices have all of the `N` properties of a meaning.
    pub(super) fn has<const N: usize>(&self, meaning: impl Fn(usize) -> Meaning) -> bool {
        let properties = self.vertices().map_or(&[][..], |vertices| &vertices.properties);
        (0..N).all(|k| properties.iter().any(|p| p.meaning == meaning(k)))
    }
}

/// What a property of this name is used for where it is the first one of its meaning.
pub(super) fn meaning(kind: ElementKind, name: &[u8], list: bool) -> Meaning {
    match (kind, name, list) {
        (ElementKind::Vertices, b"x", false) => Meaning::Position(0),
        (ElementKind::Vertices, b"y", false) => Meaning::Position(1),
        (ElementKind::Vertices, b"z", false) => Meaning::Position(2),
        (ElementKind::Vertices, b"nx", false) => Meaning::Normal(0),
        (ElementKind::Vertices, b"ny", false) => Meaning::Normal(1),
        (ElementKind::Vertices, b"nz", false) => Meaning::Normal(2),
        (ElementKind::Vertices, b"u" | b"s" | b"texture_u" | b"texture_s", false) => Meaning::Uv(0),
        (ElementKind::Vertices, b"v" | b"t" | b"texture_v" | b"texture_t", false) => Meaning::Uv(1),
        (ElementKind::Vertices, b"red" | b"diffuse_red", false) => Meaning::Color(0),
        (ElementKind::Vertices, b"green" | b"diffuse_green", false) => Meaning::Color(1),
        (ElementKind::Vertices, b"blue" | b"diffuse_blue", false) => Meaning::Color(2),
        (ElementKind::Faces | ElementKind::Strips, b"vertex_indices" | b"vertex_index", true) => {
            Meaning::Indices
        }
        _ => Meaning::Other,
    }
}

/// A header in the making, and the line that is being read.
struct HeaderReader<'s, 'd> {
    source: &'s Source<'d>,
    number: u64,
    line: &'d [u8],
    encoding: Option<Encoding>,
    elements: Vec<Element>,
}

/// Reads the header.
///
/// # Errors
/// `BTH-I002`, `BTH-I003` or `BTH-I006` with the line that does not follow the format, is missing,
/// or is not supported.
pub(super) fn read(source: &Source<'_>) -> Result<Header> {
    let mut lines = Lines::new(source.data);
    let mut reader = HeaderReader { source, number: 0, line: b"", encoding: None, elements: Vec::new() };
    loop {
        let Some((number, line)) = lines.next() else {
            let message = "expected end_header, found the end of the file";
            return Err(source.error_at_line(TRUNCATED, lines.number(), message, TRUNCATED_HINT));
        };
        (reader.number, reader.line) = (number, line);
        let words: Vec<&[u8]> = words(line).collect();
        match words[..] {
            [b"ply"] if number == 1 => {}
            _ if number == 1 => return Err(reader.malformed("ply")),
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, version] if reader.encoding.is_none() => reader.format(name, version)?,
            [b"element", name, count] => reader.element(name, count)?,
            [b"property", ref rest @ ..] => reader.property(rest)?,
            [b"end_header"] => {
                let body = body(source.data, lines.position(), reader.encoding);
                return reader.finish(body);
            }
            [name, ref rest @ ..] if !reader.is_misspelt(name, rest) => {
                source.monitor.warn(&format!("line {number}: \"{}\" is ignored", shown(line)));
            }
            _ => return Err(reader.malformed("format, element, property, comment or end_header")),
        }
    }
}

/// The byte at which the body begins, given that behind the line `end_header`. Where the lines of a
/// header end with CR alone, so does that one, and an LF behind it is the first byte of a binary
/// body.
fn body(data: &[u8], after: usize, encoding: Option<Encoding>) -> usize {
    let first = data.iter().position(|c| matches!(c, b'\r' | b'\n')).unwrap_or(data.len());
    let ends_with_cr = data[first..].starts_with(b"\r") && !data[first..].starts_with(b"\r\n");
    let takes_lf = encoding != Some(Encoding::Ascii) && data[..after].ends_with(b"\r\n");
    if ends_with_cr && takes_lf { after - 1 } else { after }
}

impl HeaderReader<'_, '_> {
    fn malformed(&self, expected: &str) -> Error {
        let message = format!("expected {expected}, found \"{}\"", shown(self.line));
        self.source.error_at_line(MALFORMED, self.number, message, MALFORMED_HINT)
    }

    /// Returns true if a line may be one that the body depends on: by its keyword, or since a type
    /// or a count is where these have one.
    fn is_misspelt(&self, keyword: &[u8], words: &[&[u8]]) -> bool {
        let is_type = |word: &[u8]| word == b"list" || Scalar::new(word).is_some();
        let is_count = |word: &&[u8]| words.len() == 2 && text::count(word).is_some();
        let is_word = keyword.first().is_some_and(u8::is_ascii_alphabetic);
        !is_word
            || [&b"ply"[..], b"format", b"element", b"property", b"end_header"].contains(&keyword)
            || words.first().is_some_and(|word| is_type(word))
            || words.last().is_some_and(is_count)
    }

    fn format(&mut self, name: &[u8], version: &[u8]) -> Result<()> {
        self.encoding = Some(match name {
            b"ascii" => Encoding::Ascii,
            b"binary_little_endian" => Encoding::Little,
            b"binary_big_endian" => Encoding::Big,
            _ => return Err(self.malformed("ascii, binary_little_endian or binary_big_endian")),
        });
        if version == b"1.0" {
            return Ok(());
        }
        let message = format!("expected PLY version 1.0, found \"{}\"", shown(version));
        Err(self.source.error_at_line(UNSUPPORTED, self.number, message, "convert the model to PLY 1.0"))
    }

    fn element(&mut self, name: &[u8], count: &[u8]) -> Result<()> {
        let kind = match name {
            b"vertex" => ElementKind::Vertices,
            b"face" => ElementKind::Faces,
            b"tristrips" => ElementKind::Strips,
            b"edge" => ElementKind::Edges,
            _ => ElementKind::Other,
        };
        if kind == ElementKind::Vertices && self.elements.iter().any(|e| e.kind == kind) {
            return Err(self.malformed("one element vertex"));
        }
        let count = text::count(count).ok_or_else(|| self.malformed("a number of rows"))?;
        self.elements.push(Element { name: shown(name), kind, count, properties: Vec::new() });
        Ok(())
    }

    fn property(&mut self, words: &[&[u8]]) -> Result<()> {
        let Some(element) = self.elements.last() else {
            return Err(self.malformed("element before property"));
        };
        let scalar = |name| Scalar::new(name).ok_or_else(|| self.malformed("a PLY type"));
        let (list, item, name) = match *words {
            [b"list", count, item, name] => (Some(scalar(count)?), scalar(item)?, name),
            [item, name] => (None, scalar(item)?, name),
            _ => return Err(self.malformed("property type name or property list type type name")),
        };
        if list.is_some_and(|count| !count.is_integer()) {
            return Err(self.malformed("an integer type for the count of a list"));
        }
        let mut meaning = meaning(element.kind, name, list.is_some());
        // Of several colours or texture coordinates, such as u and v next to s and t, the first
        // counts.
        let again = |p: &Property| {
            p.meaning == meaning && (matches!(meaning, Meaning::Color(_)) || p.name != shown(name))
        };
        let several = matches!(meaning, Meaning::Color(_) | Meaning::Uv(_));
        if several && element.properties.iter().any(again) {
            meaning = Meaning::Other;
        }
        if meaning == Meaning::Indices && !item.is_integer() {
            return Err(self.malformed("an integer type for indices"));
        }
        if meaning != Meaning::Other && element.properties.iter().any(|p| p.meaning == meaning) {
            return Err(self.malformed("each property once"));
        }
        if let Some(element) = self.elements.last_mut() {
            element.properties.push(Property { name: shown(name), list, scalar: item, meaning });
        }
        Ok(())
    }

    /// Checks that the header has what the body needs, which begins at byte `body`.
    fn finish(self, body: usize) -> Result<Header> {
        let (source, lines) = (self.source, self.number);
        let incomplete = |message: String| source.error_at_line(MALFORMED, lines, message, MALFORMED_HINT);
        let Some(encoding) = self.encoding else {
            let message = "expected a line \"format ...\" before end_header, found none";
            return Err(incomplete(message.to_owned()));
        };
        let header = Header { encoding, elements: self.elements, body, lines };
        if header.vertices().is_some_and(|v| v.count > 0) && !header.has::<3>(Meaning::Position) {
            let message = "expected properties x, y and z of element vertex, found not all of them";
            return Err(incomplete(message.to_owned()));
        }
        let has_corners = |e: &&Element| matches!(e.kind, ElementKind::Faces | ElementKind::Strips);
        for element in header.elements.iter().filter(has_corners) {
            if element.count > 0 && element.properties.iter().all(|p| p.meaning != Meaning::Indices) {
                let name = &element.name;
                let message = format!("expected a list vertex_indices of element {name}, found none");
                return Err(incomplete(message));
            }
        }
        Ok(header)
    }
}
