//! Small valid files.

use super::Case;
use bth_compile::bvh::{Wide, triangle_places};
use bth_compile::coordinates::pack;
use bth_compile::write::{FileBuilder, GroupParts, ObjectParts, Source, object, object_names};
use bth_format::layout::*;
use zerocopy::IntoBytes;

/// Every valid file.
pub fn valid() -> Vec<Case> {
    let mut cases = vec![
        Case::new("no-objects", FileBuilder::new().finish()),
        Case::new("nothing-to-hit", nothing_to_hit()),
        Case::new("triangle", triangle()),
        Case::new("triangle-bare", triangle_bare()),
        Case::new("two-levels", two_levels(None)),
        Case::new("grid-16", two_levels(Some(GridBits::B16))),
        Case::new("grid-21", two_levels(Some(GridBits::B21))),
        Case::new("widened-boxes", two_levels_widened()),
        Case::new("places", with_places(None)),
        Case::new("places-grid-16", with_places(Some(GridBits::B16))),
        Case::new("places-tets", tets_of(true, &[])),
        Case::new("places-deformable", super::deformable::with_places()),
        Case::new("opacity", opacity()),
        Case::new("free-directions", free_directions()),
        Case::new("free-distances", free_distances()),
        Case::new("exact-positions", super::exact::exact_positions()),
        Case::new("two-objects", two_objects()),
        Case::new("groups", groups()),
        Case::new("deformable", super::deformable::deformable()),
        Case::new("deformers", super::deformers::deforming()),
        Case::new("sequence", super::deformable::sequence()),
        Case::new("materials", super::materials::materials()),
        Case::new("second-uvs", super::materials::second_uvs()),
        Case::new("gloss", super::materials::gloss()),
        Case::new("unknown-optional-section", unknown_section()),
    ];
    cases.extend(super::scenes::valid());
    cases.extend(super::trees::valid());
    cases.push(Case::new("tets-link32", tets_of(false, &[])));
    cases
}

/// An indexed leaf of these triangles; at most 16 distinct corners.
pub(super) fn indexed(corners: &[[[f32; 3]; 3]], first: u32) -> IndexedLeaf {
    let mut points: Vec<[f32; 3]> = Vec::new();
    let mut corner = [[0; WIDTH]; 3];
    for (t, triangle) in corners.iter().enumerate() {
        for (k, p) in triangle.iter().enumerate() {
            let i = points.iter().position(|q| q == p).unwrap_or_else(|| {
                points.push(*p);
                points.len() - 1
            });
            corner[k][t] = i as u8;
        }
    }
    let row = |axis: usize| std::array::from_fn(|i| points.get(i).unwrap_or(&points[0])[axis]);
    let (triangles, vertices) = (corners.len() as u32, points.len() as u32);
    IndexedLeaf { vertex: [0, 1, 2].map(row), corner, first, triangles, vertices, reserved: 0 }
}

/// A raw leaf of these triangles.
pub(super) fn raw(corners: &[[[f32; 3]; 3]], first: u32) -> RawLeaf {
    let row = |k: usize, axis: usize| std::array::from_fn(|i| corners.get(i).unwrap_or(&corners[0])[k][axis]);
    let corner = [0, 1, 2].map(|k| [0, 1, 2].map(|axis| row(k, axis)));
    RawLeaf { corner, first, triangles: corners.len() as u32, reserved: [0; 14] }
}

pub(super) type Bounds = ([f32; 3], [f32; 3]);

pub(super) fn bounds<'a>(points: impl IntoIterator<Item = &'a [f32; 3]>) -> Bounds {
    let start = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    points
        .into_iter()
        .fold(start, |(l, u), p| ([0, 1, 2].map(|a| l[a].min(p[a])), [0, 1, 2].map(|a| u[a].max(p[a]))))
}

pub(super) fn node(children: &[(Child, Bounds)]) -> WideNode {
    let mut node = WideNode { bounds: [[[f32::MAX; WIDTH], [-f32::MAX; WIDTH]]; 3], child: [NONE; WIDTH] };
    for (i, (child, (lower, upper))) in children.iter().enumerate() {
        node.child[i] = child.code();
        for a in 0..3 {
            node.bounds[a][0][i] = lower[a];
            node.bounds[a][1][i] = upper[a];
        }
    }
    node
}

pub(super) fn lines(block: &[u8]) -> Vec<CacheLine> {
    let word = |b: &[u8]| u32::from_le_bytes(b.try_into().unwrap());
    block.chunks_exact(64).map(|b| CacheLine(std::array::from_fn(|i| word(&b[4 * i..4 * i + 4])))).collect()
}

pub(super) fn file(parts: &ObjectParts) -> Vec<u8> {
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, parts).expect("the parts fit together");
    builder.finish()
}

pub(super) const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn nothing_to_hit() -> Vec<u8> {
    let positions = [[0.0; 3], [1.0; 3], [2.0; 3]];
    let source = Source { positions: &positions, triangles: &[[0, 1, 2]], ..Source::default() };
    file(&ObjectParts {
        root: NONE,
        triangles: 1,
        dropped: 1,
        source: Some(source),
        ..ObjectParts::default()
    })
}

/// An object of the one triangle [`CORNERS`], whose leaf is all of its lines.
pub(super) fn one_triangle(lines: &[CacheLine]) -> ObjectParts<'_> {
    ObjectParts {
        bounds: Some(bounds(&CORNERS)),
        root: Child::Indexed(0).code(),
        triangles: 1,
        lines,
        triangle_ids: &[0],
        ..ObjectParts::default()
    }
}

fn triangle() -> Vec<u8> {
    let lines = lines(indexed(&[CORNERS], 0).as_bytes());
    let source = Source { positions: &CORNERS, triangles: &[[0, 1, 2]], ..Source::default() };
    let parts = ObjectParts { source: Some(source), ..one_triangle(&lines) };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    builder.provenance("{\"tool\":\"conformance\"}".into()).unwrap();
    builder.finish()
}

/// Levels of free directions.
const LEVELS: FreeLevels = FreeLevels { distance: [0.25, 1.0, 4.0], reserved: 0 };

/// Two parallel triangles, one high above the other, with what is known of free directions of them.
fn one_above_the_other(free: &[FreeDirections], free_distances: &[FreeDistances]) -> Vec<u8> {
    let above = CORNERS.map(|[x, y, _]| [x, y, 10.0]);
    let lines = lines(indexed(&[above, CORNERS], 0).as_bytes());
    file(&ObjectParts {
        bounds: Some(bounds(CORNERS.iter().chain(&above))),
        root: Child::Indexed(0).code(),
        triangles: 2,
        lines: &lines,
        triangle_ids: &[1, 0],
        places: &[1, 0].map(|slot| TrianglePlace { leaf: Child::Indexed(0), slot }.code()),
        free,
        free_distances,
        free_levels: &[LEVELS],
        ..ObjectParts::default()
    })
}

/// Sectors with a level for steep directions only.
fn steep(level: usize) -> FreeSectors {
    FreeSectors(0)
        .with(FreeSectors::of_bin(FREE_BINS / 2).expect("the bin in the middle has a sector"), level)
}

/// Rows of [`one_above_the_other`]: straight up from the lower triangle there is nothing within the
/// third level, and from the upper one nothing at all.
fn directions() -> [FreeDirections; 2] {
    let all = FreeSectors(u32::MAX);
    [FreeDirections::new(steep(3), FreeBins(0)), FreeDirections::new(all, FreeBins(FreeBins::ALL))]
}

/// As [`directions`], of both sides: there is nothing within the second level below the upper
/// triangle, either.
fn distances() -> [FreeDistances; 2] {
    [FreeDistances { sectors: [steep(3).0, u32::MAX] }, FreeDistances { sectors: [u32::MAX, steep(2).0] }]
}

fn free_directions() -> Vec<u8> {
    one_above_the_other(&directions(), &[])
}

fn free_distances() -> Vec<u8> {
    one_above_the_other(&[], &distances())
}

/// An invalid file: it has both sections.
pub(super) fn free_directions_and_distances() -> Vec<u8> {
    one_above_the_other(&directions(), &distances())
}

/// Six triangles side by side: opaque, transparent, unknown, and divided at levels 1 and 2 and once
/// more at level 1 by the same word.
fn opacity() -> Vec<u8> {
    let corners: [[[f32; 3]; 3]; 6] =
        std::array::from_fn(|k| CORNERS.map(|[x, y, z]| [x + 2.0 * k as f32, y, z]));
    let lines = lines(raw(&corners, 0).as_bytes());
    let micro = |level, word| TriangleOpacity::Micro { level, word };
    let rows = [
        TriangleOpacity::Whole(Opacity::Opaque),
        TriangleOpacity::Whole(Opacity::Transparent),
        TriangleOpacity::Whole(Opacity::Unknown),
        micro(1, 0),
        micro(2, 1),
        micro(1, 0),
    ];
    file(&ObjectParts {
        bounds: Some(bounds(corners.as_flattened())),
        root: Child::Raw(0).code(),
        triangles: 6,
        lines: &lines,
        triangle_ids: &[0, 1, 2, 3, 4, 5],
        opacity: &rows.map(TriangleOpacity::code),
        opacity_micro: &[0b10_01_00_01, 0x1864_9126],
        ..ObjectParts::default()
    })
}

fn triangle_bare() -> Vec<u8> {
    let lines = lines(raw(&[CORNERS], 0).as_bytes());
    file(&ObjectParts {
        bounds: Some(bounds(&CORNERS)),
        root: Child::Raw(0).code(),
        triangles: 1,
        lines: &lines,
        triangle_ids: &[0],
        ..ObjectParts::default()
    })
}

/// The ends of the smallest box of `f32` with the room around a point that widened boxes have.
fn room_around(point: [f32; 3]) -> [[f32; 3]; 2] {
    let margin = point.into_iter().fold(0.0, |m: f64, x| m.max(f64::from(x).abs())) * BOX_MARGIN;
    let lower = point.map(|x| {
        // The sum of these few bits is exact.
        let end = f64::from(x) - margin;
        if f64::from(end as f32) > end { (end as f32).next_down() } else { end as f32 }
    });
    let upper = point.map(|x| {
        let end = f64::from(x) + margin;
        if f64::from(end as f32) < end { (end as f32).next_up() } else { end as f32 }
    });
    [lower, upper]
}

/// A grid of 4 by 5 squares, two triangles each: 12 squares in an inner node with indexed and raw
/// leaves, 8 in leaves next to it; and a triangle without area. Normals and texture coordinates are
/// kept. With bits, the leaves are quantized to a grid that moves the source's positions slightly.
fn two_levels(bits: Option<GridBits>) -> Vec<u8> {
    two_levels_of(bits, [false; 2])
}

/// The same, with the places of triangles.
fn with_places(bits: Option<GridBits>) -> Vec<u8> {
    two_levels_of(bits, [false, true])
}

/// Returns the file of [`two_levels`] with the smallest child boxes that widened boxes allow.
fn two_levels_widened() -> Vec<u8> {
    two_levels_of(None, [true, false])
}

fn two_levels_of(bits: Option<GridBits>, [widened_boxes, has_places]: [bool; 2]) -> Vec<u8> {
    let mut positions = Vec::new();
    for y in 0..6 {
        for x in 0..5 {
            positions.push([x as f32, y as f32, 0.25 * (x * y) as f32]);
        }
    }
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for y in 0..5 {
        for x in 0..4 {
            let v = 5 * y + x;
            triangles.push([v, v + 1, v + 6]);
            triangles.push([v, v + 6, v + 5]);
        }
    }
    triangles.push([7, 7, 8]);
    let corners = |t: u32| triangles[t as usize].map(|v| positions[v as usize]);
    let range = |from: u32, to: u32| (from..to).map(corners).collect::<Vec<_>>();
    let of = |from: u32, to: u32| {
        let room = |p: &[f32; 3]| if widened_boxes { room_around(*p) } else { [*p; 2] };
        bounds(&range(from, to).iter().flatten().flat_map(room).collect::<Vec<_>>())
    };
    // Root, inner node, then the leaves.
    let (inner, leaf) = (NODE_LINES as u32, 2 * NODE_LINES as u32);
    let at = |indexed: u32, raw: u32| leaf + indexed * INDEXED_LINES as u32 + raw * RAW_LINES as u32;
    let root = node(&[
        (Child::Node(inner), of(0, 24)),
        (Child::Indexed(at(2, 1)), of(24, 32)),
        (Child::Raw(at(3, 1)), of(32, 40)),
    ]);
    let second = node(&[
        (Child::Indexed(at(0, 0)), of(0, 8)),
        (Child::Raw(at(1, 0)), of(8, 16)),
        (Child::Indexed(at(1, 1)), of(16, 24)),
    ]);
    let mut all = lines(root.as_bytes());
    all.extend(lines(second.as_bytes()));
    all.extend(lines(indexed(&range(0, 8), 0).as_bytes()));
    all.extend(lines(raw(&range(8, 16), 8).as_bytes()));
    all.extend(lines(indexed(&range(16, 24), 16).as_bytes()));
    all.extend(lines(indexed(&range(24, 32), 24).as_bytes()));
    all.extend(lines(raw(&range(32, 40), 32).as_bytes()));
    let mut wide = Wide {
        lines: all,
        triangle_ids: (0..40).collect(),
        root: Child::Node(0).code(),
        depth: 2,
        leaf_vertices: Vec::new(),
        widened_boxes,
    };
    let bounds = bounds(&positions);
    let grid = bits.map(|bits| {
        let step = [8.0, 8.0, 16.0].map(|extent| extent / (1u32 << bits as u32) as f32);
        let grid = Grid { bits, origin: [0.0; 3], step };
        // A reader that compares with the source must round to the grid.
        let off = step.map(|s| 0.375 * s);
        positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|k| p[k] + off[k]));
        (grid, off.iter().map(|x| x * x).sum::<f32>().sqrt().next_up())
    });
    if let Some((grid, _)) = &grid {
        pack(&mut wide, grid).expect("a few lines");
    }
    let places = match &grid {
        _ if !has_places => Vec::new(),
        of_leaves => triangle_places(&wide, of_leaves.as_ref().map(|(grid, _)| grid), triangles.len()),
    };
    let normals = vec![[0.0, 0.0, 1.0]; positions.len()];
    let uvs: Vec<_> = positions.iter().map(|p| [p[0] / 4.0, p[1] / 5.0]).collect();
    let source = Source {
        positions: &positions,
        triangles: &triangles,
        corners: &triangles,
        normals: &normals,
        uvs: &uvs,
        ..Source::default()
    };
    file(&ObjectParts {
        bounds: Some(bounds),
        root: wide.root,
        triangles: 41,
        dropped: 1,
        grid,
        widened_boxes,
        lines: &wide.lines,
        triangle_ids: &wide.triangle_ids,
        places: &places,
        source: Some(source),
        ..ObjectParts::default()
    })
}

/// Four triangles in three groups of two materials, one group in two runs, one without a name; and
/// an object without groups. Both objects have names.
fn groups() -> Vec<u8> {
    let triangles: Vec<_> = (0..4).map(|i| CORNERS.map(|[x, y, z]| [x, y, z + i as f32])).collect();
    let lines = lines(indexed(&triangles, 0).as_bytes());
    let group = |name: &str, material| bth_import::Group { name: name.into(), material };
    let groups = GroupParts::of(&bth_import::Groups {
        groups: vec![group("wheel", Some(0)), group("window, front", Some(1)), group("", None)],
        materials: vec!["rubber".into(), "gl\u{e4}s".into()],
        runs: vec![[0, 0], [1, 1], [2, 0], [3, 2]],
    });
    let parts = ObjectParts {
        bounds: Some(bounds(triangles.as_flattened())),
        root: Child::Indexed(0).code(),
        triangles: 4,
        lines: &lines,
        triangle_ids: &[0, 1, 2, 3],
        groups: Some(&groups),
        ..ObjectParts::default()
    };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    object(&mut builder, 1, &ObjectParts { groups: None, ..parts }).unwrap();
    object_names(&mut builder, ["car", "stone"]).unwrap();
    builder.finish()
}

fn two_objects() -> Vec<u8> {
    let lines = lines(indexed(&[CORNERS], 0).as_bytes());
    let parts = one_triangle(&lines);
    let mut builder = FileBuilder::new();
    object(&mut builder, 1, &parts).unwrap();
    object(&mut builder, 0, &parts).unwrap();
    builder.finish()
}

fn unknown_section() -> Vec<u8> {
    let mut builder = FileBuilder::new();
    builder.section(1000, NONE, 3, b"abcdef".as_slice()).unwrap();
    builder.finish()
}

/// Vertices of the five tetrahedra that fill a cube whose corner i is at (i & 1, i >> 1 & 1, i >>
/// 2).
pub(super) const CUBE: [[u32; 4]; 5] = [[0, 1, 2, 4], [1, 2, 3, 7], [1, 2, 4, 7], [1, 4, 5, 7], [2, 4, 6, 7]];
/// Two faces of the middle tetrahedron.
pub(super) const FACES: [[u32; 3]; 2] = [[1, 2, 7], [1, 4, 2]];

/// Two cubes as tet leaves, each around two triangles; a triangle leaf; and a triangle without
/// area.
pub(super) fn tets_of(has_places: bool, leaf_vertices: &[[u32; WIDTH]]) -> Vec<u8> {
    let mut positions: Vec<[f32; 3]> = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut parts = TetParts::default();
    for cube in 0..2u32 {
        let point = |i: u32| [(4 * cube + (i & 1)) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32];
        let base = positions.len() as u32;
        let rows = [1, 2, 4, 7];
        positions.extend(rows.map(point));
        let ids = triangles.len() as u32;
        let row = |v: u32| base + rows.iter().position(|r| *r == v).unwrap() as u32;
        triangles.extend(FACES.map(|f| f.map(row)));
        parts.add(&[0, 1, 2, 3, 4, 5, 6, 7].map(point), &CUBE, &FACES, ids);
    }
    let base = positions.len() as u32;
    positions.extend([[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 1.0, 0.5]]);
    triangles.extend([[base, base + 1, base + 2], [base, base, base + 1]]);
    let corners = |t: usize| triangles[t].map(|v| positions[v as usize]);

    let leaf = NODE_LINES as u32;
    let root = node(&[
        (Child::Tets(0), ([0.0; 3], [1.0; 3])),
        (Child::Indexed(leaf), bounds(&corners(4))),
        (Child::Tets(1), ([4.0, 0.0, 0.0], [5.0, 1.0, 1.0])),
    ]);
    let mut all = lines(root.as_bytes());
    all.extend(lines(indexed(&[corners(4)], 0).as_bytes()));
    let homes = [0, 1, 2, 3, NONE, NONE];
    let place = |leaf, slot| TrianglePlace { leaf: Child::Indexed(leaf), slot }.code();
    let places = [NONE, NONE, NONE, NONE, place(leaf, 0), NONE];
    let source = Source { positions: &positions, triangles: &triangles, ..Source::default() };
    file(&ObjectParts {
        bounds: Some(bounds(&positions)),
        root: Child::Node(0).code(),
        triangles: 6,
        dropped: 1,
        grid: None,
        lines: &all,
        triangle_ids: &[4],
        leaf_vertices,
        places: if has_places { &places } else { &[] },
        tet_leaves: &parts.leaves,
        tets: &parts.records,
        tet_vertices: &parts.vertices,
        tet_faces: &parts.faces,
        hull_faces: &parts.hulls,
        triangle_faces: &homes,
        source: Some(source),
        ..ObjectParts::default()
    })
}

/// The sections of tet leaves.
#[derive(Default)]
pub(super) struct TetParts {
    pub(super) leaves: Vec<TetLeaf>,
    pub(super) records: Vec<u8>,
    pub(super) vertices: Vec<TetVertex>,
    pub(super) faces: Vec<TetFace>,
    pub(super) hulls: Vec<HullFace>,
}

/// Returns true if a vertex lies on the side of a face from which its corners are
/// counter-clockwise.
fn is_in_front(points: &[[f32; 3]], face: &[u32; 3], vertex: u32) -> bool {
    let [a, b, c, d] = [face[0], face[1], face[2], vertex].map(|v| points[v as usize].map(f64::from));
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
    minor(1, 2) * w[0] + minor(2, 0) * w[1] + minor(0, 1) * w[2] > 0.0
}

impl TetParts {
    /// Encodes a tetrahedron with its neighbours and the vertices opposite in them.
    pub(super) fn push_record(&mut self, next: [u32; 4], opposite: [u32; 4]) {
        let link = std::array::from_fn(|i| Link { next: next[i], opposite: opposite[i] });
        self.records.extend(Link32 { link }.as_bytes());
    }

    /// Adds a leaf of tetrahedra (ascending vertices) with constrained faces, whose triangles
    /// number from `ids`.
    pub(super) fn add(&mut self, points: &[[f32; 3]], tets: &[[u32; 4]], faces: &[[u32; 3]], ids: u32) {
        let (first_tet, first_vertex) =
            ((self.records.len() / size_of::<Link32>()) as u32, self.vertices.len() as u32);
        let (first_face, first_hull) = (self.faces.len() as u32, self.hulls.len() as u32);
        let (lower, upper) = bounds(points);
        self.vertices.extend(points.iter().map(|p| TetVertex { position: *p, reserved: 0 }));

        let without = |tet: [u32; 4], slot: usize| -> Vec<u32> {
            tet.into_iter().filter(|v| *v != tet[slot]).collect()
        };
        let in_front = |face: &[u32; 3], v: u32| is_in_front(points, face, v);
        self.faces.extend(faces.iter().enumerate().map(|(i, f)| TetFace {
            vertex: f.map(|v| first_vertex + v),
            triangle: ids + i as u32,
            tet: [NONE; 2],
            opposite: [NONE; 2],
        }));
        for (t, &tet) in tets.iter().enumerate() {
            let mut next = [NONE; 4];
            let mut opposite = [NONE; 4];
            for slot in 0..4 {
                let face = without(tet, slot);
                let beyond = tets
                    .iter()
                    .enumerate()
                    .find(|(o, other)| *o != t && face.iter().all(|v| other.contains(v)));
                let Some((other, vertices)) = beyond else {
                    let mut vertex: [u32; 3] = face.try_into().unwrap();
                    if !in_front(&vertex, tet[slot]) {
                        vertex.swap(1, 2);
                    }
                    self.hulls.push(HullFace {
                        vertex: vertex.map(|v| first_vertex + v),
                        tet: first_tet + t as u32,
                        opposite: first_vertex + tet[slot],
                    });
                    continue;
                };
                let fourth = vertices.iter().find(|v| !face.contains(v)).unwrap();
                opposite[slot] = first_vertex + fourth;
                next[slot] = match faces.iter().position(|f| f.iter().all(|v| face.contains(v))) {
                    None => first_tet + other as u32,
                    Some(f) => {
                        let side = usize::from(!in_front(&faces[f], tet[slot]));
                        let row = first_face as usize + f;
                        self.faces[row].tet[side] = first_tet + t as u32;
                        self.faces[row].opposite[side] = first_vertex + tet[slot];
                        FACE_BIT | row as u32
                    }
                };
            }
            self.push_record(next, opposite);
        }
        self.leaves.push(TetLeaf {
            lower,
            upper,
            first_tet,
            tets: tets.len() as u32,
            first_vertex,
            vertices: points.len() as u32,
            first_face,
            faces: faces.len() as u32,
            first_hull,
            hulls: self.hulls.len() as u32 - first_hull,
            subtree: NONE,
            flags: 0,
        });
    }
}
