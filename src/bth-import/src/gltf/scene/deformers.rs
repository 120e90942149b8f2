//! Deformers of a manifest from the skins and morph targets of a glTF scene (glTF 2.0
//! specification, §3.7.2.2 and §3.7.3).

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use bth_scene::{Deformer, JointSet, Node, Skin, Source, Transform};

use crate::error::Result;
use crate::gltf::file::WEIGHTS;
use crate::gltf::placed_mesh::GltfPart;
use crate::gltf::scene::importer::{Deforming, Importer};
use crate::gltf::schema::GltfNode;
use crate::gltf::transform;

impl Importer<'_, '_> {
    /// Places the mesh of a node that has morph targets or a skin: as an object that deforms if an
    /// animation moves it, else as one at rest.
    pub(super) fn deforming(
        &mut self,
        index: usize,
        node: &GltfNode,
        mesh: usize,
        row: usize,
    ) -> Result<usize> {
        let part = format!("node {index}");
        let weights = self.weights(node, mesh, &part)?;
        let moves = self.is_moved(index, node)?;
        let name = self.file.document.meshes[mesh].name.clone();
        if moves && self.options.deform {
            let (path, mesh) = (self.path.to_owned(), mesh as u32);
            let source = Source::Deforming { path, mesh, without: JointSet::default() };
            let object = self.new_object(&name, mesh as usize, source);
            self.deforming.push(Deforming { node: index, row, object, weights });
            return Ok(object);
        }
        if moves {
            self.ignore(&part, "its skin and morph targets are not animated: it stays at rest".to_owned())?;
        }
        if node.skin.is_none() && node.weights.is_none() {
            return self.object(mesh, &part);
        }
        let key = GltfPart::AtRest(index as u32);
        if let Some(object) = self.objects.get(&key) {
            return Ok(*object);
        }
        let source = Source::AtRest { path: self.path.to_owned(), node: index as u32 };
        let object = self.new_object(&name, mesh, source);
        self.objects.insert(key, object);
        Ok(object)
    }

    /// Adds a node in world space for an object with a skin at rest, since the transform of the
    /// object's node has no effect (§3.7.3.2).
    pub(super) fn place_in_world(&mut self, row: usize, object: usize) {
        let mut visible = true;
        let mut next = Some(row);
        while let Some(at) = next {
            let node = self.manifest.nodes.get(at);
            visible &= node.visible;
            next = node.parent;
        }
        let name = format!("{}/at rest", self.manifest.nodes.name(row));
        let name = self.names.nodes.unique(&name, String::new());
        let transform = Transform::default();
        self.manifest.nodes.push(Node {
            name: &name,
            parent: None,
            transform,
            object: Some(object),
            group: None,
            visible,
        });
    }

    /// A further object of the manifest.
    pub(super) fn new_object(&mut self, name: &str, mesh: usize, source: Source) -> usize {
        let name = self.names.objects.unique(name, format!("mesh {mesh}"));
        self.manifest.objects.push(bth_scene::Object::new(name, source));
        self.manifest.objects.len() - 1
    }

    /// Returns the morph weights of a node: its own, else of its mesh, else zeros.
    fn weights(&self, node: &GltfNode, mesh: usize, part: &str) -> Result<Vec<f64>> {
        let found = &self.file.document.meshes[mesh];
        let targets = found.primitives.first().map_or(0, |primitive| primitive.targets.len());
        let weights = node.weights.as_ref().or(found.weights.as_ref());
        let weights = weights.filter(|weights| !weights.is_empty()).cloned();
        let weights = weights.unwrap_or_else(|| vec![0.0; targets]);
        if weights.len() != targets {
            let message =
                format!("expected a weight for each of {targets} morph targets, found {}", weights.len());
            return Err(self.file.error(WEIGHTS, part, message));
        }
        Ok(weights)
    }

    /// Returns true if the chosen animations change the weights of a node or move a joint of its
    /// skin.
    fn is_moved(&self, index: usize, node: &GltfNode) -> Result<bool> {
        if self.morphed[index] && node.mesh.is_some_and(|mesh| self.file.document.has_targets(mesh)) {
            return Ok(true);
        }
        let Some(skin) = node.skin else { return Ok(false) };
        let mut at_rest = HashSet::new();
        for &joint in &self.file.skin(skin)?.joints {
            let path = self.ancestors_until(joint, |node| at_rest.contains(&node))?;
            if path.iter().any(|node| self.moved[*node]) {
                return Ok(true);
            }
            at_rest.extend(path);
        }
        Ok(false)
    }

    /// A node of the document and those above it, upwards, below the first that is known.
    fn ancestors_until(&self, node: usize, is_known: impl Fn(usize) -> bool) -> Result<Vec<usize>> {
        let mut path = Vec::new();
        let mut next = Some(node);
        while let Some(index) = next {
            if index >= self.file.document.nodes.len() {
                return Err(self.file.graph_error(format!("node {index}"), "it does not exist"));
            }
            if is_known(index) {
                break;
            }
            if path.len() > self.file.document.nodes.len() {
                return Err(self.file.graph_error(format!("node {node}"), "it is an ancestor of itself"));
            }
            path.push(index);
            next = self.parents[index];
        }
        Ok(path)
    }

    /// Adds the deformers of the nodes that deform, with their skins.
    pub(super) fn deformers(&mut self) -> Result<()> {
        let mut skins = HashMap::new();
        for Deforming { node, row, object, weights } in std::mem::take(&mut self.deforming) {
            let mut skin = None;
            if let Some(number) = self.file.document.nodes[node].skin {
                if let Entry::Vacant(entry) = skins.entry(number) {
                    entry.insert(self.skin(number)?);
                }
                skin = skins.get(&number).copied();
            }
            self.manifest.deformers.push(Deformer { node: row, object, skin, weights });
        }
        self.manifest.deformers.sort_by_key(|deformer| deformer.node);
        Ok(())
    }

    /// Adds a skin to the manifest. Joints outside of the scene get nodes with the transforms of
    /// the document's.
    fn skin(&mut self, number: usize) -> Result<usize> {
        let part = format!("skin {number}");
        let found = self.file.skin(number)?;
        if found.joints.is_empty() {
            return Err(self.file.graph_error(part, "expected at least one joint"));
        }
        let inverse_binds = self.file.inverse_binds(number, found)?;
        let inverse_binds = inverse_binds.map(|all| all.iter().map(transform::rows).collect::<Vec<_>>());
        let finite = |matrix: &[[f64; 4]; 3]| matrix.as_flattened().iter().all(|x| x.is_finite());
        if inverse_binds.as_ref().is_some_and(|all| !all.iter().all(finite)) {
            return Err(self.file.graph_error(part, "expected finite inverse bind matrices"));
        }
        let joints = found.joints.iter().map(|joint| self.joint(*joint)).collect::<Result<_>>()?;
        let name = self.names.skins.unique(&found.name, part);
        self.manifest.skins.push(Skin { name, joints, inverse_binds });
        Ok(self.manifest.skins.len() - 1)
    }

    /// The row of a joint's node.
    fn joint(&mut self, joint: usize) -> Result<usize> {
        let without_row = self.ancestors_until(joint, |node| self.report.node_rows[node].is_some())?;
        let above = without_row.last().map_or(Some(joint), |last| self.parents[*last]);
        let mut row = above.and_then(|node| self.report.node_rows[node]);
        for &index in without_row.iter().rev() {
            let node = &self.file.document.nodes[index];
            let transform = self.transform(node, &format!("node {index}"))?;
            let name = self.names.nodes.unique(&node.name, format!("node {index}"));
            let parent = row.replace(self.manifest.nodes.len());
            self.manifest.nodes.push(Node {
                name: &name,
                parent,
                transform,
                object: None,
                group: None,
                visible: true,
            });
            self.report.node_rows[index] = row;
        }
        row.ok_or_else(|| self.file.graph_error(format!("node {joint}"), "it does not exist"))
    }
}
