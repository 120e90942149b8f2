//! Rewrites the lines of a wide BVH with shorter leaves, on a grid.

use crate::bvh::Wide;
use crate::error::{Error, Result};
use bth_format::layout::*;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A node or leaf in the lines.
struct MovedBlock {
    /// Child code in the wide BVH of `f32`.
    old: Child,
    /// Offset of its new place, in half lines.
    half: u64,
}

/// Shortens the leaves, whose corners must lie on the grid, and moves the blocks together.
///
/// # Errors
/// `BTH-L202` when a child code cannot address a leaf.
pub fn pack(wide: &mut Wide, grid: &Grid) -> Result<()> {
    let mut blocks = blocks(wide);
    let [indexed, raw] = grid.bits.half_lines();
    let mut end = 0u64;
    for block in &mut blocks {
        let halves = match block.old {
            Child::Node(_) => {
                // Nodes stay on whole lines.
                end = end.next_multiple_of(2);
                2 * NODE_LINES
            }
            Child::Indexed(_) => indexed,
            _ => raw,
        };
        block.half = end;
        end += halves as u64;
    }
    if end > u64::from(Child::INDEX_LIMIT) {
        let message =
            format!("the BVH needs {end} half lines of 32 bytes; an object can have {}", Child::INDEX_LIMIT);
        return Err(Error::Limit { code: "BTH-L202", message });
    }
    let mut packed = Packed {
        old: &wide.lines,
        code_at: vec![NONE; wide.lines.len()],
        lines: vec![CacheLine([0; 16]); (end as usize).div_ceil(2)],
        grid,
    };
    for block in &blocks {
        // Leaves on a grid are counted in half lines.
        let (old, code) = match block.old {
            Child::Node(old) => (old, Child::Node((block.half / 2) as u32).code()),
            Child::Indexed(old) => (old, Child::Indexed(block.half as u32).code()),
            Child::Raw(old) => (old, Child::Raw(block.half as u32).code()),
            Child::Tets(_) => unreachable!("a block of the wide BVH"),
        };
        packed.code_at[old as usize] = code;
    }
    for block in &blocks {
        packed.write(block);
    }
    wide.root = packed.code(wide.root);
    wide.lines = packed.lines;
    Ok(())
}

/// All nodes and leaves, in the order of their lines.
fn blocks(wide: &Wide) -> Vec<MovedBlock> {
    let mut found = Vec::new();
    let mut stack = vec![wide.root];
    while let Some(code) = stack.pop() {
        match Child::from_code(code) {
            Some(old @ Child::Node(line)) => {
                found.push((line, MovedBlock { old, half: 0 }));
                stack.extend(read::<WideNode>(&wide.lines, line).child);
            }
            Some(old @ (Child::Indexed(line) | Child::Raw(line))) => {
                found.push((line, MovedBlock { old, half: 0 }))
            }
            Some(Child::Tets(_)) | None => {}
        }
    }
    found.sort_unstable_by_key(|(line, _)| *line);
    found.into_iter().map(|(_, block)| block).collect()
}

fn read<T: FromBytes + KnownLayout + Immutable>(lines: &[CacheLine], line: u32) -> &T {
    let bytes = &lines.as_bytes()[line as usize * size_of::<CacheLine>()..][..size_of::<T>()];
    T::ref_from_bytes(bytes).expect("a block is a whole number of aligned lines")
}

struct Packed<'a> {
    old: &'a [CacheLine],
    /// New child code of the block at each old line.
    code_at: Vec<u32>,
    lines: Vec<CacheLine>,
    grid: &'a Grid,
}

impl Packed<'_> {
    /// The new code of a child.
    fn code(&self, old: u32) -> u32 {
        match Child::from_code(old) {
            Some(Child::Node(line) | Child::Indexed(line) | Child::Raw(line)) => self.code_at[line as usize],
            Some(Child::Tets(_)) | None => old,
        }
    }

    fn write(&mut self, block: &MovedBlock) {
        let (half, grid, bits) = (block.half, self.grid, self.grid.bits);
        match block.old {
            Child::Node(line) => {
                let mut node = *read::<WideNode>(self.old, line);
                node.child = node.child.map(|code| self.code(code));
                self.put(half, &node);
            }
            Child::Indexed(line) => {
                let leaf = read::<IndexedLeaf>(self.old, line);
                let (vertex, high) = split(grid, &leaf.vertex);
                let corner = leaf.corner.map(|row| std::array::from_fn(|i| row[i] | row[i + WIDTH / 2] << 4));
                let (first, triangles, vertices) = (leaf.first, leaf.triangles as u8, leaf.vertices as u8);
                match bits {
                    GridBits::B16 => self.put(
                        half,
                        &IndexedLeaf16 { vertex, corner, first, triangles, vertices, reserved: 0 },
                    ),
                    GridBits::B21 => {
                        let reserved = 0;
                        self.put(
                            half,
                            &IndexedLeaf21 { vertex, high, corner, first, triangles, vertices, reserved },
                        );
                    }
                }
            }
            Child::Raw(line) => {
                let leaf = read::<RawLeaf>(self.old, line);
                let rows = leaf.corner.each_ref().map(|rows| split(grid, rows));
                let (corner, high) = (rows.map(|r| r.0), rows.map(|r| r.1));
                let (first, triangles, reserved) = (leaf.first, leaf.triangles, [0; 6]);
                match bits {
                    GridBits::B16 => self.put(half, &RawLeaf16 { corner, first, triangles, reserved }),
                    GridBits::B21 => self.put(half, &RawLeaf21 { corner, high, first, triangles, reserved }),
                }
            }
            Child::Tets(_) => unreachable!("a block of the wide BVH"),
        }
    }

    fn put<T: IntoBytes + Immutable>(&mut self, half: u64, block: &T) {
        let bytes = block.as_bytes();
        self.lines.as_mut_bytes()[half as usize * HALF_LINE..][..bytes.len()].copy_from_slice(bytes);
    }
}

/// Low bits of each axis, and the high bits of all three axes together.
fn split(grid: &Grid, rows: &[[f32; WIDTH]; 3]) -> ([[u16; WIDTH]; 3], [u16; WIDTH]) {
    let mut high = [0u16; WIDTH];
    let low = std::array::from_fn(|axis| {
        std::array::from_fn(|i| {
            let steps = grid.steps(axis, rows[axis][i]);
            debug_assert!((0..=i64::from(grid.bits.max_steps())).contains(&steps));
            high[i] |= ((steps >> 16) as u16) << (5 * axis);
            steps as u16
        })
    });
    (low, high)
}
