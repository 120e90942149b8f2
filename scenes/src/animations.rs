//! Animated scenes: manifests, and the models that they refer to. The first three are modelled on
//! the animations of the BTH paper.

use crate::math::sin_cos;
use crate::{Model, blob, gyroid, hairball, knot, sheet};
use bth_random::Rng;
use bth_scene::{
    Camera, Frames, Interpolation, Lens, Light, LightKind, Manifest, Node, Object, Property, SequenceFrames,
    SequenceTiming, Source, Track, Transform,
};
use glam::DVec3;

/// An animated scene that can be made by name.
#[derive(Clone, Copy, Debug)]
pub struct Animation {
    /// Name, as on the command line.
    pub name: &'static str,
    /// What it shows.
    pub about: &'static str,
    /// Makes it.
    pub make: fn() -> Scene,
}

/// A scene and its models.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The manifest.
    pub manifest: Manifest,
    /// Path of each model, relative to the manifest, and the model.
    pub models: Vec<(String, Model)>,
}

/// All scenes.
pub const ANIMATIONS: [Animation; 5] = [
    Animation { name: "turning", about: "one model of 100,000 faces that turns once", make: turning },
    Animation { name: "swarm", about: "101 objects in random motion", make: swarm },
    Animation { name: "falling", about: "100 hairballs that fall and tumble onto a floor", make: falling },
    Animation {
        name: "carousel",
        about: "hierarchy, instances, a lamp and a camera that move; small",
        make: carousel,
    },
    Animation { name: "scroll", about: "a sheet that rolls up, as one file for each frame", make: scroll },
];

/// The scene of that name.
pub fn find(name: &str) -> Option<&'static Animation> {
    ANIMATIONS.iter().find(|a| a.name == name)
}

/// Builds a manifest node by node.
#[derive(Default)]
struct Builder {
    manifest: Manifest,
}

fn parts(translation: [f64; 3], scale: f64) -> Transform {
    Transform::Parts { translation, rotation: [0.0, 0.0, 0.0, 1.0], scale: [scale; 3] }
}

impl Builder {
    fn new(last: i32, rate: f64) -> Self {
        let frames = Frames { first: 0, last, rate };
        Self { manifest: Manifest { frames, ..Manifest::default() } }
    }

    fn object(&mut self, name: &str, path: &str) -> usize {
        let source = Source::Model { path: path.to_owned(), mesh: None };
        self.manifest.objects.push(Object::new(name, source));
        self.manifest.objects.len() - 1
    }

    fn node(
        &mut self,
        name: String,
        parent: Option<usize>,
        object: Option<usize>,
        transform: Transform,
    ) -> usize {
        self.manifest.nodes.push(Node { name: &name, parent, transform, object, group: None, visible: true })
    }

    fn track(&mut self, node: usize, property: Property, keys: impl IntoIterator<Item = (f64, Vec<f64>)>) {
        let (times, values): (Vec<f64>, Vec<Vec<f64>>) = keys.into_iter().unzip();
        let values = values.concat();
        self.manifest.tracks.push(Track {
            node,
            property,
            interpolation: Interpolation::Linear,
            times,
            values,
        });
    }

    /// Adds a track that rotates a node about an axis, `turns` times within `seconds`.
    fn turn(&mut self, node: usize, axis: [f64; 3], turns: f64, seconds: f64) {
        // Interpolation between two keys takes the shorter rotation, so keys are at most a third of
        // a turn apart.
        let count = (turns.abs() * 3.0).ceil().max(1.0) as u32;
        let key = |i: u32| {
            let part = f64::from(i) / f64::from(count);
            (part * seconds, quaternion(axis, part * turns).to_vec())
        };
        self.track(node, Property::Rotation, (0..=count).map(key));
    }

    fn camera(&mut self, name: &str, node: usize, fov: f64) {
        let lens = Lens::Perspective(fov);
        self.manifest.cameras.push(Camera {
            name: name.to_owned(),
            node,
            lens,
            aspect: None,
            near: None,
            far: None,
        });
        self.manifest.camera = Some(0);
    }

    fn light(&mut self, name: &str, node: usize, kind: LightKind, color: [f64; 3], intensity: f64) {
        self.manifest.lights.push(Light { name: name.to_owned(), node, kind, color, intensity, range: None });
    }
}

/// Rounds to four decimals, so that manifests stay short.
fn short(x: f64) -> f64 {
    (x * 1e4 + 0.5).floor() / 1e4
}

fn quaternion(axis: [f64; 3], turns: f64) -> [f64; 4] {
    let (s, c) = sin_cos(turns / 2.0);
    [axis[0] * s, axis[1] * s, axis[2] * s, c].map(short)
}

/// The rotation of a camera or light as a quaternion: first downwards by `pitch` turns about its
/// own x axis, then by `yaw` turns about the vertical.
fn view(yaw: f64, pitch: f64) -> [f64; 4] {
    let ((sy, cy), (sp, cp)) = (sin_cos(yaw / 2.0), sin_cos(-pitch / 2.0));
    [cy * sp, sy * cp, -sy * sp, cy * cp].map(short)
}

fn floor() -> Model {
    let mut model = Model::default();
    let rows = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| model.push([x, 0.0, -z]));
    model.quad(rows);
    model
}

fn turning() -> Scene {
    let mut b = Builder::new(47, 24.0);
    let object = b.object("gyroid", "models/gyroid.ply");
    let node = b.node("gyroid".into(), None, Some(object), Transform::default());
    b.turn(node, [0.0, 1.0, 0.0], 1.0, 2.0);
    Scene { manifest: b.manifest, models: vec![("models/gyroid.ply".to_owned(), gyroid::gyroid(100_000))] }
}

fn swarm() -> Scene {
    let mut b = Builder::new(95, 24.0);
    let knot = b.object("knot", "models/knot.ply");
    let blob = b.object("blob", "models/blob.ply");
    let mut rng = Rng::new(101);
    for i in 0..101 {
        let object = if i % 2 == 0 { knot } else { blob };
        let size = short(rng.between(0.5, 1.1));
        let node = b.node(format!("object {i}"), None, Some(object), parts([0.0; 3], size));
        let mut position = DVec3::from_array(rng.point_in_ball()) * 9.0;
        let keys: Vec<_> = (0..=4)
            .map(|key| {
                let value = position.to_array().map(short).to_vec();
                position += DVec3::from_array(rng.point_in_ball()) * 4.0;
                (f64::from(key), value)
            })
            .collect();
        b.track(node, Property::Translation, keys);
        let axis = rng.unit_vector().map(short);
        b.turn(node, axis, short(rng.between(-2.0, 2.0)), 4.0);
    }
    let models = vec![
        ("models/knot.ply".to_owned(), knot::torus_knot(12_000)),
        ("models/blob.ply".to_owned(), blob::blob(20_000)),
    ];
    Scene { manifest: b.manifest, models }
}

fn falling() -> Scene {
    let mut b = Builder::new(71, 24.0);
    let hair = b.object("hairball", "models/hairball.ply");
    let ground = b.object("floor", "models/floor.ply");
    b.node("floor".into(), None, Some(ground), parts([0.0; 3], 16.0));
    let mut rng = Rng::new(100);
    for i in 0..100 {
        let node = b.node(format!("hairball {i}"), None, Some(hair), parts([0.0; 3], 1.0));
        let (x, z) = (short(f64::from(i % 10) * 2.2 - 9.9), short(f64::from(i / 10) * 2.2 - 9.9));
        let height = rng.between(3.0, 14.0);
        // Falls freely, rebounds once with half its speed, and comes to rest.
        let fall = (2.0 * (height - 0.9) / 9.81).sqrt();
        let rise = (height - 0.9) / 4.0;
        let keys = (0..=18).map(|key| {
            let t = f64::from(key) / 6.0;
            let since = t - fall;
            let y = if since < 0.0 {
                height - 4.905 * t * t
            } else {
                let up = (2.0 * 9.81 * rise).sqrt();
                (0.9 + up * since - 4.905 * since * since).max(0.9)
            };
            (t, vec![x, short(y), z])
        });
        b.track(node, Property::Translation, keys.collect::<Vec<_>>());
        let axis = rng.unit_vector().map(short);
        b.turn(node, axis, short(rng.between(-1.5, 1.5)), 3.0);
    }
    let eye =
        Transform::Parts { translation: [0.0, 13.0, 24.0], rotation: view(0.0, 0.075), scale: [1.0; 3] };
    let eye = b.node("eye".into(), None, None, eye);
    b.camera("main", eye, 50.0);
    let models = vec![
        ("models/hairball.ply".to_owned(), hairball::hairball(60_000)),
        ("models/floor.ply".to_owned(), floor()),
    ];
    Scene { manifest: b.manifest, models }
}

fn carousel() -> Scene {
    const ARMS: u32 = 8;
    let mut b = Builder::new(47, 24.0);
    let knot = b.object("knot", "models/knot.ply");
    let blob = b.object("blob", "models/blob.ply");
    let ground = b.object("floor", "models/floor.ply");
    b.node("floor".into(), None, Some(ground), parts([0.0, -1.6, 0.0], 9.0));
    b.node("hub".into(), None, Some(blob), parts([0.0; 3], 1.2));
    let table = b.node("turntable".into(), None, None, Transform::default());
    b.turn(table, [0.0, 1.0, 0.0], 0.5, 2.0);
    for i in 0..ARMS {
        let angle = f64::from(i) / f64::from(ARMS);
        let arm = Transform::Parts {
            translation: [0.0; 3],
            rotation: quaternion([0.0, 1.0, 0.0], angle),
            scale: [1.0; 3],
        };
        let arm = b.node(format!("arm {i}"), Some(table), None, arm);
        let lift = b.node(format!("lift {i}"), Some(arm), None, parts([3.6, 0.0, 0.0], 1.0));
        let keys = (0..=4).map(|key| {
            let (s, _) = sin_cos(angle * 2.0 + f64::from(key) / 4.0);
            (f64::from(key) / 2.0, vec![3.6, short(0.6 * s), 0.0])
        });
        b.track(lift, Property::Translation, keys.collect::<Vec<_>>());
        let mirror = if i % 2 == 0 { 1.0 } else { -1.0 };
        let rider = Transform::Parts {
            translation: [0.0; 3],
            rotation: [0.0, 0.0, 0.0, 1.0],
            scale: [0.55 * mirror, 0.55, 0.55],
        };
        let rider = b.node(format!("rider {i}"), Some(lift), Some(knot), rider);
        b.turn(rider, [0.0, 0.0, 1.0], mirror, 2.0);
        let moon = b.node(format!("moon axis {i}"), Some(rider), None, Transform::default());
        b.turn(moon, [1.0, 0.0, 0.0], 1.0, 2.0);
        b.node(format!("moon {i}"), Some(moon), Some(blob), parts([0.0, 2.2, 0.0], 0.3));
    }
    let dolly = b.node("dolly".into(), None, None, Transform::default());
    b.turn(dolly, [0.0, 1.0, 0.0], -0.125, 2.0);
    let eye = Transform::Parts { translation: [0.0, 4.2, 8.6], rotation: view(0.0, 0.075), scale: [1.0; 3] };
    let eye = b.node("eye".into(), Some(dolly), None, eye);
    b.camera("dolly", eye, 48.0);
    let above =
        Transform::Parts { translation: [0.0, 14.0, 0.0], rotation: view(0.0, 0.25), scale: [1.0; 3] };
    let above = b.node("above".into(), None, None, above);
    b.camera("above", above, 45.0);
    let sun = Transform::Parts { translation: [0.0; 3], rotation: view(0.08, 0.13), scale: [1.0; 3] };
    let sun = b.node("sun".into(), None, None, sun);
    b.light("sun", sun, LightKind::Directional, [1.0, 0.95, 0.85], 3.0);
    let models = vec![
        ("models/knot.ply".to_owned(), knot::torus_knot(2_880)),
        ("models/blob.ply".to_owned(), blob::blob(5_000)),
        ("models/floor.ply".to_owned(), floor()),
    ];
    Scene { manifest: b.manifest, models }
}

fn scroll() -> Scene {
    const FRAMES: u32 = 13;
    let mut b = Builder::new(24, 24.0);
    let frames = SequenceFrames::Numbered("models/sheet_##.ply".to_owned());
    let timing = SequenceTiming { rate: Some(12.0), start: 0.0 };
    b.manifest.objects.push(Object::new("sheet", Source::Sequence { frames, timing }));
    b.node("sheet".into(), None, Some(0), Transform::default());
    let eye = Transform::Parts { translation: [0.5, 0.45, 0.9], rotation: view(0.0, 0.08), scale: [1.0; 3] };
    let eye = b.node("eye".into(), None, None, eye);
    b.camera("main", eye, 50.0);
    let model = |frame: u32| {
        let share = f64::from(frame) / f64::from(FRAMES - 1);
        (format!("models/sheet_{frame:02}.ply"), sheet::sheet(0.9 * share, share))
    };
    Scene { manifest: b.manifest, models: (0..FRAMES).map(model).collect() }
}
