//! `bthc calibrate`: measures the costs of tracing on this machine.

use crate::args::Calibrate;
use crate::calibrate::{Measured, Subject, fit, measure};
use crate::failure::Failure;
use crate::measure::{QueryKind, Rays};
use crate::progress::Progress;
use crate::table::{Table, bytes};
use crate::{output, overwrite};
use bth::Scene;
use bth_compile::costs::Profile;
use bth_compile::pipeline::{self, CompileOptions};
use bth_compile::{Monitor, bvh, sampling, write};
use bth_import::{self, Keep, Mesh};
use bth_scenes::{Model, blob, gyroid};
use serde_json::{Value, json};
use std::path::Path;

/// Faces of the generated models: their tetrahedra take a quarter of a megabyte, and many times the
/// caches.
const SMALL_FACES: u32 = 2_400;
const LARGE_FACES: u32 = 220_000;
/// Bytes of tetrahedra from which a model counts as large.
const LARGE_BYTES: f64 = 6e6;

pub(crate) fn run(args: &Calibrate) -> Result<(), Failure> {
    overwrite::check(&args.output, &args.models)?;
    let progress = Progress::new(args.json);
    let mut measured = Measured { small: Vec::new(), large: Vec::new(), leaf: 0.0 };
    let own = [
        ("blob", blob::blob(SMALL_FACES)),
        ("gyroid", gyroid::gyroid(SMALL_FACES)),
        ("large blob", blob::blob(LARGE_FACES)),
    ];
    let mut models: Vec<(String, Mesh)> =
        own.into_iter().map(|(name, model)| (name.to_owned(), of(model))).collect();
    for path in &args.models {
        let (mesh, _) = bth_import::import(path, Keep::None, &progress)?;
        models.push((path.display().to_string(), mesh));
    }
    let subjects = models
        .iter()
        .map(|(name, mesh)| Subject::new(name, mesh, &progress))
        .collect::<Result<Vec<_>, _>>()?;
    progress.stage("measure", None);
    let (scene, rays) = leaf(&progress)?;
    let beside = (&scene, &rays, QueryKind::Nearest);
    let (all, leaf) = measure(&subjects, beside, args.rounds, || progress.cancelled())?;
    measured.leaf = leaf;
    for times in all {
        let kind = if times.bytes[0] < LARGE_BYTES { &mut measured.small } else { &mut measured.large };
        kind.push(times);
    }
    drop(progress);

    let profile = fit(&measured, &bth::Isa::chosen().to_string());
    let mut text = serde_json::to_string_pretty(&profile).map_err(std::io::Error::from)?;
    text.push('\n');
    // What cannot be written is shown at least, and written where it cannot be shown.
    if args.json {
        let written = write::write_atomically(&args.output, text.as_bytes()).map_err(Failure::from);
        let shown = output::json(&object(&profile, &args.output, &written));
        if let Err(failure) = written {
            failure.print();
            return Err(Failure::Reported(failure.exit_code()));
        }
        return Ok(shown?);
    }
    let shown = output::text(&table(&profile));
    write::write_atomically(&args.output, text.as_bytes())?;
    shown?;
    Ok(output::text(&format!("wrote {}\n", args.output.display()))?)
}

/// What `--json` shows: the profile, and where it is, or why it could not be written there.
fn object(profile: &Profile, output: &Path, written: &Result<(), Failure>) -> Value {
    let mut object = json!({"hash": profile.hash(), "profile": profile});
    match written {
        Ok(()) => object["output"] = output.to_string_lossy().into(),
        Err(failure) => object["error"] = json!(failure.diagnosis()),
    }
    object
}

fn of(model: Model) -> Mesh {
    Mesh { positions: model.positions, triangles: model.triangles, ..Mesh::default() }
}

/// A BVH that is a single leaf, a fan of eight triangles, and rays into it.
fn leaf(progress: &Progress) -> Result<(Scene, Rays), Failure> {
    let rim = |i: u32| {
        [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0]]
            [i as usize]
    };
    let mut model = Model { positions: vec![[0.0, 0.0, 0.2]], triangles: Vec::new() };
    for i in 0..8 {
        let [x, y]: [f32; 2] = rim(i);
        model.positions.push([x, y, 0.0]);
        model.triangles.push([0, 1 + i, 1 + (i + 1) % 8]);
    }
    let mesh = of(model);
    let (tree, _) = bvh::build(&mesh, &bvh::BvhOptions::default(), progress)?;
    let file = pipeline::assemble(&mesh, &tree, &[], &CompileOptions::default(), progress)?;
    let scene = bth::from_bytes(&file.bytes)?;
    let root = &tree.nodes[0];
    let rays = Rays::new(&sampling::outside(root.lower, root.upper, 4096, 13));
    Ok((scene, rays))
}

fn table(profile: &Profile) -> String {
    let ns = |x: f64| format!("{x:.2}");
    let mut table = Table::default();
    table.row(["nanoseconds", &profile.isa]);
    let bvh = profile.bvh;
    table.row(["a ray, by itself", &ns(bvh.ray)]);
    table.row(["a node of the binary BVH, rays from outside", &ns(bvh.outside)]);
    table.row(["a node of the binary BVH, rays from surfaces", &ns(bvh.surface)]);
    table.row(["a wide node", &ns(bvh.node)]);
    table.row(["a leaf of triangles", &ns(bvh.block)]);
    let [small, large] = profile.bytes.map(|b| bytes(b as u64));
    for (name, costs) in &profile.tets {
        for (how, walk) in
            [("from outside", costs.outside), ("from a surface", costs.surface), ("ray by ray", costs.alone)]
        {
            table.row([&format!("{name}, {how}: entry"), &ns(walk.entry)]);
            table.row([&format!("{name}, {how}: a hit"), &ns(walk.hit)]);
            table.row([&format!("{name}, {how}: a step in {small}"), &ns(walk.step[0])]);
            table.row([&format!("{name}, {how}: a step in {large}"), &ns(walk.step[1])]);
        }
    }
    table.render()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_that_cannot_be_written_stand_beside_the_error() {
        let (profile, path) = (Profile::default(), Path::new("missing/costs.json"));
        let failed = Failure::file("BTH-O020", path, &"no such folder");
        let object = |written| super::object(&profile, path, &written);
        let (good, bad) = (object(Ok(())), object(Err(failed)));
        assert_eq!((&good["output"], &good["error"]), (&"missing/costs.json".into(), &Value::Null));
        assert_eq!((&bad["output"], &bad["error"]["code"]), (&Value::Null, &"BTH-O020".into()));
        assert_eq!(bad["error"]["exit_code"], 4);
        assert!(good["profile"].is_object() && good["profile"] == bad["profile"], "{bad}");
    }
}
