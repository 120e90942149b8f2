//! The stage against alpha that is evaluated point by point.

use super::*;
use bth_format::layout::{micro_corners, micro_triangle};
use bth_import::{AlphaImage, CutoutCorner, CutoutMaterial, Silent, Wrap};
use bth_random::Rng;

/// Alpha of a material at texture coordinates by the definition (glTF 2.0 specification, §3.8.4 and
/// §3.9.4), in f64.
pub(super) fn alpha_at(images: &[AlphaImage], material: &CutoutMaterial, uv: [f64; 2], vertex: f64) -> f64 {
    let Some(image) = material.image.map(|row| &images[row]) else { return material.factor * vertex };
    let size = [image.width, image.height].map(i64::from);
    let texel = |x: f64, y: f64| {
        let wrap = |axis: usize, k: f64| {
            let (k, n) = (k as i64, size[axis]);
            match material.wrap[axis] {
                Wrap::Repeat => k.rem_euclid(n),
                Wrap::Clamp => k.clamp(0, n - 1),
                Wrap::Mirror if k.rem_euclid(2 * n) < n => k.rem_euclid(2 * n),
                Wrap::Mirror => 2 * n - 1 - k.rem_euclid(2 * n),
            }
        };
        f64::from(image.alpha[(wrap(1, y) * size[0] + wrap(0, x)) as usize]) / 255.0
    };
    let [x, y] = [0, 1].map(|k| uv[k] * size[k] as f64);
    let sampled = if material.nearest {
        texel(x.floor(), y.floor())
    } else {
        let (x, y) = (x - 0.5, y - 0.5);
        let (i, j) = (x.floor(), y.floor());
        let (s, t) = (x - i, y - j);
        let above = (1.0 - s) * texel(i, j) + s * texel(i + 1.0, j);
        let below = (1.0 - s) * texel(i, j + 1.0) + s * texel(i + 1.0, j + 1.0);
        (1.0 - t) * above + t * below
    };
    material.factor * sampled * vertex
}

/// The values of the corners at weights of the second and third.
fn interpolated(corners: &[CutoutCorner; 3], [u, v]: [f64; 2]) -> ([f64; 2], f64) {
    let mix = |value: &dyn Fn(&CutoutCorner) -> f64| {
        let [a, b, c] = corners.each_ref().map(value);
        a + u * (b - a) + v * (c - a)
    };
    ([0, 1].map(|k| mix(&|corner| f64::from(corner.uv[k]))), mix(&|corner| f64::from(corner.alpha)))
}

/// State of the micro-triangle that a point lies in.
fn state_at(opacities: &TriangleOpacities, triangle: usize, u: f32, v: f32) -> Opacity {
    match TriangleOpacity::from_code(opacities.rows[triangle]).unwrap() {
        TriangleOpacity::Whole(state) => state,
        TriangleOpacity::Micro { level, word } => {
            let micro = micro_triangle(level, u, v);
            let word = opacities.micro[word as usize + micro as usize / 16];
            Opacity::from_code(word >> (2 * (micro % 16)) & 3).unwrap()
        }
    }
}

fn corner(u: f32, v: f32) -> CutoutCorner {
    CutoutCorner { uv: [u, v], alpha: 1.0 }
}

fn material(image: Option<usize>) -> CutoutMaterial {
    CutoutMaterial { image, wrap: [Wrap::Repeat; 2], nearest: false, factor: 1.0, cutoff: 0.5 }
}

/// A mesh of triangles side by side that have these corners.
fn cutouts(
    images: Vec<AlphaImage>,
    materials: Vec<CutoutMaterial>,
    triangles: &[(u32, [CutoutCorner; 3])],
) -> (Mesh, Cutouts) {
    let mut mesh = Mesh::default();
    let mut cutouts = Cutouts { images, materials, mesh_triangles: triangles.len(), ..Cutouts::default() };
    for (k, (material, corners)) in triangles.iter().enumerate() {
        let (x, first) = (k as f32, 3 * k as u32);
        mesh.positions.extend([[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]]);
        mesh.triangles.push([first, first + 1, first + 2]);
        cutouts.triangles.push(CutoutTriangle { triangle: k as u32, material: *material, corners: *corners });
    }
    (mesh, cutouts)
}

/// Random images: noise, blobs that are larger than texels, and checkers.
fn images(random: &mut Rng) -> Vec<AlphaImage> {
    let image = |width: u32, height: u32, alpha: &mut dyn FnMut(u32, u32) -> u8| AlphaImage {
        width,
        height,
        alpha: (0..width * height).map(|k| alpha(k % width, k / width)).collect(),
    };
    vec![
        image(7, 5, &mut |_, _| random.below(256) as u8),
        image(64, 64, &mut |x, y| if (x / 8 + y / 8) % 2 == 0 { 255 } else { 0 }),
        image(33, 20, &mut |x, y| (127.5 + 127.5 * ((x as f64 * 0.3).sin() * (y as f64 * 0.4).cos())) as u8),
        image(1, 1, &mut |_, _| 128),
    ]
}

fn random_material(random: &mut Rng, images: usize) -> CutoutMaterial {
    let wrap = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    CutoutMaterial {
        image: Some(random.below(images as u64) as usize),
        wrap: [0, 1].map(|_| wrap[random.below(3) as usize]),
        nearest: random.below(3) == 0,
        factor: [1.0, 0.7][random.below(2) as usize],
        cutoff: random.between(0.05, 0.95),
    }
}

/// Corners of every kind: small and large, far away, on one line, all at one point, at the edges of
/// texels.
fn random_corners(random: &mut Rng) -> [CutoutCorner; 3] {
    let scale = [0.05, 1.0, 6.0, 300.0, 1e6][random.below(5) as usize];
    let kind = random.below(6);
    let snap = |x: f64| if kind == 1 { (x * 64.0).round() / 64.0 } else { x };
    let mut corners = [0; 3].map(|_| {
        let uv = [0; 2].map(|_| snap(random.between(-scale, scale)) as f32);
        CutoutCorner { uv, alpha: if kind == 0 { random.unit_f32() } else { 1.0 } }
    });
    match kind {
        2 => corners[2] = corners[1],
        3 => corners = [corners[0]; 3],
        4 => corners[2].uv = [0, 1].map(|k| 2.0 * corners[1].uv[k] - corners[0].uv[k]),
        _ => {}
    }
    corners
}

#[test]
fn states_agree_with_alpha_at_every_point() {
    let mut random = Rng::new(145);
    let images = images(&mut random);
    let materials: Vec<_> = (0..40).map(|_| random_material(&mut random, images.len())).collect();
    let triangles: Vec<_> =
        (0..200).map(|k| (k % materials.len() as u32, random_corners(&mut random))).collect();
    let (mesh, cutouts) = cutouts(images, materials, &triangles);
    let (opacities, report) = compile(&mesh, &cutouts, &Silent).unwrap().unwrap();
    let mut found = [0u32; 3];
    for (k, (row, corners)) in triangles.iter().enumerate() {
        for point in 0..200 {
            let (mut u, mut v) = (random.unit_f32(), random.unit_f32());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            // Corners and edges of micro-triangles too.
            if point % 3 == 0 {
                (u, v) = ((u * 64.0).round() / 64.0, (v * 64.0).round() / 64.0);
                v = v.min(1.0 - u);
            }
            let material = &cutouts.materials[*row as usize];
            let (uv, vertex) = interpolated(corners, [f64::from(u), f64::from(v)]);
            let alpha = alpha_at(&cutouts.images, material, uv, vertex);
            let state = state_at(&opacities, k, u, v);
            found[state as usize] += 1;
            // The rounding of this evaluation.
            let slack = 1e-12;
            match state {
                Opacity::Opaque => assert!(
                    alpha >= material.cutoff - slack,
                    "{k} {material:?} {corners:?} ({u}, {v}): {alpha}"
                ),
                Opacity::Transparent => assert!(
                    alpha < material.cutoff + slack,
                    "{k} {material:?} {corners:?} ({u}, {v}): {alpha}"
                ),
                Opacity::Unknown => {}
            }
        }
    }
    assert!(found.iter().all(|count| *count > 2000), "states found: {found:?}");
    assert!((report.opaque + report.transparent + report.unknown - 1.0).abs() < 1e-9, "{report:?}");
}

#[test]
fn a_checker_is_resolved_up_to_the_edges_of_its_squares() {
    let image = AlphaImage {
        width: 64,
        height: 64,
        alpha: (0..4096).map(|k| if (k % 64 / 16 + k / 64 / 16) % 2 == 0 { 255 } else { 0 }).collect(),
    };
    let triangle = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
    let nearest = CutoutMaterial { nearest: true, ..material(Some(0)) };
    for (material, most) in [(material(Some(0)), 0.25), (nearest, 0.25)] {
        let (mesh, cutouts) = cutouts(vec![image.clone()], vec![material], &[(0, triangle)]);
        let (_, report) = compile(&mesh, &cutouts, &Silent).unwrap().unwrap();
        assert!(report.unknown < most && (report.opaque - report.transparent).abs() < 0.1, "{report:?}");
    }
}

#[test]
fn equal_patterns_are_stored_once() {
    let mut random = Rng::new(3);
    let images = images(&mut random);
    let one = [corner(0.1, 0.2), corner(1.3, 0.2), corner(0.1, 1.7)];
    let (mesh, cutouts) = cutouts(images, vec![material(Some(1))], &[(0, one); 9]);
    let (opacities, report) = compile(&mesh, &cutouts, &Silent).unwrap().unwrap();
    assert_eq!((report.triangles, report.subdivided, report.patterns), (9, 9, 1));
    assert!(opacities.rows.iter().all(|row| *row == opacities.rows[0]));
    assert_eq!(report.bytes as usize, 4 * (opacities.rows.len() + opacities.micro.len()));
}

#[test]
fn whole_triangles_have_one_state() {
    let image = AlphaImage { width: 2, height: 1, alpha: vec![255, 0] };
    let clamped = CutoutMaterial { wrap: [Wrap::Clamp; 2], ..material(Some(0)) };
    let triangle = |x: f32| [corner(x, 0.0), corner(x + 0.1, 0.0), corner(x, 0.1)];
    let nan = [corner(f32::NAN, 0.0), corner(f32::INFINITY, 0.0), corner(0.0, 0.0)];
    let faint = CutoutMaterial { factor: 0.25, ..material(None) };
    let rows = [(0, triangle(-3.0)), (0, triangle(3.0)), (0, nan), (1, nan), (2, nan)];
    let (mesh, cutouts) = cutouts(vec![image], vec![clamped, material(None), faint], &rows);
    let (opacities, report) = compile(&mesh, &cutouts, &Silent).unwrap().unwrap();
    let states =
        [Opacity::Opaque, Opacity::Transparent, Opacity::Unknown, Opacity::Opaque, Opacity::Transparent];
    assert_eq!(opacities.rows, states.map(|state| TriangleOpacity::Whole(state).code()));
    assert!(opacities.micro.is_empty() && report.subdivided == 0);
}

#[test]
fn cutouts_without_holes_leave_nothing() {
    let (mesh, cutouts) = cutouts(vec![], vec![material(None)], &[(0, [corner(0.0, 0.0); 3])]);
    assert!(compile(&mesh, &cutouts, &Silent).unwrap().is_none());
    let other = Mesh::default();
    assert!(compile(&other, &cutouts, &Silent).is_err(), "cut-outs of another mesh");
}

#[test]
fn levels_are_lowered_until_all_patterns_have_room() {
    let plans = vec![Plan::Micro(MAX_OPACITY_LEVEL); 20_000];
    let most = most_levels(&plans);
    assert!(most == 7, "{most}");
    assert_eq!(most_levels(&[Plan::Micro(2), Plan::Whole(Opacity::Opaque)]), MAX_OPACITY_LEVEL);
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let mut random = Rng::new(77);
    let images = images(&mut random);
    let materials: Vec<_> = (0..5).map(|_| random_material(&mut random, images.len())).collect();
    let triangles: Vec<_> = (0..60).map(|k| (k % 5, random_corners(&mut random))).collect();
    let (mesh, cutouts) = cutouts(images, materials, &triangles);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| compile(&mesh, &cutouts, &Silent).unwrap())
    };
    assert_eq!(with(1), with(3));
}

/// The corners that the format gives micro-triangles are those that the stage decided.
#[test]
fn parts_are_numbered_as_the_format_numbers_micro_triangles() {
    let image =
        AlphaImage { width: 32, height: 32, alpha: (0..1024).map(|k| (k * 37 % 256) as u8).collect() };
    let material = CutoutMaterial { nearest: true, cutoff: 0.3, ..material(Some(0)) };
    let triangle = [corner(0.0, 0.0), corner(1.0, 0.1), corner(0.2, 1.0)];
    let (mesh, cutouts) = cutouts(vec![image], vec![material], &[(0, triangle)]);
    let (opacities, _) = compile(&mesh, &cutouts, &Silent).unwrap().unwrap();
    let Some(TriangleOpacity::Micro { level, .. }) = TriangleOpacity::from_code(opacities.rows[0]) else {
        panic!("a triangle of 500 texels of noise is divided");
    };
    let pyramid = Pyramid::new(&cutouts.images[0]);
    let surface = Surface { material: &cutouts.materials[0], pyramid: Some(&pyramid) };
    let footprint = Footprint::new(&surface, &triangle);
    let n = f64::from(1u32 << level);
    for micro in 0..1u32 << (2 * level) {
        let corners = micro_corners(level, micro).map(|p| p.map(|x| f64::from(x) / n));
        let center = [0, 1].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 3.0);
        let state = state_at(&opacities, 0, center[0] as f32, center[1] as f32);
        assert_eq!(state, footprint.state(corners, true), "micro-triangle {micro} of level {level}");
    }
}
