//! Assembles an object from the results of the stages, and the file with one object.

use super::report::{FileReport, MotionReport};
use super::traced::{TracedMesh, collapse};
use crate::coordinates::OnGrid;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::stage::Stage;
use crate::{bvh, free, tets, write};
use bth_import::{ImageFile, Mesh};
use std::collections::BTreeSet;

/// A compiled file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Compiled {
    /// The bytes of the file. They depend on the source's content and the options only.
    pub bytes: Vec<u8>,
}

impl From<bth_format::File> for Compiled {
    fn from(file: bth_format::File) -> Self {
        Compiled { bytes: file.bytes().to_vec() }
    }
}

/// The tree of an object.
pub(super) struct Hierarchy {
    pub(super) wide: bvh::Wide,
    /// The box of what can be hit; `None` if that is nothing.
    pub(super) bounds: Option<([f32; 3], [f32; 3])>,
    /// Triangles that no ray can hit.
    pub(super) dropped: u32,
}

/// What an object keeps besides its tree.
pub(super) struct ObjectSource {
    /// The mesh; its vertices are on the grid, if there is one.
    pub(super) mesh: Mesh,
    /// The grid and the original positions, if vertices were moved.
    pub(super) on_grid: Option<OnGrid>,
    /// Absent where free directions are not kept.
    pub(super) free: Option<free::Free>,
    /// How it was compiled, if its vertices move by themselves.
    pub(super) motion: Option<MotionReport>,
}

/// An object that is ready to be written.
pub(crate) struct Object {
    /// The mesh; its vertices are on the grid, if there is one.
    mesh: Mesh,
    /// The grid and the original positions, if vertices were moved.
    on_grid: Option<OnGrid>,
    hierarchy: Hierarchy,
    /// The place of each triangle in the leaves.
    places: Vec<u32>,
    /// Absent where free directions are not kept.
    free: Option<free::FreeRows>,
    /// Absent without tet leaves.
    encoded: Option<tets::Encoded>,
    /// Absent where no groups are kept.
    groups: Option<write::GroupParts>,
    pub(crate) tet_leaves: u64,
    pub(crate) tet_triangles: u64,
    /// How it was compiled, if its vertices move by themselves.
    pub(crate) motion: Option<MotionReport>,
}

/// Assembles an object: collapses the BVH with tet leaves instead of their nodes, and encodes the
/// tet leaves.
pub(super) struct Collapse<'a> {
    pub(super) traced: TracedMesh,
    pub(super) leaves: Vec<tets::Leaf>,
    pub(super) free: Option<free::Free>,
    pub(super) motion: Option<MotionReport>,
    pub(super) options: &'a CompileOptions,
}

impl Stage for Collapse<'_> {
    type Output = (Object, bvh::CollapseReport);
    const NAME: &'static str = "collapse";
    const VERSION: &'static str = "6";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { traced, leaves, free, motion, options } = self;
        let (cut, meshes): (Vec<u32>, Vec<tets::TetMesh>) = leaves.into_iter().unzip();
        let (wide, report) = collapse(traced.by_ref(), &cut, options, monitor)?;
        // The tree takes more memory than the rest, and is not needed any more.
        let TracedMesh { mesh, on_grid, tree, .. } = traced;
        let bounds = tree.nodes.first().map(|root| (root.lower, root.upper));
        let dropped = (mesh.triangles.len() - tree.order.len()) as u32;
        drop(tree);
        let source = ObjectSource { mesh, on_grid, free, motion };
        Ok((Object::new(source, Hierarchy { wide, bounds, dropped }, meshes), report))
    }
}

impl Object {
    /// An object with a tree, in which tet leaves are these.
    pub(super) fn new(source: ObjectSource, hierarchy: Hierarchy, tets: Vec<tets::TetMesh>) -> Self {
        let ObjectSource { mesh, on_grid, free, motion } = source;
        let triangles = mesh.triangles.len();
        let grid = on_grid.as_ref().map(|on_grid| &on_grid.grid);
        let places = bvh::triangle_places(&hierarchy.wide, grid, triangles);
        Self {
            free: free.map(|free| free::FreeRows::new(free, &places)),
            groups: mesh.groups.as_ref().map(write::GroupParts::of),
            tet_leaves: tets.len() as u64,
            tet_triangles: tets.iter().map(|tets| tets.faces.len() as u64).sum(),
            encoded: (!tets.is_empty()).then(|| tets::encode(&tets, triangles)),
            mesh,
            on_grid,
            hierarchy,
            places,
            motion,
        }
    }

    /// The file with this object only, after the checks of a reader.
    pub(super) fn file(
        &self,
        provenance: String,
        images: &[ImageFile],
        options: &CompileOptions,
    ) -> Result<(bth_format::File, FileReport)> {
        let mut builder = write::FileBuilder::new();
        write::object(&mut builder, 0, &self.parts(options))?;
        write::images(&mut builder, images.iter().map(|image| (image.name, image.bytes.as_slice())))?;
        builder.provenance(provenance)?;
        let file = write::open(&builder)?;
        file.check_images().map_err(write::defect)?;
        let resident_bytes = file.resident_bytes();
        let triangles = self.mesh.triangles.len();
        let report = FileReport {
            bytes: file.bytes().len() as u64,
            tet_leaves: self.tet_leaves,
            tet_triangles: self.tet_triangles,
            resident_bytes,
            resident_bytes_per_triangle: resident_bytes as f64 / triangles.max(1) as f64,
        };
        Ok((file, report))
    }

    /// Names of the images that its textures refer to.
    pub(super) fn image_names(&self) -> BTreeSet<[u8; 16]> {
        let materials = self.mesh.materials.iter();
        materials.flat_map(|m| &m.textures).map(|texture| texture.image).collect()
    }

    /// The contents of the object's sections.
    pub(crate) fn parts(&self, options: &CompileOptions) -> write::ObjectParts<'_> {
        let Self { mesh, on_grid, hierarchy: Hierarchy { wide, bounds, dropped }, .. } = self;
        let mut parts = write::ObjectParts {
            bounds: *bounds,
            root: wide.root,
            triangles: mesh.triangles.len() as u32,
            dropped: *dropped,
            lines: &wide.lines,
            triangle_ids: &wide.triangle_ids,
            leaf_vertices: &wide.leaf_vertices,
            places: &self.places,
            grid: on_grid.as_ref().map(|on| (on.grid, on.displacement)),
            widened_boxes: wide.widened_boxes,
            groups: self.groups.as_ref(),
            materials: mesh.materials.as_ref(),
            deformation: mesh.deformation.as_ref(),
            source: Some(source(mesh, on_grid.as_ref(), options)),
            ..Default::default()
        };
        if let Some(free) = &self.free {
            parts.free = &free.directions;
            parts.free_distances = &free.distances;
            parts.free_levels = &free.levels;
        }
        if let Some(sequence) = mesh.sequence.as_ref().filter(|_| !wide.leaf_vertices.is_empty()) {
            parts.sequence_times = &sequence.times;
            parts.sequence_positions = &sequence.positions;
        }
        if let Some(opacity) = &mesh.opacity {
            parts.opacity = &opacity.rows;
            parts.opacity_micro = &opacity.micro;
        }
        if let Some(encoded) = &self.encoded {
            parts.tet_leaves = &encoded.leaves;
            parts.tets = &encoded.tets;
            parts.tet_vertices = &encoded.vertices;
            parts.tet_faces = &encoded.faces;
            parts.hull_faces = &encoded.hulls;
            parts.triangle_faces = &encoded.face_of_triangle;
        }
        parts
    }
}

/// The geometry and the attributes of the source that the file keeps.
fn source<'a>(mesh: &'a Mesh, on_grid: Option<&'a OnGrid>, options: &CompileOptions) -> write::Source<'a> {
    let mut source = write::Source::default();
    if options.geometry || mesh.exact.is_some() {
        source.exact = mesh.exact.as_ref();
        source.positions = on_grid.map_or(&mesh.positions, |on| &on.source);
        source.triangles = &mesh.triangles;
    }
    if let Some(attributes) = &mesh.attributes {
        source.corners = &attributes.corners;
        source.normals = &attributes.normals;
        source.uvs = &attributes.uvs;
    }
    source
}
