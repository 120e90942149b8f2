//! Files with scene sections: valid ones, and those that break one rule each.

use super::valid::{CORNERS, indexed, lines, one_triangle};
use super::{Case, Editor, Seal};
use bth_compile::write::{DeformerParts, FileBuilder, ObjectParts, SceneParts, object, scene};
use bth_format::layout::*;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// A quaternion other than the identity.
const TURN: [f64; 4] = [0.0, 0.6, 0.0, 0.8];

fn parts(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> [f64; 12] {
    let mut transform = [0.0; 12];
    transform[..3].copy_from_slice(&translation);
    transform[3..7].copy_from_slice(&rotation);
    transform[7..10].copy_from_slice(&scale);
    transform
}

fn node(transform: [f64; 12], parent: u32, flags: u32, name: (u32, u32)) -> Node {
    Node { transform, parent, flags, name: name.0, name_length: name.1, reserved: [0; 4] }
}

pub(super) fn still() -> SceneParts {
    let identity = parts([0.0; 3], [0.0, 0.0, 0.0, 1.0], [1.0; 3]);
    SceneParts {
        scene: Scene { rate: 24.0, first_frame: 0, last_frame: 0, camera: NONE, reserved: [0; 11] },
        nodes: vec![node(identity, NONE, 0, (0, 0))],
        instances: vec![Instance { node: 0, object: 0, flags: 0, first: 0 }],
        tracks: Vec::new(),
        times: Vec::new(),
        values: Vec::new(),
        cameras: Vec::new(),
        lights: Vec::new(),
        names: Vec::new(),
        deformers: DeformerParts::default(),
    }
}

/// Names: bytes 0..4 `base`, 4..9 `mov\u{fc}`, 9..12 `eye`.
fn moving() -> SceneParts {
    let matrix = [1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.5, 0.0, 0.0, 0.0, -2.0, 0.0];
    let mut parts = SceneParts {
        scene: Scene { rate: 30.0, first_frame: -3, last_frame: 60, camera: 1, reserved: [0; 11] },
        nodes: vec![
            node(matrix, NONE, NODE_MATRIX, (0, 4)),
            node(parts([1.0, 2.0, 3.0], TURN, [1.0, 1.0, -0.5]), 0, 0, (4, 5)),
            node(parts([0.0, 0.0, 9.0], TURN, [1.0; 3]), NONE, NODE_HIDDEN, (9, 3)),
        ],
        instances: [(1, 1, 0), (0, 0, 1), (1, 0, 2)]
            .map(|(node, object, first)| Instance { node, object, flags: 0, first })
            .to_vec(),
        ..still()
    };
    let mut track =
        |node, property: Property, interpolation: Interpolation, times: &[f64], values: &[f64]| {
            parts.tracks.push(Track {
                node,
                property: property as u32,
                interpolation: interpolation as u32,
                keys: times.len() as u32,
                first_time: parts.times.len() as u32,
                first_value: parts.values.len() as u32,
                reserved: [0; 2],
            });
            parts.times.extend(times);
            parts.values.extend(values);
        };
    track(0, Property::Visible, Interpolation::Step, &[0.0, 1.0], &[0.0, 1.0]);
    track(1, Property::Translation, Interpolation::Linear, &[-1.0, 2.0], &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    let spline = [[0.0; 4], TURN, [0.0, 0.1, 0.0, 0.0]].concat();
    track(1, Property::Rotation, Interpolation::Cubic, &[0.5], &spline);
    track(1, Property::Scale, Interpolation::Step, &[0.0], &[1.0, 0.0, 1.0]);
    let camera = Camera {
        node: 2,
        projection: 0,
        name: 9,
        name_length: 3,
        size: 40.0,
        aspect: 1.5,
        near: 0.1,
        far: 100.0,
        reserved: [0; 4],
    };
    let wide = Camera { projection: 1, size: 400.0, aspect: 0.0, near: 0.0, far: 0.0, ..camera };
    parts.cameras = vec![camera, wide];
    let sun = Light {
        node: 1,
        kind: 0,
        name: 0,
        name_length: 0,
        color: [1.0, 0.5, 0.0],
        intensity: 3.0,
        range: 0.0,
        inner: 0.0,
        outer: 0.0,
        reserved: [0; 2],
    };
    let spot = Light { kind: 2, range: 8.0, inner: 10.0, outer: 90.0, ..sun };
    parts.lights = vec![sun, spot];
    parts.names = b"basemov\xc3\xbceye".to_vec();
    parts
}

fn of_group(node: u32, group: u32, first: u32) -> Instance {
    Instance { node, object: group, flags: INSTANCE_OF_GROUP, first }
}

/// Two instances in a group, that group and an object in another, and both groups in the world.
/// Written out they are nine instances.
pub(super) fn groups() -> SceneParts {
    let at = |x: f64, rotation: [f64; 4], scale: f64| parts([x, 0.0, 0.0], rotation, [scale, 1.0, scale]);
    let of_object = |node, object, first| Instance { node, object, flags: 0, first };
    let moved = moving();
    let mut track = moved.tracks[1];
    (track.first_time, track.first_value) = (0, 0);
    let camera = Camera { node: 4, ..moved.cameras[0] };
    SceneParts {
        nodes: vec![
            node(at(0.0, TURN, 1.0), NONE, NODE_GROUP, (0, 4)),
            node(at(2.0, TURN, -0.5), 0, 0, (0, 0)),
            node(at(1.0, TURN, 2.0), NONE, NODE_GROUP, (4, 5)),
            node(at(3.0, TURN, 1.0), NONE, 0, (0, 0)),
            node(at(-5.0, TURN, 0.25), 3, 0, (0, 0)),
        ],
        instances: vec![
            of_object(0, 0, 0),
            of_object(1, 1, 1),
            of_group(2, 0, 0),
            of_object(2, 1, 2),
            of_group(3, 2, 0),
            of_group(4, 0, 3),
            of_object(4, 0, 5),
            of_group(4, 2, 6),
        ],
        tracks: vec![track],
        times: moved.times[2..4].to_vec(),
        values: moved.values[2..8].to_vec(),
        cameras: vec![Camera { name: 9, ..camera }],
        lights: vec![Light { node: 3, ..moved.lights[0] }],
        names: moved.names,
        ..still()
    }
}

/// Files whose groups break F188.
fn no_groups() -> Vec<Case> {
    let case = |name: &str, change: fn(&mut SceneParts)| {
        let mut parts = groups();
        change(&mut parts);
        Case::new(name, file(2, &parts))
    };
    vec![
        case("F188-order", |parts| parts.instances.swap(0, 3)),
        case("F188-itself", |parts| parts.instances[2].object = 2),
        case("F188-later-group", |parts| parts.instances[1] = of_group(1, 2, 1)),
        case("F188-camera", |parts| parts.cameras[0].node = 1),
        case("F188-light", |parts| parts.lights[0].node = 2),
        case("F188-levels", |parts| {
            parts.nodes = vec![parts.nodes[2]; 16];
            parts.nodes.push(Node { flags: 0, ..parts.nodes[0] });
            let shown = (1..17).map(|node| of_group(node, node - 1, 0));
            parts.instances = std::iter::once(parts.instances[0]).chain(shown).collect();
            (parts.tracks, parts.times, parts.values) = (Vec::new(), Vec::new(), Vec::new());
            (parts.cameras, parts.lights) = (Vec::new(), Vec::new());
        }),
        case("F188-too-many", |parts| {
            parts.nodes = vec![parts.nodes[2]; 12];
            let four = |node: u32| (0..8).map(move |_| of_group(node, node - 1, 0));
            parts.instances = std::iter::once(parts.instances[0]).chain((1..12).flat_map(four)).collect();
            (parts.tracks, parts.times, parts.values) = (Vec::new(), Vec::new(), Vec::new());
            (parts.cameras, parts.lights) = (Vec::new(), Vec::new());
        }),
    ]
}

/// A file with a number of equal objects and a scene.
fn file(objects: u32, scene_parts: &SceneParts) -> Vec<u8> {
    builder_of(objects, scene_parts).finish()
}

/// The same, to which sections can be added.
pub(super) fn builder_of(objects: u32, scene_parts: &SceneParts) -> FileBuilder<'_> {
    let lines = lines(indexed(&[CORNERS], 0).as_bytes());
    let parts = one_triangle(&lines);
    let mut builder = FileBuilder::new();
    (0..objects).for_each(|i| object(&mut builder, i, &parts).expect("the parts fit together"));
    let mut builder = builder.into_static();
    scene(&mut builder, scene_parts).expect("each section once");
    builder
}

/// The valid files.
pub(super) fn valid() -> Vec<Case> {
    let empty = SceneParts { nodes: Vec::new(), instances: Vec::new(), ..still() };
    vec![
        Case::new("scene-empty", file(0, &empty)),
        Case::new("scene-still", file(1, &still())),
        Case::new("scene-moving", file(2, &moving())),
        Case::new("scene-groups", file(2, &groups())),
    ]
}

/// The moving scene with bytes changed at an offset of a section of the whole file.
fn changed(name: &str, kind: u32, at: usize, value: &[u8]) -> Case {
    let mut editor = Editor::new(&file(2, &moving()));
    let entry = editor.entry_at(NONE, kind) + offset_of!(SectionEntry, offset);
    let start = u64::from_le_bytes(editor.bytes[entry..entry + 8].try_into().unwrap()) as usize;
    editor.put(start + at, value);
    Case::new(name, editor.seal(Seal::Sections))
}

fn word(name: &str, kind: u32, at: usize, value: u32) -> Case {
    changed(name, kind, at, &value.to_le_bytes())
}

fn number(name: &str, kind: u32, at: usize, value: f64) -> Case {
    changed(name, kind, at, &value.to_le_bytes())
}

/// Files that break one rule each.
pub(super) fn invalid() -> Vec<Case> {
    let mut cases = container();
    cases.extend(nodes());
    cases.extend(no_groups());
    cases.extend(tracks());
    cases.extend(cameras_and_lights());
    cases
}

fn container() -> Vec<Case> {
    let alone = |kind, stride, bytes: Vec<u8>| {
        let mut builder = FileBuilder::new();
        builder.section(kind, NONE, stride, bytes).unwrap();
        builder.finish()
    };
    let of_object = {
        let lines = lines(indexed(&[CORNERS], 0).as_bytes());
        let parts = ObjectParts { root: NONE, lines: &[], ..ObjectParts::default() };
        let mut builder = FileBuilder::new();
        object(&mut builder, 0, &parts).unwrap();
        builder.section(kind::NAMES, 0, 1, lines[0].as_bytes().to_vec()).unwrap();
        builder.finish()
    };
    let scene = still().scene;
    vec![
        Case::new("F017-scene-of-an-object", of_object),
        Case::new("F150-names-alone", alone(kind::NAMES, 1, b"x".to_vec())),
        Case::new("F150-two-scenes", alone(kind::SCENE, 64, [scene, scene].as_bytes().to_vec())),
        Case::new("F150-no-row", alone(kind::SCENE, 64, Vec::new())),
        number("F150-rate", kind::SCENE, 0, 0.0),
        number("F150-endless-rate", kind::SCENE, 0, f64::INFINITY),
        word("F150-frames", kind::SCENE, offset_of!(Scene, first_frame), 61),
        word("F150-far-frame", kind::SCENE, offset_of!(Scene, last_frame), (1 << 24) + 1),
        word("F150-camera", kind::SCENE, offset_of!(Scene, camera), 2),
        word("F150-reserved", kind::SCENE, 60, 1),
    ]
}

fn nodes() -> Vec<Case> {
    let second = size_of::<Node>();
    vec![
        word("F151-itself", kind::NODES, second + offset_of!(Node, parent), 1),
        word("F151-later-parent", kind::NODES, offset_of!(Node, parent), 2),
        word("F151-flags", kind::NODES, offset_of!(Node, flags), 8),
        word("F151-parent-of-group", kind::NODES, second + offset_of!(Node, flags), NODE_GROUP),
        word("F151-reserved", kind::NODES, offset_of!(Node, reserved), 1),
        number("F152-infinite", kind::NODES, 0, f64::INFINITY),
        changed("F152-no-rotation", kind::NODES, second + 24, &[0; 32]),
        number("F152-behind-the-scale", kind::NODES, second + 88, 1.0),
        word("F153-beyond-the-end", kind::NODES, offset_of!(Node, name_length), 13),
        word("F153-within-a-character", kind::NODES, second + offset_of!(Node, name_length), 4),
        word("F153-overflow", kind::CAMERAS, offset_of!(Camera, name), u32::MAX),
        word("F153-light", kind::LIGHTS, offset_of!(Light, name_length), 100),
        word("F154-node", kind::INSTANCES, 0, 3),
        word("F154-object", kind::INSTANCES, 4, 2),
        word("F154-flags", kind::INSTANCES, 8, 2),
        word("F154-no-group", kind::INSTANCES, 8, INSTANCE_OF_GROUP),
        word("F154-number", kind::INSTANCES, 12, 1),
    ]
}

fn tracks() -> Vec<Case> {
    let row = size_of::<Track>();
    let (first_time, first_value) = (offset_of!(Track, first_time), offset_of!(Track, first_value));
    let trailing = |name, change: fn(&mut SceneParts)| {
        let mut parts = moving();
        change(&mut parts);
        Case::new(name, file(2, &parts))
    };
    vec![
        word("F155-node", kind::TRACKS, 3 * row, 3),
        word("F155-property", kind::TRACKS, 3 * row + 4, 5),
        word("F155-interpolation", kind::TRACKS, 3 * row + 8, 3),
        word("F155-twice", kind::TRACKS, 3 * row + 4, Property::Rotation as u32),
        word("F155-fading", kind::TRACKS, 8, Interpolation::Linear as u32),
        word("F155-matrix", kind::TRACKS, 4, Property::Scale as u32),
        word("F155-reserved", kind::TRACKS, 24, 1),
        word("F156-no-keys", kind::TRACKS, 3 * row + offset_of!(Track, keys), 0),
        word("F156-hole", kind::TRACKS, row + first_time, 3),
        word("F156-overlap", kind::TRACKS, row + first_value, 1),
        word("F156-beyond-the-end", kind::TRACKS, 3 * row + offset_of!(Track, keys), 2),
        trailing("F156-times-left", |parts| parts.times.push(9.0)),
        trailing("F156-values-left", |parts| parts.values.push(9.0)),
        number("F157-time-twice", kind::TIMES, 8, 0.0),
        number("F157-no-time", kind::TIMES, 16, f64::NAN),
        number("F157-half-visible", kind::VALUES, 0, 0.5),
        number("F157-infinite", kind::VALUES, 16, f64::NEG_INFINITY),
        changed("F157-no-rotation", kind::VALUES, 8 * 12, &[0; 32]),
    ]
}

fn cameras_and_lights() -> Vec<Case> {
    let (camera, light) = (size_of::<Camera>(), size_of::<Light>());
    vec![
        word("F158-node", kind::CAMERAS, 0, 3),
        word("F158-projection", kind::CAMERAS, 4, 2),
        number("F158-field-of-view", kind::CAMERAS, offset_of!(Camera, size), 180.0),
        number("F158-height", kind::CAMERAS, camera + offset_of!(Camera, size), f64::INFINITY),
        number("F158-aspect", kind::CAMERAS, offset_of!(Camera, aspect), -1.0),
        number("F158-near", kind::CAMERAS, camera + offset_of!(Camera, near), -1.0),
        number("F158-far", kind::CAMERAS, offset_of!(Camera, far), 0.1),
        word("F158-reserved", kind::CAMERAS, offset_of!(Camera, reserved), 1),
        word("F159-node", kind::LIGHTS, 0, 3),
        word("F159-kind", kind::LIGHTS, 4, 3),
        number("F159-color", kind::LIGHTS, offset_of!(Light, color), -0.5),
        number("F159-intensity", kind::LIGHTS, offset_of!(Light, intensity), f64::NAN),
        number("F159-range", kind::LIGHTS, offset_of!(Light, range), -1.0),
        number("F159-sun-with-an-angle", kind::LIGHTS, offset_of!(Light, outer), 45.0),
        number("F159-inner", kind::LIGHTS, light + offset_of!(Light, inner), 90.0),
        number("F159-outer", kind::LIGHTS, light + offset_of!(Light, outer), 91.0),
        word("F159-reserved", kind::LIGHTS, offset_of!(Light, reserved), 1),
    ]
}
