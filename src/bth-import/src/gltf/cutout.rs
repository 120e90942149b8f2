//! The triangles of cut-out materials (alpha modes MASK and BLEND), in the order in which the
//! import of a mesh numbers them.

use std::collections::HashMap;

use crate::cutout::{AlphaImage, AlphaMode, CutoutCorner, CutoutMaterial, CutoutTriangle, Cutouts, Wrap};
use crate::error::Result;
use crate::gltf::alpha_image;
use crate::gltf::extensions::Use;
use crate::gltf::file::GltfFile;
use crate::gltf::material::{ALPHA_MODES, Material};
use crate::gltf::placed_mesh::{GltfPart, PlacedMesh, placed_meshes};
use crate::gltf::primitive::{PrimitiveReader, Triangles};
use crate::gltf::rigid_parts::Selection;
use crate::gltf::schema::GltfDocument;
use crate::gltf::texture_reader::TextureReader;
use crate::gltf::transform;
use crate::gltf::uv_set::UvSet;
use crate::materials::Looks;
use crate::mesh::Keep;
use crate::source::Source;
use crate::text::shown;

/// Reads the cut-outs of a document's default scene, as [`crate::import()`] reads it.
pub(crate) fn flat(source: &Source<'_>, looks: Looks) -> Result<Cutouts> {
    let file = GltfFile::open(source, Use::Flat, looks.polygons)?;
    let (placed, _) = placed_meshes(&file)?;
    Ok(placed_cutouts(&file, looks, &[placed])?.swap_remove(0))
}

/// Reads the cut-outs of parts, as [`crate::import_gltf_parts`] reads them.
pub(crate) fn parts(source: &Source<'_>, looks: Looks, parts: &[GltfPart]) -> Result<Vec<Cutouts>> {
    let file = GltfFile::open(source, Use::Parts, looks.polygons)?;
    let model = |part: &GltfPart| Ok(vec![part.placed(&file)?]);
    let models = parts.iter().map(model).collect::<Result<Vec<_>>>()?;
    placed_cutouts(&file, looks, &models)
}

impl GltfDocument {
    /// Returns the numbers of the textures of cut-out materials, in order of the materials.
    pub(super) fn cutout_textures(&self, mode: AlphaMode) -> impl Iterator<Item = usize> {
        let cut_out = self.well_formed_materials().filter(move |m| cutoff(m, mode).is_some());
        cut_out.filter_map(|material| Some(material.base().ok()?.texture?.index))
    }
}

/// Returns the cutoff of a material, if its alpha makes holes.
fn cutoff(material: &Material, mode: AlphaMode) -> Option<f64> {
    match (material.alpha_mode.as_deref()?, mode) {
        ("MASK", AlphaMode::Mask | AlphaMode::Blend) => Some(material.alpha_cutoff.unwrap_or(0.5)),
        ("BLEND", AlphaMode::Blend) => Some(0.5),
        _ => None,
    }
}

/// Reads the cut-outs of models of placed meshes.
fn placed_cutouts(file: &GltfFile<'_>, looks: Looks, models: &[Vec<PlacedMesh>]) -> Result<Vec<Cutouts>> {
    let textures = TextureReader { file, without: "without cut-outs (--alpha none)" };
    let materials = CutoutMaterials {
        textures,
        looks,
        rows: HashMap::new(),
        image_rows: HashMap::new(),
        read: Vec::new(),
        uv_sets: Vec::new(),
        images: Vec::new(),
    };
    let mut reader = CutoutReader { file, materials, cutouts: Cutouts::default() };
    let mut all = Vec::new();
    for model in models {
        for placed in model {
            reader.mesh(placed)?;
        }
        all.push(std::mem::take(&mut reader.cutouts));
    }
    for cutouts in all.iter_mut().filter(|cutouts| !cutouts.triangles.is_empty()) {
        cutouts.images.clone_from(&reader.materials.images);
        cutouts.materials.clone_from(&reader.materials.read);
    }
    Ok(all)
}

/// Reads the cut-out materials of a document, each at its first use.
struct CutoutMaterials<'m, 'a> {
    textures: TextureReader<'m, 'a>,
    looks: Looks,
    /// Rows of `read` by the document's materials; `None` for materials without holes.
    rows: HashMap<usize, Option<usize>>,
    /// Rows of `images` by the document's images; `None` for images without alpha.
    image_rows: HashMap<usize, Option<usize>>,
    read: Vec<CutoutMaterial>,
    /// For each row of `read` the texture coordinates; `None` without a texture.
    uv_sets: Vec<Option<UvSet>>,
    images: Vec<AlphaImage>,
}

impl CutoutMaterials<'_, '_> {
    /// Returns the row of a material of the document; `None` where its alpha makes no holes.
    ///
    /// # Errors
    /// `BTH-I002` for a malformed material, `BTH-I014` and `BTH-I016` for a texture that cannot be
    /// read, `BTH-L003` for one that is too large.
    fn row(&mut self, index: usize) -> Result<Option<usize>> {
        if let Some(known) = self.rows.get(&index) {
            return Ok(*known);
        }
        let row = self.material(index)?.map(|(material, uv_set)| {
            self.read.push(material);
            self.uv_sets.push(uv_set);
            self.read.len() - 1
        });
        self.rows.insert(index, row);
        Ok(row)
    }

    fn material(&mut self, index: usize) -> Result<Option<(CutoutMaterial, Option<UvSet>)>> {
        let (part, monitor) = (format!("material {index}"), self.textures.file.source.monitor);
        let (material, base) = self.textures.material(index)?;
        if let Some(mode) = material.unknown_alpha_mode() {
            let (expected, found) = (ALPHA_MODES.join(", "), shown(mode.as_bytes()));
            monitor.warn(&format!(
                "{part}: expected an alphaMode of {expected}, found \"{found}\"; it has no holes"
            ));
        }
        let Some(cutoff) = cutoff(&material, self.looks.alpha) else { return Ok(None) };
        let factor = base.factor.map_or(1.0, |factor| factor[3]);
        if !((0.0..=1.0).contains(&factor) && cutoff >= 0.0 && cutoff.is_finite()) {
            let message = format!(
                "expected an alpha factor from 0 to 1 and a cutoff from 0, found {factor} and {cutoff}"
            );
            return Err(self.textures.malformed(&part, message));
        }
        let plain = CutoutMaterial { image: None, wrap: [Wrap::Repeat; 2], nearest: false, factor, cutoff };
        let Some(used) = &base.texture else { return Ok(Some((plain, None))) };
        let uv_set = UvSet::of(used)
            .map_err(|e| self.textures.malformed(&part, format!("expected a texture, found: {e}")))?;
        let texture = self.textures.texture(used.index)?;
        let Some(source) = texture.image else {
            let name = format!("texture {}", used.index);
            let message = "expected a PNG, JPEG or WebP image, found none";
            let refused = Err(self.textures.unreadable(&name, message.to_owned()));
            self.looks.unreadable.check::<()>(refused, monitor)?;
            return Ok(Some((plain, None)));
        };
        let image = self.image(source)?;
        let read = CutoutMaterial { image, wrap: texture.wrap, nearest: texture.nearest, ..plain };
        Ok(Some((read, Some(uv_set))))
    }

    /// Returns the row of an image; `None` where its alpha is 1 everywhere, and where it is
    /// skipped.
    fn image(&mut self, index: usize) -> Result<Option<usize>> {
        if let Some(known) = self.image_rows.get(&index) {
            return Ok(*known);
        }
        let decoded = self.textures.image(index, |bytes| alpha_image::decode(&bytes));
        let decoded = self.looks.unreadable.check(decoded, self.textures.file.source.monitor)?.flatten();
        let row = decoded.map(|image| {
            self.images.push(image);
            self.images.len() - 1
        });
        self.image_rows.insert(index, row);
        Ok(row)
    }
}

struct CutoutReader<'m, 'a> {
    file: &'m GltfFile<'a>,
    materials: CutoutMaterials<'m, 'a>,
    /// The cut-outs of the model so far.
    cutouts: Cutouts,
}

impl CutoutReader<'_, '_> {
    fn mesh(&mut self, placed: &PlacedMesh) -> Result<()> {
        let selection = placed.kept.of_mesh(self.file, placed.mesh)?;
        for (index, reader) in PrimitiveReader::of_mesh(self.file, placed.mesh).enumerate() {
            self.file.source.monitor.check()?;
            self.primitive(&reader, index, &selection, transform::is_mirrored(&placed.world))?;
        }
        Ok(())
    }

    /// Appends the triangles of a primitive. The import exchanges their last two corners where it
    /// is `mirrored`.
    fn primitive(
        &mut self,
        reader: &PrimitiveReader<'_, '_>,
        index: usize,
        selection: &Selection,
        mirrored: bool,
    ) -> Result<()> {
        let material = reader.primitive.material;
        let row = material.map_or(Ok(None), |material| self.materials.row(material))?;
        let Some(mut kept) = reader.kept(Keep::None)? else { return Ok(()) };
        if let Some(uv_set) = row.and_then(|row| self.materials.uv_sets[row].as_ref()) {
            kept.take_uvs(reader.primitive, uv_set.clone());
        }
        if reader.points_or_lines(&kept)?.is_some() {
            return Ok(());
        }
        let mut triangles = reader.read(&kept, 0)?;
        selection.retain(index, &mut triangles.corners);
        let first = self.cutouts.mesh_triangles;
        self.cutouts.mesh_triangles += triangles.corners.len();
        let Some(row) = row else { return Ok(()) };
        let colors = reader.colors(&triangles)?;
        if triangles.uvs.is_none() && self.materials.read[row].image.is_some() {
            let warning =
                format!("{}: its texture has no coordinates; its triangles are opaque", reader.part);
            self.file.source.monitor.warn(&warning);
            return Ok(());
        }
        let corner = |row: u32| corner(&triangles, colors.as_deref(), row as usize);
        self.cutouts.triangles.extend(triangles.corners.iter().enumerate().map(|(k, corners)| {
            let corners = transform::turned(*corners, mirrored).map(corner);
            CutoutTriangle { triangle: (first + k) as u32, material: row as u32, corners }
        }));
        Ok(())
    }
}

fn corner(triangles: &Triangles, colors: Option<&[[f32; 4]]>, row: usize) -> CutoutCorner {
    let uv = triangles.uvs.as_ref().map_or([0.0; 2], |uvs| uvs[row]);
    // What is no number counts as 1; colours beyond 0 and 1 are clamped.
    let alpha = colors.map_or(1.0, |colors| colors[row][3]);
    CutoutCorner { uv, alpha: if alpha.is_nan() { 1.0 } else { alpha.clamp(0.0, 1.0) } }
}
