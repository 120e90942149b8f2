//! The properties that the generators guarantee: bytes, face counts, topology and
//! self-intersections.

use bth_scenes::catalogue::{ENTRIES, find};
use bth_scenes::topology::topology;
use bth_scenes::{Model, write};
use robust::{Coord3D, orient3d};

/// FNV-1a, 64 bits.
fn hash(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

fn make(name: &str, faces: u32) -> Model {
    (find(name).expect("a name of the catalogue").make)(faces)
}

#[test]
fn models_have_the_same_bytes_everywhere() {
    let expected: [(&str, u64); 7] = [
        ("torus-knot", 0x6bb1_f08b_5980_08dc),
        ("torus-knots-in-a-box", 0x0c4a_2263_56a2_9eb5),
        ("hairball", 0x1741_13b5_44fc_dcdf),
        ("gyroid", 0x73e3_a405_0770_d88a),
        ("hall", 0x83f8_49c8_fa03_a9bb),
        ("soup", 0xc449_42fe_43ff_2cfc),
        ("blob", 0x863c_6fb6_59e7_9312),
    ];
    let found = ENTRIES.map(|e| (e.name, hash(&write::ply(&(e.make)(e.faces)))));
    assert_eq!(found, expected, "found {found:#x?}");
}

#[test]
fn face_counts_come_near_to_what_is_asked() {
    for entry in &ENTRIES {
        for faces in [entry.faces / 2, entry.faces, entry.faces * 2] {
            let found = (entry.make)(faces).triangles.len() as f64;
            let ratio = found / f64::from(faces);
            assert!((0.75..1.34).contains(&ratio), "{}: {found} for {faces}", entry.name);
        }
    }
    assert_eq!(make("torus-knot", 2_880).triangles.len(), 2_880);
    assert_eq!(make("torus_knots_in_a_box", 77_772).triangles.len(), 77_772);
    assert_eq!(make("soup", 777).triangles.len(), 777);
}

#[test]
fn tiny_face_counts_give_a_model_too() {
    for entry in &ENTRIES {
        assert!(!(entry.make)(1).triangles.is_empty(), "{}", entry.name);
    }
}

#[test]
fn closed_models_are_closed_and_point_outwards() {
    for name in ["torus-knot", "gyroid", "hall", "blob"] {
        let model = make(name, find(name).unwrap().faces);
        let found = topology(&model);
        assert!(found.is_closed() && found.duplicate == 0, "{name}: {found:?}");
        assert!(volume(&model) > 0.0, "{name} is inside out");
    }
    let hair = topology(&make("hairball", 1_200));
    assert_eq!((hair.boundary_edges, hair.non_manifold_edges, hair.flipped_edges), (100, 0, 0));
    assert_eq!(hair.components, 10);
    assert_eq!(topology(&make("torus-knots-in-a-box", 77_772)).components, 28);
    assert!(topology(&make("torus-knots-in-a-box", 77_772)).is_closed());
    assert_eq!(topology(&make("torus-knot", 2_880)).components, 1);
    assert_eq!(topology(&make("blob", 1_000)).components, 1);
}

#[test]
fn no_model_has_degenerate_or_duplicate_triangles() {
    for entry in &ENTRIES {
        let found = topology(&(entry.make)(entry.faces));
        assert_eq!((found.degenerate, found.duplicate), (0, 0), "{}", entry.name);
    }
}

#[test]
fn every_part_of_the_hall_points_outwards() {
    let model = make("hall", 4_000);
    let parts = parts(&model);
    assert_eq!(parts.len(), 118);
    for part in parts {
        assert!(volume(&part) > 0.0, "the part from position {} is inside out", part.triangles[0][0]);
    }
}

#[test]
fn clean_models_do_not_intersect_themselves() {
    for (name, faces) in [("torus-knot", 2_880), ("gyroid", 6_000), ("blob", 2_000)] {
        assert_eq!(crossings(&make(name, faces)), 0, "{name}");
    }
}

#[test]
fn messy_models_intersect_themselves() {
    assert!(crossings(&make("soup", 2_000)) > 200);
    assert!(crossings(&make("hall", 3_000)) > 200);
}

#[test]
fn planted_cases_are_in_bad_contact_exactly_where_marked() {
    for case in bth_scenes::planted::cases() {
        assert!(topology(&case.model).degenerate == 0, "{}", case.name);
        // The oracle below sees only triangles without shared vertices.
        if (1..case.model.triangles.len()).all(|t| !shares(&case.model, 0, t)) {
            assert_eq!(crossings(&case.model) > 0, case.bad, "{}", case.name);
        }
    }
}

#[test]
fn writers_keep_every_bit_of_the_positions() {
    let model = make("torus-knot", 2_880);
    let text = write::obj(&model);
    let read: Vec<f32> = text
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .flat_map(|line| line.split(' ').map(|x| x.parse().unwrap()))
        .collect();
    assert_eq!(read, model.positions.as_flattened());
    assert_eq!(text.lines().filter(|line| line.starts_with("f ")).count(), 2_880);
    assert_eq!(write::stl(&model).len(), 84 + 50 * 2_880);
    let ply = write::ply(&model);
    let header = ply.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    assert_eq!(ply.len() - header, 12 * 1_440 + 13 * 2_880);
}

/// Each triangle of a strip is one corner and the two before it, the odd ones turned.
#[test]
fn strips_hold_the_same_triangles_in_less_than_half_the_bytes() {
    for (name, faces) in [("blob", 80_000), ("torus-knot", 2_880), ("soup", 50)] {
        let model = make(name, faces);
        let bytes = write::ply_of_strips(&model);
        let header = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let corners = &bytes[header + 12 * model.positions.len() + 4..];
        let corners: Vec<i32> =
            corners.chunks_exact(4).map(|b| i32::from_le_bytes(b.try_into().unwrap())).collect();
        let turned = |t: [i32; 3]| {
            let first = (0..3).min_by_key(|&k| t[k]).unwrap();
            [0, 1, 2].map(|k| t[(first + k) % 3] as u32)
        };
        let strips = corners.split(|&v| v == -1).flat_map(|strip| {
            let corners = strip.windows(3).enumerate();
            corners.map(|(k, t)| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
        });
        let expected: Vec<_> = model.triangles.iter().map(|t| turned(t.map(|v| v as i32))).collect();
        assert_eq!(strips.map(turned).collect::<Vec<_>>(), expected, "{name}");
        if name == "blob" {
            assert!(4 * corners.len() < 13 * expected.len() / 2);
        }
    }
}

#[test]
fn files_are_written_by_extension_and_others_refused() {
    let folder = tempfile::tempdir().unwrap();
    let model = make("blob", 8);
    for name in ["a.obj", "a.ply", "a.stl"] {
        write::file(&model, &folder.path().join(name)).unwrap();
    }
    let error = write::file(&model, &folder.path().join("a.fbx")).unwrap_err();
    assert!(error.to_string().contains(".obj, .ply or .stl"));
}

/// Six times the enclosed volume.
fn volume(model: &Model) -> f64 {
    (0..model.triangles.len())
        .map(|t| {
            let [a, b, c] = model.corners(t).map(|p| p.map(f64::from));
            a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        })
        .sum()
}

/// The connected parts of a model.
fn parts(model: &Model) -> Vec<Model> {
    let mut label: Vec<u32> = (0..model.positions.len() as u32).collect();
    loop {
        let before = label.clone();
        for t in &model.triangles {
            let low = t.map(|v| label[v as usize]).into_iter().min().unwrap();
            t.iter().for_each(|&v| label[v as usize] = low);
        }
        if label == before {
            break;
        }
    }
    let mut parts = std::collections::BTreeMap::<u32, Model>::new();
    for t in &model.triangles {
        parts.entry(label[t[0] as usize]).or_default().triangles.push(*t);
    }
    for part in parts.values_mut() {
        part.positions.clone_from(&model.positions);
    }
    parts.into_values().collect()
}

fn shares(model: &Model, a: usize, b: usize) -> bool {
    model.triangles[a].iter().any(|v| model.triangles[b].contains(v))
}

/// The obvious oracle: pairs of triangles without a common vertex that touch, by exact predicates.
fn crossings(model: &Model) -> usize {
    let corners: Vec<_> = (0..model.triangles.len()).map(|t| model.corners(t)).collect();
    let bounds: Vec<_> = corners
        .iter()
        .map(|c| {
            [0, 1, 2].map(|k| {
                let x = c.map(|p| p[k]);
                [x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2])]
            })
        })
        .collect();
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.sort_by(|&a, &b| bounds[a][0][0].total_cmp(&bounds[b][0][0]));
    let mut found = 0;
    for (at, &a) in order.iter().enumerate() {
        for &b in order[at + 1..].iter().take_while(|&&b| bounds[b][0][0] <= bounds[a][0][1]) {
            let apart =
                (1..3).any(|k| bounds[a][k][0] > bounds[b][k][1] || bounds[b][k][0] > bounds[a][k][1]);
            if !apart && !shares(model, a, b) && touch(corners[a], corners[b]) {
                found += 1;
            }
        }
    }
    found
}

fn touch(a: [[f32; 3]; 3], b: [[f32; 3]; 3]) -> bool {
    let edges = |t: [[f32; 3]; 3], u| [0, 1, 2].iter().any(|&k| segment_meets(t[k], t[(k + 1) % 3], u));
    edges(a, b) || edges(b, a)
}

fn side(t: [[f32; 3]; 3], p: [f32; 3]) -> f64 {
    let c = |p: [f32; 3]| Coord3D { x: p[0], y: p[1], z: p[2] };
    orient3d(c(t[0]), c(t[1]), c(t[2]), c(p)).signum_or_zero()
}

trait Sign {
    fn signum_or_zero(self) -> f64;
}
impl Sign for f64 {
    fn signum_or_zero(self) -> f64 {
        if self == 0.0 { 0.0 } else { self.signum() }
    }
}

/// Returns true if a closed segment and a closed triangle have a point in common.
fn segment_meets(p: [f32; 3], q: [f32; 3], t: [[f32; 3]; 3]) -> bool {
    let (sp, sq) = (side(t, p), side(t, q));
    if sp == 0.0 && sq == 0.0 {
        return coplanar_meets(p, q, t);
    }
    if sp * sq > 0.0 {
        return false;
    }
    let s = [0, 1, 2].map(|k| side([p, q, t[k]], t[(k + 1) % 3]));
    s.iter().all(|&x| x >= 0.0) || s.iter().all(|&x| x <= 0.0)
}

/// As [`segment_meets`] for a segment in the plane of the triangle: an end inside it, or a crossing
/// with an edge. Both are projected along a coordinate axis that is not parallel to the plane.
fn coplanar_meets(p: [f32; 3], q: [f32; 3], t: [[f32; 3]; 3]) -> bool {
    let area = |a: [f32; 3], b: [f32; 3], c: [f32; 3], drop: usize| {
        let f = |p: [f32; 3]| robust::Coord { x: p[(drop + 1) % 3], y: p[(drop + 2) % 3] };
        robust::orient2d(f(a), f(b), f(c)).signum_or_zero()
    };
    let Some(drop) = (0..3).find(|&d| area(t[0], t[1], t[2], d) != 0.0) else { return false };
    let s = |a, b, c| area(a, b, c, drop);
    let inside = |x| {
        let w = [0, 1, 2].map(|k| s(t[k], t[(k + 1) % 3], x));
        w.iter().all(|&x| x >= 0.0) || w.iter().all(|&x| x <= 0.0)
    };
    inside(p)
        || inside(q)
        || (0..3).any(|k| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            // Collinear overlap has an end of one in the other; ends in the triangle are done
            // above.
            s(p, q, a) * s(p, q, b) < 0.0 && s(a, b, p) * s(a, b, q) < 0.0
        })
}
