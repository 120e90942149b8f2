//! What the animation of a scene makes of the vertices of the objects that its skins and morph
//! targets deform.

use super::encode;
use crate::cached::{HashedRows, Sink};
use crate::error::Result;
use crate::pipeline::PoseSource;
use crate::write::SceneParts;
use bth::DeformerPoses;
use bth_files::Digest;
use bth_format::layout::{Deformer, NONE, Property, Track};
use bth_format::{DeformationView, SceneView};
use bth_import::{Deformation, Mesh};
use bth_scene::Manifest;
use std::collections::HashMap;

/// The clips of a scene's deformers: how each moves its object over all frames. A clip is named by
/// a hash of all that it depends on besides the object, so deformers that do the same have one.
#[derive(Default)]
pub(super) struct Clips {
    /// The scene's rows, with the numbers that objects have in the manifest.
    parts: Option<SceneParts>,
    /// For each object of the manifest with a deformer its clip.
    of_object: HashMap<usize, Digest>,
    /// For each clip a deformer.
    deformers: HashMap<Digest, Deformer>,
}

impl Clips {
    /// The clips of a manifest; `order` has parents before children, `visible` is as for
    /// [`encode::encode`].
    ///
    /// # Errors
    /// `BTH-L050` beyond the limits of the format.
    pub(super) fn of(manifest: &Manifest, order: &[usize], visible: &[bool]) -> Result<Self> {
        if manifest.deformers.is_empty() {
            return Ok(Self::default());
        }
        let as_they_are: Vec<_> = (0..manifest.objects.len() as u32).map(Some).collect();
        let mut nodes = Vec::new();
        let (parts, _) = encode::encode(manifest, order, visible, &as_they_are, &mut |rows| {
            nodes.extend_from_slice(rows);
            Ok(())
        })?;
        let parts = SceneParts { nodes, ..parts };
        let nodes = node_digests(&parts);
        let mut clips = Self::default();
        for deformer in &parts.deformers.deformers {
            let digest = digest(&parts, deformer, &nodes);
            clips.of_object.insert(deformer.object as usize, digest);
            clips.deformers.insert(digest, *deformer);
        }
        clips.parts = Some(parts);
        Ok(clips)
    }

    /// The clip of an object of the manifest.
    pub(super) fn of_object(&self, object: usize) -> Option<Digest> {
        self.of_object.get(&object).copied()
    }

    /// The poses of a mesh in a clip; `None` if the mesh does not fit the deformer, which is an
    /// error found later.
    pub(super) fn poses(&self, clip: &Digest, mesh: &Mesh) -> Option<ClipPoses<'_>> {
        let (parts, deformer) = (self.parts.as_ref()?, *self.deformers.get(clip)?);
        let deformation = mesh.deformation.clone()?;
        let skin = parts.deformers.skins.get(deformer.skin as usize);
        let joints = skin.map_or(0, |skin| skin.joints);
        let fits = deformation.counts.targets == deformer.weights
            && deformation.counts.joints <= joints
            && (deformation.counts.joints == 0) == (deformer.skin == NONE);
        fits.then(|| ClipPoses { parts, deformer, base: mesh.positions.clone(), deformation })
    }
}

/// The poses of an object in a clip.
pub(super) struct ClipPoses<'a> {
    parts: &'a SceneParts,
    deformer: Deformer,
    base: Vec<[f32; 3]>,
    deformation: Deformation,
}

impl PoseSource for ClipPoses<'_> {
    fn range(&self) -> (f64, f64) {
        let scene = &self.parts.scene;
        (f64::from(scene.first_frame) / scene.rate, f64::from(scene.last_frame) / scene.rate)
    }

    fn positions_at(&self, seconds: f64) -> Vec<[f32; 3]> {
        let Deformation { counts, joints, weights, morphs, morph_rows, deltas } = &self.deformation;
        let deformation = DeformationView {
            rows: std::slice::from_ref(counts),
            joints,
            weights,
            morphs,
            morph_rows,
            deltas,
        };
        let view = view(self.parts);
        DeformerPoses { view, deformer: self.deformer, base: &self.base, deformation }.positions_at(seconds)
    }
}

/// The rows as a reader sees them.
fn view(parts: &SceneParts) -> SceneView<'_> {
    SceneView {
        scene: std::slice::from_ref(&parts.scene),
        nodes: &parts.nodes,
        instances: &parts.instances,
        tracks: &parts.tracks,
        times: &parts.times,
        values: &parts.values,
        cameras: &parts.cameras,
        lights: &parts.lights,
        names: &parts.names,
        deformers: &parts.deformers.deformers,
        skins: &parts.deformers.skins,
        skin_joints: &parts.deformers.joints,
        morph_weights: &parts.deformers.weights,
        ..SceneView::default()
    }
}

/// Adds a track with its keys, of `width` numbers each.
fn add_track(rows: &mut HashedRows, view: &SceneView<'_>, track: &Track, width: usize) {
    let per_key = width * if track.interpolation == CUBIC { 3 } else { 1 };
    let (times, values) = view.keys(track, per_key);
    rows.add(&[track.property, track.interpolation]);
    rows.add(times);
    rows.add(values);
}

/// Code of cubic interpolation, whose keys have tangents.
const CUBIC: u32 = bth_format::layout::Interpolation::Cubic as u32;

/// For each node a hash of all that its transform to world space depends on at any time.
fn node_digests(parts: &SceneParts) -> Vec<Digest> {
    let view = view(parts);
    let mut digests: Vec<Digest> = Vec::with_capacity(parts.nodes.len());
    for (row, node) in (0u32..).zip(&parts.nodes) {
        let mut rows = HashedRows::new("node");
        match node.parent {
            NONE => rows.add(b"root"),
            parent => rows.add(digests[parent as usize].hex().as_bytes()),
        }
        rows.add(&node.transform);
        rows.add(&[node.flags & bth_format::layout::NODE_MATRIX]);
        let first = view.tracks.partition_point(|track| track.node < row);
        for track in view.tracks[first..].iter().take_while(|track| track.node == row) {
            let width = Property::from_code(track.property).and_then(Property::width);
            if let Some(width) = width.filter(|_| track.property != Property::Weights as u32) {
                add_track(&mut rows, &view, track, width);
            }
        }
        digests.push(rows.finish());
    }
    digests
}

/// A hash of all that the poses of a deformer's object depend on besides the object.
fn digest(parts: &SceneParts, deformer: &Deformer, nodes: &[Digest]) -> Digest {
    let view = view(parts);
    let mut rows = HashedRows::new("clip");
    rows.add(&[parts.scene.rate]);
    rows.add(&[parts.scene.first_frame, parts.scene.last_frame]);
    if let Some(skin) = view.skins.get(deformer.skin as usize) {
        for joint in &view.skin_joints[skin.first_joint as usize..][..skin.joints as usize] {
            rows.add(&joint.inverse_bind);
            rows.add(nodes[joint.node as usize].hex().as_bytes());
        }
    }
    rows.add(&view.morph_weights[deformer.first_weight as usize..][..deformer.weights as usize]);
    let key = (deformer.node, Property::Weights as u32);
    if let Ok(row) = view.tracks.binary_search_by_key(&key, |track| (track.node, track.property)) {
        add_track(&mut rows, &view, &view.tracks[row], deformer.weights as usize);
    }
    rows.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_scene::{Node, Nodes, Transform};

    /// A node "arm" under a node "body", which deforms an object by two targets, with a track of
    /// their weights.
    const TEXT: &str = "version = 1\n\
        frames = { first = 0, last = 8, rate = 4 }\n\
        objects = [{ name = \"face\", model = \"face.gltf\", mesh = 0, deforms = true }]\n\
        nodes = [{ name = \"body\" }, { name = \"arm\", parent = \"body\", object = \"face\" }, { name = \"other\" }]\n\
        skins = [{ name = \"s\", joints = [\"arm\"] }]\n\
        deformers = [{ node = \"arm\", object = \"face\", skin = \"s\", weights = [0.5, 0.25] }]\n\
        tracks = [{ node = \"arm\", property = \"weights\", times = [0, 1], values = [[0, 0], [1, 0.5]] }]\n";

    fn clip(change: impl FnOnce(&mut Manifest)) -> Option<Digest> {
        let mut manifest =
            bth_scene::parse(TEXT, std::path::Path::new("x")).unwrap_or_else(|e| panic!("{e}"));
        change(&mut manifest);
        let order = encode::order(&manifest);
        Clips::of(&manifest, &order, &vec![true; manifest.nodes.len()]).unwrap().of_object(0)
    }

    #[test]
    fn a_clip_depends_on_all_that_moves_the_object_and_on_nothing_else() {
        let clip_of = clip(|_| {});
        assert!(clip_of.is_some());
        let with_node = |at: usize, change: fn(&mut Node<'_>)| {
            clip(|m| {
                let mut changed = Nodes::default();
                for (row, mut node) in m.nodes.iter().enumerate() {
                    (row == at).then(|| change(&mut node));
                    changed.push(node);
                }
                m.nodes = changed;
            })
        };
        let moved: fn(&mut Node<'_>) = |node| {
            node.transform =
                Transform::Matrix([[1.0, 0.0, 0.0, 5.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);
        };
        assert_eq!(with_node(2, moved), clip_of);
        assert_eq!(with_node(0, |node| node.name = "torso"), clip_of);
        assert_ne!(with_node(0, moved), clip_of);
        assert_ne!(with_node(1, moved), clip_of);
        assert_ne!(clip(|m| m.frames.last = 9), clip_of);
        assert_ne!(clip(|m| m.deformers[0].weights[1] = 0.5), clip_of);
        assert_ne!(clip(|m| m.deformers[0].skin = None), clip_of);
        assert_ne!(clip(|m| m.tracks.clear()), clip_of);
        assert_eq!(clip(|m| m.deformers.clear()), None);
    }
}
