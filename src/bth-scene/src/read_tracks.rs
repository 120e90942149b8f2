//! Tracks: keyframes of one property of one node.

use crate::error::{Result, code};
use crate::model::{Deformer, Interpolation, Property, Track};
use crate::names::Names;
use crate::nodes::{Nodes, Transform};
use crate::read_transform::rotation;
use crate::table::{Table, Value};
use std::collections::{HashMap, HashSet};

/// Keys of a track.
pub(crate) const TRACK_KEYS: &[&str] = &["node", "property", "interpolation", "times", "values"];

/// Reads the tracks of a manifest.
pub(crate) fn tracks(
    tables: &[Table<'_>],
    names: &Names,
    nodes: &Nodes,
    deformers: &[Deformer],
) -> Result<Vec<Track>> {
    let mut seen = HashSet::new();
    let weights: HashMap<usize, usize> = deformers.iter().map(|d| (d.node, d.weights.len())).collect();
    tables
        .iter()
        .map(|table| {
            let track = track(table, names, &weights)?;
            let node = nodes.get(track.node);
            let moves = !matches!(track.property, Property::Visible | Property::Weights);
            if matches!(node.transform, Transform::Matrix(_)) && moves {
                let message = format!("the node \"{}\" has a matrix, which tracks cannot move", node.name);
                return Err(table.need("node")?.error(
                    code::CONFLICT,
                    message,
                    "give the node translation, rotation and scale instead",
                ));
            }
            if !seen.insert((track.node, track.property)) {
                let message =
                    format!("the {} of \"{}\" has a track already", track.property.name(), node.name);
                return Err(table.error(code::TRACK, message, "keep one of them"));
            }
            Ok(track)
        })
        .collect()
}

/// Reads a track; `weights` has for each node with a deformer the number of its weights.
fn track(table: &Table<'_>, names: &Names, weights: &HashMap<usize, usize>) -> Result<Track> {
    let node_value = table.need("node")?;
    let node = names.row(&node_value)?;
    let property = table.need("property")?.choice(&Property::ALL.map(|p| (p.name(), p)))?;
    let Some(width) = property.width().or_else(|| weights.get(&node).copied().filter(|n| *n > 0)) else {
        let message = "a track of weights is of a node whose deformer has weights";
        return Err(node_value.error(code::CONFLICT, message, "give the node a deformer with weights"));
    };
    let usual = if property == Property::Visible { Interpolation::Step } else { Interpolation::Linear };
    let interpolation = match table.get("interpolation") {
        None => usual,
        Some(value) => {
            let chosen = value.choice(&Interpolation::ALL.map(|i| (i.name(), i)))?;
            if property == Property::Visible && chosen != Interpolation::Step {
                return Err(value.not_allowed("\"step\" for visibility", format!("\"{}\"", chosen.name())));
            }
            chosen
        }
    };
    let times = times(&table.need("times")?)?;
    let values_value = table.need("values")?;
    let keys = values_value.array()?;
    if keys.len() != times.len() {
        let message = format!("expected a value for each of {} times, found {}", times.len(), keys.len());
        return Err(values_value.error(code::TRACK, message, "give as many values as times"));
    }
    let mut values = Vec::with_capacity(keys.len() * interpolation.values_per_key() * width);
    for key in &keys {
        if interpolation != Interpolation::Cubic {
            value(key, property, width, &mut values)?;
            continue;
        }
        let parts = key.array()?;
        let [before, at, after] = parts.as_slice() else {
            let message =
                format!("expected an in-tangent, a value and an out-tangent, found {} rows", parts.len());
            return Err(key.error(code::TRACK, message, "give three rows for each key"));
        };
        tangent(before, property, width, &mut values)?;
        value(at, property, width, &mut values)?;
        tangent(after, property, width, &mut values)?;
    }
    Ok(Track { node, property, interpolation, times, values })
}

fn times(value: &Value<'_>) -> Result<Vec<f64>> {
    let keys = value.array()?;
    if keys.is_empty() {
        return Err(value.error(code::TRACK, "expected at least one time, found none", "remove the track"));
    }
    let mut times: Vec<f64> = Vec::with_capacity(keys.len());
    for key in keys {
        let time = key.number()?;
        if let Some(last) = times.last().filter(|last| **last >= time) {
            let message = format!("expected a time after {last}, found {time}");
            return Err(key.error(code::TRACK, message, "order the keys by time, each time once"));
        }
        times.push(time);
    }
    Ok(times)
}

fn value(value: &Value<'_>, property: Property, width: usize, into: &mut Vec<f64>) -> Result<()> {
    match property {
        Property::Translation | Property::Scale => into.extend(value.numbers::<3>()?),
        Property::Rotation => into.extend(rotation(value)?),
        Property::Visible => into.push(f64::from(u8::from(value.boolean()?))),
        Property::Weights => into.extend(value.numbers_of(width)?),
    }
    Ok(())
}

fn tangent(value: &Value<'_>, property: Property, width: usize, into: &mut Vec<f64>) -> Result<()> {
    match property {
        Property::Rotation => into.extend(value.numbers::<4>()?),
        Property::Weights => into.extend(value.numbers_of(width)?),
        _ => into.extend(value.numbers::<3>()?),
    }
    Ok(())
}
