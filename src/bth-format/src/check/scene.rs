//! The check of the scene sections: O(their bytes).

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::scene_view::SceneView;
use std::fmt::Debug;
use std::mem::offset_of;

/// Frames lie within this of 0.
const FRAME_LIMIT: i32 = 1 << 24;

/// Checks the scene sections of a file with so many objects.
///
/// # Errors
/// The first violation of `BTH-F150` to `BTH-F159`, with an offset from the start of its section.
pub fn scene(view: &SceneView<'_>, objects: u32) -> Result<()> {
    header(view)?;
    rows(kind::NODES, view.nodes, |row, node| self::node(view, row, node))?;
    rows(kind::INSTANCES, view.instances, |_, instance| self::instance(view, instance, objects))?;
    tracks(view)?;
    rows(kind::CAMERAS, view.cameras, |_, camera| self::camera(view, camera))?;
    rows(kind::LIGHTS, view.lights, |_, light| self::light(view, light))
}

/// What a row violates: the code, the byte of the row, what is expected and what was found.
type Violation = (Code, usize, &'static str, String);

fn violation(
    code: Code,
    offset: usize,
    expected: &'static str,
    found: impl Debug,
) -> std::result::Result<(), Violation> {
    Err((code, offset, expected, format!("{found:?}")))
}

fn rows<T>(
    kind: u32,
    rows: &[T],
    check: impl Fn(usize, &T) -> std::result::Result<(), Violation>,
) -> Result<()> {
    for (i, row) in rows.iter().enumerate() {
        check(i, row).map_err(|(code, offset, expected, found)| {
            let offset = i * size_of::<T>() + offset;
            Error::within_file(code, kind, offset as u64, expected, format!("{found} in row {i}"))
        })?;
    }
    Ok(())
}

fn header(view: &SceneView<'_>) -> Result<()> {
    let [scene] = view.scene else {
        let found = format!("{} rows of SCENE", view.scene.len());
        return Err(Error::within_file(Code::Scene, kind::SCENE, 0, "one row of SCENE", found));
    };
    rows(kind::SCENE, std::slice::from_ref(scene), |_, s| {
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

fn node(view: &SceneView<'_>, row: usize, node: &Node) -> std::result::Result<(), Violation> {
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
    if !t.iter().all(|x| x.is_finite()) || parts && (is_zero(&t[3..7]) || !is_zero(&t[10..])) {
        return violation(Code::NodeTransform, 0, "a finite transform with a quaternion that is not zero", t);
    }
    if !view.is_name(node.name, node.name_length) {
        let found = (node.name, node.name_length);
        return violation(
            Code::Name,
            offset_of!(Node, name),
            "a name of at most 4096 bytes within NAMES",
            found,
        );
    }
    Ok(())
}

fn is_zero(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| *x == 0.0)
}

fn instance(view: &SceneView<'_>, instance: &Instance, objects: u32) -> std::result::Result<(), Violation> {
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

fn tracks(view: &SceneView<'_>) -> Result<()> {
    let (mut times, mut values) = (0u64, 0u64);
    let mut before = None;
    for (i, track) in view.tracks.iter().enumerate() {
        let at = |offset: usize| (i * size_of::<Track>() + offset) as u64;
        let fail = |code, offset, expected: &str, found: String| {
            Err(Error::within_file(code, kind::TRACKS, at(offset), expected, format!("{found} in row {i}")))
        };
        let width = match known(view, track) {
            Err((code, offset, expected, found)) => return fail(code, offset, expected, found),
            Ok((property, interpolation)) => property.width() * interpolation.values_per_key(),
        };
        if before >= Some((track.node, track.property)) {
            let found = format!("{:?} behind {before:?}", (track.node, track.property));
            return fail(Code::Track, 0, "ascending nodes and properties", found);
        }
        before = Some((track.node, track.property));
        if track.keys == 0 || (u64::from(track.first_time), u64::from(track.first_value)) != (times, values) {
            let found = format!("{} keys at {} and {}", track.keys, track.first_time, track.first_value);
            return fail(Code::TrackRanges, offset_of!(Track, keys), "ranges behind those before", found);
        }
        times += u64::from(track.keys);
        values += u64::from(track.keys) * width as u64;
        if times > view.times.len() as u64 || values > view.values.len() as u64 {
            let found = format!("{} keys", track.keys);
            return fail(Code::TrackRanges, offset_of!(Track, keys), "ranges within TIMES and VALUES", found);
        }
        keys(view, track, width)?;
    }
    for (kind, found, rows) in
        [(kind::TIMES, times, view.times.len()), (kind::VALUES, values, view.values.len())]
    {
        if found != rows as u64 {
            let expected = format!("{found} rows, as the tracks have");
            return Err(Error::within_file(Code::TrackRanges, kind, 8 * found, expected, rows.to_string()));
        }
    }
    Ok(())
}

fn known(view: &SceneView<'_>, track: &Track) -> std::result::Result<(Property, Interpolation), Violation> {
    let fail = |offset: usize, expected, found: u32| Err((Code::Track, offset, expected, found.to_string()));
    let Some(node) = view.nodes.get(track.node as usize) else {
        return fail(offset_of!(Track, node), "a row of NODES", track.node);
    };
    let Some(property) = Property::from_code(track.property) else {
        return fail(offset_of!(Track, property), "a known property", track.property);
    };
    if node.flags & NODE_MATRIX != 0 && property != Property::Visible {
        return fail(offset_of!(Track, property), "visibility, of a node with a matrix", track.property);
    }
    let interpolation = Interpolation::from_code(track.interpolation);
    match interpolation.filter(|i| property != Property::Visible || *i == Interpolation::Step) {
        None => fail(offset_of!(Track, interpolation), "an interpolation that fits", track.interpolation),
        Some(_) if track.reserved != [0; 2] => {
            fail(offset_of!(Track, reserved), "zeros", track.reserved[0] | track.reserved[1])
        }
        Some(interpolation) => Ok((property, interpolation)),
    }
}

/// Checks the keys of a track whose ranges are right.
fn keys(view: &SceneView<'_>, track: &Track, width: usize) -> Result<()> {
    let (times, values) = view.keys(track, width);
    let ascending = |i: usize| times[i].is_finite() && (i == 0 || times[i - 1] < times[i]);
    if let Some(i) = (0..times.len()).find(|i| !ascending(*i)) {
        let at = 8 * (u64::from(track.first_time) + i as u64);
        let found = format!("{}", times[i]);
        return Err(Error::within_file(Code::TrackKeys, kind::TIMES, at, "finite ascending times", found));
    }
    let fits = |key: &[f64]| {
        let value = if width == 12 { &key[4..8] } else { key };
        match Property::from_code(track.property) {
            Some(Property::Rotation) => !is_zero(value),
            Some(Property::Visible) => value[0] == 0.0 || value[0] == 1.0,
            _ => true,
        }
    };
    for (i, key) in values.chunks_exact(width).enumerate() {
        if !key.iter().all(|x| x.is_finite()) || !fits(key) {
            let at = 8 * (u64::from(track.first_value) + (i * width) as u64);
            let found = format!("{key:?}");
            return Err(Error::within_file(
                Code::TrackKeys,
                kind::VALUES,
                at,
                "a value of the property",
                found,
            ));
        }
    }
    Ok(())
}

fn camera(view: &SceneView<'_>, camera: &Camera) -> std::result::Result<(), Violation> {
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
    named(view, camera.name, camera.name_length)
}

fn light(view: &SceneView<'_>, light: &Light) -> std::result::Result<(), Violation> {
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
    named(view, light.name, light.name_length)
}

/// Checks a name, whose fields are at the same offset in all rows but those of nodes.
fn named(view: &SceneView<'_>, first: u32, length: u32) -> std::result::Result<(), Violation> {
    const _: () = assert!(offset_of!(Camera, name) == offset_of!(Light, name));
    if view.is_name(first, length) {
        return Ok(());
    }
    violation(
        Code::Name,
        offset_of!(Camera, name),
        "a name of at most 4096 bytes within NAMES",
        (first, length),
    )
}
