//! Everything that the format demands beyond opening and the index check: hashes, zero gaps, and geometry, with exact
//! predicates. Costs O(bytes of the file). Specification: "Verifying".

mod aabb;
mod free;
mod object;
mod report;
mod source;
mod tet_leaf;
mod tree;
mod triangle_marks;

pub use report::Report;

use crate::error::{Code, Error, Result};
use crate::file::{File, SectionView, hash128};
use crate::layout::*;

/// Verifies hashes, gaps, indices and geometry of a file.
///
/// # Errors
/// All damaged sections and gaps, and for each object the first violation; at least one error. Codes are `BTH-F020`,
/// `BTH-F021` and `BTH-F101` to `BTH-F209`. The scene sections count as one object.
pub fn verify(file: &File) -> std::result::Result<Report, Vec<Error>> {
    let mut errors = Vec::new();
    let mut report =
        Report { bytes: file.bytes().len() as u64, objects: file.object_count(), ..Report::default() };
    let mut end = size_of::<Header>() + size_of_val(file.table());
    for section in file.sections() {
        let e = section.entry;
        check_gap(file, end, e.offset as usize, &mut errors);
        end = (e.offset + e.length) as usize;
        errors.extend(check_hash(&section).err());
        report.sections += 1;
    }
    check_gap(file, end, file.bytes().len(), &mut errors);
    for object in 0..file.object_count() {
        let checked = file
            .check(object)
            .and_then(|view| object::check(&view, &mut report).map_err(|e| file.locate(e, object)));
        errors.extend(checked.err());
    }
    errors.extend(file.check_object_names().err());
    errors.extend(file.check_images().err());
    errors.extend(file.check_scene().err());
    if errors.is_empty() { Ok(report) } else { Err(errors) }
}

/// BTH-F021: the hash of a section is that of its bytes.
fn check_hash(section: &SectionView) -> Result<()> {
    let (e, hash) = (section.entry, hash128(section.bytes));
    if hash == e.hash {
        return Ok(());
    }
    let (expected, found) = (format!("hash {:02x?}", e.hash), format!("{hash:02x?}"));
    Err(Error::within(Code::SectionHash, e.kind, e.offset, expected, found).in_object(e.object))
}

/// BTH-F020: the bytes between two parts of the file are zero.
fn check_gap(file: &File, from: usize, to: usize, errors: &mut Vec<Error>) {
    if let Some(i) = file.bytes()[from..to].iter().position(|b| *b != 0) {
        let found = format!("{}", file.bytes()[from + i]);
        errors.push(Error::at(Code::Gap, (from + i) as u64, "0 between sections", found));
    }
}
