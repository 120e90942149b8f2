//! Nodes of a 3MF package: what is built, with its components.

use crate::error::{Error, Result};
use crate::gltf::extensions::Use;
use crate::gltf::file::GRAPH;
use crate::gltf::made::Made;
use crate::gltf::schema::{GltfNode, GltfScene};
use crate::gltf::threemf::model::{Model, read};
use crate::gltf::threemf::object::Placed;
use crate::mesh::Polygons;
use crate::source::Source;

/// Nodes that a scene may have.
const MOST_NODES: usize = 1 << 20;

/// Makes a glTF document of a package, in metres and with y up.
pub(super) fn document(source: &Source<'_>, used: Use, _: Polygons) -> Result<Made> {
    let mut made = Made::default();
    let model = read(source, &mut made)?;
    let unit = model.unit();
    let nodes = nodes(source, &model, unit)?;
    if used != Use::Parts {
        model.warn();
    }
    made.document.asset.space = Some(format!("units of {unit} m, z up; read as metres with y up"));
    made.document.nodes = nodes;
    made.document.scenes.push(GltfScene { name: String::new(), nodes: vec![0] });
    Ok(made)
}

/// The root, which has the transform from the file's units and axes, and below it a node for each
/// object that is built and for each component in it.
fn nodes(source: &Source<'_>, model: &Model<'_>, unit: f64) -> Result<Vec<GltfNode>> {
    let axes = [unit, 0., 0., 0., 0., 0., -unit, 0., 0., unit, 0., 0., 0., 0., 0., 1.];
    let mut nodes =
        vec![GltfNode { name: "root".to_owned(), matrix: Some(axes.into()), ..GltfNode::default() }];
    let mut stack: Vec<(usize, &Placed, usize)> = model.items.iter().rev().map(|item| (0, item, 0)).collect();
    while let Some((parent, placed, depth)) = stack.pop() {
        let object = model.objects.get(&placed.key).ok_or_else(|| model.no_object(placed.key))?;
        if depth > model.objects.len() {
            let place = format!("{} object {}", model.parts[placed.key.0], placed.key.1);
            let message = "expected components that do not contain each other";
            return Err(source.error_in_part(GRAPH, place, message, super::EXPORT));
        }
        if nodes.len() >= MOST_NODES {
            let message = format!(
                "{}: a scene from 3MF may have up to {MOST_NODES} nodes; this one has more",
                source.path.display()
            );
            return Err(Error::Limit { code: "BTH-L050", message });
        }
        let mut add = |parent: usize, node: GltfNode| {
            let number = nodes.len();
            nodes[parent].children.push(number);
            nodes.push(node);
            number
        };
        let name = object.name.clone();
        let mesh = object.mesh.filter(|_| object.center.is_none());
        let matrix = Some(placed.matrix.into());
        let number = add(parent, GltfNode { name, matrix, mesh, ..GltfNode::default() });
        if let Some(center) = object.center {
            let (name, translation, mesh) =
                (format!("{}/mesh", object.name), Some(center.into()), object.mesh);
            add(number, GltfNode { name, translation, mesh, ..GltfNode::default() });
        }
        stack.extend(object.components.iter().rev().map(|component| (number, component, depth + 1)));
    }
    Ok(nodes)
}
