//! Reads OFF (the object file format of Geomview) as text.

use super::{Format, first_word};
use crate::error::Result;
use crate::mesh::Wanted;
use crate::raw::{Raw, check_rows};
use crate::source::{
    INDEX, INDEX_HINT, MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED,
};
use crate::text::{self, Lines, integer, point, shown, words};

/// Hint for a file that ends early and has lines with more than three numbers.
const LINES_HINT: &str =
    "write each vertex and each face on a line of its own, or copy the file again if it is cut off";

/// Text of Geomview.
pub(super) const FORMAT: Format = Format {
    name: "off",
    titles: &["OFF"],
    extensions: &["off"],
    is_like: |data| variant(first_word(data)).is_some(),
    read,
    ..Format::ALONE
};

/// Returns the prefix of the keyword of a variant of OFF: `[ST][C][N][4][n]OFF`, with the letters
/// before `OFF` in any order; `None` for other words.
fn variant(word: &[u8]) -> Option<&[u8]> {
    let prefix = word.strip_suffix(b"OFF")?;
    let (mut rest, mut parts) = (prefix, vec![&b"ST"[..], b"C", b"N", b"4", b"n"]);
    while !rest.is_empty() {
        let next = parts.iter().position(|part| rest.starts_with(part))?;
        rest = &rest[parts.swap_remove(next).len()..];
    }
    Some(prefix)
}

/// Lines without comments; blank ones are omitted.
struct Statements<'a, 'b> {
    source: &'b Source<'a>,
    lines: Lines<'a>,
    /// The first line of a vertex that has numbers for a second one, which may also be attributes.
    long_line: Option<u64>,
}

impl<'a> Statements<'a, '_> {
    fn next(&mut self) -> Option<(u64, &'a [u8])> {
        loop {
            let (number, line) = self.lines.next()?;
            let line = line.split(|&c| c == b'#').next().unwrap_or_default().trim_ascii();
            if !line.is_empty() {
                return Some((number, line));
            }
        }
    }

    fn expect(&mut self, what: &str) -> Result<(u64, &'a [u8])> {
        self.next().ok_or_else(|| {
            let message = format!("expected {what}, found the end of the file");
            let Some(long) = self.long_line else {
                return self.source.error_at_line(TRUNCATED, self.lines.number(), message, TRUNCATED_HINT);
            };
            let message =
                format!("{message}; a line has one vertex or one face, line {long} has more numbers");
            self.source.error_at_line(TRUNCATED, self.lines.number(), message, LINES_HINT)
        })
    }
}

/// Reads an OFF file. Colours, normals and texture coordinates at the ends of lines are ignored,
/// so each vertex and each face must have a separate line.
fn read<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    let mut statements = Statements { source, lines: Lines::new(source.data), long_line: None };
    let malformed =
        |number, message: String| source.error_at_line(MALFORMED, number, message, MALFORMED_HINT);

    // The keyword is optional, and the counts may be on its line.
    let (mut number, mut line) = statements.expect("OFF or the counts")?;
    let first = words(line).next().unwrap_or_default();
    if let Some(prefix) = variant(first) {
        let rest = line[first.len()..].trim_ascii();
        if prefix.contains(&b'4') || prefix.contains(&b'n') || rest.starts_with(b"BINARY") {
            let message = format!("expected three-dimensional text, found \"{}\"", shown(line));
            let hint = "convert the model to plain OFF or another format";
            return Err(source.error_at_line(UNSUPPORTED, number, message, hint));
        }
        (number, line) = if rest.is_empty() { statements.expect("the counts")? } else { (number, rest) };
    }
    let mut counts = [0u64; 2];
    let mut count_words = words(line);
    for (count, what) in counts.iter_mut().zip(["vertices", "faces"]) {
        let word = count_words.next().unwrap_or_default();
        *count = text::count(word).ok_or_else(|| {
            malformed(number, format!("expected the number of {what}, found \"{}\"", shown(word)))
        })?;
    }
    let [vertices, faces] = counts;
    check_rows(vertices)?;

    let mut raw = Raw::new("off", Box::new(move |_, row| source.line(line_of_vertex(source, row))));
    for row in 0..vertices {
        source.tick(row, statements.lines.position())?;
        let (number, line) = statements.expect(&format!("vertex {row} of {vertices}"))?;
        let mut line = words(line);
        let position = point(&mut line).map_err(|word| {
            malformed(number, format!("expected three coordinates, found \"{}\"", shown(word)))
        })?;
        if statements.long_line.is_none() && line.count() >= 3 {
            statements.long_line = Some(number);
        }
        raw.positions.push(position);
    }
    let mut face = Vec::new();
    for row in 0..faces {
        source.tick(row, statements.lines.position())?;
        let (number, line) = statements.expect(&format!("face {row} of {faces}"))?;
        let mut line = words(line);
        let word = line.next().unwrap_or_default();
        let corners = text::count(word).ok_or_else(|| {
            malformed(number, format!("expected a number of corners, found \"{}\"", shown(word)))
        })?;
        face.clear();
        for _ in 0..corners {
            let word = line.next().unwrap_or_default();
            let index = integer(word).ok_or_else(|| {
                malformed(number, format!("expected {corners} indices, found \"{}\"", shown(word)))
            })?;
            if index < 0 || index as u64 >= vertices {
                let message = format!("expected an index from 0 and below {vertices}, found {index}");
                return Err(source.error_at_line(INDEX, number, message, INDEX_HINT));
            }
            face.push(index as u32);
        }
        raw.push_face(&face)?;
    }
    if let Some((number, _)) = statements.next() {
        source.monitor.warn(&format!("line {number}: what follows the last face is ignored"));
    }
    raw.finish_polygons(wanted.polygons, source.monitor)?;
    raw.exact = Some(Box::new(move || {
        let lines = vertex_lines(source).take(vertices as usize);
        lines.map(|(_, line)| point(&mut words(line)).unwrap_or_default()).collect()
    }));
    Ok(raw)
}

/// The lines from the first vertex on, of a text that was read before.
fn vertex_lines<'a>(source: &Source<'a>) -> impl Iterator<Item = (u64, &'a [u8])> {
    let mut statements = Statements { source, lines: Lines::new(source.data), long_line: None };
    let first = statements.next().map_or(&b""[..], |(_, line)| line);
    let word = words(first).next().unwrap_or_default();
    if variant(word).is_some() && word.len() == first.len() {
        statements.next();
    }
    std::iter::from_fn(move || statements.next())
}

fn line_of_vertex(source: &Source<'_>, row: usize) -> u64 {
    vertex_lines(source).nth(row).map_or(0, |(number, _)| number)
}
