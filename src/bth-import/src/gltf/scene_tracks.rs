//! Tracks from glTF animations.

use super::scene::Importer;
use crate::error::Result;
use crate::gltf::json::{Animation, Channel};
use crate::source::UNSUPPORTED;
use bth_scene::{Interpolation, Property, Track, Transform};
use std::collections::HashSet;

/// Which animations of a document are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Chosen {
    /// All; of two that move the same thing the first.
    #[default]
    All,
    /// None: the scene stands still.
    None,
    /// One, by name or number.
    One(String),
}

/// The tracks of the chosen animations, by node and property, and the last time of any.
pub(super) fn read(importer: &mut Importer<'_>, chosen: &Chosen) -> Result<(Vec<Track>, f64)> {
    let mut animations = Vec::new();
    for (index, value) in importer.root.animations.iter().enumerate() {
        let animation: Animation = importer.typed(value, &format!("animation {index}"))?;
        animations.push((index, animation));
    }
    match chosen {
        Chosen::All => {}
        Chosen::None => animations.clear(),
        Chosen::One(wanted) => {
            let by_name = animations.iter().position(|(_, a)| a.name == *wanted);
            let by_number = || wanted.parse().ok().filter(|n: &usize| *n < animations.len());
            let Some(found) = by_name.or_else(by_number) else {
                let names: Vec<_> = animations.iter().map(|(i, a)| format!("{i} \"{}\"", a.name)).collect();
                let message =
                    format!("expected one of its animations ({}), found {wanted}", names.join(", "));
                let hint = "name one of these, or its number";
                return Err(importer.source.error_in_part(UNSUPPORTED, "animations", message, hint));
            };
            animations = vec![animations.swap_remove(found)];
        }
    }
    let mut tracks: Vec<Track> = Vec::new();
    let mut taken = HashSet::new();
    let mut last = 0.0f64;
    for (index, animation) in &animations {
        let name = if animation.name.is_empty() { index.to_string() } else { animation.name.clone() };
        importer.report.animations.push(name);
        for (number, channel) in animation.channels.iter().enumerate() {
            let part = format!("animation {index} channel {number}");
            let Some(track) = self::track(importer, animation, channel, &part)? else { continue };
            if !taken.insert((track.node, track.property)) {
                let name = &importer.manifest.nodes[track.node].name;
                let what = format!("the {} of \"{name}\" is animated already", track.property.name());
                importer.ignore(&part, what)?;
                continue;
            }
            last = last.max(track.times.last().copied().unwrap_or(0.0));
            tracks.push(track);
        }
    }
    tracks.sort_by_key(|t| (t.node, t.property));
    Ok((tracks, last))
}

fn track(
    importer: &mut Importer<'_>,
    animation: &Animation,
    channel: &Channel,
    part: &str,
) -> Result<Option<Track>> {
    let property = match channel.target.path.as_str() {
        "translation" => Property::Translation,
        "rotation" => Property::Rotation,
        "scale" => Property::Scale,
        other => {
            importer.ignore(part, format!("animations of {other} are ignored"))?;
            return Ok(None);
        }
    };
    // Without a node there is nothing to move; nodes of other scenes are not here.
    let Some(target) = channel.target.node else { return Ok(None) };
    let Some(row) = importer.report.node_rows.get(target) else {
        return Err(importer.error(part, format!("its node {target} does not exist")));
    };
    let Some(node) = *row else { return Ok(None) };
    if matches!(importer.manifest.nodes[node].transform, Transform::Matrix(_)) {
        let message = format!("its node {target} has a matrix, which cannot be animated");
        return Err(importer.error(part, message));
    }
    let Some(sampler) = animation.samplers.get(channel.sampler) else {
        return Err(importer.error(part, format!("its sampler {} does not exist", channel.sampler)));
    };
    let interpolation = match sampler.interpolation.as_deref() {
        None | Some("LINEAR") => Interpolation::Linear,
        Some("STEP") => Interpolation::Step,
        Some("CUBICSPLINE") => Interpolation::Cubic,
        Some(other) => return Err(importer.error(part, format!("unknown interpolation \"{other}\""))),
    };
    let times: Vec<f64> = importer.accessors.scalars(sampler.input)?.into_iter().map(f64::from).collect();
    let values: Vec<f64> = if property == Property::Rotation {
        widened(importer.accessors.vectors::<4>(sampler.output)?)
    } else {
        widened(importer.accessors.vectors::<3>(sampler.output)?)
    };
    let ascending = times.iter().all(|t| t.is_finite()) && times.windows(2).all(|w| w[0] < w[1]);
    if times.is_empty() || !ascending {
        return Err(importer.error(part, "expected finite times that ascend, at least one"));
    }
    let (width, rows) = (property.width(), interpolation.values_per_key());
    if values.len() != times.len() * width * rows {
        let message = format!(
            "expected {} rows of values for {} times, found {}",
            times.len() * rows,
            times.len(),
            values.len() / width
        );
        return Err(importer.error(part, message));
    }
    let main = rows / 2 * width;
    let zero =
        |key: &[f64]| property == Property::Rotation && key[main..main + width].iter().all(|x| *x == 0.0);
    if !values.iter().all(|x| x.is_finite()) || values.chunks(width * rows).any(zero) {
        return Err(importer.error(part, "expected finite values, and rotations that are not zero"));
    }
    Ok(Some(Track { node, property, interpolation, times, values }))
}

fn widened<const N: usize>(rows: Vec<[f32; N]>) -> Vec<f64> {
    rows.as_flattened().iter().map(|x| f64::from(*x)).collect()
}
