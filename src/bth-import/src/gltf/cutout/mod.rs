//! The triangles of cut-out materials, in the order in which the import of a mesh numbers them.

mod image;
mod material;

use serde_json::from_slice;

use crate::cutout::{AlphaMode, CutoutCorner, CutoutTriangle, Cutouts};
use crate::error::Result;
use crate::gltf::accessor::Accessors;
use crate::gltf::buffer::Buffers;
use crate::gltf::document;
use crate::gltf::extensions::{SCENE_EXTENSIONS, SUPPORTED};
use crate::gltf::placed_mesh::{GltfPart, PlacedMesh, placed_meshes};
use crate::gltf::primitive::{KeptAttributes, PrimitiveReader, Triangles};
use crate::gltf::rigid_parts::Selection;
use crate::gltf::schema::GltfDocument;
use crate::gltf::texture_parts::TextureParts;
use crate::gltf::transform;
use crate::materials::Looks;
use crate::mesh::Keep;
use crate::source::Source;
use material::Materials;

/// The cut-outs of a document's default scene, as [`crate::import()`] reads it.
pub(crate) fn flat(source: &Source<'_>, looks: Looks) -> Result<Cutouts> {
    let (document, binary) = document::read(source, &SUPPORTED)?;
    let (placed, _) = placed_meshes(source, &document)?;
    Ok(placed_cutouts(source, &document, binary, looks, &[placed])?.swap_remove(0))
}

/// The cut-outs of parts, as [`crate::import_gltf_parts`] reads them.
pub(crate) fn parts(source: &Source<'_>, looks: Looks, parts: &[GltfPart]) -> Result<Vec<Cutouts>> {
    let supported = [SUPPORTED.as_slice(), &SCENE_EXTENSIONS].concat();
    let (document, binary) = document::read(source, &supported)?;
    let model = |part: &GltfPart| Ok(vec![part.placed(source, &document)?]);
    let models = parts.iter().map(model).collect::<Result<Vec<_>>>()?;
    placed_cutouts(source, &document, binary, looks, &models)
}

/// The URIs of files beside a document that cut-outs read.
pub(crate) fn files(json: &[u8], mode: AlphaMode) -> Vec<String> {
    if mode == AlphaMode::None {
        return Vec::new();
    }
    from_slice::<TextureParts>(json).map_or(Vec::new(), |parts| material::files(&parts, mode))
}

/// The cut-outs of models, each of which consists of placed meshes.
fn placed_cutouts(
    source: &Source<'_>,
    document: &GltfDocument,
    binary: Option<&[u8]>,
    looks: Looks,
    models: &[Vec<PlacedMesh>],
) -> Result<Vec<Cutouts>> {
    let parts = &TextureParts::of(source)?;
    let accessors = Accessors { source, document, buffers: Buffers::new(source, document, binary) };
    let mut reader = CutoutReader {
        accessors: &accessors,
        materials: Materials::new(&accessors, parts, looks),
        cutouts: Cutouts::default(),
    };
    let mut all = Vec::new();
    for model in models {
        for placed in model {
            reader.mesh(placed)?;
        }
        all.push(std::mem::take(&mut reader.cutouts));
    }
    for cutouts in &mut all {
        if !cutouts.triangles.is_empty() {
            cutouts.images.clone_from(&reader.materials.images);
            cutouts.materials.clone_from(&reader.materials.read);
        }
    }
    Ok(all)
}

struct CutoutReader<'m, 'a> {
    accessors: &'m Accessors<'a>,
    materials: Materials<'m, 'a>,
    /// Those of the model so far.
    cutouts: Cutouts,
}

impl CutoutReader<'_, '_> {
    fn mesh(&mut self, placed: &PlacedMesh) -> Result<()> {
        let document = self.accessors.document;
        let primitives = document.meshes.get(placed.mesh).map_or(&[][..], |mesh| &mesh.primitives);
        let selection = placed.kept.of_mesh(self.accessors, placed.mesh)?;
        for (index, primitive) in primitives.iter().enumerate() {
            self.accessors.source.monitor.check()?;
            let part = format!("mesh {} primitive {index}", placed.mesh);
            let reader = PrimitiveReader { accessors: self.accessors, primitive, part };
            self.primitive(&reader, (index, &selection), transform::is_mirrored(&placed.world))?;
        }
        Ok(())
    }

    /// Appends the triangles of a primitive, whose last two corners the import exchanges where it is `mirrored`.
    fn primitive(
        &mut self,
        reader: &PrimitiveReader<'_, '_>,
        (index, selection): (usize, &Selection),
        mirrored: bool,
    ) -> Result<()> {
        let row = match reader.primitive.material {
            Some(material) => self.materials.row(material)?,
            None => None,
        };
        let Some(mut kept) = reader.kept(Keep::None)? else { return Ok(()) };
        if let Some(coordinates) = row.and_then(|row| self.materials.coordinates(row)) {
            kept.take_coordinates(reader.primitive, coordinates.clone());
        }
        if reader.points_or_lines(&kept)?.is_some() {
            return Ok(());
        }
        let mut triangles = reader.read(&kept, 0)?;
        selection.retain(index, &mut triangles.corners);
        let first = self.cutouts.mesh_triangles;
        self.cutouts.mesh_triangles += triangles.corners.len();
        let Some(row) = row else { return Ok(()) };
        let alphas = reader.color_alphas(&kept)?;
        if triangles.uvs.is_none() && self.materials.needs_uvs(row) {
            let warning =
                format!("{}: its texture has no coordinates; its triangles are opaque", reader.part);
            self.accessors.source.monitor.warn(&warning);
            return Ok(());
        }
        let corner = |row: u32| corner(&triangles, alphas.as_deref(), row as usize);
        self.cutouts.triangles.extend(triangles.corners.iter().enumerate().map(|(k, &[a, b, c])| {
            let rows = if mirrored { [a, c, b] } else { [a, b, c] };
            CutoutTriangle { triangle: (first + k) as u32, material: row as u32, corners: rows.map(corner) }
        }));
        Ok(())
    }
}

fn corner(triangles: &Triangles, alphas: Option<&[f32]>, row: usize) -> CutoutCorner {
    let uv = triangles.uvs.as_ref().map_or([0.0; 2], |uvs| uvs[row]);
    // What is no number counts as 1; colours beyond 0 and 1 are clamped.
    let alpha =
        alphas.map_or(1.0, |alphas| if alphas[row].is_nan() { 1.0 } else { alphas[row].clamp(0.0, 1.0) });
    CutoutCorner { uv, alpha }
}

impl PrimitiveReader<'_, '_> {
    /// Alpha of the vertex colours; `None` where they have none.
    fn color_alphas(&self, kept: &KeptAttributes) -> Result<Option<Vec<f32>>> {
        let Some(accessor) = self.primitive.attributes.get("COLOR_0").copied() else { return Ok(None) };
        if self.accessors.document.accessors.get(accessor).is_some_and(|a| a.shape == "VEC3") {
            return Ok(None);
        }
        let colors: Vec<[f32; 4]> = self.single_attribute(kept, "COLOR_0", accessor)?;
        Ok(Some(colors.into_iter().map(|color| color[3]).collect()))
    }
}
