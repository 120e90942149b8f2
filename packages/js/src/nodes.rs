//! The tree of an object, for traversals that the caller decides about.

use bth::Scene;
use bth_format::layout::{Child, NONE, WIDTH};

/// What a child code leads to: the children of a node, or the triangles of a leaf.
#[repr(C)]
pub struct Found {
    /// Lower and upper end of each child's box, in the source's space.
    bounds: [[[f64; 3]; 2]; WIDTH],
    /// The codes of the children, or the source ids of the triangles.
    ids: [u32; WIDTH],
}

/// Set in the result of [`bth_node`] for leaves.
const LEAF: u32 = 1 << 8;

/// The child code of the root of an object; 2^32 - 1 for an object without triangles.
///
/// # Safety
/// `scene` is open, and `object` is one of its objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_root(scene: *const Scene, object: u32) -> u32 {
    // SAFETY: by contract the scene is open.
    unsafe { &*scene }.object(object).header.root
}

/// Writes what a child code of an object leads to. Returns the number of children, or of triangles
/// with the bit 8 set. Returns 2^32 - 1 for a leaf of tetrahedra.
///
/// # Safety
/// `scene` is open, `object` is one of its objects, `code` comes from [`bth_root`] or from this
/// function, and `found` is valid for writes and overlaps nothing else.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bth_node(scene: *const Scene, object: u32, code: u32, found: *mut Found) -> u32 {
    // SAFETY: by contract the scene is open, and `found` is valid. All bit patterns are valid for
    // its elements.
    let (view, found) = unsafe { ((*scene).object(object), &mut *found) };
    let (mut indexed, mut raw) = (None, None);
    let (first, count) = match Child::from_code(code) {
        Some(Child::Node(line)) => {
            let node = view.node(line);
            // Rounded outwards, where positions are relative to an anchor.
            let end = |end: usize, slot: usize| {
                [0, 1, 2].map(|axis| {
                    let (x, anchor) = (f64::from(node.bounds[axis][end][slot]), view.anchor[axis]);
                    match (anchor == 0.0, end) {
                        (true, _) => x,
                        (false, 0) => (x + anchor).next_down(),
                        (false, _) => (x + anchor).next_up(),
                    }
                })
            };
            let count = node.child.iter().take_while(|code| **code != NONE).count();
            for slot in 0..count {
                found.bounds[slot] = [end(0, slot), end(1, slot)];
            }
            found.ids = node.child;
            return count as u32;
        }
        Some(Child::Indexed(index)) => {
            let leaf = view.indexed(index, &mut indexed);
            (leaf.first, leaf.triangles)
        }
        Some(Child::Raw(index)) => {
            let leaf = view.raw(index, &mut raw);
            (leaf.first, leaf.triangles)
        }
        Some(Child::Tets(_)) | None => return u32::MAX,
    };
    let ids = &view.triangle_ids[first as usize..][..count as usize];
    found.ids[..ids.len()].copy_from_slice(ids);
    LEAF | count
}
