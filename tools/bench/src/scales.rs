//! Models of all sizes, with a vertex far out, and far from the origin (`bth-bench scales`): answers that do not depend on the scale, and
//! what rays take where f32 is too small or too coarse to prepare them.

use crate::args::Scales;
use crate::clock::Clock;
use crate::isa;
use crate::markdown::{cells, count, table};
use crate::model::Model;
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::rays::{self, Finder};
use crate::rounds::least;
use anyhow::{Result, ensure};
use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::memory::{TriangleMesh, compile};
use bth_compile::pipeline::{CompileOptions, Structure};
use serde::Serialize;
use serde_json::json;

/// Exponents of two of the greatest |coordinate| of a model.
const SIZES: [i32; 15] = [-126, -116, -108, -75, -60, -55, -50, -40, 0, 38, 42, 60, 96, 102, 126];
/// Exponents of two of the coordinates of the vertex far out of a model of size 1.
const DISTANCES: [i32; 9] = [10, 20, 30, 36, 39, 42, 60, 96, 102];
/// Exponents of two of how far a model of size 1 is moved along two axes. Its coordinates lose as many bits.
const MOVES: [i32; 5] = [4, 7, 10, 13, 16];
/// Rays of a call.
const BATCH: usize = 1024;

/// What was measured of a model at a size, with a vertex far out, or far from the origin.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The model.
    pub model: String,
    /// Exponent of two of its greatest |coordinate|.
    pub size: i32,
    /// Exponent of two of the coordinates of the vertex far out, if there is one.
    pub vertex: Option<i32>,
    /// Exponent of two of how far the model was moved, if it was.
    pub moved: Option<i32>,
    /// Nanoseconds a ray: from the camera, and bounces from what it sees.
    pub ns: [f64; 2],
    /// Hits that differ in any bit from those of the model of size 1, but for t, which is scaled. None where coordinates or t at this size are
    /// no f32.
    pub differ: Option<u64>,
}

/// Rays of a kind in the space of the model of size 1, and their hits on it.
struct Set {
    rays: Vec<Ray>,
    hits: Vec<Hit>,
}

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used, an answer depends on the scale, or the report cannot be written.
pub fn run(arguments: &Scales) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = if arguments.run.quick { 1 } else { arguments.rounds };
    let progress = Progress::new();
    let mut rows = Vec::new();
    for which in &arguments.models {
        let mut model = Model::load(which)?;
        let greatest = model.mesh.positions.as_flattened().iter().fold(0f32, |most, x| most.max(x.abs()));
        ensure!(greatest > 0.0, "{which}: all coordinates are 0");
        scale(&mut model.mesh.positions, -(greatest.log2().ceil() as i32));
        let sets = sets(&model, arguments)?;
        for size in SIZES {
            progress.show(format!("{}, size 2^{size}", model.name));
            rows.push(of_size(&model, size, &sets, rounds)?);
        }
        for distance in DISTANCES {
            progress.show(format!("{}, a vertex at 2^{distance}", model.name));
            rows.push(with_vertex(&model, distance, &sets, rounds)?);
        }
        let positions = model.mesh.positions.clone();
        for by in MOVES {
            progress.show(format!("{}, moved by 2^{by}", model.name));
            let far = positions.iter().map(|[x, y, z]| [x + scaled(1.0, by), *y, z - scaled(1.0, by)]);
            model.mesh.positions = far.collect();
            rows.push(moved(&model, by, arguments, rounds)?);
        }
    }
    drop(progress);
    let options = json!({ "rounds": rounds, "rays": arguments.rays, "quick": arguments.run.quick });
    let head = Head::now("scales", isa, options);
    let json = json!({ "head": head, "rows": rows });
    Report { head: &head, title: "Sizes of models", body: body(&rows), json, charts: Vec::new() }
        .write(&arguments.run.output)?;
    let differ: u64 = rows.iter().filter_map(|row| row.differ).sum();
    ensure!(differ == 0, "{differ} hits depend on the scale");
    Ok(())
}

/// Two to the power of `exponent`, as a product of two numbers, each of which is an f32.
fn power(exponent: i32) -> [f32; 2] {
    [exponent / 2, exponent - exponent / 2].map(|half| 2f32.powi(half))
}

fn scaled(x: f32, exponent: i32) -> f32 {
    power(exponent).into_iter().fold(x, |x, factor| x * factor)
}

fn scale(points: &mut [[f32; 3]], exponent: i32) {
    points.as_flattened_mut().iter_mut().for_each(|x| *x = scaled(*x, exponent));
}

fn compiled(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<Scene> {
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    Ok(bth::from_bytes(&compile(TriangleMesh { positions, triangles }, &options, &Silent)?.0.bytes)?)
}

/// A picture of about so many pixels, whose sides are multiples of 4.
fn picture(pixels: usize) -> (u32, u32) {
    let width = 4 * ((pixels as f64 * 16.0 / 9.0).sqrt() / 4.0).floor().max(1.0) as u32;
    (width, (4 * (pixels as u32 / width / 4)).max(4))
}

/// Camera rays, and bounces from what they see.
fn sets(model: &Model, arguments: &Scales) -> Result<[Set; 2]> {
    sets_of(model, &compiled(&model.mesh.positions, &model.mesh.triangles)?, arguments)
}

fn sets_of(model: &Model, scene: &Scene, arguments: &Scales) -> Result<[Set; 2]> {
    let options = rays::Options { size: picture(arguments.rays), most: arguments.rays, view: None };
    let (_, all) = rays::sets(&Finder::new(model, scene), &options);
    let set = |name: &str| {
        let rays = all.iter().find(|set| set.name == name).map(|set| set.rays.clone()).unwrap_or_default();
        let hits = traced(scene, &rays);
        Set { rays, hits }
    };
    let sets = ["primary", "diffuse-beside"].map(set);
    ensure!(sets.iter().all(|set| set.hits.iter().any(Hit::is_hit)), "{}: no ray hits", model.name);
    Ok(sets)
}

fn traced(scene: &Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
        scene.batch(rays).nearest(hits);
    }
    hits
}

/// Nanoseconds a ray of each set.
fn time(scene: &Scene, sets: [&[Ray]; 2], rounds: usize) -> [f64; 2] {
    let times = least(&sets, rounds, |_, rays| {
        Some(Clock::ThreadCpu.time(|| drop(std::hint::black_box(traced(scene, rays)))) / rays.len() as f64)
    });
    [0, 1].map(|set| 1e9 * times[set].unwrap_or(f64::NAN))
}

/// The model at a size, with rays that are scaled with it.
fn of_size(model: &Model, size: i32, sets: &[Set; 2], rounds: usize) -> Result<Row> {
    let mut positions = model.mesh.positions.clone();
    scale(&mut positions, size);
    let scene = compiled(&positions, &model.mesh.triangles)?;
    let rays = sets.each_ref().map(|set| {
        let mut rays = set.rays.clone();
        rays.iter_mut().for_each(|ray| ray.origin = ray.origin.map(|x| scaled(x, size)));
        rays
    });
    // Powers of two change no digit of a number unless it is denormal or infinite then.
    let is_exact = |x: f32| scaled(scaled(x, size), -size) == x;
    let is_same =
        |a: &Hit, b: &Hit| scaled(a.t, size) == b.t && (a.u, a.v, a.primitive) == (b.u, b.v, b.primitive);
    let mut differ = Some(0);
    if !model.mesh.positions.as_flattened().iter().all(|x| is_exact(*x)) {
        differ = None;
    }
    for (set, rays) in sets.iter().zip(&rays) {
        let origins = set.rays.iter().flat_map(|ray| ray.origin);
        let distances = set.hits.iter().map(|hit| hit.t);
        if !origins.chain(distances).all(is_exact) {
            differ = None;
        }
        let found = traced(&scene, rays);
        let others = set.hits.iter().zip(&found).filter(|(a, b)| !is_same(a, b)).count() as u64;
        differ = differ.map(|count| count + others);
    }
    let ns = time(&scene, rays.each_ref().map(Vec::as_slice), rounds);
    Ok(Row { model: model.name.clone(), size, vertex: None, moved: None, ns, differ })
}

/// The model of size 1 with one more triangle, whose third corner is far out.
fn with_vertex(model: &Model, distance: i32, sets: &[Set; 2], rounds: usize) -> Result<Row> {
    let (mut positions, mut triangles) = (model.mesh.positions.clone(), model.mesh.triangles.clone());
    let [a, b, _] = triangles[0];
    triangles.push([a, b, positions.len() as u32]);
    positions.push([1.0, 0.5, 0.75].map(|x| scaled(x, distance)));
    let scene = compiled(&positions, &triangles)?;
    let ns = time(&scene, sets.each_ref().map(|set| set.rays.as_slice()), rounds);
    Ok(Row { model: model.name.clone(), size: 0, vertex: Some(distance), moved: None, ns, differ: None })
}

/// A model that was moved, and rays of the same kinds around it.
fn moved(model: &Model, by: i32, arguments: &Scales, rounds: usize) -> Result<Row> {
    let scene = compiled(&model.mesh.positions, &model.mesh.triangles)?;
    let sets = sets_of(model, &scene, arguments)?;
    let ns = time(&scene, sets.each_ref().map(|set| set.rays.as_slice()), rounds);
    Ok(Row { model: model.name.clone(), size: 0, vertex: None, moved: Some(by), ns, differ: None })
}

fn body(rows: &[Row]) -> String {
    let of_size_one = |row: &Row| {
        let is_it = |other: &&Row| {
            other.model == row.model && (other.size, other.vertex, other.moved) == (0, None, None)
        };
        rows.iter().find(is_it).map_or([f64::NAN; 2], |one| one.ns)
    };
    let line = |row: &Row| {
        let one = of_size_one(row);
        let [vertex, moved] = [row.vertex, row.moved]
            .map(|exponent| exponent.map_or_else(|| "–".to_owned(), |exponent| format!("2^{exponent}")));
        let mut line = vec![row.model.clone(), format!("2^{}", row.size), vertex, moved];
        for (ns, one) in row.ns.iter().zip(one) {
            line.extend([format!("{ns:.0}"), format!("{:.1}", ns / one)]);
        }
        line.push(row.differ.map_or_else(|| "–".to_owned(), count));
        line
    };
    let head = cells(&[
        "model",
        "size",
        "a vertex at",
        "moved by",
        "camera, ns",
        "times size 1",
        "bounces, ns",
        "times size 1",
        "differ",
    ]);
    format!(
        "Nanoseconds a ray on one thread, batches of {BATCH}, the least of the rounds. `size`: greatest |coordinate|; rays are scaled with the model. `a vertex at`: \
         one more triangle, whose third corner is so far out. `moved by`: along x and, the other way, z, with rays around the model that was moved. `differ`: hits with other bits than at size 1, but for t, which is scaled; – where a coordinate or t \
         at this size is no f32.\n\n{}",
        table(&head, &rows.iter().map(line).collect::<Vec<_>>())
    )
}
