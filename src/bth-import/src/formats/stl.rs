//! Reads STL, text and binary.
//!
//! A reader of our own rather than `stl_io`: docs/decisions.md says why.

use super::{Format, first_word};
use crate::error::Result;
use crate::mesh::Wanted;
use crate::raw::{Raw, RowKind, check_rows, check_triangles};
use crate::room::{BYTES_PER_TRIANGLE, TRIANGLES_AT_ONCE, check_memory};
use crate::source::{MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT};
use crate::text::{Lines, point, shown, text, without_mark, words};

/// Bytes before the first facet: 80 of any content and the count of facets.
const HEADER: usize = 84;
/// Bytes of a facet: a normal, three corners, and two bytes that some programs use for colour.
const FACET: usize = 50;

/// STL, text and binary.
pub(super) const FORMAT: Format = Format {
    name: "stl",
    titles: &["STL"],
    extensions: &["stl"],
    is_like: |data| first_word(data).eq_ignore_ascii_case(b"solid") || is_binary_size(data),
    read,
    ..Format::ALONE
};

/// The count of facets in a binary header; `None` if the file is too short for a header.
fn binary_count(data: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(data.get(80..HEADER)?.try_into().ok()?))
}

/// Returns true if the file has exactly the length that its binary header implies. This
/// distinguishes binary files whose header begins with "solid" from text files.
fn is_binary_size(data: &[u8]) -> bool {
    binary_count(data).is_some_and(|n| data.len() as u64 == HEADER as u64 + FACET as u64 * u64::from(n))
}

/// Returns true if the first word of a text begins with "solid" in letters of any case.
fn begins_with_solid(data: &[u8]) -> bool {
    without_mark(data).trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

/// Reads an STL file. Each solid of a text is a group. Facet normals are not shading attributes and
/// are ignored.
fn read<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    let data = source.data;
    let is_text =
        !is_binary_size(data) && begins_with_solid(data) && !data[..data.len().min(1024)].contains(&0);
    if is_text { read_text(source, wanted) } else { read_binary(source) }
}

fn read_binary<'a>(source: &'a Source<'_>) -> Result<Raw<'a>> {
    let data = source.data;
    let Some(count) = binary_count(data) else {
        let message = format!("expected a header of {HEADER} bytes, found {} bytes in all", data.len());
        return Err(source.error_at_byte(TRUNCATED, data.len(), message, TRUNCATED_HINT));
    };
    let body = &data[HEADER..];
    if (body.len() / FACET) < count as usize {
        let found = body.len() / FACET;
        let message = format!("expected {count} facets as the header says, found {found}");
        return Err(source.error_at_byte(TRUNCATED, data.len(), message, TRUNCATED_HINT));
    }
    check_triangles(u64::from(count))?;
    check_memory(u64::from(count), BYTES_PER_TRIANGLE, TRIANGLES_AT_ONCE)?;
    let extra = body.len() - count as usize * FACET;
    if extra > 0 {
        source.monitor.warn(&format!("{extra} bytes after the last facet are ignored"));
    }
    let locate = |_: RowKind, row: usize| source.byte(HEADER + row / 3 * FACET + 12 + row % 3 * 12);
    let mut raw = Raw::new("stl", Box::new(locate));
    raw.positions.reserve_exact(3 * count as usize);
    for (row, facet) in body.chunks_exact(FACET).take(count as usize).enumerate() {
        source.tick(row as u64, HEADER + row * FACET)?;
        let (numbers, _) = facet[12..48].as_chunks::<4>();
        let (corners, _) = numbers.as_chunks::<3>();
        raw.positions.extend(corners.iter().map(|corner| corner.map(f32::from_le_bytes)));
    }
    raw.triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Ok(raw)
}

fn read_text<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    let mut raw = Raw::new("stl", Box::new(|_, row| source.line(line_of_vertex(source.data, row))));
    let mut lines = Lines::new(source.data);
    let (mut in_solid, mut in_facet) = (false, false);
    // Rows of the loop between `outer loop` and `endloop`.
    let mut open: Option<Vec<u32>> = None;
    while let Some((number, line)) = lines.next() {
        source.tick(number, lines.position())?;
        let mut words = words(line);
        let Some(keyword) = words.next() else { continue };
        let malformed = |message: String| source.error_at_line(MALFORMED, number, message, MALFORMED_HINT);
        match (keyword.to_ascii_lowercase().as_slice(), &mut open) {
            (b"solid", None) if !in_solid => {
                in_solid = true;
                let name = text(words.collect::<Vec<_>>().join(&b' '));
                let group = raw.groups.group(name, None);
                raw.groups.start(raw.triangles.len(), group);
            }
            (b"endsolid", None) if in_solid => in_solid = false,
            (b"facet", None) if in_solid => in_facet = true,
            (b"endfacet", None) if in_solid => in_facet = false,
            (b"outer", None) if in_solid => open = Some(Vec::with_capacity(3)),
            (b"vertex", Some(corners)) => {
                let position = point(&mut words).map_err(|word| {
                    malformed(format!("expected three numbers, found \"{}\"", shown(word)))
                })?;
                check_rows(raw.positions.len() as u64 + 1)?;
                corners.push(raw.positions.len() as u32);
                raw.positions.push(position);
            }
            (b"endloop", Some(corners)) => {
                raw.push_face(corners)?;
                open = None;
            }
            _ => {
                let expected = match (&open, in_solid) {
                    (Some(_), _) => "vertex or endloop",
                    (None, true) => "facet, outer loop, endfacet or endsolid",
                    (None, false) => "solid",
                };
                return Err(malformed(format!("expected {expected}, found \"{}\"", shown(keyword))));
            }
        }
    }
    if in_facet {
        let message = "expected endfacet and endsolid, found the end of the file";
        return Err(source.error_at_line(TRUNCATED, lines.number(), message, TRUNCATED_HINT));
    }
    if in_solid {
        source.monitor.warn("the file ends without endsolid; facets may be missing");
    }
    raw.finish_polygons(wanted.polygons, source.monitor)?;
    raw.exact = Some(Box::new(|| {
        let numbers = |(_, line)| point(&mut words(line).skip(1)).unwrap_or_default();
        vertex_lines(source.data).map(numbers).collect()
    }));
    Ok(raw)
}

/// The lines of vertices.
fn vertex_lines(data: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    let is_vertex = |line: &[u8]| words(line).next().is_some_and(|w| w.eq_ignore_ascii_case(b"vertex"));
    Lines::new(data).filter(move |(_, line)| is_vertex(line))
}

fn line_of_vertex(data: &[u8], row: usize) -> u64 {
    vertex_lines(data).nth(row).map_or(0, |(number, _)| number)
}
