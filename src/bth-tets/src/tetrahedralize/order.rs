//! Puts a checked tetrahedralization in its final order: along a Hilbert curve, so that a ray's
//! next tetrahedron is near in memory (1.3 to 1.5 times faster walks than in TetGen's order).

use super::check::Checked;
use super::faces::NONE;
use super::gather::NodeInput;
use super::orientation::in_front;
use super::{Behind, Face, TetMesh};

/// Puts a tetrahedralization in its final form. Vertices that no tetrahedron uses are skipped.
pub(super) fn order(input: &NodeInput, checked: Checked) -> TetMesh {
    let curve = Curve::new(input.lower, input.upper);
    let Checked { vertices, tets, behind, sides, .. } = checked;

    let mut used = vec![false; vertices.len()];
    tets.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    let vertex_order = sorted((0..vertices.len() as u32).filter(|&v| used[v as usize]), |v| {
        curve.key(vertices[v as usize].map(f64::from))
    });
    let new_vertex = inverse(&vertex_order, vertices.len());
    let tet_order = sorted(0..tets.len() as u32, |t| curve.key(centroid(&vertices, &tets[t as usize])));
    let new_tet = inverse(&tet_order, tets.len());
    let face_order =
        sorted(0..sides.len() as u32, |f| curve.key(centroid(&input.vertices, &input.triangles[f as usize])));

    let mut constrained = vec![NONE; 4 * tets.len()];
    for (row, &f) in face_order.iter().enumerate() {
        sides[f as usize].iter().for_each(|&side| constrained[side as usize] = row as u32);
    }
    let mut mesh = TetMesh {
        lower: input.lower,
        upper: input.upper,
        vertices: vertex_order.iter().map(|&v| vertices[v as usize]).collect(),
        tets: Vec::with_capacity(tets.len()),
        behind: Vec::with_capacity(tets.len()),
        faces: Vec::with_capacity(sides.len()),
        steiner_points: (vertex_order.len()
            - vertex_order.iter().filter(|&&v| (v as usize) < input.vertices.len() + 8).count())
            as u32,
    };
    for &t in &tet_order {
        let mut corners: [(u32, u32); 4] =
            std::array::from_fn(|k| (new_vertex[tets[t as usize][k] as usize], 4 * t + k as u32));
        corners.sort_unstable();
        mesh.tets.push(corners.map(|(v, _)| v));
        mesh.behind.push(corners.map(|(_, side)| {
            match (constrained[side as usize], behind[side as usize]) {
                (NONE, NONE) => Behind::Hull,
                (NONE, other) => Behind::Tet(new_tet[other as usize / 4]),
                (row, _) => Behind::Face(row),
            }
        }));
    }
    for &f in &face_order {
        let triangle = input.triangles[f as usize];
        let [a, b] = sides[f as usize];
        let apex = vertices[tets[a as usize / 4][a as usize % 4] as usize];
        let front = in_front(triangle.map(|v| vertices[v as usize]), apex);
        let tet = [a, b].map(|side| new_tet[side as usize / 4]);
        mesh.faces.push(Face {
            triangle: input.ids[f as usize],
            vertex: triangle.map(|v| new_vertex[v as usize]),
            tet: if front { tet } else { [tet[1], tet[0]] },
        });
    }
    mesh
}

/// Rows in order of their keys, then of themselves.
fn sorted(rows: impl Iterator<Item = u32>, key: impl Fn(u32) -> u64) -> Vec<u32> {
    let mut keyed: Vec<(u64, u32)> = rows.map(|row| (key(row), row)).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, row)| row).collect()
}

/// The new row of each old row; `NONE` for rows that are skipped.
fn inverse(order: &[u32], rows: usize) -> Vec<u32> {
    let mut new = vec![NONE; rows];
    for (row, &old) in order.iter().enumerate() {
        new[old as usize] = row as u32;
    }
    new
}

fn centroid<const N: usize>(vertices: &[[f32; 3]], rows: &[u32; N]) -> [f64; 3] {
    std::array::from_fn(|k| rows.iter().map(|&v| f64::from(vertices[v as usize][k])).sum::<f64>() / N as f64)
}

/// A Hilbert curve through a box, 21 bits per axis.
struct Curve {
    lower: [f64; 3],
    scale: f64,
}

impl Curve {
    const BITS: u32 = 21;

    fn new(lower: [f32; 3], upper: [f32; 3]) -> Self {
        let extent = (0..3).map(|k| f64::from(upper[k]) - f64::from(lower[k])).fold(0.0, f64::max);
        let cells = f64::from((1u32 << Self::BITS) - 1);
        Self { lower: lower.map(f64::from), scale: cells / extent }
    }

    /// Position along the curve.
    fn key(&self, p: [f64; 3]) -> u64 {
        let limit = f64::from((1u32 << Self::BITS) - 1);
        hilbert(
            std::array::from_fn(|k| ((p[k] - self.lower[k]) * self.scale).clamp(0.0, limit) as u32),
            Self::BITS,
        )
    }
}

/// Position of a cell along the Hilbert curve of a cube of 2^bits cells per axis
/// (Skilling 2004, "Programming the Hilbert curve", `AxestoTranspose`).
fn hilbert(mut x: [u32; 3], bits: u32) -> u64 {
    let mut q = 1 << (bits - 1);
    while q > 1 {
        let low = q - 1;
        for i in 0..3 {
            if x[i] & q != 0 {
                x[0] ^= low;
            } else {
                let t = (x[0] ^ x[i]) & low;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut t = 0;
    let mut q = 1 << (bits - 1);
    while q > 1 {
        if x[2] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    let mut key = 0;
    for bit in (0..bits).rev() {
        for axis in x {
            key = key << 1 | u64::from((axis ^ t) >> bit & 1);
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_every_cell_once_and_moves_by_one_cell() {
        const BITS: u32 = 3;
        let n = 1u32 << BITS;
        let mut cells: Vec<(u64, [u32; 3])> = (0..n * n * n)
            .map(|i| [i % n, i / n % n, i / n / n])
            .map(|cell| (hilbert(cell, BITS), cell))
            .collect();
        cells.sort_unstable();
        for (i, (key, cell)) in cells.iter().enumerate() {
            assert_eq!(*key, i as u64);
            if i > 0 {
                let before = cells[i - 1].1;
                assert_eq!((0..3).map(|k| cell[k].abs_diff(before[k])).sum::<u32>(), 1);
            }
        }
    }
}
