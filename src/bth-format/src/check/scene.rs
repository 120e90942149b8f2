//! The scene sections but for tracks. Costs O(their bytes).

use super::deformers::{self, DeformationOf};
use super::rows::{RowResult, check_rows, violation};
use super::tracks;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::names::{self, is_name};
use crate::scene_view::SceneView;
use std::mem::offset_of;

/// Frame numbers are at most this in absolute value.
const FRAME_LIMIT: i32 = 1 << 24;
const NAME_EXPECTED: &str = "a name of at most 4096 bytes within NAMES";

/// Checks the scene sections of a file; `objects` is the number of its objects.
///
/// # Errors
/// The first violation of `BTH-F150` to `BTH-F159` and `BTH-F180` to `BTH-F186`, with an offset from the start of its section.
pub(crate) fn check(view: &SceneView<'_>, objects: u32, deformation: DeformationOf<'_>) -> Result<()> {
    scene_row(view)?;
    let names = names::checked(view.names);
    check_rows(kind::NODES, view.nodes, |row, node| self::node(names, row, node))?;
    check_rows(kind::INSTANCES, view.instances, |_, instance| self::instance(view, instance, objects))?;
    deformers::check(view, objects, deformation)?;
    tracks::check(view)?;
    check_rows(kind::CAMERAS, view.cameras, |_, camera| self::camera(view, names, camera))?;
    check_rows(kind::LIGHTS, view.lights, |_, light| self::light(view, names, light))
}

/// BTH-F150: the SCENE row.
fn scene_row(view: &SceneView<'_>) -> Result<()> {
    let [scene] = view.scene else {
        let found = format!("{} rows of SCENE", view.scene.len());
        return Err(Error::within_file(Code::Scene, kind::SCENE, 0, "one row of SCENE", found));
    };
    check_rows(kind::SCENE, std::slice::from_ref(scene), |_, s| {
        if !(s.rate.is_finite() && s.rate > 0.0) {
            return violation(Code::Scene, offset_of!(Scene, rate), "a finite rate above 0", s.rate);
        }
        let range = -FRAME_LIMIT..=FRAME_LIMIT;
        if s.first_frame > s.last_frame || !range.contains(&s.first_frame) || !range.contains(&s.last_frame) {
            let frames = (s.first_frame, s.last_frame);
            return violation(Code::Scene, offset_of!(Scene, first_frame), "ordered frames in range", frames);
        }
        if s.camera != NONE && s.camera as usize >= view.cameras.len() {
            return violation(Code::Scene, offset_of!(Scene, camera), "a row of CAMERAS or NONE", s.camera);
        }
        if s.reserved != [0; 11] {
            return violation(Code::Scene, offset_of!(Scene, reserved), "zeros", s.reserved);
        }
        Ok(())
    })
}

/// BTH-F151 to BTH-F153 of a node.
fn node(names: &str, row: usize, node: &Node) -> RowResult<()> {
    if node.parent != NONE && node.parent as usize >= row {
        return violation(Code::Node, offset_of!(Node, parent), "a lesser row or NONE", node.parent);
    }
    if node.flags & !(NODE_HIDDEN | NODE_MATRIX) != 0 {
        return violation(Code::Node, offset_of!(Node, flags), "known flags", node.flags);
    }
    if node.reserved != [0; 4] {
        return violation(Code::Node, offset_of!(Node, reserved), "zeros", node.reserved);
    }
    let t = &node.transform;
    let parts = node.flags & NODE_MATRIX == 0;
    if !t.iter().all(|x| x.is_finite()) || parts && (tracks::is_zero(&t[3..7]) || !tracks::is_zero(&t[10..]))
    {
        return violation(Code::NodeTransform, 0, "a finite transform with a quaternion that is not zero", t);
    }
    if !is_name(names, node.name, node.name_length) {
        let found = (node.name, node.name_length);
        return violation(Code::Name, offset_of!(Node, name), NAME_EXPECTED, found);
    }
    Ok(())
}

/// BTH-F154.
fn instance(view: &SceneView<'_>, instance: &Instance, objects: u32) -> RowResult<()> {
    if instance.node as usize >= view.nodes.len() {
        return violation(Code::Instance, offset_of!(Instance, node), "a row of NODES", instance.node);
    }
    if instance.object >= objects {
        return violation(Code::Instance, offset_of!(Instance, object), "an object", instance.object);
    }
    if (instance.flags, instance.reserved) != (0, 0) {
        let found = (instance.flags, instance.reserved);
        return violation(Code::Instance, offset_of!(Instance, flags), "zeros", found);
    }
    Ok(())
}

/// BTH-F158 and BTH-F153 of a camera.
fn camera(view: &SceneView<'_>, names: &str, camera: &Camera) -> RowResult<()> {
    if camera.node as usize >= view.nodes.len() || camera.projection > 1 {
        let found = (camera.node, camera.projection);
        return violation(Code::Camera, 0, "a row of NODES and a known projection", found);
    }
    let most = if camera.projection == 0 { 180.0 } else { f64::INFINITY };
    let size = camera.size > 0.0 && camera.size < most;
    let aspect = camera.aspect.is_finite() && camera.aspect >= 0.0;
    let near = camera.near.is_finite() && camera.near >= 0.0;
    let far = camera.far == 0.0 || camera.far > camera.near && camera.far.is_finite();
    if !(size && aspect && near && far) {
        let found = (camera.size, camera.aspect, camera.near, camera.far);
        return violation(Code::Camera, offset_of!(Camera, size), "numbers that are allowed", found);
    }
    if camera.reserved != [0; 4] {
        return violation(Code::Camera, offset_of!(Camera, reserved), "zeros", camera.reserved);
    }
    named(names, camera.name, camera.name_length)
}

/// BTH-F159 and BTH-F153 of a light.
fn light(view: &SceneView<'_>, names: &str, light: &Light) -> RowResult<()> {
    if light.node as usize >= view.nodes.len() || light.kind > 2 {
        return violation(Code::Light, 0, "a row of NODES and a known kind", (light.node, light.kind));
    }
    let from_zero = |x: f64| x.is_finite() && x >= 0.0;
    let angles = match light.kind {
        2 => from_zero(light.inner) && light.inner < light.outer && light.outer <= 90.0,
        _ => (light.inner, light.outer) == (0.0, 0.0),
    };
    let numbers = light.color.iter().chain([&light.intensity, &light.range]).all(|x| from_zero(*x));
    if !numbers || !angles {
        let found = (light.color, light.intensity, light.range, light.inner, light.outer);
        return violation(Code::Light, offset_of!(Light, color), "numbers that are allowed", found);
    }
    if light.reserved != [0; 2] {
        return violation(Code::Light, offset_of!(Light, reserved), "zeros", light.reserved);
    }
    named(names, light.name, light.name_length)
}

/// BTH-F153 of a camera or light, whose name fields have the same offset.
fn named(names: &str, first: u32, length: u32) -> RowResult<()> {
    const _: () = assert!(offset_of!(Camera, name) == offset_of!(Light, name));
    if is_name(names, first, length) {
        return Ok(());
    }
    violation(Code::Name, offset_of!(Camera, name), NAME_EXPECTED, (first, length))
}
