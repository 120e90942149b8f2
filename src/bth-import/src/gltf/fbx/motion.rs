//! Animations of an FBX file: its curves as keys with straight lines between them.

use serde_json::{Value, json};
use ufbx::{AnimStack, BakeOpts, BakedAnim, Scene};

use crate::error::Result;
use crate::gltf::extensions::Use;
use crate::gltf::fbx::load::{error, memory};
use crate::gltf::fbx::mesh::targets;
use crate::gltf::made::Made;
use crate::source::Source;

/// Adds an animation for each stack that moves nodes or weights. Only scenes need its keys.
pub(super) fn animations(source: &Source<'_>, scene: &Scene, used: Use, made: &mut Made) -> Result<()> {
    for stack in &scene.anim_stacks {
        source.monitor.check()?;
        let name = &*stack.element.name;
        if used != Use::Scene {
            made.document.animations.push(json!({"name": name}));
            continue;
        }
        let options = BakeOpts {
            temp_allocator: memory(),
            result_allocator: memory(),
            trim_start_time: true,
            key_reduction_enabled: true,
            key_reduction_rotation: true,
            ..BakeOpts::default()
        };
        let baked = ufbx::bake_anim(scene, &stack.anim, options).map_err(|e| error(source, &e))?;
        let mut keys = Keys { made, samplers: Vec::new(), channels: Vec::new() };
        for node in &baked.nodes {
            let number = node.typed_id as usize;
            let (moved, scaled) = (&node.translation_keys, &node.scale_keys);
            if !node.constant_translation {
                keys.add(
                    number,
                    "translation",
                    moved.iter().map(|k| (k.time, [k.value.x, k.value.y, k.value.z])),
                );
            }
            if !node.constant_rotation {
                let rotations = node.rotation_keys.iter();
                keys.add(
                    number,
                    "rotation",
                    rotations.map(|k| (k.time, [k.value.x, k.value.y, k.value.z, k.value.w])),
                );
            }
            if !node.constant_scale {
                keys.add(number, "scale", scaled.iter().map(|k| (k.time, [k.value.x, k.value.y, k.value.z])));
            }
        }
        weights(scene, stack, &baked, &mut keys);
        let animation = json!({"name": name, "channels": keys.channels, "samplers": keys.samplers});
        hidden(source, name, &baked);
        made.document.animations.push(animation);
    }
    Ok(())
}

/// Warns of nodes that appear or vanish, which is not followed.
fn hidden(source: &Source<'_>, stack: &str, baked: &BakedAnim) {
    let changes = |p: &ufbx::BakedProp| &*p.name == "Visibility" && !p.constant_value;
    let count = baked.elements.iter().filter(|element| element.props.iter().any(changes)).count();
    if count > 0 {
        let what = "nodes whose visibility changes are shown as they are at rest";
        source.monitor.warn(&format!("animation \"{stack}\": {count} {what}"));
    }
}

/// The keys of an animation so far.
struct Keys<'m> {
    made: &'m mut Made,
    samplers: Vec<Value>,
    channels: Vec<Value>,
}

impl Keys<'_> {
    /// Adds the keys of a property, without those that are no later than the one before in f32.
    fn add<const N: usize>(&mut self, node: usize, path: &str, keys: impl Iterator<Item = (f64, [f64; N])>) {
        let (mut times, mut values): (Vec<[f32; 1]>, Vec<[f32; N]>) = (Vec::new(), Vec::new());
        for (time, value) in keys {
            if times.last().is_none_or(|last| last[0] < time as f32) {
                times.push([time as f32]);
                values.push(value.map(|x| x as f32));
            }
        }
        let values = self.made.floats(values);
        self.sampler(node, path, times, values);
    }

    fn sampler(&mut self, node: usize, path: &str, times: Vec<[f32; 1]>, output: usize) {
        let input = self.made.floats(times);
        self.channels.push(json!({"sampler": self.samplers.len(), "target": {"node": node, "path": path}}));
        self.samplers.push(json!({"input": input, "output": output}));
    }
}

/// Adds the weights of shapes. glTF has the weights of all shapes of a node at each key.
fn weights(scene: &Scene, stack: &AnimStack, baked: &BakedAnim, keys: &mut Keys<'_>) {
    for mesh in &scene.meshes {
        let ids: Vec<u32> = targets(mesh).map(|(channel, _)| channel.element.element_id).collect();
        let elements = baked.elements.iter().filter(|element| ids.contains(&element.element_id));
        let props = elements.flat_map(|element| element.props.iter()).filter(|p| !p.constant_value);
        let mut times: Vec<f64> = props.flat_map(|p| p.keys.iter().map(|key| key.time)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup_by_key(|time| *time as f32);
        if times.is_empty() {
            continue;
        }
        // The keys were moved so that the stack begins at 0, unless it begins before.
        let start = stack.anim.time_begin.max(0.0);
        let weight = |time: &f64| {
            let at = time + start;
            targets(mesh).map(move |(channel, _)| [channel.evaluate_blend_weight(&stack.anim, at) as f32])
        };
        let values = keys.made.floats(times.iter().flat_map(weight));
        for node in &mesh.element.instances {
            let times = times.iter().map(|time| [*time as f32]).collect();
            keys.sampler(node.element.typed_id as usize, "weights", times, values);
        }
    }
}
