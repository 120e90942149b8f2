//! Meshes of an FBX file with their skins and shapes.

use std::array::from_fn;

use bth_format::layout::NONE;
use serde_json::json;
use ufbx::{
    BlendChannel, BlendKeyframe, BlendShape, Material, Mesh, Node, RefList, Scene, SkinDeformer, Vec3,
};

use crate::deformation::MOST_INFLUENCES;
use crate::error::{Place, Result};
use crate::gltf::made::{Made, center};
use crate::gltf::schema::{Faces, GltfMesh, GltfSkin, Primitive};
use crate::mesh::Polygons;
use crate::raw::{Raw, check_rows};
use crate::source::Source;

/// Corners of one vertex with different attributes that are looked through for an equal one.
const LOOKED_AT: usize = 16;

/// A mesh, whatever its materials are.
pub(super) struct Shape {
    /// The primitives by the rows of their materials.
    parts: Vec<(usize, Primitive)>,
    /// The middle of the mesh, where positions are relative to it.
    pub(super) center: Option<[f64; 3]>,
}

impl Shape {
    /// The mesh with the materials of a node.
    pub(super) fn mesh(&self, mesh: &Mesh, materials: &RefList<Material>) -> GltfMesh {
        let material = |row: usize| materials.as_ref().get(row).map(|m| m.element.typed_id as usize);
        let primitive = |(row, primitive): &(usize, Primitive)| Primitive {
            material: material(*row),
            ..primitive.clone()
        };
        let weights: Vec<f64> = targets(mesh).map(|(channel, _)| channel.weight).collect();
        GltfMesh {
            name: mesh_name(mesh),
            primitives: self.parts.iter().map(primitive).collect(),
            weights: Some(weights).filter(|weights| !weights.is_empty()),
        }
    }
}

/// A mesh without a name is called as its first node.
fn mesh_name(mesh: &Mesh) -> String {
    let node = || mesh.element.instances.iter().next().map_or("", |node| &node.element.name);
    Some(&*mesh.element.name).filter(|name| !name.is_empty()).unwrap_or_else(node).to_owned()
}

/// The shapes that move the vertices of a mesh, with what weighs them. Of shapes that follow each
/// other the last is taken.
pub(super) fn targets(mesh: &Mesh) -> impl Iterator<Item = (&BlendChannel, &BlendShape)> {
    let channels = mesh.blend_deformers.iter().flat_map(|deformer| deformer.channels.iter());
    channels.filter_map(|channel| Some((channel.as_ref(), channel.target_shape.as_deref()?)))
}

/// The shapes that are not the last of theirs.
pub(super) fn between(mesh: &Mesh) -> impl Iterator<Item = &BlendKeyframe> {
    targets(mesh).flat_map(|(channel, _)| channel.keyframes.iter().rev().skip(1))
}

/// Reads all meshes.
pub(super) fn shapes(
    source: &Source<'_>,
    scene: &Scene,
    polygons: Polygons,
    made: &mut Made,
) -> Result<Vec<Shape>> {
    let mut one = |mesh: &Mesh| {
        source.monitor.check()?;
        // What skins and shapes move stays where it is.
        let moves = mesh.skin_deformers.count + mesh.blend_deformers.count > 0;
        let center = center(mesh.vertices.iter().map(numbers)).filter(|_| !moves);
        let materials = mesh.materials.as_ref();
        let mut rows = CornerRows::new(mesh, center.unwrap_or_default());
        let mut parts = Vec::new();
        for part in &mesh.material_parts {
            let row = (part.index as usize).min(materials.len());
            parts.push((row, rows.primitive(source, part.face_indices.as_ref(), polygons, made)?));
        }
        Ok(Shape { parts, center })
    };
    scene.meshes.iter().map(|mesh| one(mesh)).collect()
}

fn numbers(v: &Vec3) -> [f64; 3] {
    [v.x, v.y, v.z]
}

/// Gives corners rows: one for all corners of a vertex with equal attributes.
struct CornerRows<'m> {
    mesh: &'m Mesh,
    center: [f64; 3],
    /// By vertex its last row so far.
    last: Vec<u32>,
    /// By row the row of the same vertex before.
    before: Vec<u32>,
    /// By row its first corner.
    corners: Vec<usize>,
}

impl<'m> CornerRows<'m> {
    fn new(mesh: &'m Mesh, center: [f64; 3]) -> Self {
        CornerRows {
            mesh,
            center,
            last: vec![NONE; mesh.num_vertices],
            before: Vec::new(),
            corners: Vec::new(),
        }
    }

    fn normal(&self, corner: usize) -> [f32; 3] {
        numbers(&self.mesh.vertex_normal[corner]).map(|x| x as f32)
    }

    /// Texture coordinates as glTF has them: v grows downwards.
    fn uv(&self, corner: usize) -> [f32; 2] {
        let uv = &self.mesh.vertex_uv[corner];
        [uv.x as f32, (1.0 - uv.y) as f32]
    }

    fn color(&self, corner: usize) -> [f32; 4] {
        let color = &self.mesh.vertex_color[corner];
        [color.x, color.y, color.z, color.w].map(|x| x as f32)
    }

    /// Returns true if two corners of a vertex have equal attributes.
    fn are_equal(&self, a: usize, b: usize) -> bool {
        let mesh = self.mesh;
        (!mesh.vertex_normal.exists || self.normal(a) == self.normal(b))
            && (!mesh.vertex_uv.exists || self.uv(a) == self.uv(b))
            && (!mesh.vertex_color.exists || self.color(a) == self.color(b))
    }

    /// The rows of a vertex, the last first.
    fn of_vertex(&self, vertex: u32) -> impl Iterator<Item = u32> {
        let last = self.last.get(vertex as usize).copied().filter(|row| *row != NONE);
        std::iter::successors(last, |row| Some(self.before[*row as usize]).filter(|row| *row != NONE))
    }

    /// The row of a corner, which may be new.
    fn of(&mut self, corner: usize) -> u32 {
        let vertex = self.mesh.vertex_indices[corner];
        let is_equal = |row: &u32| self.are_equal(self.corners[*row as usize], corner);
        let known = self.of_vertex(vertex).take(LOOKED_AT).find(is_equal);
        if let Some(row) = known {
            return row;
        }
        let row = self.corners.len() as u32;
        self.corners.push(corner);
        self.before.push(std::mem::replace(&mut self.last[vertex as usize], row));
        row
    }

    fn position(&self, row: usize) -> [f64; 3] {
        let p = numbers(&self.mesh.vertex_position[self.corners[row]]);
        from_fn(|k| p[k] - self.center[k])
    }

    fn vertex(&self, row: usize) -> usize {
        self.mesh.vertex_indices[self.corners[row]] as usize
    }

    /// Makes a primitive of faces.
    fn primitive(
        &mut self,
        source: &Source<'_>,
        faces: &[u32],
        polygons: Polygons,
        made: &mut Made,
    ) -> Result<Primitive> {
        self.corners.clear();
        self.before.clear();
        let mut raw = Raw::new("fbx", Box::new(|_, _| Place::File(source.path.to_owned())));
        let (mut exact, mut face_rows) = (Vec::new(), Vec::new());
        for (face, number) in faces.iter().zip(0..) {
            source.tick(number, 0)?;
            if self.mesh.face_hole.as_ref().get(*face as usize) == Some(&true) {
                raw.skipped += 1;
                continue;
            }
            let face = &self.mesh.faces[*face as usize];
            face_rows.clear();
            for corner in face.index_begin..face.index_begin + face.num_indices {
                face_rows.push(self.of(corner as usize));
            }
            exact.extend((exact.len()..self.corners.len()).map(|row| self.position(row)));
            raw.positions.extend(exact[raw.positions.len()..].iter().map(|p| p.map(|x| x as f32)));
            raw.push_face(&face_rows)?;
        }
        check_rows(exact.len() as u64)?;
        raw.finish_polygons_again(&exact, polygons, source.monitor)?;
        let mut primitive = self.attributes(&raw.positions, made);
        primitive.indices = Some(made.indices(raw.triangles.iter().copied().flatten()));
        primitive.targets = self.shapes(made);
        primitive.faces = Faces { polygons: raw.polygons, skipped: raw.skipped, concave: raw.concave };
        for row in 0..self.corners.len() {
            let vertex = self.vertex(row);
            self.last[vertex] = NONE;
        }
        Ok(primitive)
    }

    /// Adds the attributes of the rows.
    fn attributes(&self, positions: &[[f32; 3]], made: &mut Made) -> Primitive {
        let (mesh, corners) = (self.mesh, || self.corners.iter().copied());
        let mut primitive = Primitive::default();
        let mut add = |name: &str, accessor| primitive.attributes.insert(name.to_owned(), accessor);
        add("POSITION", made.floats(positions.iter().copied()));
        if mesh.vertex_normal.exists {
            add("NORMAL", made.floats(corners().map(|corner| self.normal(corner))));
        }
        if mesh.vertex_uv.exists {
            add("TEXCOORD_0", made.floats(corners().map(|corner| self.uv(corner))));
        }
        if mesh.vertex_color.exists {
            add("COLOR_0", made.floats(corners().map(|corner| self.color(corner))));
        }
        let Some(skin) = first_skin(mesh) else { return primitive };
        let influences: Vec<_> =
            (0..self.corners.len()).map(|row| influences(skin, self.vertex(row))).collect();
        let most = influences.iter().map(Vec::len).max().unwrap_or(0);
        for (set, from) in (0..most).step_by(4).enumerate() {
            let part = |row: &Vec<(u16, f32)>| from_fn(|k| row.get(from + k).copied().unwrap_or_default());
            let parts: Vec<[(u16, f32); 4]> = influences.iter().map(part).collect();
            let joints = made.joints(parts.iter().map(|part| part.map(|(joint, _)| joint)));
            add(&format!("JOINTS_{set}"), joints);
            add(
                &format!("WEIGHTS_{set}"),
                made.floats(parts.iter().map(|part| part.map(|(_, weight)| weight))),
            );
        }
        primitive
    }

    /// Adds the shapes, as morph targets.
    fn shapes(&self, made: &mut Made) -> Vec<serde_json::Value> {
        let count = self.corners.len();
        let target = |(_, shape): (&BlendChannel, &BlendShape)| {
            let mut moved = Vec::new();
            for (vertex, offset) in shape.offset_vertices.iter().zip(shape.position_offsets.iter()) {
                let offset = numbers(offset).map(|x| x as f32);
                moved.extend(self.of_vertex(*vertex).map(|row| (row, offset)));
            }
            json!({"POSITION": made.sparse(count, &moved)})
        };
        targets(self.mesh).map(target).collect()
    }
}

/// The skin of a mesh, if 16 bits can number its joints.
fn first_skin(mesh: &Mesh) -> Option<&SkinDeformer> {
    let first = mesh.skin_deformers.iter().next()?;
    (first.clusters.count < usize::from(u16::MAX)).then_some(first)
}

/// What moves a vertex: at most eight joints and their weights, the largest. Without any it follows
/// the node of its mesh, which is the joint after all others.
fn influences(skin: &SkinDeformer, vertex: usize) -> Vec<(u16, f32)> {
    let of = skin.vertices.as_ref().get(vertex);
    let weights =
        of.and_then(|v| skin.weights.as_ref().get(v.weight_begin as usize..)?.get(..v.num_weights as usize));
    let influence = |w: &ufbx::SkinWeight| Some((u16::try_from(w.cluster_index).ok()?, w.weight as f32));
    let mut all: Vec<_> = weights.unwrap_or_default().iter().filter_map(influence).collect();
    all.retain(|(_, weight)| *weight > 0.0 && weight.is_finite());
    all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    all.truncate(MOST_INFLUENCES);
    if all.is_empty() {
        all.push((skin.clusters.count as u16, 1.0));
    }
    all
}

/// Adds the skin of a mesh at a node.
pub(super) fn skin(mesh: &Mesh, node: &Node, made: &mut Made) -> Option<usize> {
    let skin = first_skin(mesh)?;
    let joint = |node: &Node| node.element.typed_id as usize;
    let clusters =
        || skin.clusters.iter().filter_map(|cluster| Some((cluster.bone_node.as_deref()?, cluster)));
    let joints = clusters().map(|(bone, _)| joint(bone)).chain([joint(node)]).collect();
    let matrices = clusters().map(|(_, cluster)| {
        let m = &cluster.geometry_to_bone;
        let columns = [m.m00, m.m10, m.m20, 0.0, m.m01, m.m11, m.m21, 0.0, m.m02, m.m12, m.m22, 0.0];
        let columns: Vec<f64> = columns.into_iter().chain([m.m03, m.m13, m.m23, 1.0]).collect();
        from_fn(|k| columns[k] as f32)
    });
    const IDENTITY: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let matrices = made.floats(matrices.chain([IDENTITY]));
    let name = skin.element.name.to_string();
    made.document.skins.push(GltfSkin { name, inverse_bind_matrices: Some(matrices), joints });
    Some(made.document.skins.len() - 1)
}
