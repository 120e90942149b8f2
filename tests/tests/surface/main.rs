//! What hits lead to: surfaces against an independent evaluation, groups, materials, names and
//! bounds, through models, scenes, grids, files without attributes, and the cache.

mod model;

use crate::model::{
    IDENTITY, Model, Rows, assert_close, compiled, cross, dot, number, options, through, unit, wide,
};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth::{Accept, Scene, SurfacePoint};
use bth_compile::Silent;
use bth_compile::coordinates::CoordinateOptions;
use bth_compile::pipeline::{CompileOptions, compile};
use bth_format::layout::{GridBits, kind};
use bth_import::Keep;
use bth_random::Rng;
use std::path::Path;

/// The normal of the object at three weights, evaluated independently: by the adjoint of the
/// transform instead of its inverse.
fn expected_normals(model: &Model, rows: &Rows, hit: &Hit) -> ([f64; 3], [f64; 3]) {
    let id = hit.primitive.triangle as usize;
    let [a, b, c] = model.triangles[id].map(wide);
    let plane = unit(cross([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k])));
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let corners = model.normals[id].map(|n| if n == [0.0; 3] { plane } else { wide(n) });
    let smooth = [0, 1, 2].map(|k| (1.0 - u - v) * corners[0][k] + u * corners[1][k] + v * corners[2][k]);
    let smooth = if model.normals[id] == [[0.0; 3]; 3] { plane } else { smooth };
    let column = |k: usize| [rows[0][k], rows[1][k], rows[2][k]];
    let (x, y, z) = (column(0), column(1), column(2));
    // The adjoint keeps sides where the determinant is positive.
    let side = dot(x, cross(y, z)).signum();
    let adjoint = [cross(y, z), cross(z, x), cross(x, y)];
    let to_world =
        |n: [f64; 3]| unit([0, 1, 2].map(|k| side * (0..3).map(|j| adjoint[j][k] * n[j]).sum::<f64>()));
    (to_world(plane), to_world(smooth))
}

/// A ray at a point of a triangle, in world space.
fn aimed(rows: &Rows, corners: [[f32; 3]; 3], rng: &mut Rng) -> Ray {
    let (u, v) = (number(rng, 1.0).abs() / 2.0, number(rng, 1.0).abs() / 2.0);
    let p =
        [0, 1, 2].map(|k| f64::from(corners[0][k] * (1.0 - u - v) + corners[1][k] * u + corners[2][k] * v));
    let target = through(rows, p).map(|x| x as f32);
    let size = rows.iter().flat_map(|row| &row[..3]).fold(0.0f64, |most, x| most.max(x.abs())) as f32;
    let offset = [0; 3].map(|_| number(rng, 20.0 * size));
    Ray::new([0, 1, 2].map(|k| target[k] + offset[k]), offset.map(|x| -x))
}

#[track_caller]
fn check_surface(model: &Model, rows: &Rows, scene: &Scene, hit: &Hit) -> SurfacePoint {
    let found = scene.surface(hit).expect("a surface");
    let id = hit.primitive.triangle as usize;
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let corners = model.triangles[id].map(wide);
    let p = [0, 1, 2].map(|k| (1.0 - u - v) * corners[0][k] + u * corners[1][k] + v * corners[2][k]);
    assert_close(found.object_position, p, 1e-14);
    assert_close(found.position, through(rows, p), 1e-13);
    let (plane, smooth) = expected_normals(model, rows, hit);
    assert_close(found.geometric_normal, plane, 1e-9);
    assert_close(found.normal, smooth, 1e-9);
    let uv = [0, 1].map(|k| {
        let [a, b, c] = model.uvs[id].map(|uv| f64::from(uv[k]));
        ((1.0 - u - v) * a + u * b + v * c) as f32
    });
    assert_eq!(found.uv, Some(uv));
    let world = scene.triangle_in_world(hit.primitive).unwrap();
    for (found, corner) in world.into_iter().zip(corners) {
        assert_close(found, through(rows, corner), 1e-13);
    }
    let (group, material) = &model.parts[id];
    assert_eq!(scene.group_name(found.object, found.group), group);
    assert_eq!(scene.material_name(found.object, found.material.unwrap()), material);
    assert_eq!(scene.group_of(found.object, id as u32), found.group);
    found
}

#[test]
fn surfaces_of_a_model_are_those_of_its_source() {
    let model = Model::random(400, 1);
    let scene = bth::from_bytes(&compiled(&model, &options())).unwrap();
    let mut rng = Rng::new(2);
    let mut hits = 0;
    for triangle in &model.triangles {
        let Some(hit) = scene.nearest(&aimed(&IDENTITY, *triangle, &mut rng)) else { continue };
        let found = check_surface(&model, &IDENTITY, &scene, &hit);
        assert_eq!(found.object_normal, found.normal);
        assert_eq!(found.object_geometric_normal, found.geometric_normal);
        hits += 1;
    }
    assert!(hits > 300, "{hits}");
    assert_eq!(scene.object_name(0), "", "files do not depend on paths");
}

/// Transforms that turn, mirror, shear and scale, by much and by little.
fn transforms() -> Vec<Rows> {
    let scaled = |x: f64, y: f64, z: f64| [[x, 0.0, 0.0, 3.0], [0.0, y, 0.0, -4.0], [0.0, 0.0, z, 5.0]];
    vec![
        IDENTITY,
        scaled(-1.0, 1.0, 1.0),
        scaled(2.0, 0.25, -7.0),
        scaled(1e-6, 1e-6, 1e-6),
        scaled(-3e8, 3e8, 3e8),
        [[0.0, -1.0, 0.0, 100.0], [1.0, 0.5, 0.0, 0.0], [0.0, 0.25, 2.0, -100.0]],
        [[-0.6, 0.0, 0.8, 0.0], [0.0, -1.0, 0.0, 0.0], [0.8, 0.0, 0.6, 0.0]],
    ]
}

#[test]
fn surfaces_of_instances_are_those_of_the_transformed_source() {
    let model = Model::random(150, 3);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.obj"), model.obj()).unwrap();
    let mut rng = Rng::new(4);
    for rows in transforms() {
        let text: Vec<String> =
            rows.iter().map(|r| format!("[{}]", r.map(|x| format!("{x:?}")).join(", "))).collect();
        let text = format!(
            "version = 1\n[[objects]]\nname = \"statue\"\nmodel = \"model.obj\"\n\
             [[nodes]]\nname = \"a\"\nobject = \"statue\"\nmatrix = [{}]\n",
            text.join(", ")
        );
        let manifest = bth_scene::parse(&text, Path::new("scene.manifest")).unwrap();
        let compile =
            bth_compile::scene::compile(&manifest, folder.path(), Path::new("x"), &options(), &Silent);
        let scene = bth::from_bytes(&compile.unwrap().0.bytes).unwrap();
        assert_eq!(scene.object_name(0), "statue");
        let mut hits = 0;
        for triangle in &model.triangles {
            let Some(hit) = scene.nearest(&aimed(&rows, *triangle, &mut rng)) else { continue };
            check_surface(&model, &rows, &scene, &hit);
            hits += 1;
        }
        assert!(hits > 75, "{hits} with {rows:?}");
        let (lower, upper) = scene.bounds().unwrap();
        assert_eq!(scene.instance_bounds(0), Some((lower, upper)));
        for corner in model.triangles.as_flattened() {
            let p = through(&rows, wide(*corner));
            assert!((0..3).all(|k| f64::from(lower[k]) <= p[k] && p[k] <= f64::from(upper[k])), "{p:?}");
        }
    }
}

#[test]
fn needles_have_normals_as_exact_arithmetic_has_them() {
    // Two edges that f64 cannot tell from parallel ones, and edges of 1e-38 and of 1e38.
    let tiny = f32::from_bits(1);
    let needle = [[0.0, 0.0, 0.0], [1e30, 0.0, 0.0], [1e30, tiny, 0.0]];
    let triangles = vec![
        needle,
        [[0.0, 0.0, 1.0], [1e-38, 0.0, 1.0], [0.0, 1e-38, 1.0]],
        [[0.0, 3e38, 0.0], [0.0, 0.0, 3e38], [3e38, 0.0, 0.0]],
        [[1e20, 1.0, 0.0], [1e20, 2.0, 0.0], [1.0, 1.0, 0.0]],
    ];
    let count = triangles.len();
    let model = Model {
        triangles,
        normals: vec![[[0.0; 3]; 3]; count],
        uvs: vec![[[0.0; 2]; 3]; count],
        parts: vec![(String::new(), "m".into()); count],
    };
    let scene = bth::from_bytes(&compiled(&model, &options())).unwrap();
    let third = 1.0 / 3f64.sqrt();
    let expected = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [third; 3], [0.0, 0.0, 1.0]];
    for (triangle, expected) in expected.into_iter().enumerate() {
        let primitive = PrimitiveRef { instance: 0, triangle: triangle as u32 };
        let found = scene.surface(&Hit { t: 1.0, u: 0.25, v: 0.25, primitive }).unwrap();
        assert_close(found.geometric_normal, expected, 1e-12);
    }
}

#[test]
fn what_a_file_does_not_keep_is_absent() {
    let model = Model::random(60, 5);
    let ray = |scene: &Scene, rng: &mut Rng| {
        let mut hits = model.triangles.iter().filter_map(|t| scene.nearest(&aimed(&IDENTITY, *t, rng)));
        hits.next().expect("a hit")
    };
    let mut rng = Rng::new(6);
    let bare = CompileOptions { attributes: Keep::None, names: false, ..options() };
    let scene = bth::from_bytes(&compiled(&model, &bare)).unwrap();
    let hit = ray(&scene, &mut rng);
    let found = scene.surface(&hit).unwrap();
    assert_eq!(
        (found.normal, found.uv, found.group, found.material),
        (found.geometric_normal, None, 0, None)
    );
    assert_eq!((scene.group_count(0), scene.group_name(0, 0), scene.material_count(0)), (1, "", 0));

    let plain = scene;
    let nothing = CompileOptions { geometry: false, ..options() };
    let scene = bth::from_bytes(&compiled(&model, &nothing)).unwrap();
    let hit = ray(&scene, &mut rng);
    // The leaf of the triangle has its corners.
    let (of_leaf, whole) = (scene.surface(&hit).unwrap(), plain.surface(&hit).unwrap());
    assert_eq!((of_leaf.position, of_leaf.geometric_normal), (whole.position, whole.geometric_normal));
    assert_eq!(scene.triangle(hit.primitive), plain.triangle(hit.primitive));
    let group = scene.group_of(0, hit.primitive.triangle);
    assert_eq!(scene.group_name(0, group), model.parts[hit.primitive.triangle as usize].0);

    for primitive in [
        PrimitiveRef::NONE,
        PrimitiveRef { instance: 1, triangle: 0 },
        PrimitiveRef { instance: 0, triangle: 60 },
    ] {
        assert_eq!((scene.triangle(primitive), scene.triangle_in_world(primitive)), (None, None));
    }
    assert_eq!(scene.surface(&Hit::MISS), None);
}

#[test]
fn vertices_are_those_that_rays_are_tested_against() {
    let model = Model::random(200, 7);
    let coordinates = CoordinateOptions { bits: Some(GridBits::B16), ..CoordinateOptions::default() };
    let bytes = compiled(&model, &CompileOptions { coordinates, ..options() });
    let scene = bth::from_bytes(&bytes).unwrap();
    let view = scene.object(0);
    let most = f64::from(view.header.displacement);
    assert!(most > 0.0);
    let mut moved = 0;
    for (id, source) in model.triangles.iter().enumerate() {
        let found = scene.triangle(PrimitiveRef { instance: 0, triangle: id as u32 }).unwrap();
        for (found, source) in found.into_iter().zip(source) {
            assert_eq!(found, view.grid.unwrap().nearest(*source).map(f64::from));
            moved += usize::from(found != source.map(f64::from));
        }
    }
    assert!(moved > 300, "{moved}");
}

#[test]
fn names_change_nothing_but_their_sections() {
    let model = Model::random(300, 8);
    let with = bth_format::File::from_bytes(&compiled(&model, &options())).unwrap();
    let without =
        bth_format::File::from_bytes(&compiled(&model, &CompileOptions { names: false, ..options() }))
            .unwrap();
    let sections = |file: &bth_format::File| {
        let of_names = [kind::GROUPS, kind::GROUP_RUNS, kind::MATERIALS, kind::LABELS, kind::PROVENANCE];
        let others = file.sections().filter(|s| !of_names.contains(&s.entry.kind));
        others.map(|s| (s.entry.kind, s.entry.hash)).collect::<Vec<_>>()
    };
    assert_eq!(sections(&with), sections(&without));
    assert_eq!(without.table().len(), sections(&without).len() + 1);
    assert!(!without.provenance().unwrap().contains("names"));
    assert_eq!(with.table().len(), sections(&with).len() + 5);
}

#[test]
fn masks_are_of_groups() {
    let model = Model::random(300, 9);
    let mut scene = bth::from_bytes(&compiled(&model, &options())).unwrap();
    let hidden = model.parts[0].clone();
    for group in 0..scene.group_count(0) {
        let material = scene.group_material(0, group).map(|m| scene.material_name(0, m));
        if (scene.group_name(0, group), material) == (&hidden.0, Some(&hidden.1)) {
            scene.set_group_mask(0, group, 2);
        }
    }
    let accept = Accept { mask: 1, ..Accept::default() };
    let mut rng = Rng::new(10);
    let (mut changed, mut hits) = (0, Vec::new());
    for triangle in &model.triangles {
        let ray = aimed(&IDENTITY, *triangle, &mut rng);
        let found = scene.nearest_accepted(&ray, &accept);
        scene.all_hits(&ray, &Accept::default(), &mut hits);
        let visible = |hit: &&Hit| model.parts[hit.primitive.triangle as usize] != hidden;
        assert_eq!(found, hits.iter().find(visible).copied());
        changed += usize::from(found != scene.nearest(&ray));
    }
    assert!(changed > 0);
    let masks = (0..scene.group_count(0)).map(|group| scene.group_mask(0, group)).collect::<Vec<_>>();
    assert!(masks.contains(&2) && masks.iter().all(|&mask| mask == 2 || mask == u32::MAX));
    assert_eq!(scene.instance_mask(0), u32::MAX);
    // Masks that are set back exclude nothing.
    (0..scene.group_count(0)).for_each(|group| scene.set_group_mask(0, group, u32::MAX));
    for triangle in &model.triangles {
        let ray = aimed(&IDENTITY, *triangle, &mut rng);
        let nearest = scene.nearest(&ray);
        let mut hits = [Hit::MISS];
        scene.batch(&[ray]).accept(&accept).nearest(&mut hits);
        assert_eq!(
            (hits[0].is_hit().then_some(hits[0]), scene.nearest_accepted(&ray, &accept)),
            (nearest, nearest)
        );
    }
}

#[test]
fn the_cache_keeps_groups() {
    let folder = tempfile::tempdir().unwrap();
    let store = bth_cache::Store::open(&folder.path().join("cache"), 1 << 30).unwrap();
    let path = folder.path().join("model.obj");
    let model = Model::random(50, 11);
    std::fs::write(&path, model.obj()).unwrap();
    let plain = compile(&path, &options(), &Silent).unwrap().0.bytes;
    let cache = bth_compile::cached::Cache::new(&store, "model");
    let through = |options: &CompileOptions| {
        let found =
            bth_compile::pipeline::compile_cached(&path, options, &cache, &|_| true, &Silent).unwrap();
        found.content.unwrap().bytes().unwrap().into_owned()
    };
    let without = CompileOptions { names: false, ..options() };
    let first = through(&without);
    assert_eq!(through(&options()), plain);
    // The mesh with its groups comes from the cache, the rest is made again.
    let best = CompileOptions { geometry: false, ..options() };
    assert_eq!(through(&best), compile(&path, &best, &Silent).unwrap().0.bytes);
    assert_eq!(through(&options()), plain);
    assert_eq!(through(&without), first);
}

#[test]
fn thousands_of_groups_are_found() {
    let count = 30_000u32;
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    let mut rng = Rng::new(12);
    let mut expected = Vec::new();
    for _ in 0..count {
        let part = rng.below(4000);
        text += &format!("usemtl m{part}\n");
        for _ in 0..=rng.below(3) {
            text += "f 1 2 3\n";
            expected.push(part);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    std::fs::write(&path, text).unwrap();
    let scene = bth::from_bytes(&compile(&path, &options(), &Silent).unwrap().0.bytes).unwrap();
    assert!(scene.group_count(0) > 3000);
    for (triangle, part) in expected.iter().enumerate() {
        let group = scene.group_of(0, triangle as u32);
        let material = scene.group_material(0, group).unwrap();
        assert_eq!(scene.material_name(0, material), format!("m{part}"));
    }
    let counts = scene.object(0).triangles_of_groups();
    assert_eq!(counts.iter().sum::<u64>(), expected.len() as u64);
}
