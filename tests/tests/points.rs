//! Points of f64, and points among instances, agree with rational arithmetic about the images of
//! triangles, with every instruction set.

use bth::rays::PrimitiveRef;
use bth::{Closest64, Feature, Isa, Scene};
use bth_random::Rng;
use bth_tests::oracle::winding;
use bth_tests::placed_soup::{exact_soup, placed_soup};
use num_rational::BigRational;
use num_traits::{FromPrimitive, Signed, ToPrimitive, Zero};

type Corners = [[f32; 3]; 3];
type Point = [BigRational; 3];

fn exact(x: f64) -> BigRational {
    BigRational::from_f64(x).expect("a finite number")
}

fn minus(a: &Point, b: &Point) -> Point {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

fn dot(a: &Point, b: &Point) -> BigRational {
    (0..3).map(|k| &a[k] * &b[k]).sum()
}

/// a + t b.
fn along(a: &Point, b: &Point, t: &BigRational) -> Point {
    [0, 1, 2].map(|k| &a[k] + t * &b[k])
}

fn cross(a: &Point, b: &Point) -> Point {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &a[i] * &b[j] - &a[j] * &b[i])
}

/// A triangle of an instance in world space.
struct Image {
    primitive: PrimitiveRef,
    corners: [Point; 3],
}

fn image(m: &[f64; 12], p: [f32; 3]) -> Point {
    let m = m.map(exact);
    let p = p.map(|x| exact(x.into()));
    [0, 4, 8].map(|r| &m[r] * &p[0] + &m[r + 1] * &p[1] + &m[r + 2] * &p[2] + &m[r + 3])
}

fn images(triangles: &[Corners], matrices: &[[f64; 12]]) -> Vec<Image> {
    let of = |(instance, m): (u32, &[f64; 12])| {
        let place = |(triangle, corners): (u32, &Corners)| Image {
            primitive: PrimitiveRef { instance, triangle },
            corners: corners.map(|p| image(m, p)),
        };
        (0..).zip(triangles).map(place).collect::<Vec<_>>()
    };
    (0..).zip(matrices).flat_map(of).collect()
}

/// The squared distance: to the nearest point of an edge, or to the plane.
fn squared_distance(point: &Point, corners: &[Point; 3]) -> BigRational {
    let square = |v: &Point| dot(v, v);
    let [a, b, c] = corners;
    let normal = cross(&minus(b, a), &minus(c, a));
    let mut inside = !square(&normal).is_zero();
    let mut least: Option<BigRational> = None;
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let edge = minus(q, p);
        let t = match square(&edge) {
            length if length.is_zero() => length,
            length => dot(&edge, &minus(point, p)) / length,
        };
        let t = t.clamp(exact(0.0), exact(1.0));
        let squared = square(&minus(&along(p, &edge, &t), point));
        least = Some(least.map_or(squared.clone(), |least| least.min(squared)));
        inside &= !dot(&normal, &cross(&edge, &minus(point, p))).is_negative();
    }
    if inside {
        let height = dot(&normal, &minus(a, point));
        return &height * &height / square(&normal);
    }
    least.expect("three edges")
}

/// Cuts a polygon to a box (Sutherland and Hodgman).
fn overlaps_box(lower: [f64; 3], upper: [f64; 3], corners: &[Point; 3]) -> bool {
    let mut polygon: Vec<Point> = corners.to_vec();
    for (k, plane, sign) in (0..3).flat_map(|k| [(k, lower[k], 1.0), (k, upper[k], -1.0)]) {
        let height = |p: &Point| (&p[k] - exact(plane)) * exact(sign);
        let mut kept = Vec::new();
        for (i, p) in polygon.iter().enumerate() {
            let q = &polygon[(i + 1) % polygon.len()];
            let (from, to) = (height(p), height(q));
            if !from.is_negative() {
                kept.push(p.clone());
            }
            if from.is_negative() != to.is_negative() {
                kept.push(along(p, &minus(q, p), &(&from / (&from - &to))));
            }
        }
        polygon = kept;
    }
    !polygon.is_empty()
}

fn unit(rng: &mut Rng) -> f64 {
    rng.between(-1.0, 1.0)
}

/// Triangles of a few shapes that share vertices and edges.
fn triangles(rng: &mut Rng, count: usize) -> Vec<Corners> {
    let coarse = rng.below(2) == 0;
    let vertices: Vec<[f32; 3]> = (0..6)
        .map(|_| {
            let p = [(); 3].map(|()| unit(rng) as f32);
            if coarse { p.map(|x| (x * 2.0).round() / 2.0) } else { p }
        })
        .collect();
    let vertex = |rng: &mut Rng| vertices[rng.below(6) as usize];
    (0..count)
        .map(|_| {
            let [a, b, c] = [vertex(rng), vertex(rng), vertex(rng)];
            match rng.below(5) {
                // A needle.
                0 => [a, b, [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * 0.25 + unit(rng) as f32 * 1e-5)],
                _ => [a, b, c],
            }
        })
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect()
}

/// A transform: none, one that is exact in few bits, or any; near the origin or far from it.
fn matrix(rng: &mut Rng) -> [f64; 12] {
    let far = [[0.0; 3], [5.5e6, 4.2e5, 300.0], [1e-3, 0.5, 2.0]][rng.below(3) as usize];
    let kind = rng.below(4);
    std::array::from_fn(|i| match (kind, i % 4) {
        (0, 3) => 0.0,
        (0, _) => f64::from(u8::from(i % 5 == 0)),
        (_, 3) => far[i / 4],
        (1, _) => (unit(rng) * 4.0).round() / 2.0,
        _ => unit(rng),
    })
}

/// National coordinates.
const ANCHOR: [f64; 3] = [5.5e6, 4.2e5, 300.0];

/// The triangles near an anchor, with digits that f32 does not hold.
fn exact_triangles(rng: &mut Rng, triangles: &[Corners]) -> Vec<[[f64; 3]; 3]> {
    let turn = unit(rng);
    let place = |p: [f32; 3]| {
        let [x, y, z] = p.map(f64::from);
        [ANCHOR[0] + x + turn * y, ANCHOR[1] + y - turn * x, ANCHOR[2] + z * (1.0 + turn * turn)]
    };
    triangles.iter().map(|corners| corners.map(place)).collect()
}

/// A scene, and the images of its triangles.
fn scene(rng: &mut Rng, count: usize, in_f64: bool) -> Option<(Scene, Vec<Image>)> {
    let mut triangles = triangles(rng, count);
    let is_tiny = rng.below(8) == 0;
    if is_tiny {
        // To numbers that f32 has few bits for.
        triangles.iter_mut().flatten().flatten().for_each(|x| *x *= 1e-42);
    }
    if triangles.is_empty() {
        return None;
    }
    if rng.below(4) == 0 {
        let identity = std::array::from_fn(|i| f64::from(u8::from(i % 5 == 0)));
        return Some((
            bth::from_bytes(&placed_soup(&triangles, &[])).unwrap(),
            images(&triangles, &[identity]),
        ));
    }
    if in_f64 {
        let wide = exact_triangles(rng, &triangles);
        let scene = bth::from_bytes(&exact_soup(&wide, ANCHOR)).unwrap();
        let place = |(triangle, corners): (u32, &[[f64; 3]; 3])| Image {
            primitive: PrimitiveRef { instance: 0, triangle },
            corners: corners.map(|p| p.map(exact)),
        };
        return Some((scene, (0..).zip(&wide).map(place).collect()));
    }
    let mut matrices = vec![matrix(rng)];
    if is_tiny {
        matrices[0] = std::array::from_fn(|i| if i % 4 == 3 { 0.0 } else { matrices[0][i] * 1e4 });
    }
    if rng.below(2) == 0 {
        // Its mirror image, with which it shares the points with x = 0.
        let m = matrices[0];
        matrices.push(std::array::from_fn(|i| if i % 4 == 0 { -m[i] } else { m[i] }));
    }
    let scene = bth::from_bytes(&placed_soup(&triangles, &matrices)).ok()?;
    Some((scene, images(&triangles, &matrices)))
}

/// A point at or near a triangle.
fn point(rng: &mut Rng, images: &[Image]) -> [f64; 3] {
    let Image { corners: [a, b, c], .. } = &images[rng.below(images.len() as u64) as usize];
    let [u, v] = [[0.0, 0.0], [0.5, 0.0], [0.25, 0.25], [1.0, 1.0]][rng.below(4) as usize];
    let at = along(&along(a, &minus(b, a), &exact(u)), &minus(c, a), &exact(v));
    let offset = [0.0, 0.0, 1e-12, 1e-7, 1e-3, 1.0, 1e3][rng.below(7) as usize];
    let axis = rng.below(4) as usize;
    [0, 1, 2].map(|k| {
        let moved = if axis == 3 || axis == k { unit(rng) * offset } else { 0.0 };
        at[k].to_f64().unwrap() + moved
    })
}

/// Calls `check` with every instruction set.
fn with_every_isa(mut check: impl FnMut(Isa)) {
    let before = Isa::chosen();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("available");
        check(isa);
    }
    before.choose().expect("available");
}

/// Checks distance, point and feature of a result.
fn check(point: [f64; 3], images: &[Image], squared: &[BigRational], found: &Closest64) {
    let least = squared.iter().min().unwrap();
    let first = squared.iter().position(|x| x == least).unwrap();
    assert_eq!(found.primitive, images[first].primitive, "{point:?}: {found:?}");
    let corners = &images[first].corners;
    let edge = |i: usize| minus(&corners[(i + 1) % 3], &corners[i]).map(|x| x.to_f64().unwrap().abs());
    let longest = (0..3).flat_map(edge).fold(0.0, f64::max);
    let distance = least.to_f64().unwrap().sqrt();
    // The bounds of the documentation, and the roundings of this test.
    let bound = (distance + longest) * 2f64.powi(-40);
    let off = (found.distance - distance).abs();
    assert!(
        off <= bound + distance * 1e-15 && off <= distance * 2f64.powi(-28),
        "{point:?}: {found:?}, {distance}"
    );
    let step = found.point.iter().fold(0.0f64, |most, x| most.max(x.abs())) * f64::EPSILON;
    let on = squared_distance(&found.point.map(exact), corners).to_f64().unwrap().sqrt();
    let away = minus(&found.point.map(exact), &point.map(exact)).map(|x| x.to_f64().unwrap());
    let away = away.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!(on <= 2.0 * (bound + step), "{point:?}: {found:?} is {on} off");
    assert!((away - distance).abs() <= 2.0 * (bound + step), "{point:?}: {found:?}, {away}");
    let to = |feature: Feature| {
        let corner = |i: u8| &corners[usize::from(i) % 3];
        let [p, q] = match feature {
            Feature::Face => return None,
            Feature::Edge(i) => [corner(i), corner(i + 1)],
            Feature::Vertex(i) => [corner(i), corner(i)],
        };
        Some(squared_distance(&point.map(exact), &[p.clone(), q.clone(), p.clone()]))
    };
    assert!(to(found.feature).is_none_or(|to| to == *least), "{point:?}: {found:?}");
    assert!((0.0..=1.0).contains(&found.u) && (0.0..=1.0).contains(&found.v));
}

#[test]
fn closest_points_are_exact() {
    check_closest(false);
}

#[test]
fn closest_points_of_models_in_f64_are_exact() {
    check_closest(true);
}

fn check_closest(in_f64: bool) {
    let mut rng = Rng::new(1);
    let (mut checked, mut ties, mut features) = (0, 0, [0; 7]);
    for round in 0..200 {
        let Some((scene, images)) = scene(&mut rng, 1 + round % 6, in_f64) else { continue };
        let points: Vec<_> = (0..4).map(|_| point(&mut rng, &images)).collect();
        let distances = |p: &[f64; 3]| -> Vec<_> {
            images.iter().map(|image| squared_distance(&p.map(exact), &image.corners)).collect()
        };
        let squared: Vec<_> = points.iter().map(distances).collect();
        let narrow: Vec<_> = points.iter().map(|p| p.map(|x| x as f32)).collect();
        let narrow_least: Vec<_> =
            narrow.iter().map(|p| distances(&p.map(f64::from)).into_iter().min().unwrap()).collect();
        let mut expected: Option<Vec<_>> = None;
        with_every_isa(|isa| {
            let mut batch = vec![None; points.len()];
            scene.closest_batch_f64(&points, f64::INFINITY, &mut batch);
            for (i, point) in points.iter().enumerate() {
                let found = scene.closest_f64(*point, f64::INFINITY);
                assert_eq!(found, batch[i], "{isa}: {point:?}");
                let radius = found.expect("a triangle").distance;
                for radius in [radius.next_down(), radius, radius.next_up()] {
                    let contains = squared[i].iter().any(|x| *x <= exact(radius) * exact(radius));
                    let ball = scene.overlaps_sphere_f64(*point, radius);
                    assert_eq!(ball, contains && radius >= 0.0, "{isa}: {point:?}, {radius}");
                    assert_eq!(
                        scene.closest_f64(*point, radius).is_some(),
                        ball,
                        "{isa}: {point:?}, {radius}"
                    );
                }
                // f32: within 0.55 units in the last place.
                let found = scene.closest(narrow[i], f32::INFINITY).expect("a triangle");
                let least = &narrow_least[i];
                let unit = f64::from(found.distance.next_up()) - f64::from(found.distance);
                let [low, high] = [-0.55, 0.55].map(|x| exact(f64::from(found.distance) + x * unit));
                let is_within = (low.is_negative() || &low * &low <= *least) && *least <= &high * &high;
                assert!(is_within, "{isa}: {:?}: {found:?}", narrow[i]);
                assert!(scene.overlaps_sphere(narrow[i], found.distance));
                assert_eq!(scene.closest(narrow[i], found.distance), Some(found));
            }
            assert_eq!(*expected.get_or_insert_with(|| batch.clone()), batch, "{isa}");
        });
        for ((point, squared), found) in points.iter().zip(&squared).zip(expected.unwrap()) {
            let found = found.unwrap();
            check(*point, &images, squared, &found);
            let least = squared.iter().min().unwrap();
            ties += usize::from(squared.iter().filter(|x| *x == least).count() > 1);
            features[found.feature.code() as usize] += 1;
            checked += 1;
        }
    }
    assert!(
        checked > 400 && ties > 80 && features.iter().all(|n| *n > 10),
        "{checked}, {ties}, {features:?}"
    );
}

#[test]
fn boxes_and_balls_overlap_exactly() {
    check_overlaps(false);
}

#[test]
fn boxes_and_balls_overlap_models_in_f64_exactly() {
    check_overlaps(true);
}

fn check_overlaps(in_f64: bool) {
    let mut rng = Rng::new(2);
    let mut results = [0; 2];
    for round in 0..400 {
        let Some((scene, images)) = scene(&mut rng, 1 + round % 6, in_f64) else { continue };
        let (a, b) = (point(&mut rng, &images), point(&mut rng, &images));
        let size = [0.0, 1e-12, 1e-6, 0.1, 1.0][rng.below(5) as usize];
        let (lower, upper) = match rng.below(3) {
            0 => ([0, 1, 2].map(|k| a[k].min(b[k])), [0, 1, 2].map(|k| a[k].max(b[k]))),
            1 => (a.map(|x| x - size), a.map(|x| x + size)),
            _ => (a, a.map(|x| x + size)),
        };
        let radius =
            scene.closest_f64(a, f64::INFINITY).expect("a triangle").distance * [1.0, 1.5][round % 2];
        let primitives = |test: &dyn Fn(&Image) -> bool| -> Vec<PrimitiveRef> {
            images.iter().filter(|image| test(image)).map(|image| image.primitive).collect()
        };
        let in_box = primitives(&|image| overlaps_box(lower, upper, &image.corners));
        let square = exact(radius) * exact(radius);
        let in_ball = primitives(&|image| squared_distance(&a.map(exact), &image.corners) <= square);
        let [low32, high32] = [lower, upper].map(|p| p.map(|x| x as f32));
        let in_box32 =
            primitives(&|image| overlaps_box(low32.map(f64::from), high32.map(f64::from), &image.corners));
        with_every_isa(|isa| {
            let mut found = Vec::new();
            scene.triangles_in_box_f64(lower, upper, &mut found);
            assert_eq!(found, in_box, "{isa}: {lower:?}, {upper:?}");
            assert_eq!(scene.overlaps_box_f64(lower, upper), !in_box.is_empty());
            scene.triangles_in_sphere_f64(a, radius, &mut found);
            assert_eq!(found, in_ball, "{isa}: {a:?}, {radius}");
            scene.triangles_in_box(low32, high32, &mut found);
            assert_eq!(found, in_box32, "{isa}: {low32:?}, {high32:?}");
        });
        results[0] += in_box.len();
        results[1] += in_ball.len();
    }
    assert!(results.iter().all(|n| *n > 150), "{results:?}");
}

/// The faces of the cube from 0 to 1.
fn cube() -> Vec<Corners> {
    let corner = |i: u32| [0, 1, 2].map(|k| (i >> k & 1) as f32);
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).map(|t| t.map(corner)).collect()
}

/// Returns true if the cube's image contains a point moved by (δ, δ², δ³) for a tiny δ.
fn contains(m: &[f64; 12], point: [f64; 3]) -> bool {
    // Products of four of the numbers are multiples of 2^-300.
    let tiny = exact(2f64.powi(-400));
    let steps = [tiny.clone(), &tiny * &tiny, &tiny * &tiny * &tiny];
    let moved = [0, 1, 2].map(|k| exact(point[k]) + &steps[k] - exact(m[4 * k + 3]));
    let column = |k: usize| [0, 1, 2].map(|r: usize| exact(m[4 * r + k]));
    let [x, y, z] = [column(0), column(1), column(2)];
    let whole = dot(&x, &cross(&y, &z));
    let inside = |a: &Point, b: &Point| {
        let t = dot(&moved, &cross(a, b)) / &whole;
        t.is_positive() && t < exact(1.0)
    };
    inside(&y, &z) && inside(&z, &x) && inside(&x, &y)
}

#[test]
fn points_are_inside_of_exactly_one_of_the_solids_that_touch() {
    let mut rng = Rng::new(3);
    let (mut inside, mut on) = (0, 0);
    for _ in 0..150 {
        let m = matrix(&mut rng);
        let mirrored = std::array::from_fn(|i| if i % 4 == 0 { -m[i] } else { m[i] });
        let Ok(scene) = bth::from_bytes(&placed_soup(&cube(), &[m, mirrored])) else { continue };
        let images = images(&cube(), &[m, mirrored]);
        let points: Vec<_> = (0..12).map(|_| point(&mut rng, &images)).collect();
        let count = |p: [f64; 3]| i32::from(contains(&m, p)) + i32::from(contains(&mirrored, p));
        let narrow: Vec<_> = points.iter().map(|p| p.map(|x| x as f32)).collect();
        let expected: Vec<i32> = points.iter().map(|p| count(*p)).collect();
        let expected_narrow: Vec<i32> = narrow.iter().map(|p| count(p.map(f64::from))).collect();
        with_every_isa(|isa| {
            let [mut winding, mut of_narrow] = [(); 2].map(|()| vec![0; points.len()]);
            let mut distances = vec![0.0; points.len()];
            scene.winding_batch_f64(&points, &mut winding);
            assert_eq!(winding, expected, "{isa}: {m:?}, {points:?}");
            scene.winding_batch(&narrow, &mut of_narrow);
            assert_eq!(of_narrow, expected_narrow, "{isa}: {m:?}, {narrow:?}");
            scene.signed_distance_batch_f64(&points, &mut distances);
            for (i, point) in points.iter().enumerate() {
                assert_eq!(distances[i] < 0.0, winding[i] != 0 && distances[i] != 0.0, "{isa}: {point:?}");
                on += usize::from(distances[i].abs() < 1e-9);
            }
            inside += winding.iter().filter(|n| **n == 1).count();
        });
    }
    assert!(inside > 500 && on > 500, "{inside} inside, {on} on the surface");
}

#[test]
fn points_are_inside_of_models_in_f64() {
    let mut rng = Rng::new(4);
    let mut inside = 0;
    for _ in 0..60 {
        let corners = exact_triangles(&mut rng, &cube());
        let scene = bth::from_bytes(&exact_soup(&corners, ANCHOR)).unwrap();
        let images: Vec<_> = corners
            .iter()
            .map(|t| Image { primitive: PrimitiveRef::NONE, corners: t.map(|p| p.map(exact)) })
            .collect();
        let points: Vec<_> = (0..12).map(|_| point(&mut rng, &images)).collect();
        let direction = [(); 3].map(|()| unit(&mut rng));
        let expected: Vec<i32> = points.iter().map(|p| winding(&corners, *p, direction)).collect();
        with_every_isa(|isa| {
            let mut found = vec![0; points.len()];
            scene.winding_batch_f64(&points, &mut found);
            assert_eq!(found, expected, "{isa}: {points:?}");
        });
        inside += expected.iter().filter(|n| **n == 1).count();
    }
    assert!(inside > 100, "{inside}");
}

#[test]
fn numbers_at_the_ends_of_the_range_are_measured_exactly() {
    let triangle = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let scene = bth::from_bytes(&placed_soup(&[triangle], &[])).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(scene.closest_f64([bad, 0.0, 0.0], f64::INFINITY), None);
        assert!(scene.signed_distance_f64([bad, 0.0, 0.0]).is_nan() && !scene.contains_f64([bad, 0.0, 0.0]));
        assert!(!scene.overlaps_box_f64([f64::NAN; 3], [bad; 3]));
    }
    for radius in [f64::NAN, -1.0] {
        assert_eq!(scene.closest_f64([0.0; 3], radius), None);
        assert!(!scene.overlaps_sphere_f64([0.0; 3], radius));
    }
    for height in [0.0, f64::from_bits(1), 1e-200, 1e-30, 1e30, 1e200, f64::MAX] {
        let found = scene.closest_f64([0.25, 0.25, height], f64::INFINITY).expect("a triangle");
        assert_eq!((found.distance, found.point[0]), (height, 0.25), "{height}");
        assert!(scene.overlaps_sphere_f64([0.25, 0.25, height], height));
        assert_eq!(scene.overlaps_box_f64([0.25, 0.25, height], [1.0, 1.0, f64::INFINITY]), height == 0.0);
    }
    assert!(scene.overlaps_box_f64([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]));
}
