//! Reads OFF (the object file format of Geomview) as text.

use super::{Format, first_word};
use crate::error::{Error, Result};
use crate::mesh::Wanted;
use crate::raw::{Raw, check_rows};
use crate::source::{
    INDEX, INDEX_HINT, MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED,
};
use crate::text::{self, Lines, integer, point, shown};

/// Text of Geomview.
pub(super) const FORMAT: Format = Format {
    name: "off",
    titles: &["OFF"],
    extensions: &["off"],
    is_like: |data| split_keyword(first_word(data)).is_some(),
    read,
    ..Format::ALONE
};

/// Splits the first word into the prefix of a variant of OFF, `[ST][C][N][4][n]OFF` with the
/// letters before `OFF` in any order, and the number of vertices that may follow without a blank.
/// `None` for other words.
fn split_keyword(word: &[u8]) -> Option<(&[u8], &[u8])> {
    let at = word.windows(3).position(|three| three == b"OFF")?;
    let (prefix, number) = (&word[..at], &word[at + 3..]);
    let (mut rest, mut parts) = (prefix, vec![&b"ST"[..], b"C", b"N", b"4", b"n"]);
    while !rest.is_empty() {
        let next = parts.iter().position(|part| rest.starts_with(part))?;
        rest = &rest[parts.swap_remove(next).len()..];
    }
    number.iter().all(u8::is_ascii_digit).then_some((prefix, number))
}

/// The words of the text without comments, and where elements end.
struct Values<'a, 'b> {
    source: &'b Source<'a>,
    lines: Lines<'a>,
    /// What is left of the line.
    rest: &'a [u8],
    /// The line from which the last word came.
    number: u64,
    /// The line on which the last element began.
    began: u64,
    /// True if the next element begins right behind the last one, else on the next line.
    is_stream: bool,
}

impl<'a> Values<'a, '_> {
    /// The next word, also of another line; empty at the end of the file.
    fn next(&mut self) -> &'a [u8] {
        loop {
            self.rest = self.rest.trim_ascii_start();
            if !self.rest.is_empty() && self.rest[0] != b'#' {
                let end = self.rest.iter().position(|c| c.is_ascii_whitespace() || *c == b'#');
                let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
                self.rest = rest;
                return word;
            }
            let Some((number, line)) = self.lines.next() else { return b"" };
            (self.number, self.rest) = (number, line);
        }
    }

    /// Returns true if the line has no more words.
    fn is_line_done(&self) -> bool {
        self.rest.trim_ascii_start().first().is_none_or(|c| *c == b'#')
    }

    /// Ends an element. What follows on its line are attributes, which are ignored, unless the
    /// element took several lines.
    fn end(&mut self) -> Result<()> {
        if self.is_stream || self.is_line_done() {
            return Ok(());
        }
        if self.number != self.began {
            return Err(self.wrong("the end of the line", self.rest.trim_ascii()));
        }
        self.rest = b"";
        Ok(())
    }

    /// The first word of an element.
    fn begin(&mut self) -> &'a [u8] {
        let word = self.next();
        self.began = self.number;
        word
    }

    /// Reads vertex `row` of `all`.
    fn point<T: std::str::FromStr + Default + Copy>(&mut self, row: u64, all: u64) -> Result<[T; 3]> {
        let mut first = Some(self.begin());
        let read = point(&mut std::iter::from_fn(|| first.take().or_else(|| Some(self.next()))));
        let what = || format!("three coordinates of vertex {row} of {all}");
        let point = read.map_err(|word| self.wrong(&what(), word))?;
        self.end().map(|()| point)
    }

    /// The error for a word that is not what was expected.
    #[cold]
    fn wrong(&self, expected: &str, found: &[u8]) -> Error {
        if found.is_empty() {
            let message = format!("expected {expected}, found the end of the file");
            return self.source.error_at_line(TRUNCATED, self.lines.number(), message, TRUNCATED_HINT);
        }
        let message = format!("expected {expected}, found \"{}\"", shown(found));
        self.source.error_at_line(MALFORMED, self.number, message, MALFORMED_HINT)
    }
}

/// Reads the keyword, which is optional, and the numbers of vertices and faces, which may be on its
/// line or even part of its word. The number of edges is optional, too.
fn header<'a, 'b>(source: &'b Source<'a>, is_stream: bool) -> Result<([u64; 2], Values<'a, 'b>)> {
    let lines = Lines::new(source.data);
    let mut values = Values { source, lines, rest: b"", number: 0, began: 0, is_stream };
    let mut word = values.begin();
    if let Some((prefix, number)) = split_keyword(word) {
        let is_binary = values.rest.trim_ascii_start().starts_with(b"BINARY");
        if prefix.contains(&b'4') || prefix.contains(&b'n') || is_binary {
            let line = [word, values.rest].concat();
            let message = format!("expected three-dimensional text, found \"{}\"", shown(&line));
            let hint = "convert the model to plain OFF or another format";
            return Err(source.error_at_line(UNSUPPORTED, values.number, message, hint));
        }
        word = if number.is_empty() { values.begin() } else { number };
    }
    let vertices = text::count(word).ok_or_else(|| values.wrong("the number of vertices", word))?;
    let word = values.next();
    let faces = text::count(word).ok_or_else(|| values.wrong("the number of faces", word))?;
    if values.number != values.began {
        values.next();
    }
    values.rest = b"";
    Ok(([vertices, faces], values))
}

/// Reads an OFF file. Colours, normals and texture coordinates at the ends of lines are ignored, so
/// each vertex and each face begins on another line. A text for which that is wrong is read as a
/// stream of numbers without such attributes.
fn read<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    read_as(source, wanted, false).or_else(|error| match error {
        Error::Input { code, .. } if [MALFORMED, TRUNCATED, INDEX].contains(&code) => {
            read_as(source, wanted, true).map_err(|_| error)
        }
        _ => Err(error),
    })
}

fn read_as<'a>(source: &'a Source<'_>, wanted: Wanted, is_stream: bool) -> Result<Raw<'a>> {
    let ([vertices, faces], mut values) = header(source, is_stream)?;
    check_rows(vertices)?;
    let locate = move |_, row| source.line(line_of_vertex(source, is_stream, row).unwrap_or_default());
    let mut raw = Raw::new("off", Box::new(locate));
    for row in 0..vertices {
        source.tick(row, values.lines.position())?;
        raw.positions.push(values.point(row, vertices)?);
    }
    let mut face = Vec::new();
    for row in 0..faces {
        source.tick(row, values.lines.position())?;
        let word = values.begin();
        let what = || format!("the number of corners of face {row} of {faces}");
        let corners = text::count(word).ok_or_else(|| values.wrong(&what(), word))?;
        face.clear();
        for _ in 0..corners {
            let word = values.next();
            let index = integer(word).ok_or_else(|| values.wrong(&format!("{corners} indices"), word))?;
            if index < 0 || index as u64 >= vertices {
                let message = format!("expected an index from 0 and below {vertices}, found {index}");
                return Err(source.error_at_line(INDEX, values.number, message, INDEX_HINT));
            }
            face.push(index as u32);
        }
        values.end()?;
        raw.push_face(&face)?;
    }
    let more = values.next();
    if !more.is_empty() && is_stream {
        return Err(values.wrong("the end of the file", more));
    } else if !more.is_empty() {
        source.monitor.warn(&format!("line {}: what follows the last face is ignored", values.number));
    }
    raw.finish_polygons(wanted.polygons, source.monitor)?;
    raw.exact = Some(Box::new(move || {
        let again = |(_, mut values): (_, Values<'_, '_>)| {
            (0..vertices).map(|row| values.point(row, vertices)).collect()
        };
        header(source, is_stream).and_then(again).unwrap_or_default()
    }));
    Ok(raw)
}

/// The line on which a vertex begins, of a text that was read before.
fn line_of_vertex(source: &Source<'_>, is_stream: bool, row: usize) -> Result<u64> {
    let ([vertices, _], mut values) = header(source, is_stream)?;
    (0..=row as u64).try_for_each(|row| values.point::<f64>(row, vertices).map(drop))?;
    Ok(values.began)
}
