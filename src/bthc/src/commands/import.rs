//! `bthc import`: writes a scene manifest for a glTF, FBX or 3MF file.

use super::scene::folder;
use crate::args::Import;
use crate::failure::Failure;
use crate::output;
use crate::overwrite;
use crate::progress::Progress;
use crate::table::{Table, count};
use bth_compile::write;
use bth_import::gltf::scene::{self, ImportReport};
use serde_json::json;
use std::path::{Component, Path};

pub(crate) fn run(args: &Import) -> Result<(), Failure> {
    if !bth_import::is_scene(&args.model) {
        let message = format!("{} is no glTF, GLB, FBX or 3MF file", args.model.display());
        return Err(Failure::Usage { message, hint: "manifests of other models are written by hand" });
    }
    let path = args.output.clone().unwrap_or_else(|| args.model.with_extension("manifest"));
    let to_stdout = path.as_os_str() == "-";
    if to_stdout && args.json {
        let message = "standard output takes the manifest or one JSON object".to_owned();
        return Err(Failure::Usage { message, hint: "name a file with -o" });
    }
    overwrite::check(&path, [&args.model])?;
    let name = name_from(folder(&path), &args.model)?;
    let progress = Progress::new(args.quiet || args.json);
    let (manifest, report) = scene::import(&args.model, &name, &args.gltf.options(), &progress)?;
    let text = format!("# From {name}, scene {}.\n{}", comment(&report.scene), manifest.to_toml());
    if to_stdout {
        drop(progress);
        return Ok(output::text(&text)?);
    }
    write::write_atomically(&path, text.as_bytes())?;
    drop(progress);
    if args.json {
        output::json(&json!({"output": path.to_string_lossy(), "import": report}))?;
    } else if !args.quiet {
        output::text(&summary(&path, &report))?;
    }
    Ok(())
}

/// Makes a text fit for a comment: control characters become blanks.
fn comment(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The path of a model, relative to the folder of the manifest.
fn name_from(folder: &Path, model: &Path) -> Result<String, Failure> {
    let real = |path: &Path| std::fs::canonicalize(path).map_err(|e| Failure::file("BTH-O001", path, &e));
    let (folder, model) = (real(folder)?, real(model)?);
    let Ok(inside) = model.strip_prefix(&folder) else {
        return Err(Failure::Usage {
            message: format!("{} does not lie below {}", model.display(), folder.display()),
            hint: "write the manifest beside that file or in a folder above it",
        });
    };
    let parts: Option<Vec<&str>> = inside
        .components()
        .map(|c| match c {
            Component::Normal(part) => part.to_str().filter(|p| !p.contains(['\\', ':'])),
            _ => None,
        })
        .collect();
    parts.map(|parts| parts.join("/")).ok_or_else(|| Failure::Usage {
        message: format!("{} has a name that cannot stand in a manifest", inside.display()),
        hint: "rename it: names in manifests are UTF-8, without colons and back slashes",
    })
}

fn summary(path: &Path, report: &ImportReport) -> String {
    format!("{}\nwrote {}\n", facts(report).render(), path.display())
}

/// The name of a scene or animation of a glTF file. One without a name is called by its number,
/// which would look like a count.
fn name_or_number(name: &str) -> String {
    match name.parse::<u32>() {
        Ok(number) => format!("number {number} (without a name)"),
        Err(_) => name.to_owned(),
    }
}

/// What was found in a scene.
pub(super) fn facts(report: &ImportReport) -> Table {
    let mut table = Table::default();
    table.row(["scene", &name_or_number(&report.scene)]);
    if let Some(space) = &report.space {
        table.row(["space", space]);
    }
    table.row(["nodes", &count(report.nodes)]);
    table.row(["instances", &count(report.instances)]);
    table.row(["objects", &count(report.objects)]);
    for (row, names) in
        [("animations", &report.animations), ("animations left out", &report.animations_left_out)]
    {
        if !names.is_empty() {
            let all: Vec<_> = names.iter().map(|name| name_or_number(name)).collect();
            table.row([row, &all.join(", ")]);
        }
    }
    table.count("objects that deform", report.deformers);
    table.count("instances of parts that move rigidly", report.rigid_parts);
    table.count("tracks", report.tracks);
    table.count("cameras", report.cameras);
    table.count("lights", report.lights);
    table
}
