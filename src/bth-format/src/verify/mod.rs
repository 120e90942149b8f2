//! Everything that the format demands beyond opening and the index check: hashes, zero gaps, and
//! geometry, with exact predicates. Costs O(bytes of the file). Specification: "Verifying".

mod aabb;
mod free;
mod source;
mod tet_leaf;
mod tree;
mod trees;
mod triangle_set;

use crate::error::{Code, Error, Result};
use crate::file::{File, SectionView, hash128};
use crate::layout::*;
use crate::object::ObjectView;

/// Counts over a whole file.
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
/// All damaged sections and gaps, and for each object the first violation; at least one error.
/// Codes are `BTH-F020`, `BTH-F021` and `BTH-F101` to `BTH-F213`. The scene sections count as one
/// object.
pub fn verify(file: &File) -> std::result::Result<Report, Vec<Error>> {
    let mut errors = Vec::new();
    let mut report =
        Report { bytes: file.bytes().len() as u64, objects: file.object_count(), ..Report::default() };
    let mut end = size_of::<Header>() + size_of_val(file.table());
    let (first, others): (Vec<_>, Vec<_>) =
        file.sections().partition(|section| section.entry.kind == kind::OBJECT);
    for section in first.into_iter().chain(others) {
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
            .and_then(|view| check_object(&view, &mut report).map_err(|e| file.locate(e, object)));
        errors.extend(checked.err());
    }
    errors.extend(file.check_object_names().err());
    errors.extend(file.check_images().err());
    errors
        .extend(file.check_scene().and_then(|_| trees::check(file).map_err(|e| file.locate(e, NONE))).err());
    if errors.is_empty() { Ok(report) } else { Err(errors) }
}

/// Checks the geometry of an object whose indices have been checked, BTH-F201 to BTH-F211, and adds
/// the object to a report. Offsets of errors count from the start of the section.
fn check_object(view: &ObjectView, report: &mut Report) -> Result<()> {
    let placed = tree::check(view)?;
    for (row, leaf) in view.tet_leaves.iter().enumerate() {
        tet_leaf::check(view, row, leaf)?;
        report.tets += u64::from(leaf.tets);
    }
    source::check_dropped(view, &placed)?;
    source::check_displacement(view)?;
    source::check_rounding(view)?;
    free::check(view)?;
    report.tet_leaves += view.tet_leaves.len() as u64;
    report.triangles += u64::from(view.header.triangles - view.header.dropped);
    report.dropped += u64::from(view.header.dropped);
    report.compared_with_source += u32::from(!view.triangles.is_empty());
    Ok(())
}

/// BTH-F021: the hash of a section matches its bytes.
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
