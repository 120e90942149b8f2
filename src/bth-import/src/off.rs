//! Reads OFF (the object file format of Geomview) as text.

use crate::error::Result;
use crate::number::{Lines, float, integer, shown, words};
use crate::raw::{Raw, check_rows};
use crate::source::{
    INDEX, INDEX_HINT, MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED,
};

/// Whether a word is the keyword of a variant of OFF: `[ST][C][N][4][n]OFF`.
pub(super) fn is_keyword(word: &[u8]) -> bool {
    variant(word).is_some()
}

/// The prefix of a keyword; `None` for other words.
fn variant(word: &[u8]) -> Option<&[u8]> {
    let prefix = word.strip_suffix(b"OFF")?;
    let mut rest = prefix;
    for part in [&b"ST"[..], b"C", b"N", b"4", b"n"] {
        rest = rest.strip_prefix(part).unwrap_or(rest);
    }
    rest.is_empty().then_some(prefix)
}

/// Lines without comments; blank ones are omitted.
struct Statements<'a, 'b> {
    source: &'b Source<'a>,
    lines: Lines<'a>,
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
            self.source.error_at_line(TRUNCATED, self.lines.number(), message, TRUNCATED_HINT)
        })
    }
}

/// Reads an OFF file. Colours, normals and texture coordinates at the ends of lines are ignored.
pub(super) fn read<'a>(source: &'a Source<'_>) -> Result<Raw<'a>> {
    let mut statements = Statements { source, lines: Lines::new(source.data) };
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
        *count = integer(word).and_then(|n| u64::try_from(n).ok()).ok_or_else(|| {
            malformed(number, format!("expected the number of {what}, found \"{}\"", shown(word)))
        })?;
    }
    let [vertices, faces] = counts;
    check_rows(vertices)?;

    let mut raw = Raw::new("off", Box::new(move |_, row| source.line(line_of_vertex(source, row))));
    for row in 0..vertices {
        source.tick(row, statements.lines.position())?;
        let (number, line) = statements.expect(&format!("vertex {row} of {vertices}"))?;
        let mut position = [0.0; 3];
        let mut line = words(line);
        for x in &mut position {
            let word = line.next().unwrap_or_default();
            *x = float(word).ok_or_else(|| {
                malformed(number, format!("expected three coordinates, found \"{}\"", shown(word)))
            })?;
        }
        raw.positions.push(position);
    }
    let mut face = Vec::new();
    for row in 0..faces {
        source.tick(row, statements.lines.position())?;
        let (number, line) = statements.expect(&format!("face {row} of {faces}"))?;
        let mut line = words(line);
        let word = line.next().unwrap_or_default();
        let corners = integer(word).and_then(|n| u64::try_from(n).ok()).ok_or_else(|| {
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
    Ok(raw)
}

fn line_of_vertex(source: &Source<'_>, row: usize) -> u64 {
    let mut statements = Statements { source, lines: Lines::new(source.data) };
    let Some((_, first)) = statements.next() else { return 0 };
    let word = words(first).next().unwrap_or_default();
    if is_keyword(word) && word.len() == first.len() {
        statements.next();
    }
    (0..=row).map_while(|_| statements.next()).last().map_or(0, |(number, _)| number)
}
