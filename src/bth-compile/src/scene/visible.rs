//! The nodes that may be visible between the first frame and the last.

use bth_scene::{Manifest, Property, Track, Transform};

/// Decides for each node if it, or an instance at it, may be visible. True for every node that some
/// frame shows; also true for some that no frame shows, when a node and its parent are visible at
/// different times. Scales of zero do not hide an object with a skin, which the transform of its
/// node does not move.
pub(super) fn visible(manifest: &Manifest, order: &[usize]) -> Vec<bool> {
    let frames = manifest.frames;
    let range = [frames.first, frames.last].map(|f| f64::from(f) / frames.rate);
    let mut shown: Vec<bool> = manifest.nodes.iter().map(|n| n.visible).collect();
    let mut scaled: Vec<bool> = manifest.nodes.iter().map(|n| has_size(&n.transform)).collect();
    for track in &manifest.tracks {
        match track.property {
            Property::Visible => shown[track.node] = some_value(track, range, |v| v[0] != 0.0),
            // A scale track is assumed to give the node a size at some time. Where it passes
            // through zero between two keys, it does so for an instant only.
            Property::Scale => scaled[track.node] = true,
            Property::Translation | Property::Rotation | Property::Weights => {}
        }
    }
    let mut with_size = vec![false; manifest.nodes.len()];
    for &node in order {
        let parent = manifest.nodes.parent(node);
        shown[node] &= parent.is_none_or(|parent| shown[parent]);
        with_size[node] = scaled[node] && parent.is_none_or(|parent| with_size[parent]);
    }
    let mut skinned = vec![false; manifest.objects.len()];
    let skins = manifest.deformers.iter().filter(|deformer| deformer.skin.is_some());
    skins.for_each(|deformer| skinned[deformer.object] = true);
    let nodes = manifest.nodes.iter().zip(shown).zip(with_size);
    nodes
        .map(|((node, shown), with_size)| shown && (with_size || node.object.is_some_and(|o| skinned[o])))
        .collect()
}

/// The nodes that are hidden because they have no size along some axis, though they have one along
/// another: a file may mean flat surfaces.
pub(super) fn flattened(manifest: &Manifest) -> Vec<&str> {
    let mut has_track = vec![false; manifest.nodes.len()];
    let of_scale = manifest.tracks.iter().filter(|track| track.property == Property::Scale);
    of_scale.for_each(|track| has_track[track.node] = true);
    let is_flat = |transform: &Transform| match transform {
        Transform::Parts { scale, .. } => scale.contains(&0.0) && scale.iter().any(|x| *x != 0.0),
        Transform::Matrix(_) => false,
    };
    let nodes = manifest.nodes.iter().enumerate();
    let flat = nodes.filter(|(row, node)| node.visible && is_flat(&node.transform) && !has_track[*row]);
    flat.map(|(_, node)| node.name).collect()
}

fn has_size(transform: &Transform) -> bool {
    match transform {
        Transform::Parts { scale, .. } => !scale.contains(&0.0),
        Transform::Matrix(rows) => rows.iter().any(|row| row[..3].iter().any(|x| *x != 0.0)),
    }
}

/// Returns true if a track with step interpolation has a value that satisfies the condition at some
/// time of a range.
fn some_value(track: &Track, [from, to]: [f64; 2], holds: impl Fn(&[f64]) -> bool) -> bool {
    let first = track.times.partition_point(|t| *t <= from).saturating_sub(1);
    let end = track.times.partition_point(|t| *t <= to).max(first + 1);
    track.values.chunks(track.property.width().unwrap_or(1)).take(end).skip(first).any(holds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn seen(text: &str) -> Vec<bool> {
        let manifest = bth_scene::parse(&format!("version = 1\n{text}"), Path::new("x")).unwrap();
        visible(&manifest, &super::super::encode::order(&manifest))
    }

    #[test]
    fn hidden_nodes_hide_what_is_below_in_whatever_order_they_stand() {
        let text = r#"nodes = [{ name = "leaf", parent = "top" }, { name = "top", visible = false },
            { name = "flat", scale = [1, 0, 1] }, { name = "below", parent = "flat" }, { name = "free" },
            { name = "point", matrix = [[0, 0, 0, 1], [0, 0, 0, 1], [0, 0, 0, 1]] }]"#;
        assert_eq!(seen(text), [false, false, false, false, true, false]);
    }

    #[test]
    fn tracks_of_visibility_count_within_the_range_of_frames() {
        let tracked = |first: i32, last: i32| {
            seen(&format!(
                r#"frames = {{ first = {first}, last = {last}, rate = 10 }}
                nodes = [{{ name = "a" }}]
                tracks = [{{ node = "a", property = "visible", times = [1, 2, 3], values = [false, true, false] }}]"#
            ))[0]
        };
        assert!(!tracked(0, 19) && tracked(0, 20) && tracked(29, 40) && !tracked(30, 40) && tracked(25, 25));
    }
}
