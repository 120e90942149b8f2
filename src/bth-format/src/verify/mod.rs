//! Everything that the format demands beyond what opening and the index check look at: hashes,
//! zero gaps, and geometry. Costs O(bytes of the file), with exact predicates.

mod geometry;
mod seen;

use crate::error::{Code, Error};
use crate::file::{File, hash128};
use crate::layout::*;

/// What a verified file holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Objects.
    pub objects: u32,
    /// Sections whose hashes were compared.
    pub sections: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Triangles that can be hit.
    pub triangles: u64,
    /// Triangles of zero area.
    pub dropped: u64,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Tetrahedra.
    pub tets: u64,
    /// Objects whose triangles were compared with kept positions of the source.
    pub compared_with_source: u32,
}

/// Verifies hashes, gaps, indices and geometry of a file.
///
/// # Errors
/// What was found, at least one: all damaged sections and gaps, and for each object the first violation.
/// Codes are `BTH-F020`, `BTH-F021` and `BTH-F101` to `BTH-F207`; the scene sections count as one object.
pub fn verify(file: &File) -> Result<Report, Vec<Error>> {
    let mut errors = Vec::new();
    let mut report =
        Report { bytes: file.bytes().len() as u64, objects: file.object_count(), ..Report::default() };
    let mut end = size_of::<Header>() + size_of_val(file.table());
    for section in file.sections() {
        let e = section.entry;
        gap(file, end, e.offset as usize, &mut errors);
        end = (e.offset + e.length) as usize;
        let hash = hash128(section.bytes);
        if hash != e.hash {
            let (expected, found) = (format!("hash {:02x?}", e.hash), format!("{hash:02x?}"));
            errors.push(
                Error::within(Code::SectionHash, e.kind, e.offset, expected, found).in_object(e.object),
            );
        }
        report.sections += 1;
    }
    gap(file, end, file.bytes().len(), &mut errors);
    for object in 0..file.object_count() {
        let checked = file
            .check(object)
            .and_then(|view| geometry::check(&view, &mut report).map_err(|e| file.locate(e, object)));
        errors.extend(checked.err());
    }
    errors.extend(file.check_scene().err());
    if errors.is_empty() { Ok(report) } else { Err(errors) }
}

fn gap(file: &File, from: usize, to: usize, errors: &mut Vec<Error>) {
    if let Some(i) = file.bytes()[from..to].iter().position(|b| *b != 0) {
        let found = file.bytes()[from + i].to_string();
        errors.push(Error::at(Code::Gap, (from + i) as u64, "0 between sections", found));
    }
}
