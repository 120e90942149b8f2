//! Assembles an object from the results of the stages, and the file with one object.

use super::clock::timed;
use super::motion::MotionReport;
use super::{CompileOptions, FileReport};
use crate::coordinates::OnGrid;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::{bvh, coordinates, free, tets, write};
use bth_format::layout::{Object as Header, Segment};
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

/// A mesh with the vertices that are traced, and its binary BVH.
pub(crate) struct TracedMesh {
    /// The mesh; its vertices are on the grid, if there is one.
    pub(crate) mesh: Mesh,
    /// The grid and the original positions, if vertices were moved.
    pub(crate) on_grid: Option<OnGrid>,
    pub(crate) tree: bvh::BinaryBvh,
    /// For each node the probability that a ray enters it, if that is not by its area: counted, or a mean over poses.
    pub(crate) probabilities: Option<Vec<f64>>,
}

/// As [`TracedMesh`], borrowed.
#[derive(Clone, Copy)]
pub(super) struct TracedRef<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) on_grid: Option<&'a OnGrid>,
    pub(super) tree: &'a bvh::BinaryBvh,
    pub(super) probabilities: Option<&'a [f64]>,
}

impl TracedMesh {
    pub(super) fn by_ref(&self) -> TracedRef<'_> {
        let probabilities = self.probabilities.as_deref();
        TracedRef { mesh: &self.mesh, on_grid: self.on_grid.as_ref(), tree: &self.tree, probabilities }
    }
}

/// An object that is ready to be written.
pub(crate) struct Object {
    traced: TracedMesh,
    wide: bvh::Wide,
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
    /// When which of its hierarchies applies; empty where one applies always.
    pub(crate) segments: Vec<Segment>,
    /// The objects with the hierarchies of all segments but the first.
    pub(crate) segment_objects: Vec<Object>,
    /// What the trees of an object whose vertices move cost.
    pub(crate) motion: Option<MotionReport>,
}

/// Assembles an object: collapses the BVH with tet leaves in place of their nodes, and encodes the tet leaves.
pub(super) fn join(
    traced: TracedMesh,
    leaves: Vec<tets::Leaf>,
    free: Option<free::Free>,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(Object, bvh::CollapseReport)> {
    let (cut, meshes): (Vec<u32>, Vec<tets::TetMesh>) = leaves.into_iter().unzip();
    let (wide, collapse) = collapse(traced.by_ref(), &cut, options, monitor)?;
    let triangles = traced.mesh.triangles.len();
    let encoded =
        (!meshes.is_empty()).then(|| tets::encode(&meshes, &wide.subtrees, options.record, triangles));
    let tet_leaves = meshes.len() as u64;
    let tet_triangles = meshes.iter().map(|m| m.faces.len() as u64).sum();
    let groups = traced.mesh.groups.as_ref().map(write::GroupParts::of);
    let grid = traced.on_grid.as_ref().map(|on_grid| &on_grid.grid);
    let places = bvh::triangle_places(&wide, grid, triangles);
    let free = free.map(|free| free::FreeRows::new(free, &places));
    let object = Object {
        traced,
        wide,
        places,
        free,
        encoded,
        groups,
        tet_leaves,
        tet_triangles,
        segments: Vec::new(),
        segment_objects: Vec::new(),
        motion: None,
    };
    Ok((object, collapse))
}

/// The wide BVH over a binary one, in which the nodes `cut` are tet leaves.
pub(super) fn collapse(
    traced: TracedRef<'_>,
    cut: &[u32],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(bvh::Wide, bvh::CollapseReport)> {
    let collapse_options = bvh::CollapseOptions {
        keep_subtrees: options.keep_subtrees,
        leaf_vertices: options.deformable,
        ..options.collapse
    };
    let weighed = bvh::Weighed { bvh: traced.tree, probabilities: traced.probabilities };
    let collapse = || bvh::collapse(traced.mesh, weighed, cut, &collapse_options, monitor);
    let (mut wide, mut report) = timed(collapse)?;
    if let Some(on_grid) = traced.on_grid {
        coordinates::pack(&mut wide, &on_grid.grid)?;
    }
    report.measure(&wide);
    Ok((wide, report))
}

/// The bytes of a file from a mesh, its binary BVH and the tetrahedralizations of some of its nodes. For benchmarks, which
/// store one tetrahedralization in several forms.
///
/// # Errors
/// A limit of the format, cancellation.
pub fn assemble(
    mesh: &Mesh,
    tree: &bvh::BinaryBvh,
    built: &[tets::Leaf],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<Compiled> {
    let traced = TracedMesh { mesh: mesh.clone(), on_grid: None, tree: tree.clone(), probabilities: None };
    let (object, _) = join(traced, built.to_vec(), None, options, monitor)?;
    Ok(object.file("{}".to_owned(), &[], options)?.0.into())
}

impl Object {
    /// The file with this object only, after the checks of a reader.
    pub(super) fn file(
        &self,
        provenance: String,
        images: &[ImageFile],
        options: &CompileOptions,
    ) -> Result<(bth_format::File, FileReport)> {
        let parts = self.parts(options);
        let mut builder = write::FileBuilder::new();
        write::object(&mut builder, 0, &parts)?;
        write::images(&mut builder, images.iter().map(|image| (image.name, image.bytes.as_slice())))?;
        builder.provenance(provenance)?;
        let file = write::open(&builder)?;
        file.check_images().map_err(write::defect)?;
        let resident_bytes = resident_bytes(&parts);
        let triangles = self.traced.mesh.triangles.len();
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
        let materials = self.traced.mesh.materials.iter();
        materials.flat_map(|m| &m.textures).map(|texture| texture.image).collect()
    }

    /// The report on the coordinates, if vertices were moved.
    pub(super) fn coordinates_report(&self) -> Option<coordinates::CoordinateReport> {
        self.traced.on_grid.as_ref().map(OnGrid::report)
    }

    /// The contents of the object's sections.
    pub(crate) fn parts(&self, options: &CompileOptions) -> write::ObjectParts<'_> {
        let TracedMesh { mesh, on_grid, tree, .. } = &self.traced;
        let mut parts = write::ObjectParts {
            bounds: tree.nodes.first().map(|root| (root.lower, root.upper)),
            root: self.wide.root,
            triangles: mesh.triangles.len() as u32,
            dropped: (mesh.triangles.len() - tree.order.len()) as u32,
            lines: &self.wide.lines,
            triangle_ids: &self.wide.triangle_ids,
            leaf_vertices: &self.wide.leaf_vertices,
            places: &self.places,
            grid: on_grid.as_ref().map(|on| (on.grid, on.displacement)),
            widened_boxes: self.wide.widened_boxes,
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
        if let Some(sequence) = mesh.sequence.as_ref().filter(|_| !self.wide.leaf_vertices.is_empty()) {
            parts.sequence_times = &sequence.times;
            parts.sequence_positions = &sequence.positions;
        }
        parts.segments = &self.segments;
        if let Some(opacity) = &mesh.opacity {
            parts.opacity = &opacity.rows;
            parts.opacity_micro = &opacity.micro;
        }
        if let Some(encoded) = &self.encoded {
            parts.record = Some(options.record);
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
    if options.geometry {
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

/// Bytes of the sections that tracing reads.
fn resident_bytes(parts: &write::ObjectParts<'_>) -> u64 {
    let bytes = size_of::<Header>()
        + size_of_val(parts.lines)
        + size_of_val(parts.triangle_ids)
        + size_of_val(parts.tet_leaves)
        + size_of_val(parts.tets)
        + size_of_val(parts.tet_vertices)
        + size_of_val(parts.tet_faces)
        + size_of_val(parts.hull_faces)
        + size_of_val(parts.triangle_faces)
        + size_of_val(parts.places)
        + size_of_val(parts.free)
        + size_of_val(parts.free_distances)
        + size_of_val(parts.free_levels)
        + size_of_val(parts.opacity)
        + size_of_val(parts.opacity_micro);
    bytes as u64
}
