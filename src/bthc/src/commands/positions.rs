//! `bthc positions`: prints where the vertices of a scene are at some times.

use crate::args::Positions;
use crate::failure::Failure;
use crate::output;
use bth::Scene;
use serde_json::{Value, json};

pub(crate) fn run(args: &Positions) -> Result<(), Failure> {
    let mut scene = bth::open(&args.file)?;
    let times = if args.seconds.is_empty() { vec![scene.seconds()] } else { args.seconds.clone() };
    let mut at_times = Vec::new();
    for seconds in times {
        scene.set_seconds(seconds)?;
        at_times.push(at_time(&scene));
    }
    let triangles = |object: u32| scene.object(object).triangles.to_vec();
    let objects: Vec<Value> = (0..scene.object_count())
        .map(|object| json!({"name": scene.object_name(object), "triangles": triangles(object)}))
        .collect();
    Ok(output::json(&json!({"objects": objects, "times": at_times}))?)
}

/// The positions of all objects and the transforms of all instances at the scene's time.
fn at_time(scene: &Scene) -> Value {
    let instance = |row: u32| {
        let view = scene.instance(row);
        let node = scene.description().map_or("", |description| description.node_name(view.node));
        json!({"node": node, "object": view.object, "visible": view.visible, "to_world": view.to_world})
    };
    let positions: Vec<_> = (0..scene.object_count()).map(|object| scene.positions(object)).collect();
    json!({
        "seconds": scene.seconds(),
        "instances": (0..scene.instance_count()).map(instance).collect::<Vec<_>>(),
        "positions": positions,
    })
}
