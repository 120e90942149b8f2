//! The index check of an object: what makes tracing it safe.
//!
//! An object that passes cannot make the runtime read out of bounds, loop, or visit a node twice.
//! Costs O(bytes of the object), without recursion. What is true of the numbers rather than of the
//! indices (boxes that contain their triangles, tetrahedra that have volume) is [`crate::verify`]'s business.

mod leaves;
mod links;
mod nodes;
mod scene;
mod sources;
mod tets;

pub(crate) use links::Derived;
pub use scene::scene;

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::{ObjectView, Records};
use std::mem::offset_of;

/// Checks every index of an object.
///
/// # Errors
/// The first violation of `BTH-F102` to `BTH-F141`, with an offset from the start of its section;
/// [`crate::file::File::check`] gives offsets from the start of the file.
pub fn object(view: &ObjectView) -> Result<()> {
    header(view)?;
    sources::check(view)?;
    tets::check(view)?;
    nodes::check(view)?;
    links::check(view)
}

fn header(view: &ObjectView) -> Result<()> {
    let h = view.header;
    let fail = |code, offset: usize, expected: String, found: String| {
        Err(Error::within(code, kind::OBJECT, offset as u64, expected, found))
    };
    let fits = match view.records {
        Records::None => h.record == 0 && view.tet_leaves.is_empty(),
        Records::Link32(_) => h.record == RecordKind::Link32 as u32,
        Records::Tet32(_) => h.record == RecordKind::Tet32 as u32,
        Records::Tet20(_) => h.record == RecordKind::Tet20 as u32,
        Records::Tet16(_) => h.record == RecordKind::Tet16 as u32,
    };
    if !fits {
        let found = format!("{} with {} tet leaves", h.record, view.tet_leaves.len());
        return fail(Code::Record, offset_of!(Object, record), "the kind of the records".into(), found);
    }
    let rows = [
        ("TRIANGLE_FACES", view.triangle_homes.len()),
        ("TRIANGLES", view.triangles.len()),
        ("CORNERS", view.corners.len()),
    ];
    let triangles = h.triangles as usize;
    for (name, rows) in rows {
        if rows != 0 && rows != triangles {
            let expected = format!("{triangles} rows of {name}, or none");
            return fail(Code::Counts, offset_of!(Object, triangles), expected, rows.to_string());
        }
    }
    if h.triangles > crate::limits::MAX_TRIANGLES {
        let expected = format!("at most {} triangles", crate::limits::MAX_TRIANGLES);
        return fail(Code::Limit, offset_of!(Object, triangles), expected, triangles.to_string());
    }
    if h.dropped > h.triangles {
        let expected = format!("at most {triangles} dropped triangles");
        return fail(Code::Counts, offset_of!(Object, dropped), expected, h.dropped.to_string());
    }
    if h.depth > crate::limits::MAX_DEPTH as u32 {
        let expected = format!("at most {}", crate::limits::MAX_DEPTH);
        return fail(Code::Depth, offset_of!(Object, depth), expected, h.depth.to_string());
    }
    let zero = h.lower.iter().chain(&h.upper).all(|x| x.to_bits() == 0);
    let good = if h.root == NONE { zero } else { is_box(h.lower, h.upper) };
    if !good {
        let expected = if h.root == NONE { "zeros, without a root" } else { "finite bounds, lower <= upper" };
        return fail(Code::ObjectBounds, 0, expected.into(), format!("{:?} to {:?}", h.lower, h.upper));
    }
    Ok(())
}

/// Whether a box is finite and not inside out.
fn is_box(lower: [f32; 3], upper: [f32; 3]) -> bool {
    (0..3).all(|a| lower[a].is_finite() && upper[a].is_finite() && lower[a] <= upper[a])
}

/// One bit per line or row.
struct Bits(Vec<u64>);

impl Bits {
    fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }
    /// Sets a bit; returns whether it was set already.
    fn set(&mut self, i: usize) -> bool {
        let (word, bit) = (&mut self.0[i / 64], 1 << (i % 64));
        let was = *word & bit != 0;
        *word |= bit;
        was
    }
    fn get(&self, i: usize) -> bool {
        self.0[i / 64] & (1 << (i % 64)) != 0
    }
}
