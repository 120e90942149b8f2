use super::*;
use crate::coordinates::CoordinateOptions;
use crate::pipeline::{compile, compile_cached, compile_parts};
use crate::source::TriangleMesh;
use bth::rays::Ray;
use bth_cache::Store;
use bth_format::layout::GridBits;
use bth_import::{PositionRows, Silent, TRIANGLES_AT_ONCE};

/// Triangles at random, one of them without area.
fn cloud(count: u32, random: &mut bth_random::Rng) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), vec![[0, 0, 1]]);
    for i in 0..count {
        let center = [0; 3].map(|_: i32| random.unit_f64() as f32 * 10.0);
        positions.extend([0; 3].map(|_: i32| center.map(|x| x + random.unit_f64() as f32)));
        triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    (positions, triangles)
}

/// Answers equal the answers of the file that is built at once, and every byte is verified.
#[test]
fn files_of_parts_are_whole_and_answer_alike() {
    let mut random = bth_random::Rng::new(11);
    let (positions, triangles) = cloud(3000, &mut random);
    let model = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &triangles };
    for options in
        [CompileOptions::fast(), CompileOptions { structure: Structure::Bvh, ..Default::default() }]
    {
        let (whole, expected) = compile(model, &options, &Silent).unwrap();
        let whole = bth::from_bytes(&whole.bytes).unwrap();
        for part_triangles in [17, 400, 2999] {
            let options = CompileOptions { part_triangles, ..options.clone() };
            let (file, report) = compile(model, &options, &Silent).unwrap();
            let of = |report: &BvhReport| (report.triangles, report.dropped);
            assert_eq!(of(&report.bvh), of(&expected.bvh));
            let file = bth_format::File::from_bytes(&file.bytes).unwrap();
            bth_format::verify::verify(&file).unwrap();
            let scene = bth::from_file(file).unwrap();
            for _ in 0..500 {
                let [origin, to] = [0; 2].map(|_| [0; 3].map(|_: i32| random.unit_f64() as f32 * 10.0));
                let ray = Ray::new(origin, [0, 1, 2].map(|k| to[k] - origin[k]));
                assert_eq!(scene.nearest(&ray), whole.nearest(&ray));
            }
        }
    }
}

/// Whatever parts the cache has, the bytes are the same, and only shards keep parts.
#[test]
fn shards_build_parts_that_the_whole_takes_from_the_cache() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("model.obj");
    let (positions, triangles) = cloud(900, &mut bth_random::Rng::new(12));
    let mut text: String = positions.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    text.extend(triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
    std::fs::write(&model, text).unwrap();
    let (fast, bits) = (CompileOptions::fast(), Some(GridBits::B16));
    let coordinates = CoordinateOptions { bits, ..Default::default() };
    let positions = bth_import::Positions::F64;
    for (row, options) in
        [CompileOptions { coordinates, ..fast.clone() }, CompileOptions { positions, ..fast.clone() }, fast]
            .into_iter()
            .enumerate()
    {
        let options = CompileOptions { part_triangles: 100, ..options };
        let (expected, _) = compile(&model, &options, &Silent).unwrap();
        for (shards, of) in [(0..0, 1), (1..2, 1), (1..6, 5), (1..20, 19), (2..3, 3)] {
            let store = Store::open(&folder.path().join(format!("{row} {shards:?}")), 1 << 30).unwrap();
            let parts = |cache: &Cache<'_>| {
                let shard = |number| compile_parts(&model, &options, cache, Shard { number, of }, &Silent);
                shards.clone().map(shard).collect::<Result<Option<Vec<u64>>>>().unwrap()
            };
            let built: u64 = parts(&Cache::new(&store, "model")).unwrap().iter().sum();
            assert_eq!(built, if shards.len() as u32 == of { 16 } else { 5 * shards.len() as u64 });
            let cache = Cache::new(&store, "model");
            let done = compile_cached(&model, &options, &cache, &|_| true, &Silent).unwrap();
            assert!(done.content.unwrap().bytes().unwrap() == expected.bytes);
            assert_eq!(cache.log().hits.get("part").copied().unwrap_or(0), built);
            assert_eq!(store.list().iter().filter(|entry| entry.stage == "part").count() as u64, built);
            assert!(shards.is_empty() || parts(&cache).is_none(), "the file is in the cache");
        }
    }
}

#[test]
fn only_what_needs_no_tree_of_all_triangles_is_built_in_parts() {
    let many = TRIANGLES_AT_ONCE + 1;
    let mut options = CompileOptions::default();
    assert!(in_parts(many, &options) && !in_parts(many - 1, &options));
    options.deformable = true;
    assert!(!in_parts(many, &options));
    let tets = CompileOptions { structure: Structure::Tets, ..CompileOptions::default() };
    assert!(!in_parts(many, &tets));
}
