//! The scene sections except tracks. Costs O(their bytes).

use super::deformers::{self, DeformationOf};
use super::rows::{RowResult, check_fields, check_rows};
use super::tracks;
use crate::error::{Code, Error, Result};
use crate::groups::Groups;
use crate::layout::*;
use crate::names::{self, is_name};
use crate::view::SceneView;

/// Max absolute value of a frame number.
const FRAME_LIMIT: i32 = 1 << 24;
const NAME_EXPECTED: &str = "a name of at most 4096 bytes within NAMES";

/// Checks the scene sections of a file; `objects` is the number of its objects.
///
/// # Errors
/// The first violation of `BTH-F150` to `BTH-F159`, `BTH-F180` to `BTH-F186`, and `BTH-F188`, with
/// an offset from the start of its section.
pub(crate) fn check(view: &SceneView<'_>, objects: u32, deformation: DeformationOf<'_>) -> Result<()> {
    scene_row(view)?;
    let names = names::checked(view.names);
    check_rows(kind::NODES, view.nodes, |row, node| self::node(names, row, node))?;
    check_rows(kind::INSTANCES, view.instances, |_, instance| self::instance(view, instance, objects))?;
    deformers::check(view, objects, deformation)?;
    tracks::check(view)?;
    check_rows(kind::CAMERAS, view.cameras, |_, camera| self::camera(view, names, camera))?;
    check_rows(kind::LIGHTS, view.lights, |_, light| self::light(view, names, light))?;
    groups(view)
}

/// BTH-F150: the SCENE row.
fn scene_row(view: &SceneView<'_>) -> Result<()> {
    let [scene] = view.scene else {
        let found = format!("{} rows of SCENE", view.scene.len());
        return Err(Error::within_file(Code::Scene, kind::SCENE, 0, "one row of SCENE", found));
    };
    check_rows(kind::SCENE, std::slice::from_ref(scene), |_, s| {
        let range = -FRAME_LIMIT..=FRAME_LIMIT;
        let frames = (s.first_frame, s.last_frame);
        check_fields!(Scene {
            Scene rate: s.rate.is_finite() && s.rate > 0.0, "a finite rate above 0", s.rate;
            Scene first_frame: frames.0 <= frames.1 && range.contains(&frames.0) && range.contains(&frames.1),
                "ordered frames in range", frames;
            Scene camera: s.camera == NONE || (s.camera as usize) < view.cameras.len(),
                "a row of CAMERAS or NONE", s.camera;
            Scene reserved: s.reserved == [0; 11], "zeros", s.reserved;
        });
        Ok(())
    })
}

/// BTH-F151 to BTH-F153 of a node.
fn node(names: &str, row: usize, node: &Node) -> RowResult<()> {
    let t = &node.transform;
    let is_matrix = node.flags & NODE_MATRIX != 0;
    let transforms = is_matrix || !tracks::is_zero(&t[3..7]) && tracks::is_zero(&t[10..]);
    check_fields!(Node {
        Node parent: node.parent == NONE || (node.parent as usize) < row, "a lesser row or NONE", node.parent;
        Node flags: node.flags & !(NODE_HIDDEN | NODE_MATRIX | NODE_GROUP) == 0
            && (node.flags & NODE_GROUP == 0 || node.parent == NONE),
            "known flags, and no parent of a group", node.flags;
        Node reserved: node.reserved == [0; 4], "zeros", node.reserved;
        NodeTransform transform: t.iter().all(|x| x.is_finite()) && transforms,
            "a finite transform with a quaternion that is not zero", t;
        Name name: is_name(names, node.name, node.name_length), NAME_EXPECTED, (node.name, node.name_length);
    });
    Ok(())
}

/// BTH-F154.
fn instance(view: &SceneView<'_>, instance: &Instance, objects: u32) -> RowResult<()> {
    let flags = instance.flags;
    check_fields!(Instance {
        Instance node: (instance.node as usize) < view.nodes.len(), "a row of NODES", instance.node;
        Instance flags: flags & !INSTANCE_OF_GROUP == 0, "known flags", flags;
        Instance object: match instance.group() {
            None => instance.object < objects,
            Some(node) => view.nodes.get(node as usize).is_some_and(|node| node.flags & NODE_GROUP != 0),
        }, "an object or a group", instance.object;
    });
    Ok(())
}

/// BTH-F188, and BTH-F154 of the numbers of instances.
fn groups(view: &SceneView<'_>) -> Result<()> {
    let Some(groups) = Groups::of(view) else {
        return check_rows(kind::INSTANCES, view.instances, |row, instance| {
            check_fields!(Instance {
                Instance first: instance.first as usize == row, "the number of the row", instance.first;
            });
            Ok(())
        });
    };
    let at = |section, offset: usize, expected: &'static str, found: String| {
        Err(Error::within_file(Code::NodeGroups, section, offset as u64, expected, found))
    };
    let is_in_group =
        |node: u32| view.nodes.get(node as usize).is_some() && groups.of_node(node) != groups.world();
    let skinned: Vec<u32> = view.deformers.iter().filter(|d| d.skin != NONE).map(|d| d.object).collect();
    let mut before = 0;
    for (row, instance) in view.instances.iter().enumerate() {
        let within = groups.of_node(instance.node);
        let is_behind = instance.group().is_none_or(|node| groups.of_node(node) < within);
        let is_skinned = instance.group().is_none() && skinned.contains(&instance.object);
        if within < before || !is_behind || within != groups.world() && is_skinned {
            let expected =
                "an instance in the order of the groups, of an object without a skin or an earlier group";
            return at(kind::INSTANCES, row * size_of::<Instance>(), expected, format!("{instance:?}"));
        }
        before = within;
    }
    let mut wrong = None;
    let written_out = groups.written_out(view.instances, |row, first| {
        let found = view.instances[row].first;
        if found != first && wrong.is_none() {
            let at = row * size_of::<Instance>() + std::mem::offset_of!(Instance, first);
            let (expected, found) = (format!("{first} instances before"), format!("{found}"));
            wrong = Some(Error::within_file(Code::Instance, kind::INSTANCES, at as u64, expected, found));
        }
    });
    if let Err(found) = written_out {
        let expected = "at most 16 levels and fewer than 2^32 - 1 instances once groups are written out";
        return at(kind::INSTANCES, 0, expected, found);
    }
    wrong.map_or(Ok(()), Err)?;
    let world_only = |section, size: usize, row: Option<usize>| match row {
        Some(row) => at(section, row * size, "a node of the world", "a node in a group".to_owned()),
        None => Ok(()),
    };
    let camera = view.cameras.iter().position(|camera| is_in_group(camera.node));
    world_only(kind::CAMERAS, size_of::<Camera>(), camera)?;
    let light = view.lights.iter().position(|light| is_in_group(light.node));
    world_only(kind::LIGHTS, size_of::<Light>(), light)?;
    let deformer = view.deformers.iter().position(|deformer| is_in_group(deformer.node));
    world_only(kind::DEFORMERS, size_of::<Deformer>(), deformer)
}

/// BTH-F158 and BTH-F153 of a camera.
fn camera(view: &SceneView<'_>, names: &str, c: &Camera) -> RowResult<()> {
    let most = if c.projection == 0 { 180.0 } else { f64::INFINITY };
    let from_zero = |x: f64| x.is_finite() && x >= 0.0;
    let size = c.size > 0.0 && c.size < most;
    let far = c.far == 0.0 || c.far > c.near && c.far.is_finite();
    check_fields!(Camera {
        Camera node: (c.node as usize) < view.nodes.len() && c.projection <= 1,
            "a row of NODES and a known projection", (c.node, c.projection);
        Camera size: size && from_zero(c.aspect) && from_zero(c.near) && far,
            "numbers that are allowed", (c.size, c.aspect, c.near, c.far);
        Camera reserved: c.reserved == [0; 4], "zeros", c.reserved;
        Name name: is_name(names, c.name, c.name_length), NAME_EXPECTED, (c.name, c.name_length);
    });
    Ok(())
}

/// BTH-F159 and BTH-F153 of a light.
fn light(view: &SceneView<'_>, names: &str, l: &Light) -> RowResult<()> {
    let from_zero = |x: f64| x.is_finite() && x >= 0.0;
    let angles = match l.kind {
        2 => from_zero(l.inner) && l.inner < l.outer && l.outer <= 90.0,
        _ => (l.inner, l.outer) == (0.0, 0.0),
    };
    let numbers = l.color.iter().chain([&l.intensity, &l.range]).all(|x| from_zero(*x));
    check_fields!(Light {
        Light node: (l.node as usize) < view.nodes.len() && l.kind <= 2,
            "a row of NODES and a known kind", (l.node, l.kind);
        Light color: numbers && angles,
            "numbers that are allowed", (l.color, l.intensity, l.range, l.inner, l.outer);
        Light reserved: l.reserved == [0; 2], "zeros", l.reserved;
        Name name: is_name(names, l.name, l.name_length), NAME_EXPECTED, (l.name, l.name_length);
    });
    Ok(())
}
