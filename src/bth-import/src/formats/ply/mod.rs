//! Reads PLY: vertices with faces or triangle strips, in text or binary of either byte order.
//!
//! `header` reads the elements and their properties, `ascii` or `binary` the body, and `sink`
//! collects the rows. docs/decisions.md says why these are not the readers of `ply-rs-bw`.

mod ascii;
mod binary;
mod header;
mod sink;

use self::header::{ElementKind, Encoding, Header};
use self::sink::{Sink, warn_left_out};
use super::{Format, first_word};
use crate::error::{Place, Result};
use crate::mesh::Wanted;
use crate::raw::{Raw, check_rows};
use crate::room::{BYTES_PER_TRIANGLE, TRIANGLES_AT_ONCE, check_memory};
use crate::source::Source;

/// PLY, text and binary.
pub(super) const FORMAT: Format = Format {
    name: "ply",
    titles: &["PLY"],
    extensions: &["ply"],
    is_like: |data| first_word(data) == b"ply",
    read,
    ..Format::ALONE
};

/// Reads a PLY file. Edges count as skipped elements.
fn read<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    let mut header = header::read(source)?;
    if !wanted.materials || header.color_scale().is_none() {
        header.skip_colors();
    }
    warn_left_out(source, &header, wanted);
    check_rows(header.vertices().map_or(0, |v| v.count))?;
    let faces = header.elements.iter().filter(|e| e.kind == ElementKind::Faces);
    // A triangle has 4 bytes in the file, so that a wrong count is told as what it is.
    let faces = faces.map(|e| e.count).fold(0, u64::saturating_add).min(source.data.len() as u64 / 4);
    check_memory(faces, BYTES_PER_TRIANGLE, TRIANGLES_AT_ONCE)?;
    let raw = Raw::new("ply", Box::new(|_, _| Place::File(source.path.to_owned())));
    let mut sink = Sink::new(raw, &header, wanted);
    for element in header.elements.iter().filter(|e| e.kind == ElementKind::Edges) {
        sink.raw.skipped = sink.raw.skipped.saturating_add(element.count);
    }
    match header.encoding {
        Encoding::Ascii => ascii::read(source, &header, &mut sink)?,
        Encoding::Little => binary::read::<false>(source, &header, &mut sink)?,
        Encoding::Big => binary::read::<true>(source, &header, &mut sink)?,
    }
    sink.raw.finish_polygons(wanted.polygons, source.monitor)?;
    let raw = sink.finish();
    Ok(Raw { locate: Box::new(move |_, row| place_of_vertex(source, &header, row)), ..raw })
}

fn place_of_vertex(source: &Source<'_>, header: &Header, row: usize) -> Place {
    match header.encoding {
        Encoding::Ascii => source.line(ascii::line_of_vertex(source, header, row)),
        Encoding::Little => source.byte(binary::byte_of_vertex::<false>(source, header, row)),
        Encoding::Big => source.byte(binary::byte_of_vertex::<true>(source, header, row)),
    }
}
