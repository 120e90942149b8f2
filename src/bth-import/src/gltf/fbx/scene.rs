//! Nodes, cameras and lights of an FBX file, and what is dropped.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use serde_json::{Value, json};
use ufbx::{Camera, Light, LightType, Mesh, Node, ProjectionMode, Scene, Vec2, Vec3};

use crate::error::Result;
use crate::gltf::extensions::{Use, VISIBILITY};
use crate::gltf::fbx::load::{EXPORT, load};
use crate::gltf::fbx::{material, mesh, motion};
use crate::gltf::made::Made;
use crate::gltf::schema::{Extensions, GltfNode, GltfScene};
use crate::mesh::Polygons;
use crate::source::{NON_FINITE, Source};

/// Of files before this version the library does not know which nodes are visible.
const FIRST_WITH_VISIBILITY: u32 = 6000;
const LIGHTS: &str = "KHR_lights_punctual";

/// Makes a glTF document of a file, in metres and with y up.
pub(super) fn document(source: &Source<'_>, used: Use, polygons: Polygons) -> Result<Made> {
    let scene = load(source)?;
    let mut made = Made::default();
    made.document.asset.space = Some(space(&scene));
    material::materials(&scene, &mut made);
    nodes(source, &scene, polygons, &mut made)?;
    motion::animations(source, &scene, used, &mut made)?;
    if used != Use::Parts {
        warn(source, &scene);
    }
    Ok(made)
}

/// Says in which units and axes a file is, and what became of them.
fn space(scene: &Scene) -> String {
    let setting = |name: &str, default| {
        ufbx::find_prop(&scene.settings.props, name).map_or(default, |property| property.value_int)
    };
    let up = usize::try_from(setting("UpAxis", 1)).ok().and_then(|axis| ["x", "y", "z"].get(axis).copied());
    let sign = if setting("UpAxisSign", 1) < 0 { "-" } else { "" };
    // The scale is what makes metres of the units.
    let unit = scene.metadata.root_scale as f32;
    format!("units of {unit} m, {sign}{} up; read as metres with y up", up.unwrap_or("an unknown axis"))
}

/// Adds the nodes, with the numbers that the library gives them, and what is at them.
fn nodes(source: &Source<'_>, scene: &Scene, polygons: Polygons, made: &mut Made) -> Result<()> {
    let shapes = mesh::shapes(source, scene, polygons, made)?;
    let (mut meshes, mut lights) = (HashMap::new(), Vec::<Value>::new());
    let (mut nodes, mut inner) = (Vec::with_capacity(scene.nodes.count), Vec::new());
    for node in &scene.nodes {
        let mut new = place(source, node, scene.metadata.version < FIRST_WITH_VISIBILITY)?;
        if let Some(mesh) = node.mesh.as_deref() {
            // The node of a geometric transform has the mesh of its parent, not the materials.
            let holder = node.parent.as_deref().filter(|_| node.is_geometry_transform_helper).unwrap_or(node);
            let (id, materials) = (mesh.element.typed_id, &holder.materials);
            let key = (id, materials.iter().map(|material| material.element.typed_id).collect::<Vec<_>>());
            let shape = &shapes[id as usize];
            let number = Some(*meshes.entry(key).or_insert_with(|| {
                made.document.meshes.push(shape.mesh(mesh, materials));
                made.document.meshes.len() - 1
            }));
            new.skin = mesh::skin(mesh, node, made);
            if shape.center.is_some() {
                new.children.push(scene.nodes.count + inner.len());
                let (name, translation) = (format!("{}/mesh", new.name), shape.center.map(Box::new));
                inner.push(GltfNode { name, translation, mesh: number, ..GltfNode::default() });
            } else {
                new.mesh = number;
            }
        }
        if let Some(camera) = node.camera.as_deref().and_then(self::camera) {
            new.camera = Some(made.document.cameras.len());
            made.document.cameras.push(camera);
        }
        if let Some(light) = node.light.as_deref().and_then(self::light) {
            new.extensions.insert(LIGHTS.to_owned(), json!({"light": lights.len()}));
            lights.push(light);
        }
        nodes.push(new);
    }
    nodes.append(&mut inner);
    made.document.nodes = nodes;
    made.document.extensions.insert(LIGHTS.to_owned(), json!({"lights": lights}));
    let roots = vec![scene.root_node.element.typed_id as usize];
    made.document.scenes.push(GltfScene { name: String::new(), nodes: roots });
    Ok(())
}

/// A node with its place and children.
fn place(source: &Source<'_>, node: &Node, is_old: bool) -> Result<GltfNode> {
    let own = node.element.name.to_string();
    let parent = || node.parent.as_deref().map_or(String::new(), |parent| parent.element.name.to_string());
    let name = match node {
        _ if node.is_root => "root".to_owned(),
        _ if node.is_geometry_transform_helper => format!("{}/geometry", parent()),
        _ if node.is_scale_helper => format!("{}/scale", parent()),
        _ => own,
    };
    let ufbx::Transform { translation: t, rotation: r, scale: s } = &node.local_transform;
    let [x, y, z, a, b, c, d] = [t.x, t.y, t.z, r.x, r.y, r.z, r.w].map(steady);
    let numbers = [x, y, z, a, b, c, d, s.x, s.y, s.z];
    if !numbers.iter().all(|x| x.is_finite()) {
        let message = format!("expected a finite transform, found {numbers:?}");
        return Err(source.error_in_part(NON_FINITE, format!("node \"{name}\""), message, EXPORT));
    }
    let [tx, ty, tz, rx, ry, rz, rw, sx, sy, sz] = numbers;
    let mut extensions = Extensions::new();
    if !node.visible && !is_old {
        extensions.insert(VISIBILITY.to_owned(), json!({"visible": false}));
    }
    Ok(GltfNode {
        name,
        children: node.children.iter().map(|child| child.element.typed_id as usize).collect(),
        translation: Some([tx, ty, tz].into()),
        rotation: Some([rx, ry, rz, rw].into()),
        scale: Some([sx, sy, sz].into()),
        extensions,
        ..GltfNode::default()
    })
}

/// A number of 37 bits. The system's library computes the sines of rotations. Their last bits
/// differ between machines, and files do not depend on them.
fn steady(x: f64) -> f64 {
    const DROPPED: u64 = 1 << 16;
    f64::from_bits(x.to_bits().wrapping_add(DROPPED / 2) & !(DROPPED - 1))
}

/// A camera, unless its lens has no size. Cut planes count where they can be.
fn camera(camera: &Camera) -> Option<Value> {
    let is_good = |x: f64| x.is_finite() && x > 0.0;
    let znear = Some(camera.near_plane).filter(|x| is_good(*x)).unwrap_or(0.0);
    let zfar = Some(camera.far_plane).filter(|far| far.is_finite() && *far > znear);
    let (name, aspect) = (&*camera.element.name, Some(steady(camera.aspect_ratio)).filter(|x| is_good(*x)));
    let Vec2 { x: width, y: height } = camera.orthographic_size;
    if camera.projection_mode == ProjectionMode::Orthographic {
        let zfar = zfar.unwrap_or(2.0 * znear + 1.0);
        let lens = json!({"xmag": width / 2.0, "ymag": height / 2.0, "znear": znear, "zfar": zfar});
        return (is_good(width) && is_good(height)).then(|| json!({"name": name, "orthographic": lens}));
    }
    let angle = camera.field_of_view_deg.y;
    let lens = json!({
        "yfov": steady(angle.to_radians()), "aspectRatio": aspect, "znear": znear, "zfar": zfar,
    });
    (is_good(angle) && angle < 180.0).then(|| json!({"name": name, "perspective": lens}))
}

/// A point, directional or spot light. A lamp of FBX has no unit: glTF gets the same number.
fn light(light: &Light) -> Option<Value> {
    let kind = match light.type_ {
        LightType::Point => "point",
        LightType::Directional => "directional",
        LightType::Spot => "spot",
        LightType::Area | LightType::Volume => return None,
    };
    let Vec3 { x, y, z } = light.color;
    let intensity = if light.cast_light { light.intensity.max(0.0) } else { 0.0 };
    let outer = steady(light.outer_angle.to_radians() / 2.0).clamp(0.0, FRAC_PI_2);
    let inner = steady(light.inner_angle.to_radians() / 2.0).clamp(0.0, outer);
    let color = [x, y, z].map(|part| part.max(0.0));
    let mut value =
        json!({"name": &*light.element.name, "type": kind, "color": color, "intensity": intensity});
    if kind == "spot" && outer > 0.0 {
        value["spot"] = json!({"innerConeAngle": inner, "outerConeAngle": outer});
    }
    Some(value)
}

/// Warns of what is dropped, and of what the library repaired.
fn warn(source: &Source<'_>, scene: &Scene) {
    let large = |light: &Light| matches!(light.type_, LightType::Area | LightType::Volume);
    let many = |counts: &dyn Fn(&Mesh) -> usize| scene.meshes.iter().map(|mesh| counts(mesh)).sum::<usize>();
    let finer =
        |mesh: &Mesh| usize::from(mesh.subdivision_render_levels.max(mesh.subdivision_preview_levels) > 0);
    for (count, what) in [
        (scene.nurbs_curves.count + scene.line_curves.count, "curves are left out"),
        (scene.nurbs_surfaces.count, "NURBS surfaces are left out"),
        (scene.procedural_geometries.count, "procedural geometries are left out"),
        (scene.lights.iter().filter(|light| large(light)).count(), "area and volume lights are left out"),
        (
            scene.cameras.iter().filter(|c| self::camera(c).is_none()).count(),
            "cameras without a lens are left out",
        ),
        (scene.cache_deformers.count, "vertex caches are left out: their meshes are at rest"),
        (scene.constraints.count, "constraints have an effect only where they are baked into keys"),
        (many(&|mesh| mesh.skin_deformers.count.saturating_sub(1)), "second skins of meshes are left out"),
        (
            scene.skin_deformers.iter().filter(|skin| skin.num_dq_weights > 0).count(),
            "skins move linearly, not by dual quaternions",
        ),
        (many(&|mesh| mesh::between(mesh).count()), "shapes between others are left out"),
        (
            many(&|mesh| mesh.uv_sets.count.saturating_sub(1)),
            "further sets of texture coordinates are left out",
        ),
        (many(&finer), "subdivision surfaces are read as their cages"),
    ] {
        if count > 0 {
            source.monitor.warn(&format!("{count} {what}"));
        }
    }
    for warning in &scene.metadata.warnings {
        let (text, count) = (&warning.description, warning.count);
        source.monitor.warn(&format!("the file has defects that were repaired: {text} ({count} times)"));
    }
}
