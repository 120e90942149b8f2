//! Which meshes of a glTF document a model is made of, and where they are placed.

use bth_scene::JointSet;
use glam::DAffine3;

use crate::error::Result;
use crate::gltf::file::{GRAPH, GltfFile};
use crate::gltf::rigid_parts::KeptTriangles;
use crate::gltf::transform;

/// A mesh at a place of the flat model.
pub(super) struct PlacedMesh {
    /// `None` when the mesh is read in its own space.
    pub(super) node: Option<usize>,
    pub(super) mesh: usize,
    pub(super) world: DAffine3,
    pub(super) kept: KeptTriangles,
}

/// A part of a glTF document that is read as a separate model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GltfPart {
    /// A mesh by its number, in its own space.
    Mesh(u32),
    /// A mesh in its own space, with what moves its vertices.
    Deforming {
        /// Number of the mesh.
        mesh: u32,
        /// Joints whose rigid parts ([`GltfPart::Rigid`]) are skipped.
        without: JointSet,
    },
    /// The connected components of a mesh that one joint alone moves, in the space of the mesh.
    Rigid {
        /// Number of the mesh.
        mesh: u32,
        /// Number of the joint.
        joint: u32,
    },
    /// The mesh of a node, by the node's number, at rest: with its default morph weights, and with
    /// its joints where the nodes place them. With a skin it is in world space, else in the node's
    /// space.
    AtRest(u32),
}

impl GltfPart {
    /// The mesh of the part.
    ///
    /// # Errors
    /// `BTH-I012` where the node does not exist or has no mesh.
    pub(super) fn placed(self, file: &GltfFile<'_>) -> Result<PlacedMesh> {
        let kept = match self {
            GltfPart::Mesh(_) | GltfPart::AtRest(_) => KeptTriangles::All,
            GltfPart::Deforming { without, .. } => KeptTriangles::without(without),
            GltfPart::Rigid { joint, .. } => KeptTriangles::Part(joint),
        };
        let (node, mesh) = match self {
            GltfPart::Mesh(mesh) | GltfPart::Deforming { mesh, .. } | GltfPart::Rigid { mesh, .. } => {
                (None, mesh as usize)
            }
            GltfPart::AtRest(node) => {
                let mesh = file.document.nodes.get(node as usize).and_then(|node| node.mesh);
                let message = "it does not exist or has no mesh";
                let part = format!("node {node}");
                let error = || file.source.error_in_part(GRAPH, part, message, "name a node that has a mesh");
                (Some(node as usize), mesh.ok_or_else(error)?)
            }
        };
        Ok(PlacedMesh { node, mesh, world: DAffine3::IDENTITY, kept })
    }
}

/// Returns the scene's visible nodes that have a mesh, in depth-first order, with their world
/// transforms, and how many KHR_node_visibility hides.
pub(super) fn placed_meshes(file: &GltfFile<'_>) -> Result<(Vec<PlacedMesh>, u64)> {
    let document = &file.document;
    let roots = match document.scenes.get(document.scene.unwrap_or(0)) {
        Some(scene) => scene.nodes.clone(),
        None if document.scene.is_some() => {
            return Err(
                file.graph_error(format!("scene {}", document.scene.unwrap_or(0)), "it does not exist")
            );
        }
        None => document.parentless_nodes(),
    };
    let (mut placed, mut hidden) = (Vec::new(), 0);
    let mut visited = vec![false; document.nodes.len()];
    let mut stack: Vec<_> = roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY, true)).collect();
    while let Some((index, parent, visible)) = stack.pop() {
        let part = || format!("node {index}");
        let node = document.nodes.get(index).ok_or_else(|| file.graph_error(part(), "it does not exist"))?;
        if std::mem::replace(&mut visited[index], true) {
            return Err(
                file.graph_error(part(), "expected a node with one parent, found it twice in the scene")
            );
        }
        let world = parent * transform::local(node);
        let visible = file.is_visible(index, node)? && visible;
        match node.mesh {
            Some(mesh) if visible => {
                placed.push(PlacedMesh { node: Some(index), mesh, world, kept: KeptTriangles::All });
            }
            mesh => hidden += u64::from(mesh.is_some()),
        }
        stack.extend(node.children.iter().rev().map(|&child| (child, world, visible)));
    }
    Ok((placed, hidden))
}
