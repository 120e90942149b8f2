//! Many instances of one small object, for measurements of the top level.

use bth_compile::write::{FileBuilder, ObjectParts, SceneParts, object, scene};
use bth_format::layout::*;
use bth_random::Rng;
use zerocopy::IntoBytes;

/// A file with `count` moving instances: every node has a track, or only the root.
pub fn crowd(count: u32, own_tracks: bool) -> Vec<u8> {
    let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]];
    let row = |k: usize| std::array::from_fn(|i| corners.get(i).unwrap_or(&corners[0])[k]);
    let mut corner = [[0; WIDTH]; 3];
    (0..3).for_each(|k| corner[k][0] = k as u8);
    let leaf = IndexedLeaf {
        vertex: [row(0), row(1), row(2)],
        corner,
        first: 0,
        triangles: 1,
        vertices: 3,
        reserved: 0,
    };
    let words: Vec<u32> =
        leaf.as_bytes().chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
    let lines: Vec<CacheLine> = words.chunks_exact(16).map(|w| CacheLine(w.try_into().unwrap())).collect();
    let parts = ObjectParts {
        bounds: Some(([0.0; 3], [1.0, 1.0, 0.5])),
        root: Child::Indexed(0).code(),
        triangles: 1,
        lines: &lines,
        triangle_ids: &[0],
        places: &[TrianglePlace { leaf: Child::Indexed(0), slot: 0 }.code()],
        ..ObjectParts::default()
    };
    let mut rng = Rng::new(1);
    let mut centered = |width: f64| (f64::from(rng.unit_f32()) - 0.5) * width;
    let side = f64::from(count).cbrt() * 2.0;
    let node = |translation: [f64; 3], parent| {
        let mut transform = [0.0; 12];
        transform[..3].copy_from_slice(&translation);
        transform[6] = 1.0;
        transform[7..10].fill(1.0);
        Node { transform, parent, flags: 0, name: 0, name_length: 0, reserved: [0; 4] }
    };
    let mut nodes = vec![node([0.0; 3], NONE)];
    let (mut tracks, mut times, mut values) = (Vec::new(), Vec::new(), Vec::new());
    let mut track = |node: u32, property: Property, from: &[f64], to: &[f64]| {
        tracks.push(Track {
            node,
            property: property as u32,
            interpolation: Interpolation::Linear as u32,
            keys: 2,
            first_time: times.len() as u32,
            first_value: values.len() as u32,
            reserved: [0; 2],
        });
        times.extend([0.0, 100.0]);
        values.extend(from.iter().chain(to));
    };
    if !own_tracks {
        track(0, Property::Rotation, &[0.0, 0.0, 0.0, 1.0], &[0.0, 1.0, 0.0, 0.0]);
    }
    for i in 1..=count {
        let position = [(); 3].map(|()| centered(side));
        nodes.push(node(position, 0));
        if own_tracks {
            track(i, Property::Translation, &position, &position.map(|x| -x));
            track(i, Property::Rotation, &[0.0, 0.0, 0.0, 1.0], &[0.6, 0.0, 0.8, 0.0]);
        }
    }
    let parts_of_scene = SceneParts {
        scene: Scene { rate: 24.0, first_frame: 0, last_frame: 2400, camera: NONE, reserved: [0; 11] },
        nodes,
        instances: (0..count).map(|first| Instance { node: first + 1, object: 0, flags: 0, first }).collect(),
        tracks,
        times,
        values,
        cameras: Vec::new(),
        lights: Vec::new(),
        names: Vec::new(),
        deformers: Default::default(),
    };
    let mut builder = FileBuilder::new();
    object(&mut builder, 0, &parts).unwrap();
    scene(&mut builder, &parts_of_scene).unwrap();
    builder.finish()
}
