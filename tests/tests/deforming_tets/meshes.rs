//! Meshes with tetrahedra, and positions into which they deform.

use bth_compile::Silent;
use bth_compile::memory::{TriangleMesh, compile};
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_format::layout::RecordKind;
use bth_random::Rng;
use bth_tests::structures::options;

pub(crate) type Positions = Vec<[f32; 3]>;
pub(crate) type Triangles = Vec<[u32; 3]>;

pub(crate) fn compiled(mesh: &(Positions, Triangles), structure: Structure, record: RecordKind) -> Vec<u8> {
    let options =
        CompileOptions { deformable: true, deformable_tets: true, ..options(structure, record, true) };
    let mesh = TriangleMesh { positions: &mesh.0, triangles: &mesh.1 };
    let (compiled, _) = compile(mesh, &options, &Silent).unwrap();
    let file = bth_format::File::from_bytes(&compiled.bytes).unwrap();
    bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}", e[0]));
    compiled.bytes
}

/// Adds triangles without area, which other positions may give one.
pub(crate) fn with_flat(mut mesh: (Positions, Triangles)) -> (Positions, Triangles) {
    let first = mesh.0.len() as u32;
    mesh.0.extend([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    mesh.1.extend([[first, first + 1, first + 2], [0, 0, 1]]);
    mesh
}

/// Closed surfaces, each beside the one before, in which every third triangle has vertices of its own at the places of others. Where
/// `crossing`, a triangle crosses each of them, so that the whole cannot be tetrahedralized.
pub(crate) fn mesh(triangles: u32, knots: u32, crossing: bool) -> (Positions, Triangles) {
    let knot = bth_scenes::knot::torus_knot(triangles);
    let (mut positions, mut rows) = (Positions::new(), Triangles::new());
    for at in 0..knots {
        let first = positions.len() as u32;
        positions.extend(knot.positions.iter().map(|p| [p[0] + 8.0 * at as f32, p[1], p[2]]));
        for (row, corners) in knot.triangles.iter().enumerate() {
            let corners = corners.map(|v| first + v);
            rows.push(match row % 3 {
                0 => corners.map(|v| {
                    positions.push(positions[v as usize]);
                    positions.len() as u32 - 1
                }),
                _ => corners,
            });
        }
        if crossing {
            let p = positions[first as usize];
            let last = positions.len() as u32;
            positions.extend([p.map(|x| x - 0.5), p.map(|x| x + 0.5), [p[0] + 0.7, p[1], p[2] - 0.4]]);
            rows.push([last, last + 1, last + 2]);
        }
    }
    (positions, rows)
}

/// Deformations of many kinds; of small ones more than of large ones. Vertices at one place stay at one place but for the last kinds.
pub(crate) fn deformed(rest: &[[f32; 3]], kind: usize, rng: &mut Rng) -> Positions {
    let seed = rng.next();
    let twist = (rng.unit_f32() * 2.0 - 1.0) * [0.003, 0.01, 1.0][kind / 7 % 3];
    let noise_of = |p: &[f32; 3]| {
        let place = p.iter().fold(seed, |hash, x| hash.rotate_left(17) ^ u64::from((x + 0.0).to_bits()));
        let mut own = Rng::new(place);
        [0; 3].map(|_| own.unit_f32() * 2.0 - 1.0)
    };
    let mut moved: Positions = rest.to_vec();
    for p in &mut moved {
        let ([x, y, z], noise) = (*p, noise_of(p));
        *p = match kind {
            0 => [x, y, z],
            1 => [x * 2.0 + 3.0, y * 0.3 - 70.0, z * 1.7],
            2 => [x * 1e-20, y * 1e-22, z * 1e-20],
            3 => [x * 1e30, y * 1e31, z * 1e30],
            4 => [-x, y, z],
            5 => [x.abs(), y, z],
            6 => [x, y, z].map(|x| x.round()),
            7 | 14 | 21 => {
                let (sin, cos) = (twist * y).sin_cos();
                [x * cos - z * sin, y, x * sin + z * cos]
            }
            8 | 15 | 22 => {
                let size = [1e-6, 1e-4, 0.1][kind / 7 - 1];
                [0, 1, 2].map(|k| [x, y, z][k] + size * noise[k])
            }
            9 => [x, y, 0.0],
            10 => [0.0; 3],
            11 => noise.map(|x| 5.0 * x),
            // Turned as a whole, about the middle: the box does not turn.
            12 => [0.9998 * x - 0.02 * z, y, 0.02 * x + 0.9998 * z],
            _ => [x, y, z],
        };
    }
    match kind {
        // One vertex of several at a place, or all of one triangle, by one unit in the last place.
        13 => {
            let last = moved.len() - 1;
            moved[last][1] = moved[last][1].next_up();
        }
        16 => {
            let at = rng.below(moved.len() as u64) as usize;
            moved[at] = moved[at].map(|x| x + 0.01);
        }
        _ => {}
    }
    moved
}

pub(crate) const KINDS: usize = 23;
