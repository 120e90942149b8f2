//! `bthc marks`: lists the triangles of a model that are in bad contact with others.

use super::threads::with_threads;
use crate::args::Marks;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::table::count;
use crate::{output, overwrite, ray_files};
use bth_compile::{bvh, marks, write};
use bth_import::Keep;
use serde_json::json;

pub(crate) fn run(args: &Marks) -> Result<(), Failure> {
    if let Some(path) = &args.tris {
        overwrite::check(path, [&args.model])?;
    }
    let progress = Progress::new(args.json);
    let (mesh, contacts) = with_threads(args.threads, || -> bth_compile::Result<_> {
        let (mesh, _) = bth_import::import(&args.model, Keep::None, &progress)?;
        // The contacts do not depend on the tree, so the fastest builder is used.
        let options = bvh::BvhOptions { quality: bvh::Quality::Fast, ..Default::default() };
        let (tree, _) = bvh::build(&mesh, &options, &progress)?;
        let contacts = marks::bad_pairs(&mesh, &tree, &progress)?;
        Ok((mesh, contacts))
    })??;
    drop(progress);
    if let Some(path) = &args.tris {
        write::write_atomically(path, &ray_files::triangles(&mesh))?;
    }
    let triangles = mesh.triangles.len();
    if args.json {
        let report =
            json!({"triangles": triangles, "bad_pairs": contacts.pairs, "bad_triangles": contacts.triangles});
        output::json(&report)?;
    } else {
        let mut text = String::new();
        for id in &contacts.triangles {
            text.push_str(&format!("{id}\n"));
        }
        text.push_str(&format!(
            "{} of {} triangles in {} bad contacts\n",
            count(contacts.triangles.len() as u64),
            count(triangles as u64),
            count(contacts.pairs)
        ));
        output::text(&text)?;
    }
    Ok(())
}
