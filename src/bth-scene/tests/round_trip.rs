//! Every scene that can be written is read back as an equal value.

use bth_scene::*;
use proptest::prelude::*;

fn name() -> impl Strategy<Value = String> {
    // Quotes, backslashes and letters beyond ASCII must survive.
    prop::collection::vec(prop::sample::select(vec!['a', '"', '\\', 'ß', ' ', '#', '\'', '字', '.']), 0..6)
        .prop_map(String::from_iter)
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>().prop_filter("finite", |x| x.is_finite()), (-100i32..100).prop_map(f64::from)]
}

fn transform() -> impl Strategy<Value = Transform> {
    let vector = || prop::array::uniform3(finite());
    let parts = (vector(), prop::array::uniform4(finite()), vector()).prop_map(|(translation, q, scale)| {
        let rotation = if q == [0.0; 4] { [0.0, 0.0, 0.0, 1.0] } else { q };
        Transform::Parts { translation, rotation, scale }
    });
    prop_oneof![parts, prop::array::uniform3(prop::array::uniform4(finite())).prop_map(Transform::Matrix)]
}

prop_compose! {
    fn scene()(
        nodes in prop::collection::vec((name(), transform(), any::<[bool; 3]>(), 0usize..100), 1..6),
        keys in prop::collection::vec((finite(), prop::collection::vec(finite(), 12)), 1..20),
        frames in (-50i32..50, 0i32..100, 0.001f64..1e6),
        lens in (0.001f64..179.9, any::<bool>(), prop::option::of(0.1f64..10.0)),
        property in 0usize..5, interpolation in 0usize..3,
    ) -> Manifest {
        let mut objects = vec![
            Object::new("model", Source::Model { path: "a b/ü.ply".into(), mesh: None }),
            Object::new("mesh", Source::Model { path: "x.glb".into(), mesh: Some(7) }),
            Object::new("file", Source::Compiled { path: "x.bth".into(), object: Some(1) }),
            Object::new("deforms", Source::Deforming { path: "x.glb".into(), mesh: 2, without: JointSet::default() }),
            Object::new("soft", Source::Deforming {
                    path: "x.glb".into(),
                    mesh: 2,
                    without: frames.1.cast_unsigned().to_le_bytes().map(u32::from).into_iter().collect(),
                }),
            Object::new("rigid", Source::RigidPart { path: "x.glb".into(), mesh: 2, joint: 255 }),
            Object::new("rests", Source::AtRest { path: "x.glb".into(), node: 3 }),
            Object::new("walk", Source::Sequence {
                    frames: SequenceFrames::Numbered("w/a_##.ply".into()),
                    timing: SequenceTiming { rate: Some(frames.2), start: -0.5 },
                }),
            Object::new("list", Source::Sequence {
                    frames: SequenceFrames::Listed((0..11).map(|i| format!("{i} \"#.obj")).collect()),
                    timing: SequenceTiming::default(),
                }),
            Object::new("cloth", Source::Cached {
                    path: "c.obj".into(),
                    mesh: lens.1.then_some(3),
                    cache: "c.pc2".into(),
                    timing: SequenceTiming { rate: None, start: frames.2 },
                }),
        ];
        let extra_share = lens.2.unwrap_or(0.0) / 10.0;
        let material = Material { color: [extra_share, 1.0, 0.1], metallic: extra_share, ..Material::default() };
        objects[0].material = lens.2.map(|_| material);
        let mut rows = Nodes::default();
        for (i, (name, transform, flags, object)) in nodes.iter().enumerate() {
            rows.push(Node {
            name: &format!("{name}{i}"),
            parent: (flags[0] && i > 0).then(|| object % i),
            transform: *transform,
            object: flags[1].then_some(object % 3),
            group: None,
            visible: flags[2],
        });
        }
        let mut nodes = rows;
        let plain = |name: &'static str, group| Node {
            name, parent: None, transform: Transform::default(), object: None, group, visible: true,
        };
        let group = nodes.len();
        nodes.push(plain("group", None));
        nodes.push(plain("shows it", Some(group)));
        let property = Property::ALL[property];
        let visible = property == Property::Visible;
        let interpolation = if visible { Interpolation::Step } else { Interpolation::ALL[interpolation] };
        let mut times: Vec<f64> = keys.iter().map(|k| k.0).collect();
        times.sort_by(f64::total_cmp);
        times.dedup_by(|a, b| a == b);
        let numbers = interpolation.values_per_key() * property.width().unwrap_or(2);
        let value = |k: &(f64, Vec<f64>)| -> Vec<f64> {
            k.1[..numbers].iter().enumerate().map(|(i, x)| match property {
                Property::Visible => f64::from(u8::from(*x > 0.0)),
                // No quaternion is zero.
                Property::Rotation if i % 4 == 3 => 1.0,
                _ => *x,
            }).collect()
        };
        let values = keys[..times.len()].iter().flat_map(value).collect();
        let (fov, perspective, extra) = lens;
        let extra_number = extra.unwrap_or(0.0);
        let moves = !matches!(property, Property::Visible | Property::Weights);
        let movable = matches!(nodes.get(0).transform, Transform::Parts { .. }) || !moves;
        let binds = [[[frames.2, 0.0, -1.5, extra_number], [0.0; 4], [fov, 1.0, 2.0, 3.0]]; 2];
        let track = Track { node: 0, property, interpolation, times, values };
        Manifest {
            frames: Frames { first: frames.0, last: frames.0 + frames.1, rate: frames.2 },
            camera: perspective.then_some(0),
            objects,
            cameras: vec![Camera {
                name: "c".into(),
                node: nodes.len() - 1,
                lens: if perspective { Lens::Perspective(fov) } else { Lens::Orthographic(fov) },
                aspect: extra,
                near: extra,
                far: extra.map(|x| 2.0 * x),
            }],
            lights: vec![
                Light { name: "a".into(), node: 0, kind: LightKind::Point, color: [fov; 3], intensity: fov, range: extra },
                Light {
                    name: "b".into(), node: 0, kind: LightKind::Spot { inner: fov / 4.0, outer: fov / 2.0 },
                    color: [0.0, 1.0, 0.5], intensity: 0.0, range: None,
                },
            ],
            skins: vec![
                Skin { name: "plain \"skin\"".into(), joints: vec![0], inverse_binds: None },
                Skin {
                    name: "bound".into(),
                    joints: vec![nodes.len() - 1, 0],
                    inverse_binds: Some(binds.to_vec()),
                },
            ],
            deformers: vec![Deformer {
                node: 0,
                object: 3,
                skin: perspective.then_some(1),
                weights: vec![fov, -1.0],
            }],
            tracks: if movable { vec![track] } else { Vec::new() },
            nodes,
        }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_back_equal(scene in scene()) {
        let text = scene.to_toml();
        let read = parse(&text, "x".as_ref()).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        prop_assert_eq!(read, scene);
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "[\\[\\]{}=\"a-e0-9.,\\n #version]{0,80}") {
        let _ = parse(&text, "x".as_ref());
        let _ = parse(&format!("version = 1\n{text}"), "x".as_ref());
    }
}
