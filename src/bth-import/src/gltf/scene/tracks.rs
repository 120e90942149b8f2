//! Tracks of a manifest from the animations of a glTF document.

use std::collections::HashSet;
use std::ops::Range;

use bth_scene::{Interpolation, Property, Track, Transform};

use crate::error::Result;
use crate::gltf::scene::Chosen;
use crate::gltf::scene::importer::Importer;
use crate::gltf::schema::{Animation, Channel, Sampler};

impl Importer<'_, '_> {
    /// The tracks of animations, by node and property, and the last time of any in seconds.
    pub(super) fn tracks(&mut self, animations: &[(usize, Animation)]) -> Result<(Vec<Track>, f64)> {
        let mut tracks: Vec<Track> = Vec::new();
        let mut taken = HashSet::new();
        let mut last = 0.0f64;
        for (index, animation) in animations {
            for (number, channel) in animation.channels.iter().enumerate() {
                let part = format!("animation {index} channel {number}");
                let Some(track) = self.track(animation, channel, &part)? else { continue };
                if !taken.insert((track.node, track.property)) {
                    let name = self.manifest.nodes.name(track.node);
                    let what = format!("the {} of \"{name}\" is animated already", track.property.name());
                    self.ignore(&part, what)?;
                    continue;
                }
                last = last.max(track.times.last().copied().unwrap_or(0.0));
                tracks.push(track);
            }
        }
        tracks.sort_by_key(|t| (t.node, t.property));
        Ok((tracks, last))
    }

    /// Returns the chosen animations with their numbers, and notes which nodes they change. The
    /// report lists these and the others.
    pub(super) fn animations(&mut self, chosen: &Chosen) -> Result<Vec<(usize, Animation)>> {
        let all = &self.file.document.animations;
        let names: Vec<String> =
            all.iter().map(|value| value["name"].as_str().unwrap_or_default().to_owned()).collect();
        // One that is not chosen may be malformed.
        let typed = |index: usize| Ok((index, self.file.typed(&all[index], &format!("animation {index}"))?));
        let chosen = self.choose(&names, chosen)?.map(typed).collect::<Result<Vec<(usize, Animation)>>>()?;
        for (index, name) in names.into_iter().enumerate() {
            let name = if name.is_empty() { index.to_string() } else { name };
            let is_chosen = chosen.iter().any(|(number, _)| *number == index);
            let list = match is_chosen {
                true => &mut self.report.animations,
                false => &mut self.report.animations_left_out,
            };
            list.push(name);
        }
        for channel in chosen.iter().flat_map(|(_, animation)| &animation.channels) {
            let list = if channel.target.path == "weights" { &mut self.morphed } else { &mut self.moved };
            channel.target.node.and_then(|node| list.get_mut(node)).into_iter().for_each(|x| *x = true);
        }
        Ok(chosen)
    }

    /// The numbers of the chosen ones of all animations.
    fn choose(&self, names: &[String], chosen: &Chosen) -> Result<Range<usize>> {
        match chosen {
            Chosen::First => Ok(0..names.len().min(1)),
            Chosen::All => Ok(0..names.len()),
            Chosen::None => Ok(0..0),
            Chosen::One(wanted) => {
                let by_name = names.iter().position(|name| name == wanted);
                let by_number = || wanted.parse().ok().filter(|n: &usize| *n < names.len());
                let found = by_name.or_else(by_number);
                let missing = || self.no_such("animations", names.iter().map(String::as_str), wanted);
                found.map(|n| n..n + 1).ok_or_else(missing)
            }
        }
    }

    /// A channel's track; `None` where it moves nothing of the scene.
    fn track(&mut self, animation: &Animation, channel: &Channel, part: &str) -> Result<Option<Track>> {
        let property = match channel.target.path.as_str() {
            "translation" => Property::Translation,
            "rotation" => Property::Rotation,
            "scale" => Property::Scale,
            "weights" => Property::Weights,
            other => {
                self.ignore(part, format!("animations of {other} are ignored"))?;
                return Ok(None);
            }
        };
        // Without a node the channel moves nothing.
        let Some(target) = channel.target.node else { return Ok(None) };
        let Some(row) = self.report.node_rows.get(target) else {
            return Err(self.file.graph_error(part, format!("its node {target} does not exist")));
        };
        // Nodes of other scenes have no row.
        let Some(node) = *row else { return Ok(None) };
        let moves = property != Property::Weights;
        if moves && matches!(self.manifest.nodes.get(node).transform, Transform::Matrix(_)) {
            let message = format!("its node {target} has a matrix, which cannot be animated");
            return Err(self.file.graph_error(part, message));
        }
        let Some(sampler) = animation.samplers.get(channel.sampler) else {
            return Err(self
                .file
                .graph_error(part, format!("its sampler {} does not exist", channel.sampler)));
        };
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(other) => {
                return Err(self.file.graph_error(part, format!("unknown interpolation \"{other}\"")));
            }
        };
        let deformer = |row: usize| self.manifest.deformers.iter().find(|deformer| deformer.node == row);
        let width = match property.width() {
            Some(width) => width,
            // Nodes whose mesh stays at rest have no deformer, which has been said before.
            None => match deformer(node).map_or(0, |deformer| deformer.weights.len()) {
                0 if self.options.deform => {
                    self.ignore(part, format!("node {target} has no morph targets that could be animated"))?;
                    return Ok(None);
                }
                0 => return Ok(None),
                width => width,
            },
        };
        let (times, values) = self.keys(sampler, property, width, interpolation, part)?;
        Ok(Some(Track { node, property, interpolation, times, values }))
    }

    /// The times and values of a sampler's keys, checked.
    fn keys(
        &self,
        sampler: &Sampler,
        property: Property,
        width: usize,
        interpolation: Interpolation,
        part: &str,
    ) -> Result<(Vec<f64>, Vec<f64>)> {
        let times: Vec<f64> = self.file.scalars(sampler.input)?.into_iter().map(f64::from).collect();
        let values = match property {
            Property::Rotation => widened(self.file.vectors::<4>(sampler.output)?),
            Property::Weights => self.file.scalars(sampler.output)?.into_iter().map(f64::from).collect(),
            _ => widened(self.file.vectors::<3>(sampler.output)?),
        };
        let ascending = times.iter().all(|t| t.is_finite()) && times.windows(2).all(|w| w[0] < w[1]);
        if times.is_empty() || !ascending {
            return Err(self.file.graph_error(part, "expected finite times that ascend, at least one"));
        }
        let rows = interpolation.values_per_key();
        if values.len() != times.len() * width * rows {
            let message = format!(
                "expected {} rows of values for {} times, found {}",
                times.len() * rows,
                times.len(),
                values.len() / width
            );
            return Err(self.file.graph_error(part, message));
        }
        // A cubic key has its value between two tangents.
        let main = rows / 2 * width;
        let zero =
            |key: &[f64]| property == Property::Rotation && key[main..main + width].iter().all(|x| *x == 0.0);
        if !values.iter().all(|x| x.is_finite()) || values.chunks(width * rows).any(zero) {
            return Err(self
                .file
                .graph_error(part, "expected finite values, and rotations that are not zero"));
        }
        Ok((times, values))
    }
}

fn widened<const N: usize>(rows: Vec<[f32; N]>) -> Vec<f64> {
    rows.as_flattened().iter().map(|x| f64::from(*x)).collect()
}
