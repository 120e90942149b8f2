//! Reads the body of a text PLY, which has one row a line.

use crate::error::Result;
use crate::formats::ply::header::{Element, ElementKind, Header, Meaning, Scalar};
use crate::formats::ply::sink::{Sink, Vertex, slot};
use crate::source::{MALFORMED, MALFORMED_HINT, Source, TRUNCATED, TRUNCATED_HINT};
use crate::text::{self, Lines, float, integer, shown, words};

/// Reads all elements.
pub(super) fn read(source: &Source<'_>, header: &Header, sink: &mut Sink<'_>) -> Result<()> {
    let mut lines = Lines::after(source.data, header.body, header.lines);
    let mut indices = Vec::new();
    // The number of rows with more values than the header announces, and the line of the first.
    let (mut longer, mut first_longer) = (0u64, 0);
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        for row in 0..element.count {
            source.tick(row, lines.position())?;
            let Some((number, line)) = lines.find(|(_, line)| !line.trim_ascii().is_empty()) else {
                let message = format!(
                    "expected {} rows of element {}, found {row} and the end of the file",
                    element.count, element.name
                );
                return Err(source.error_at_line(TRUNCATED, lines.number(), message, TRUNCATED_HINT));
            };
            if !read_row(source, element, number, line, &mut indices, sink)? {
                first_longer = if longer == 0 { number } else { first_longer };
                longer += 1;
            }
        }
    }
    if longer > 0 {
        let message = format!(
            "{longer} rows have more values than the header tells, which are ignored; the first is line {first_longer}"
        );
        source.monitor.warn(&message);
    }
    if let Some((number, _)) = lines.find(|(_, line)| !line.trim_ascii().is_empty()) {
        source.monitor.warn(&format!("line {number}: what follows the last element is ignored"));
    }
    Ok(())
}

/// Reads a row. Returns true if it has as many values as the header announces.
fn read_row(
    source: &Source<'_>,
    element: &Element,
    number: u64,
    line: &[u8],
    indices: &mut Vec<i64>,
    sink: &mut Sink<'_>,
) -> Result<bool> {
    let mut words = words(line);
    let malformed = |expected: &str, word: &[u8]| {
        let message = format!("expected {expected} of element {}, found \"{}\"", element.name, shown(word));
        source.error_at_line(MALFORMED, number, message, MALFORMED_HINT)
    };
    let mut vertex = Vertex::default();
    for property in &element.properties {
        let mut count = 1;
        if property.list.is_some() {
            let word = words.next().unwrap_or_default();
            count = text::count(word).ok_or_else(|| malformed("the count of a list", word))?;
        }
        let place = slot(property.meaning);
        indices.clear();
        for _ in 0..count {
            let word = words.next().unwrap_or_default();
            if let Some(place) = place {
                let value = match property.scalar {
                    Scalar::F32 => float::<f32>(word).map(f64::from),
                    _ => float::<f64>(word),
                };
                vertex[place] = value.ok_or_else(|| malformed("a number", word))?;
            } else if property.meaning == Meaning::Indices {
                indices.push(integer(word).ok_or_else(|| malformed("an index", word))?);
            } else if word.is_empty() {
                return Err(malformed("more values", word));
            }
        }
        if property.meaning == Meaning::Indices {
            sink.list(element.kind, indices, || (source.line(number), String::new()))?;
        }
    }
    if element.kind == ElementKind::Vertices {
        sink.vertex(vertex);
    }
    Ok(words.next().is_none())
}

/// The line of a vertex's row.
pub(super) fn line_of_vertex(source: &Source<'_>, header: &Header, row: usize) -> u64 {
    let with_rows = header.elements.iter().filter(|element| !element.properties.is_empty());
    let before: u64 = with_rows.take_while(|e| e.kind != ElementKind::Vertices).map(|e| e.count).sum();
    let lines = Lines::after(source.data, header.body, header.lines);
    let mut rows = lines.filter(|(_, line)| !line.trim_ascii().is_empty());
    rows.nth(before as usize + row).map_or(0, |(number, _)| number)
}
