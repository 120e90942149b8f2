//! The rows of the scene sections, from a manifest.

use super::deformers;
use crate::error::{Error, Result};
use crate::write::{Names, SceneParts};
use bth_format::groups::Groups;
use bth_format::layout as on_disk;
use bth_format::layout::NONE;
use bth_scene::{Lens, LightKind, Manifest, NodeGroups, Track, Transform};
use std::collections::HashSet;

/// The order of the nodes with parents before children, groups before what shows them, and groups
/// that move last: the manifest's order where it has this property, else by depth.
pub(super) fn order(manifest: &Manifest) -> Vec<usize> {
    let mut order = parents_first(manifest);
    if let Some(groups) = groups(manifest) {
        let moves = groups.moving(&manifest.nodes, &manifest.tracks);
        order.sort_by_key(|node| groups.order(*node, &moves));
    }
    order
}

/// The groups of nodes, which the reader of manifests has checked.
fn groups(manifest: &Manifest) -> Option<NodeGroups> {
    NodeGroups::of(&manifest.nodes).unwrap_or_default()
}

fn parents_first(manifest: &Manifest) -> Vec<usize> {
    let nodes = &manifest.nodes;
    let mut order: Vec<usize> = (0..nodes.len()).collect();
    if (0..nodes.len()).all(|row| nodes.parent(row).is_none_or(|parent| parent < row)) {
        return order;
    }
    let mut depth = vec![usize::MAX; nodes.len()];
    let mut path = Vec::new();
    for start in 0..nodes.len() {
        let mut next = Some(start);
        while let Some(node) = next.filter(|node| depth[*node] == usize::MAX) {
            path.push(node);
            next = nodes.parent(node);
        }
        let mut below = next.map_or(0, |node| depth[node] + 1);
        while let Some(node) = path.pop() {
            depth[node] = below;
            below += 1;
        }
    }
    order.sort_by_key(|node| depth[*node]);
    order
}

/// Nodes that are passed on at a time.
const CHUNK: usize = 1 << 13;

/// Encodes the scene sections. `objects` gives for each object of the manifest the object of the
/// file, `None` for those that no instance uses. `visible` is true for each node that may be seen;
/// instances at other nodes are skipped. The rows of nodes go to `take` in pieces, since they may
/// not fit in memory. Returns all other rows, and the groups.
///
/// # Errors
/// `BTH-L050` beyond the limits of the format; errors of `take`.
pub(super) fn encode(
    manifest: &Manifest,
    order: &[usize],
    visible: &[bool],
    objects: &[Option<u32>],
    take: &mut dyn FnMut(&[on_disk::Node]) -> Result<()>,
) -> Result<(SceneParts, Option<Groups>)> {
    check_limits(manifest)?;
    let mut row_of = vec![NONE; manifest.nodes.len()];
    order.iter().enumerate().for_each(|(row, node)| row_of[*node] = row as u32);
    let mut names = Names::default();
    let frames = manifest.frames;
    let mut parts = SceneParts {
        scene: on_disk::Scene {
            rate: frames.rate,
            first_frame: frames.first,
            last_frame: frames.last,
            camera: manifest.camera.map_or(NONE, |camera| camera as u32),
            reserved: [0; 11],
        },
        nodes: Vec::new(),
        instances: Vec::new(),
        tracks: Vec::new(),
        times: Vec::new(),
        values: Vec::new(),
        cameras: Vec::new(),
        lights: Vec::new(),
        names: Vec::new(),
        deformers: deformers::encode(manifest, &row_of, objects),
    };
    // Names of nodes are different, so only those that others have, too, are looked up again.
    let cameras = manifest.cameras.iter().map(|camera| camera.name.as_str());
    let others: HashSet<&str> =
        cameras.chain(manifest.lights.iter().map(|light| light.name.as_str())).collect();
    let groups = groups(manifest);
    let is_group = |node: usize| groups.as_ref().is_some_and(|groups| groups.is_group(node));
    let mut nodes = Vec::with_capacity(CHUNK.min(order.len()));
    for (row, &index) in order.iter().enumerate() {
        let node = manifest.nodes.get(index);
        let (name, name_length) = match others.contains(node.name) {
            true => names.add(node.name),
            false => names.append(node.name),
        };
        let (transform, matrix) = transform(&node.transform);
        let hidden = if node.visible { 0 } else { on_disk::NODE_HIDDEN };
        if nodes.len() == CHUNK {
            take(&nodes)?;
            nodes.clear();
        }
        nodes.push(on_disk::Node {
            transform,
            parent: node.parent.map_or(NONE, |parent| row_of[parent]),
            flags: hidden | matrix | if is_group(index) { on_disk::NODE_GROUP } else { 0 },
            name,
            name_length,
            reserved: [0; 4],
        });
        if let Some(object) = node.object.filter(|_| visible[index]).and_then(|object| objects[object]) {
            parts.instances.push(on_disk::Instance { node: row as u32, object, flags: 0, first: 0 });
        }
        if let Some(group) = node.group.filter(|_| visible[index]) {
            let (object, flags) = (row_of[group], on_disk::INSTANCE_OF_GROUP);
            parts.instances.push(on_disk::Instance { node: row as u32, object, flags, first: 0 });
        }
    }
    take(&nodes)?;
    let rows =
        order.iter().map(|&node| (manifest.nodes.parent(node).map(|parent| row_of[parent]), is_group(node)));
    let groups = Groups::of_rows(rows);
    number_instances(groups.as_ref(), &mut parts.instances);
    add_tracks(&mut parts, manifest, &row_of);
    add_cameras(&mut parts, &mut names, manifest, &row_of);
    add_lights(&mut parts, &mut names, manifest, &row_of);
    parts.names = names.bytes;
    Ok((parts, groups))
}

/// Gives each row the number of its first instance. Where there are too many, the check of the
/// scene says so.
fn number_instances(groups: Option<&Groups>, instances: &mut [on_disk::Instance]) {
    match groups {
        Some(groups) => drop(groups.number(instances)),
        None => (0..).zip(instances).for_each(|(row, instance)| instance.first = row),
    }
}

/// Adds the cameras.
fn add_cameras(parts: &mut SceneParts, names: &mut Names, manifest: &Manifest, row_of: &[u32]) {
    for camera in &manifest.cameras {
        let (name, name_length) = names.add(&camera.name);
        let (projection, size) = match camera.lens {
            Lens::Perspective(fov) => (0, fov),
            Lens::Orthographic(height) => (1, height),
        };
        parts.cameras.push(on_disk::Camera {
            node: row_of[camera.node],
            projection,
            name,
            name_length,
            size,
            aspect: camera.aspect.unwrap_or(0.0),
            near: camera.near.unwrap_or(0.0),
            far: camera.far.unwrap_or(0.0),
            reserved: [0; 4],
        });
    }
}

/// Adds the lights.
fn add_lights(parts: &mut SceneParts, names: &mut Names, manifest: &Manifest, row_of: &[u32]) {
    for light in &manifest.lights {
        let (name, name_length) = names.add(&light.name);
        let (kind, inner, outer) = match light.kind {
            LightKind::Directional => (0, 0.0, 0.0),
            LightKind::Point => (1, 0.0, 0.0),
            LightKind::Spot { inner, outer } => (2, inner, outer),
        };
        parts.lights.push(on_disk::Light {
            node: row_of[light.node],
            kind,
            name,
            name_length,
            color: light.color,
            intensity: light.intensity,
            range: light.range.unwrap_or(0.0),
            inner,
            outer,
            reserved: [0; 2],
        });
    }
}

fn check_limits(manifest: &Manifest) -> Result<()> {
    let names = || {
        let nodes = (0..manifest.nodes.len()).map(|node| manifest.nodes.name(node));
        let cameras = manifest.cameras.iter().map(|camera| camera.name.as_str());
        nodes.chain(cameras).chain(manifest.lights.iter().map(|light| light.name.as_str()))
    };
    let bytes = names().map(|name| name.len() as u64).sum();
    let values = manifest.tracks.iter().map(|t| t.values.len() as u64).sum();
    for (what, count) in
        [("nodes", manifest.nodes.len() as u64), ("bytes of names", bytes), ("values", values)]
    {
        if count >= u64::from(i32::MAX as u32) {
            let message = format!("a scene may have fewer than {} {what}; this one has {count}", i32::MAX);
            return Err(Error::Limit { code: "BTH-L050", message });
        }
    }
    if let Some(long) = names().find(|name| name.len() > bth_format::limits::MAX_NAME as usize) {
        let (start, most) = (long.chars().take(40).collect::<String>(), bth_format::limits::MAX_NAME);
        let message =
            format!("a name may have {most} bytes; the one that starts \"{start}\" has {}", long.len());
        return Err(Error::Limit { code: "BTH-L050", message });
    }
    Ok(())
}

fn transform(transform: &Transform) -> ([f64; 12], u32) {
    let mut numbers = [0.0; 12];
    match transform {
        Transform::Parts { translation, rotation, scale } => {
            numbers[..3].copy_from_slice(translation);
            numbers[3..7].copy_from_slice(rotation);
            numbers[7..10].copy_from_slice(scale);
            (numbers, 0)
        }
        Transform::Matrix(rows) => {
            numbers.copy_from_slice(rows.as_flattened());
            (numbers, on_disk::NODE_MATRIX)
        }
    }
}

/// Adds the tracks. Skips weights of deformers that are not in the file.
fn add_tracks(parts: &mut SceneParts, manifest: &Manifest, row_of: &[u32]) {
    let deformers = &parts.deformers.deformers;
    let deforms = |node: usize| deformers.binary_search_by_key(&row_of[node], |d| d.node).is_ok();
    let is_kept = |t: &&Track| t.property != bth_scene::Property::Weights || deforms(t.node);
    let mut tracks: Vec<_> = manifest.tracks.iter().filter(is_kept).collect();
    tracks.sort_by_key(|t| (row_of[t.node], t.property));
    for track in tracks {
        let property = match track.property {
            bth_scene::Property::Translation => on_disk::Property::Translation,
            bth_scene::Property::Rotation => on_disk::Property::Rotation,
            bth_scene::Property::Scale => on_disk::Property::Scale,
            bth_scene::Property::Visible => on_disk::Property::Visible,
            bth_scene::Property::Weights => on_disk::Property::Weights,
        };
        let interpolation = match track.interpolation {
            bth_scene::Interpolation::Step => on_disk::Interpolation::Step,
            bth_scene::Interpolation::Linear => on_disk::Interpolation::Linear,
            bth_scene::Interpolation::Cubic => on_disk::Interpolation::Cubic,
        };
        parts.tracks.push(on_disk::Track {
            node: row_of[track.node],
            property: property as u32,
            interpolation: interpolation as u32,
            keys: track.times.len() as u32,
            first_time: parts.times.len() as u32,
            first_value: parts.values.len() as u32,
            reserved: [0; 2],
        });
        parts.times.extend(&track.times);
        parts.values.extend(&track.values);
    }
}
