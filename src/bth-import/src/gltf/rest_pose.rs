//! The rest pose of a mesh: its default morph weights, then its skin with the joints where the
//! nodes place them at rest.
//!
//! glTF 2.0 specification, §3.7.2.2 (morph targets) and §3.7.3 (skins): a vertex p becomes Σ wᵢ ·
//! G(jointᵢ) · IBMᵢ · (p + Σ mₖ Δpₖ), where G is the transform of a joint's node to world space
//! through all its ancestors. The transform of the skinned node itself has no effect (§3.7.3.2).

use glam::{DAffine3, DMat3, DVec3};

use crate::error::Result;
use crate::gltf::file::GltfFile;
use crate::gltf::primitive::{PrimitiveReader, Triangles};
use crate::gltf::schema::GltfSkin;
use crate::gltf::transform;
use crate::source::INDEX;

/// How a placed mesh deforms at rest.
#[derive(Default)]
pub(super) struct RestPose {
    /// Weights of the morph targets: of the node, else of the mesh.
    weights: Vec<f64>,
    /// For each joint of the skin the transform from the mesh to world space; `None` without a
    /// skin.
    joints: Option<Vec<DAffine3>>,
}

impl RestPose {
    /// The rest pose of the mesh of a node, or of a mesh on its own.
    ///
    /// # Errors
    /// `BTH-I012` where a skin or a joint does not exist or nodes are their own ancestors, and as
    /// for an accessor.
    pub(super) fn new(file: &GltfFile<'_>, node: Option<usize>, mesh: usize) -> Result<RestPose> {
        let document = &file.document;
        let of_node = node.and_then(|node| document.nodes[node].weights.as_ref());
        let of_mesh = document.meshes.get(mesh).and_then(|mesh| mesh.weights.as_ref());
        let weights = of_node.or(of_mesh).cloned().unwrap_or_default();
        let skin = node.and_then(|node| document.nodes[node].skin);
        let joints = skin.map(|skin| joint_transforms(file, skin)).transpose()?;
        Ok(RestPose { weights, joints })
    }

    /// Returns true if [`Self::apply`] brings positions to world space: for skinned meshes.
    pub(super) fn is_skinned(&self) -> bool {
        self.joints.is_some()
    }

    /// Moves the vertices of a primitive, and turns their normals, to where they are at rest.
    ///
    /// # Errors
    /// `BTH-I005` for joints that the skin does not have, and as for an accessor.
    pub(super) fn apply(&self, reader: &PrimitiveReader<'_, '_>, triangles: &mut Triangles) -> Result<()> {
        let wide = |rows: &[[f32; 3]]| rows.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
        let targets = reader.targets()?;
        let morphs: Vec<_> =
            self.weights.iter().zip(&targets).filter(|(weight, _)| **weight != 0.0).collect();
        if morphs.is_empty() && self.joints.is_none() {
            return Ok(());
        }
        let rows = triangles.positions.len() as u64;
        let mut positions: Vec<DVec3> = wide(&triangles.positions);
        let mut normals: Option<Vec<DVec3>> = triangles.normals.as_deref().map(wide);
        for (weight, target) in morphs {
            let add = |values: &mut [DVec3], name: &str| -> Result<()> {
                let Some(&accessor) = target.get(name) else { return Ok(()) };
                let offsets: Vec<[f32; 3]> = reader.rows(accessor, rows)?;
                for (value, offset) in values.iter_mut().zip(offsets) {
                    *value += *weight * DVec3::from_array(offset.map(f64::from));
                }
                Ok(())
            };
            add(&mut positions, "POSITION")?;
            normals.as_mut().map_or(Ok(()), |normals| add(normals, "NORMAL"))?;
        }
        if let Some(joints) = &self.joints {
            let transforms = vertex_transforms(reader, joints, triangles)?;
            for (position, transform) in positions.iter_mut().zip(&transforms) {
                *position = transform.transform_point3(*position);
            }
            for (normal, transform) in normals.iter_mut().flatten().zip(&transforms) {
                *normal = transform::direction_of_normal(transform, *normal);
            }
        }
        let narrow = |v: &DVec3| v.to_array().map(|x| x as f32);
        triangles.positions = positions.iter().map(narrow).collect();
        if let Some(normals) = normals {
            triangles.normals = Some(normals.iter().map(|n| narrow(&n.normalize_or_zero())).collect());
        }
        Ok(())
    }
}

/// For each joint of a skin the transform from the bind pose of the mesh to world space. Without
/// inverse bind matrices these are the identity.
fn joint_transforms(file: &GltfFile<'_>, skin: usize) -> Result<Vec<DAffine3>> {
    let found = file.skin(skin)?;
    let binds = file.inverse_binds(skin, found)?;
    let parents = file.document.parents();
    let joint = |(k, &node): (usize, &usize)| {
        let world = to_world(file, &parents, node)?;
        Ok(binds.as_ref().map_or(world, |binds| world * binds[k]))
    };
    found.joints.iter().enumerate().map(joint).collect()
}

impl GltfFile<'_> {
    /// Returns a skin.
    ///
    /// # Errors
    /// `BTH-I012` where it does not exist.
    pub(super) fn skin(&self, skin: usize) -> Result<&GltfSkin> {
        let found = self.document.skins.get(skin);
        found.ok_or_else(|| self.graph_error(format!("skin {skin}"), "it does not exist"))
    }

    /// Returns the inverse bind matrix of each joint of a skin, if it has some.
    ///
    /// # Errors
    /// `BTH-I012` where there are too few, and the errors of accessors.
    pub(super) fn inverse_binds(&self, skin: usize, found: &GltfSkin) -> Result<Option<Vec<DAffine3>>> {
        let Some(accessor) = found.inverse_bind_matrices else { return Ok(None) };
        let mut matrices = self.matrices(accessor)?;
        let (joints, binds) = (found.joints.len(), matrices.len());
        if binds < joints {
            let message =
                format!("expected an inverse bind matrix for each of {joints} joints, found {binds}");
            return Err(self.graph_error(format!("skin {skin}"), message));
        }
        matrices.truncate(joints);
        Ok(Some(matrices))
    }
}

/// The transform of a node to world space, through all its ancestors.
fn to_world(file: &GltfFile<'_>, parents: &[Option<usize>], node: usize) -> Result<DAffine3> {
    let document = &file.document;
    let mut world = DAffine3::IDENTITY;
    let (mut next, mut steps) = (Some(node), 0);
    while let Some(index) = next {
        let Some(found) = document.nodes.get(index) else {
            return Err(file.graph_error(format!("node {index}"), "it does not exist"));
        };
        steps += 1;
        if steps > document.nodes.len() {
            return Err(file.graph_error(format!("node {node}"), "it is an ancestor of itself"));
        }
        world = transform::local(found) * world;
        next = parents[index];
    }
    Ok(world)
}

/// For each vertex the sum of the transforms of its joints by their weights, which are divided by
/// their sum. A vertex without weights follows its first joint.
fn vertex_transforms(
    reader: &PrimitiveReader<'_, '_>,
    joints: &[DAffine3],
    triangles: &Triangles,
) -> Result<Vec<DAffine3>> {
    let zero = DAffine3::from_mat3_translation(DMat3::ZERO, DVec3::ZERO);
    let mut blended = vec![(zero, 0.0, None); triangles.positions.len()];
    for set in 0.. {
        let [indices, weights] = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
        let (Some(indices), Some(weights)) =
            (reader.optional::<4>(triangles, &indices)?, reader.optional::<4>(triangles, &weights)?)
        else {
            break;
        };
        for (row, (indices, weights)) in indices.iter().zip(&weights).enumerate() {
            let (sum, total, first) = &mut blended[row];
            for (&index, &weight) in indices.iter().zip(weights) {
                let Some(joint) = joints.get(index as usize) else {
                    let message =
                        format!("row {row}: expected a joint below {}, found {index}", joints.len());
                    return Err(reader.file.error(INDEX, reader.part.as_str(), message));
                };
                first.get_or_insert(*joint);
                let weight = f64::from(weight);
                sum.matrix3 += joint.matrix3 * weight;
                sum.translation += joint.translation * weight;
                *total += weight;
            }
        }
    }
    let blend = |(sum, total, first): (DAffine3, f64, Option<DAffine3>)| match first {
        None => DAffine3::IDENTITY,
        Some(first) if total == 0.0 => first,
        Some(_) => DAffine3 { matrix3: sum.matrix3 * (1.0 / total), translation: sum.translation / total },
    };
    Ok(blended.into_iter().map(blend).collect())
}
