//! Reads Wavefront OBJ: polygons with normals and texture coordinates, and groups of them. What
//! materials are is in [`super::mtl`]; smoothing is ignored.
//!
//! A reader of our own rather than `tobj`: docs/decisions.md says why.

use super::Format;
use super::mtl::{self, Library};
use crate::error::{Error, Result};
use crate::groups::NamedGroups;
use crate::mesh::{Keep, Wanted};
use crate::polygon::fan;
use crate::raw::{Raw, RowKind, check_rows};
use crate::source::{INDEX, INDEX_HINT, MALFORMED, MALFORMED_HINT, Source, UNSUPPORTED, read_file};
use crate::text::{Lines, float, integer, shown, words};
use crate::text::{file_name, name, next_statement, statements};
use bth_format::layout::NONE;
use std::borrow::Cow;

const ATTRIBUTE_HINT: &str = "correct the file, or compile without attributes (--attributes none)";

/// Keywords of OBJ that do not change the polygons.
const KNOWN: &str = "g s o mg usemtl mtllib usemap maplib lod bevel c_interp d_interp shadow_obj trace_obj ctech \
    stech vp cstype deg bmat step parm trim hole scrv sp end con vn vt";

/// Returns true for a keyword that does not change the polygons.
fn is_known(keyword: &[u8]) -> bool {
    KNOWN.split(' ').any(|known| known.as_bytes() == keyword)
}

/// Wavefront OBJ, with materials of MTL.
pub(super) const FORMAT: Format = Format {
    name: "obj",
    titles: &["OBJ"],
    extensions: &["obj"],
    is_like,
    read,
    files: |path, looks| match looks.materials {
        true => Ok(mtl::files(path, &read_file(path)?)),
        false => Ok(Vec::new()),
    },
    images: |source, looks| mtl::images(source, looks.unreadable),
};

/// Returns true if the first statement of a text has a keyword of OBJ.
fn is_like(data: &[u8]) -> bool {
    let mut keywords = Lines::new(data).filter_map(|(_, line)| words(line).next());
    let first = keywords.find(|word| !word.starts_with(b"#"));
    first.is_some_and(|word| matches!(word, b"v" | b"f") || is_known(word))
}

/// A use of a row before its definition, which is allowed if the definition follows.
struct Forward {
    kind: RowKind,
    index: u32,
    line: u64,
}

struct Reader<'a, 's> {
    source: &'a Source<'s>,
    raw: Raw<'a>,
    normals: bool,
    uvs: bool,
    groups: NamedGroups,
    libraries: Vec<Library>,
    /// Rows of the colours of positions; shorter where the last ones have none.
    colors: Vec<Option<u32>>,
    forward: Vec<Forward>,
    face: Vec<u32>,
    face_normals: Vec<u32>,
    face_uvs: Vec<u32>,
}

/// Reads an OBJ file. A group is what has the same name, by the last statement `o` or `g`, and the
/// same material. A polyline counts as one skipped element, as does a free-form curve or surface;
/// each point of a point statement counts as one.
fn read<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    if let Some(byte) = source.data.iter().take(4096).position(|&c| c == 0) {
        let hint = "save it as UTF-8 or ASCII text, or give it the extension of its format";
        return Err(source.error_at_byte(UNSUPPORTED, byte, "expected text, found a zero byte", hint));
    }
    let locate = |kind, row| source.line(line_of_row(source.data, kind, row));
    let mut reader = Reader {
        source,
        raw: Raw::new("obj", Box::new(locate)),
        normals: wanted.attributes != Keep::None,
        uvs: wanted.attributes == Keep::All,
        groups: NamedGroups::default(),
        libraries: Vec::new(),
        colors: Vec::new(),
        forward: Vec::new(),
        face: Vec::new(),
        face_normals: Vec::new(),
        face_uvs: Vec::new(),
    };
    let mut unknown: Option<(u64, String, u64)> = None;
    let mut flat = 0u64;
    let mut lines = Lines::new(source.data);
    while let Some((number, line)) = next_statement(&mut lines) {
        source.tick(number, lines.position())?;
        let mut words = words(&line);
        match words.next().filter(|word| !word.starts_with(b"#")) {
            None => {}
            Some(b"v") => {
                let mut words = until_comment(words);
                let (position, found) = reader.numbers(number, &mut words, 2)?;
                flat += u64::from(found == 2);
                if wanted.materials {
                    reader.color(words);
                }
                reader.raw.positions.push(position);
            }
            Some(b"vn") if reader.normals => {
                let (normal, _) = reader.numbers(number, &mut until_comment(words), 3)?;
                reader.raw.normals.push(normal);
            }
            Some(b"vt") if reader.uvs => {
                let ([u, v, _], _) = reader.numbers(number, &mut until_comment(words), 1)?;
                reader.raw.uvs.push([u, v]);
            }
            Some(b"f" | b"fo") => reader.face(number, until_comment(words))?,
            Some(b"g" | b"o") if wanted.groups => {
                reader.groups.name(reader.raw.triangles.len(), name(words));
            }
            Some(b"mtllib") if wanted.materials => {
                reader.libraries.push(Library { line: number, names: file_name(words) });
            }
            Some(b"usemtl") if wanted.groups => {
                reader.groups.material(reader.raw.triangles.len(), name(words));
            }
            Some(b"p") => reader.raw.skipped += until_comment(words).count() as u64,
            Some(b"l" | b"curv" | b"curv2" | b"surf") => reader.raw.skipped += 1,
            Some(keyword) if is_known(keyword) => {}
            Some(keyword) => {
                unknown.get_or_insert_with(|| (number, shown(keyword), 0)).2 += 1;
            }
        }
    }
    reader.check_forward()?;
    check_rows(reader.raw.positions.len() as u64)?;
    if let Some((line, keyword, count)) = unknown {
        let message = format!(
            "{count} lines with unknown keywords are ignored; the first is \"{keyword}\" in line {line}"
        );
        source.monitor.warn(&message);
    }
    if flat > 0 {
        source.monitor.warn(&format!("{flat} vertices have two coordinates; the third is taken as 0"));
    }
    let mut raw = reader.finish(wanted)?;
    raw.drop_unused_rows();
    raw.exact = Some(Box::new(|| exact_positions(source.data)));
    Ok(raw)
}

/// The positions in f64, of a text that was read before.
fn exact_positions(data: &[u8]) -> Vec<[f64; 3]> {
    let mut lines = Lines::new(data);
    let statements = std::iter::from_fn(|| next_statement(&mut lines));
    let position = |(_, line): (u64, Cow<'_, [u8]>)| {
        let mut words = words(&line);
        (words.next() == Some(b"v")).then(|| {
            let mut numbers = until_comment(words).map(|word| float(word).unwrap_or_default());
            std::array::from_fn(|_| numbers.next().unwrap_or_default())
        })
    };
    statements.filter_map(position).collect()
}

impl<'a> Reader<'a, '_> {
    /// What was read, with its materials.
    fn finish(self, wanted: Wanted) -> Result<Raw<'a>> {
        let Reader { source, mut raw, groups, libraries, colors, .. } = self;
        raw.groups = groups.recorder;
        raw.finish_polygons(wanted.polygons, source.monitor)?;
        if wanted.materials {
            let names = raw.groups.material_names();
            mtl::read(source, &libraries, names, wanted.unreadable, &mut raw.materials)?;
        }
        if !colors.is_empty() {
            // A position without a colour is white.
            let white = raw.materials.colors.row([1.0; 4]);
            let row = |position: u32| colors.get(position as usize).copied().flatten().unwrap_or(white);
            raw.materials.colors.add(0, raw.triangles.iter().map(|corners| corners.map(row)));
        }
        Ok(raw)
    }
}

impl Reader<'_, '_> {
    /// Parses up to three numbers. The first `needed` are mandatory; the others default to 0.
    /// Returns also how many there are.
    fn numbers<'w>(
        &self,
        line: u64,
        words: &mut impl Iterator<Item = &'w [u8]>,
        needed: usize,
    ) -> Result<([f32; 3], usize)> {
        let mut numbers = [0.0; 3];
        for (k, number) in numbers.iter_mut().enumerate() {
            let word = match words.next() {
                None if k >= needed => return Ok((numbers, k)),
                word => word.unwrap_or_default(),
            };
            *number = float(word).ok_or_else(|| {
                let message = format!("expected {needed} or more numbers, found \"{}\"", shown(word));
                self.source.error_at_line(MALFORMED, line, message, MALFORMED_HINT)
            })?;
        }
        Ok((numbers, 3))
    }

    /// Keeps the colour behind the coordinates of a position, sRGB, if there are three numbers.
    fn color<'w>(&mut self, words: impl Iterator<Item = &'w [u8]>) {
        let numbers: Vec<f32> = words.map_while(float).take(3).collect();
        if let [r, g, b] = *numbers.as_slice() {
            let row = self.raw.materials.colors.srgb_row([r, g, b]);
            self.colors.resize(self.raw.positions.len(), None);
            self.colors.push(Some(row));
        }
    }

    fn face<'w>(&mut self, line: u64, words: impl Iterator<Item = &'w [u8]>) -> Result<()> {
        self.face.clear();
        self.face_normals.clear();
        self.face_uvs.clear();
        for word in words {
            // v, v/vt, v//vn or v/vt/vn; a part may be empty.
            let mut parts = word.split(|&c| c == b'/');
            let position = self.index(line, RowKind::Position, word, parts.next().unwrap_or_default())?;
            self.face.push(position);
            let (uv, normal) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
            if self.uvs {
                let uv = if uv.is_empty() { NONE } else { self.index(line, RowKind::Uv, word, uv)? };
                self.face_uvs.push(uv);
            }
            if self.normals {
                let normal =
                    if normal.is_empty() { NONE } else { self.index(line, RowKind::Normal, word, normal)? };
                self.face_normals.push(normal);
            }
        }
        fan(&mut self.raw.normal_rows, &self.face_normals);
        fan(&mut self.raw.uv_rows, &self.face_uvs);
        self.raw.push_face(&self.face)
    }

    /// The row that an index means. Indices count from 1; negative ones count back from the last
    /// row so far.
    #[inline]
    fn index(&mut self, line: u64, kind: RowKind, word: &[u8], index: &[u8]) -> Result<u32> {
        let rows = self.rows(kind);
        let Some(number) = integer(index) else {
            let message = format!("expected a face corner such as 1/2/3, found \"{}\"", shown(word));
            return Err(self.source.error_at_line(MALFORMED, line, message, MALFORMED_HINT));
        };
        let row = if number > 0 { number - 1 } else { rows as i64 + number };
        if number == 0 || row < 0 || row >= i64::from(NONE) {
            return Err(self.out_of_range(line, kind, number));
        }
        if row >= rows as i64 {
            self.forward.push(Forward { kind, index: row as u32, line });
        }
        Ok(row as u32)
    }

    fn rows(&self, kind: RowKind) -> usize {
        match kind {
            RowKind::Position => self.raw.positions.len(),
            RowKind::Normal => self.raw.normals.len(),
            RowKind::Uv => self.raw.uvs.len(),
        }
    }

    #[cold]
    fn out_of_range(&self, line: u64, kind: RowKind, number: i64) -> Error {
        let name = match kind {
            RowKind::Position => "v",
            RowKind::Normal => "vn",
            RowKind::Uv => "vt",
        };
        let rows = self.rows(kind);
        let message = if number < 0 {
            format!("expected an index of one of the {rows} {name} lines above, found {number}")
        } else {
            format!("expected an index of a {name} line, from 1 to {rows}, found {number}")
        };
        let hint = if kind == RowKind::Position { INDEX_HINT } else { ATTRIBUTE_HINT };
        self.source.error_at_line(INDEX, line, message, hint)
    }

    /// Fails for the first use of a row that the whole file does not define.
    fn check_forward(&self) -> Result<()> {
        match self.forward.iter().find(|f| f.index as usize >= self.rows(f.kind)) {
            Some(f) => Err(self.out_of_range(f.line, f.kind, i64::from(f.index) + 1)),
            None => Ok(()),
        }
    }
}

/// The words before a comment, which begins at a word that begins with `#`.
#[inline]
fn until_comment<'w>(words: impl Iterator<Item = &'w [u8]>) -> impl Iterator<Item = &'w [u8]> {
    words.take_while(|word| !word.starts_with(b"#"))
}

fn line_of_row(data: &[u8], kind: RowKind, row: usize) -> u64 {
    let keyword = match kind {
        RowKind::Position => &b"v"[..],
        RowKind::Normal => b"vn",
        RowKind::Uv => b"vt",
    };
    let mut found = statements(data).filter(|(_, line)| words(line).next() == Some(keyword));
    found.nth(row).map_or(0, |(number, _)| number)
}
