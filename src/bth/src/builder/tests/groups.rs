//! Random groups in groups. The oracle is the scene in which all groups are written out.

use super::*;
use crate::rays::StartRay;
use crate::{Accept, InstancePath};

/// An instance as it was added: what it shows, in which group, and where.
#[derive(Clone, Copy)]
struct Row {
    content: Content,
    within: Option<u32>,
    transform: [f64; 12],
    visible: bool,
    mask: u32,
}

/// A builder with groups, and what is in it.
struct Nested {
    builder: SceneBuilder,
    rows: Vec<Row>,
}

/// A written-out instance.
struct Flat {
    object: u32,
    transform: [f64; 12],
    visible: bool,
    mask: u32,
    path: Vec<u32>,
}

/// The product of two transforms, as the specification has it.
fn times(a: &[f64; 12], b: &[f64; 12]) -> [f64; 12] {
    std::array::from_fn(|i| {
        let (row, column) = (i / 4 * 4, i % 4);
        let sum = a[row] * b[column] + a[row + 1] * b[4 + column] + a[row + 2] * b[8 + column];
        if column == 3 { sum + a[row + 3] } else { sum }
    })
}

fn transform(rng: &mut Rng, spread: f64) -> [f64; 12] {
    let coarse = rng.below(3) == 0;
    let mut number = || if coarse { f64::from(unit(rng)).round() } else { f64::from(unit(rng)) };
    let mut m = [0.0; 12];
    for k in 0..3 {
        for i in 0..3 {
            m[4 * k + i] = number() * 0.4 + if i == k { 1.0 } else { 0.0 };
        }
        m[4 * k + 3] = number() * spread;
    }
    let (scale, axis) = ([1.0, -1.0, 0.5, 3.0, 100.0, 0.001][rng.below(6) as usize], rng.below(4) as usize);
    if axis < 3 {
        (0..3).for_each(|k| m[4 * k + axis] *= scale);
    } else {
        (0..9).for_each(|k| m[k + k / 3] *= scale);
    }
    m
}

impl Nested {
    /// A scene with up to `depth` instances on the way to an object.
    fn random(rng: &mut Rng, depth: u32) -> Nested {
        let mut builder = SceneBuilder::new();
        for file in ["two-objects", "two-levels", "opacity"] {
            let file =
                format!("{}/../../format-spec/conformance/valid/{file}.bth", env!("CARGO_MANIFEST_DIR"));
            builder.add(&crate::open(file).unwrap());
        }
        let (objects, spread) =
            (u64::from(builder.scene().object_count()), [1.0, 4.0, 300.0][rng.below(3) as usize]);
        let mut rows = Vec::new();
        for level in 1..=depth {
            let within = (level < depth).then(|| builder.add_group());
            let count = 1 + rng.below(if depth > 4 { 2 } else { 6 });
            for i in 0..=count {
                let group = level.checked_sub(2).map(|most| most - rng.below(2).min(most.into()) as u32);
                let content = match group.filter(|_| i == 0 || rng.below(3) > 0) {
                    Some(group) => Content::Group(group),
                    None => Content::Object(rng.below(objects) as u32),
                };
                let (visible, mask) = (i == 0 || rng.below(8) > 0, if rng.below(3) > 0 { 3 } else { 1 });
                rows.push(Row { content, within, transform: transform(rng, spread), visible, mask });
            }
        }
        let mut nested = Nested { builder, rows };
        for (id, row) in nested.rows.clone().into_iter().enumerate() {
            let added = nested.builder.place(row.content, row.within, &row.transform);
            assert_eq!(added.unwrap(), id as u32);
            nested.builder.set_visible(id as u32, row.visible).unwrap();
            nested.builder.set_instance_mask(id as u32, row.mask).unwrap();
        }
        nested
    }

    /// Adds what a group, or the world, shows, below an instance.
    fn write_out(&self, within: Option<u32>, outer: Option<&Flat>, flat: &mut Vec<Flat>) {
        for (id, row) in self.rows.iter().enumerate().filter(|(_, row)| row.within == within) {
            let transform = outer.map_or(row.transform, |outer| times(&outer.transform, &row.transform));
            let mut path = outer.map_or_else(Vec::new, |outer| outer.path.clone());
            path.push(id as u32);
            let (visible, mask) = outer.map_or((true, 3), |outer| (outer.visible, outer.mask));
            let (visible, mask) = (visible && row.visible, mask & row.mask);
            match row.content {
                Content::Object(object) => flat.push(Flat { object, transform, visible, mask, path }),
                Content::Group(group) => {
                    self.write_out(
                        Some(group),
                        Some(&Flat { object: 0, transform, visible, mask, path }),
                        flat,
                    );
                }
            }
        }
    }

    /// The written-out scene, if its instances can be placed.
    fn flat(&self) -> (Option<SceneBuilder>, Vec<Flat>) {
        let mut flat = Vec::new();
        self.write_out(None, None, &mut flat);
        let mut builder = SceneBuilder::new();
        let mut object = 0;
        while object < self.builder.scene().object_count() {
            let (file, _) = self.builder.scene().file_of(object);
            object += file.object_count();
            builder.add(&crate::from_file(file.clone()).unwrap());
        }
        for instance in &flat {
            let id = builder.instance(instance.object, &instance.transform).unwrap();
            builder.set_visible(id, instance.visible).unwrap();
            builder.set_instance_mask(id, instance.mask).unwrap();
        }
        (builder.commit().is_ok().then_some(builder), flat)
    }
}

/// Rays that are aimed at instances, from near and far.
fn rays(rng: &mut Rng, flat: &[Flat]) -> Vec<Ray> {
    let aimed = |_| {
        let m = &flat[rng.below(flat.len() as u64) as usize].transform;
        let point = [0.3, 0.3, 0.0].map(|x: f64| x + f64::from(unit(rng)) * 0.4);
        let target = [0, 4, 8].map(|k| (m[k] * point[0] + m[k + 1] * point[1] + m[k + 3]) as f32);
        let distance = [0.01, 1.0, 30.0, 1e5][rng.below(4) as usize];
        let origin = target.map(|x| x + unit(rng) * distance);
        let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
        Ray { origin, tmin: 0.0, direction, tmax: [f32::INFINITY, 1.01, 5.0][rng.below(3) as usize] }
    };
    (0..60).map(aimed).collect()
}

/// Compares all queries of two scenes. Returns the number of hits.
fn compare(rng: &mut Rng, nested: &Scene, flat: &Scene, instances: &[Flat]) -> usize {
    assert_eq!(nested.instance_count() as usize, instances.len());
    for (i, instance) in instances.iter().enumerate() {
        let i = i as u32;
        let (a, b) = (nested.instance(i), flat.instance(i));
        assert_eq!(
            (a.object, a.to_world.map(|r| r.map(f64::to_bits)), a.visible),
            (b.object, b.to_world.map(|r| r.map(f64::to_bits)), b.visible)
        );
        assert_eq!(nested.instance_bounds(i), flat.instance_bounds(i));
        assert_eq!(&*nested.instance_path(i), instance.path.as_slice());
    }
    let rays = rays(rng, instances);
    let hits = nearest(nested, &rays);
    assert_eq!(hits, nearest(flat, &rays));
    let (mut some, mut others) = (Vec::new(), Vec::new());
    let accept = Accept { mask: 2, ..Accept::default() };
    for (ray, hit) in rays.iter().zip(&hits) {
        assert_eq!(nested.any(ray), hit.is_hit());
        assert_eq!(nested.nearest(ray), flat.nearest(ray));
        for accept in [Accept::default(), accept] {
            nested.all_hits(ray, &accept, &mut some);
            flat.all_hits(ray, &accept, &mut others);
            assert_eq!(some, others);
            assert_eq!(nested.nearest_accepted(ray, &accept), flat.nearest_accepted(ray, &accept));
        }
        assert_eq!(nested.crossings(ray), flat.crossings(ray));
        let wide = Ray64::new(ray.origin.map(|x| f64::from(x) * 1.000_000_001), ray.direction.map(f64::from));
        assert_eq!(nested.nearest(&wide), flat.nearest(&wide));
        let point = ray.origin;
        assert_eq!(nested.closest(point, f32::INFINITY), flat.closest(point, f32::INFINITY));
        assert_eq!(nested.winding(point), flat.winding(point));
        nested.triangles_in_sphere(point, 3.0, &mut Vec::new());
        let (mut inside, mut inside_too) = (Vec::new(), Vec::new());
        let corners = (point.map(|x| x - 2.0), point.map(|x| x + 1.0));
        nested.triangles_in_box(corners.0, corners.1, &mut inside);
        flat.triangles_in_box(corners.0, corners.1, &mut inside_too);
        assert_eq!(inside, inside_too);
        if !hit.is_hit() {
            continue;
        }
        assert_eq!(nested.surface(hit), flat.surface(hit));
        assert_eq!(nested.hit_f64(ray, hit), flat.hit_f64(ray, hit));
        let start = StartRay { start: hit.start(), direction: [unit(rng), unit(rng), unit(rng)], tmax: 1e9 };
        assert_eq!(nested.nearest(&start), flat.nearest(&start));
        assert_eq!(nested.visible(hit.start(), point), flat.visible(hit.start(), point));
        let other = hits[rng.below(hits.len() as u64) as usize];
        assert_eq!(nested.visible(hit.start(), other.start()), flat.visible(hit.start(), other.start()));
    }
    hits.iter().filter(|hit| hit.is_hit()).count()
}

#[test]
fn answers_are_those_of_the_scene_with_groups_written_out() {
    let mut rng = Rng::new(60);
    let (mut hits, mut scenes) = (0, 0);
    for case in 0..if cfg!(debug_assertions) { 24 } else { 240 } {
        let mut nested = Nested::random(&mut rng, 1 + case % 8);
        let (flat, instances) = nested.flat();
        if nested.builder.commit().is_err() {
            // A group may be singular whose instances are not seen, but not the other way round.
            continue;
        }
        let flat = flat.expect("the groups could be placed");
        hits += compare(&mut rng, nested.builder.scene(), flat.scene(), &instances);
        scenes += 1;
        // Rows on all levels move, hide and show again.
        for _ in 0..3 {
            for _ in 0..1 + rng.below(2) {
                let id = rng.below(nested.rows.len() as u64) as usize;
                let row = &mut nested.rows[id];
                (row.transform, row.visible) = (transform(&mut rng, 2.0), rng.below(4) > 0);
                let Row { transform, visible, .. } = *row;
                nested.builder.set_transform(id as u32, &transform).unwrap();
                nested.builder.set_visible(id as u32, visible).unwrap();
            }
            let (flat, instances) = nested.flat();
            if nested.builder.commit().is_err() {
                break;
            }
            let flat = flat.expect("the groups could be placed");
            hits += compare(&mut rng, nested.builder.scene(), flat.scene(), &instances);
        }
    }
    assert!(hits > 500 && scenes > 10, "{hits} {scenes}");
}

#[test]
fn a_change_that_cannot_be_placed_changes_nothing() {
    let mut rng = Rng::new(61);
    for case in 0..12 {
        let mut nested = Nested::random(&mut rng, 3 + case % 2);
        let (flat, instances) = nested.flat();
        if nested.builder.commit().is_err() {
            continue;
        }
        let flat = flat.unwrap();
        let id = (0..nested.rows.len()).rfind(|id| nested.rows[*id].visible).unwrap() as u32;
        let former = nested.rows[id as usize].transform;
        let mut singular = former;
        (0..4).for_each(|k| singular[8 + k] = singular[4 + k]);
        nested.builder.set_transform(id, &singular).unwrap();
        assert_eq!(nested.builder.commit().unwrap_err().code(), Code::Singular);
        compare(&mut rng, nested.builder.scene(), flat.scene(), &instances);
        nested.builder.set_transform(id, &former).unwrap();
        nested.builder.commit().unwrap();
        compare(&mut rng, nested.builder.scene(), flat.scene(), &instances);
    }
}

#[test]
fn groups_only_show_groups_before_them_and_have_limits() {
    let mut builder = SceneBuilder::new();
    let cube = Content::Object(builder.add(&crate::from_bytes(FILES[0]).unwrap()));
    assert_eq!(builder.place(Content::Group(0), None, &IDENTITY).unwrap_err().code(), Code::NoSuchInstance);
    let first = builder.add_group();
    let own = builder.place(Content::Group(first), Some(first), &IDENTITY);
    assert_eq!(own.unwrap_err().code(), Code::NoSuchInstance);
    assert_eq!(builder.place(cube, Some(1), &IDENTITY).unwrap_err().code(), Code::NoSuchInstance);
    builder.place(cube, Some(first), &IDENTITY).unwrap();
    // Each group shows the one before it four times.
    let mut last = first;
    for _ in 0..15 {
        let group = builder.add_group();
        for i in 0..4 {
            builder.place(Content::Group(last), Some(group), &at(f64::from(i), 0.0, 0.0)).unwrap();
        }
        last = group;
    }
    let all = builder.place(Content::Group(last), None, &IDENTITY).unwrap();
    assert_eq!(builder.commit().unwrap_err().code(), Code::TooManyInstances, "17 levels");
    builder.remove(all).unwrap();
    builder.place(Content::Group(last - 1), None, &IDENTITY).unwrap();
    builder.commit().unwrap();
    assert_eq!(builder.scene().instance_count(), 1 << 28);
}

#[test]
fn sixteen_levels_of_four_hold_a_billion_instances() {
    let mut builder = SceneBuilder::new();
    let cube = Content::Object(builder.add(&crate::from_bytes(FILES[0]).unwrap()));
    let mut last = builder.add_group();
    builder.place(cube, Some(last), &IDENTITY).unwrap();
    for level in 1..15 {
        let group = builder.add_group();
        for i in 0..4 {
            let at = at(f64::from(i * (1 << level)), f64::from(i), 0.0);
            builder.place(Content::Group(last), Some(group), &at).unwrap();
        }
        last = group;
    }
    for i in 0..3 {
        builder.place(Content::Group(last), None, &at(0.0, 0.0, -3.0 * f64::from(i))).unwrap();
    }
    builder.commit().unwrap();
    let scene = builder.scene();
    assert_eq!(scene.instance_count(), 3 << 28);
    let last = scene.instance_count() - 1;
    let path: InstancePath = scene.instance_path(last);
    assert_eq!(path.len(), 16);
    let (lower, upper) = scene.instance_bounds(last).unwrap();
    let inside = [0, 1, 2].map(|k| lower[k] + 0.4 * (upper[k] - lower[k]));
    assert!(scene.closest(inside, 1.0).is_some());
    let up = Ray::new([inside[0], inside[1], -100.0], [0.0, 0.0, 1.0]);
    assert!(scene.nearest(&up).is_some_and(|hit| hit.primitive.instance >> 28 == 2));
    assert_eq!(scene.instance(last).to_world[2], [0.0, 0.0, 1.0, -6.0]);
}
