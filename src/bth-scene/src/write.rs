//! Writes a manifest.

use crate::model::*;
use crate::nodes::{Node, Transform};
use std::fmt::Write;

/// Keyframes on a line of a track.
const KEYS_PER_LINE: usize = 8;

impl Manifest {
    /// The text of the manifest; reading it gives an equal value again.
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        self.write(&mut out).expect("a string takes all text");
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "version = {}", VERSION)?;
        if let Some(camera) = self.camera {
            writeln!(out, "camera = {}", text(&self.cameras[camera].name))?;
        }
        let Frames { first, last, rate } = self.frames;
        writeln!(out, "frames = {{ first = {first}, last = {last}, rate = {rate:?} }}")?;
        for object in &self.objects {
            writeln!(out, "\n[[objects]]\nname = {}", text(&object.name))?;
            match &object.source {
                Source::Model { path, mesh } => {
                    writeln!(out, "model = {}", text(path))?;
                    mesh.map_or(Ok(()), |mesh| writeln!(out, "mesh = {mesh}"))?;
                }
                Source::Compiled { path, object } => {
                    writeln!(out, "file = {}", text(path))?;
                    object.map_or(Ok(()), |object| writeln!(out, "object = {object}"))?;
                }
                Source::Sequence { frames, timing } => write_sequence(out, frames, timing)?,
                Source::Cached { path, mesh, cache, timing } => {
                    writeln!(out, "model = {}\nvertex_cache = {}", text(path), text(cache))?;
                    mesh.map_or(Ok(()), |mesh| writeln!(out, "mesh = {mesh}"))?;
                    write_timing(out, timing)?;
                }
                Source::Deforming { path, mesh, without } => {
                    writeln!(out, "model = {}\nmesh = {mesh}\ndeforms = true", text(path))?;
                    if !without.is_empty() {
                        list(out, "without_joints", without.iter().map(|joint| joint.to_string()))?;
                    }
                }
                Source::RigidPart { path, mesh, joint } => {
                    writeln!(out, "model = {}\nmesh = {mesh}\njoint = {joint}", text(path))?;
                }
                Source::AtRest { path, node } => writeln!(out, "model = {}\nnode = {node}", text(path))?,
            }
            if let Some(Material { color, emission, metallic, roughness }) = object.material {
                writeln!(out, "color = {color:?}")?;
                let numbers = format!("metallic = {metallic:?}, roughness = {roughness:?}");
                writeln!(out, "material = {{ emission = {emission:?}, {numbers} }}")?;
            }
        }
        self.nodes.iter().try_for_each(|node| self.write_node(out, node))?;
        self.cameras.iter().try_for_each(|camera| self.write_camera(out, camera))?;
        self.lights.iter().try_for_each(|light| self.write_light(out, light))?;
        self.skins.iter().try_for_each(|skin| self.write_skin(out, skin))?;
        self.deformers.iter().try_for_each(|deformer| self.write_deformer(out, deformer))?;
        self.tracks.iter().try_for_each(|track| self.write_track(out, track))
    }

    fn write_skin(&self, out: &mut String, skin: &Skin) -> std::fmt::Result {
        writeln!(out, "\n[[skins]]\nname = {}", text(&skin.name))?;
        list(out, "joints", skin.joints.iter().map(|joint| text(self.nodes.name(*joint))))?;
        match &skin.inverse_binds {
            Some(matrices) => list(out, "inverse_binds", matrices.iter().map(|rows| format!("{rows:?}"))),
            None => Ok(()),
        }
    }

    fn write_deformer(&self, out: &mut String, deformer: &Deformer) -> std::fmt::Result {
        writeln!(out, "\n[[deformers]]\nnode = {}", text(self.nodes.name(deformer.node)))?;
        writeln!(out, "object = {}", text(&self.objects[deformer.object].name))?;
        if let Some(skin) = deformer.skin {
            writeln!(out, "skin = {}", text(&self.skins[skin].name))?;
        }
        if !deformer.weights.is_empty() {
            list(out, "weights", deformer.weights.iter().map(|weight| format!("{weight:?}")))?;
        }
        Ok(())
    }

    fn write_node(&self, out: &mut String, node: Node<'_>) -> std::fmt::Result {
        writeln!(out, "\n[[nodes]]\nname = {}", text(node.name))?;
        if let Some(parent) = node.parent {
            writeln!(out, "parent = {}", text(self.nodes.name(parent)))?;
        }
        if let Some(object) = node.object {
            writeln!(out, "object = {}", text(&self.objects[object].name))?;
        }
        if let Some(group) = node.group {
            writeln!(out, "group = {}", text(self.nodes.name(group)))?;
        }
        if !node.visible {
            writeln!(out, "visible = false")?;
        }
        match node.transform {
            Transform::Matrix(rows) => writeln!(out, "matrix = {rows:?}"),
            Transform::Parts { translation, rotation, scale } => {
                // Compared by bits, so that a negative zero is kept.
                let is =
                    |a: &[f64], b: &[f64]| a.iter().map(|x| x.to_bits()).eq(b.iter().map(|x| x.to_bits()));
                if !is(&translation, &[0.0; 3]) {
                    writeln!(out, "translation = {translation:?}")?;
                }
                if !is(&rotation, &[0.0, 0.0, 0.0, 1.0]) {
                    writeln!(out, "rotation = {rotation:?}")?;
                }
                if !is(&scale, &[1.0; 3]) {
                    writeln!(out, "scale = {scale:?}")?;
                }
                Ok(())
            }
        }
    }

    fn write_camera(&self, out: &mut String, camera: &Camera) -> std::fmt::Result {
        writeln!(out, "\n[[cameras]]\nname = {}", text(&camera.name))?;
        writeln!(out, "node = {}", text(self.nodes.name(camera.node)))?;
        match camera.lens {
            Lens::Perspective(fov) => writeln!(out, "fov = {:?}", fov)?,
            Lens::Orthographic(height) => writeln!(out, "height = {height:?}")?,
        }
        for (key, value) in [("aspect", camera.aspect), ("near", camera.near), ("far", camera.far)] {
            value.map_or(Ok(()), |value| writeln!(out, "{key} = {value:?}"))?;
        }
        Ok(())
    }

    fn write_light(&self, out: &mut String, light: &Light) -> std::fmt::Result {
        writeln!(out, "\n[[lights]]\nname = {}", text(&light.name))?;
        writeln!(out, "node = {}", text(self.nodes.name(light.node)))?;
        match light.kind {
            LightKind::Directional => writeln!(out, "kind = \"directional\"")?,
            LightKind::Point => writeln!(out, "kind = \"point\"")?,
            LightKind::Spot { inner, outer } => {
                writeln!(out, "kind = \"spot\"\ninner = {inner:?}\nouter = {outer:?}")?;
            }
        }
        writeln!(out, "color = {:?}\nintensity = {:?}", light.color, light.intensity)?;
        light.range.map_or(Ok(()), |range| writeln!(out, "range = {range:?}"))
    }

    fn write_track(&self, out: &mut String, track: &Track) -> std::fmt::Result {
        writeln!(out, "\n[[tracks]]\nnode = {}", text(self.nodes.name(track.node)))?;
        let (property, interpolation) = (track.property.name(), track.interpolation.name());
        writeln!(out, "property = \"{property}\"\ninterpolation = \"{interpolation}\"")?;
        list(out, "times", track.times.iter().map(|t| format!("{t:?}")))?;
        let per_key = track.values.len() / track.times.len().max(1);
        let width = (per_key / track.interpolation.values_per_key()).max(1);
        let value = |v: &[f64]| match track.property {
            Property::Visible => (v[0] != 0.0).to_string(),
            _ => format!("{v:?}"),
        };
        let keys = track.values.chunks(per_key.max(1));
        list(
            out,
            "values",
            keys.map(|key| match track.interpolation {
                Interpolation::Cubic => {
                    let rows: Vec<_> = key.chunks(width).map(value).collect();
                    format!("[{}]", rows.join(", "))
                }
                _ => value(key),
            }),
        )
    }
}

fn write_sequence(out: &mut String, frames: &SequenceFrames, timing: &SequenceTiming) -> std::fmt::Result {
    match frames {
        SequenceFrames::Numbered(pattern) => writeln!(out, "sequence = {}", text(pattern))?,
        SequenceFrames::Listed(files) => list(out, "sequence", files.iter().map(|file| text(file)))?,
    }
    write_timing(out, timing)
}

fn write_timing(out: &mut String, timing: &SequenceTiming) -> std::fmt::Result {
    timing.rate.map_or(Ok(()), |rate| writeln!(out, "rate = {rate:?}"))?;
    writeln!(out, "start = {:?}", timing.start)
}

/// An array, over several lines if it is long.
fn list(out: &mut String, key: &str, items: impl Iterator<Item = String>) -> std::fmt::Result {
    let items: Vec<_> = items.collect();
    if items.len() <= KEYS_PER_LINE {
        return writeln!(out, "{key} = [{}]", items.join(", "));
    }
    writeln!(out, "{key} = [")?;
    for line in items.chunks(KEYS_PER_LINE) {
        writeln!(out, "    {},", line.join(", "))?;
    }
    writeln!(out, "]")
}

/// A TOML basic string.
fn text(value: &str) -> String {
    toml::Value::from(value).to_string()
}
