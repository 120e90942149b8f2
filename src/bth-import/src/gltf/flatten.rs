//! Flat models: the default scene's meshes in world space, in node traversal order, or single
//! meshes in their own space.

use glam::DAffine3;
use std::collections::HashMap;
use std::path::PathBuf;

use crate::deformation::RawDeformation;
use crate::error::{Place, Result};
use crate::gltf::extensions::{INSTANCING, Use};
use crate::gltf::file::GltfFile;
use crate::gltf::material::Material;
use crate::gltf::materials::{self, SharedMaterials};
use crate::gltf::placed_mesh::{GltfPart, PlacedMesh, placed_meshes};
use crate::gltf::primitive::{PrimitiveReader, Triangles};
use crate::gltf::rest_pose::RestPose;
use crate::gltf::rigid_parts::{KeptTriangles, Selection};
use crate::gltf::schema::{Faces, GltfDocument, GltfMesh};
use crate::gltf::transform;
use crate::mesh::{Keep, Wanted};
use crate::raw::{Raw, RowKind, check_triangles};
use crate::source::Source;
use bth_format::layout::NONE;
use serde::Deserialize;

/// Where the rows of one primitive of one node begin.
struct Span {
    first: [usize; 3],
    accessors: [Option<usize>; 3],
    node: Option<usize>,
    /// Mesh and primitive, for messages.
    part: String,
}

/// The groups and materials so far.
#[derive(Default)]
struct GroupNumbers {
    /// By the numbers of mesh and primitive.
    groups: HashMap<(usize, usize), u32>,
    /// By the number of the material.
    materials: HashMap<usize, u32>,
    /// The numbers of the materials by the numbers that groups refer to.
    numbers: Vec<usize>,
}

/// Appends primitives to a raw mesh.
struct Flattener<'r, 'd, 'a> {
    file: &'r GltfFile<'d>,
    raw: Raw<'a>,
    spans: Vec<Span>,
    wanted: Wanted,
    groups: GroupNumbers,
    /// Collects positions in f64, when the meshes are read a second time, without a warning.
    exact: Option<Vec<[f64; 3]>>,
}

/// Reads a glTF or GLB file: its default scene, else its first, else all root nodes, at rest and
/// without hidden nodes. Counts each segment of lines and each point as skipped.
pub(crate) fn read<'a>(source: &'a Source<'a>, wanted: Wanted) -> Result<Raw<'a>> {
    let file = GltfFile::open(source, Use::Flat, wanted.polygons)?;
    let (document, monitor) = (&file.document, source.monitor);
    if document.extensions_used.iter().any(|name| name == INSTANCING) {
        monitor.warn("EXT_mesh_gpu_instancing is ignored: each of its meshes is read once");
    }
    let (placed, hidden) = placed_meshes(&file)?;
    if hidden > 0 {
        monitor.warn(&format!("{hidden} nodes with meshes are left out: KHR_node_visibility hides them"));
    }
    let has_skin = |placed: &PlacedMesh| placed.node.is_some_and(|node| document.nodes[node].skin.is_some());
    let deforms = |placed: &PlacedMesh| has_skin(placed) || document.has_targets(placed.mesh);
    if !document.animations.is_empty() && placed.iter().any(deforms) {
        monitor.warn("animations are ignored: meshes with skins or morph targets are read at rest");
    }
    let shared = SharedMaterials::default();
    let raw = read_placed(source, &file, wanted, &shared, &placed, None)?;
    shared.report(source);
    Ok(Raw { exact: Some(Box::new(move || exact_positions(&file, &placed).unwrap_or_default())), ..raw })
}

/// The positions in f64, of meshes that were read before.
fn exact_positions(file: &GltfFile<'_>, placed: &[PlacedMesh]) -> Result<Vec<[f64; 3]>> {
    let mut flattener = Flattener::new(
        file,
        Raw::new(file.format, Box::new(|_, _| Place::File(PathBuf::new()))),
        Wanted::default(),
    );
    flattener.exact = Some(Vec::new());
    placed.iter().try_for_each(|mesh| flattener.mesh(mesh))?;
    Ok(flattener.exact.unwrap_or_default())
}

/// Reads one part of a file. Parts share what was read of it, so each buffer is read once.
pub(crate) fn read_part<'a>(
    source: &'a Source<'a>,
    file: &GltfFile<'_>,
    part: GltfPart,
    wanted: Wanted,
    shared: &SharedMaterials,
) -> Result<Raw<'a>> {
    let deformation = matches!(part, GltfPart::Deforming { .. }).then(RawDeformation::default);
    read_placed(source, file, wanted, shared, &[part.placed(file)?], deformation)
}

/// Reads placed meshes. With a `deformation` their vertices are not moved.
fn read_placed<'a>(
    source: &'a Source<'a>,
    file: &GltfFile<'_>,
    wanted: Wanted,
    shared: &SharedMaterials,
    placed: &[PlacedMesh],
    deformation: Option<RawDeformation>,
) -> Result<Raw<'a>> {
    let no_place = Box::new(|_: RowKind, _: usize| Place::File(source.path.to_owned()));
    let raw = Raw { deformation, ..Raw::new(file.format, no_place) };
    let mut flattener = Flattener::new(file, raw, wanted);
    for (done, mesh) in placed.iter().enumerate() {
        source.progress(source.data.len() / placed.len() * done)?;
        flattener.mesh(mesh)?;
    }
    let Flattener { mut raw, spans, groups, .. } = flattener;
    if wanted.materials && wanted.groups {
        materials::read(file, shared, &groups.numbers, wanted.unreadable, &mut raw.materials)?;
    }
    raw.drop_unused_rows();
    Ok(Raw { locate: Box::new(move |kind, row| locate(source, &spans, kind, row)), ..raw })
}

fn locate(source: &Source<'_>, spans: &[Span], kind: RowKind, row: usize) -> Place {
    let kind = kind as usize;
    let span = &spans[spans.partition_point(|span| span.first[kind] <= row).saturating_sub(1)];
    let accessor = span.accessors[kind]
        .map_or(String::new(), |a| format!(" accessor {a} row {}", row - span.first[kind]));
    let node = span.node.map_or(String::new(), |node| format!("node {node} "));
    Place::Part(source.path.to_owned(), format!("{node}{}{accessor}", span.part))
}

impl<'r, 'd, 'a> Flattener<'r, 'd, 'a> {
    fn new(file: &'r GltfFile<'d>, raw: Raw<'a>, wanted: Wanted) -> Self {
        Flattener { file, raw, spans: Vec::new(), wanted, groups: GroupNumbers::default(), exact: None }
    }
}

impl Flattener<'_, '_, '_> {
    fn mesh(&mut self, placed: &PlacedMesh) -> Result<()> {
        let file = self.file;
        let meshes = file.document.meshes.len();
        if placed.mesh >= meshes {
            let message = format!("expected a mesh below {meshes}, found {}", placed.mesh);
            let mesh = || format!("mesh {}", placed.mesh);
            let part = placed.node.map_or_else(mesh, |node| format!("node {node}"));
            return Err(file.graph_error(part, message));
        }
        // Nothing but their joint moves the vertices of a rigid part.
        let pose = match (&self.raw.deformation, placed.kept) {
            (Some(_), _) | (None, KeptTriangles::Part(_)) => RestPose::default(),
            (None, _) => RestPose::new(file, placed.node, placed.mesh)?,
        };
        let selection = placed.kept.of_mesh(file, placed.mesh)?;
        for (index, reader) in PrimitiveReader::of_mesh(file, placed.mesh).enumerate() {
            file.source.monitor.check()?;
            self.primitive(placed, &pose, &selection, index, &reader)?;
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        placed: &PlacedMesh,
        pose: &RestPose,
        selection: &Selection,
        index: usize,
        reader: &PrimitiveReader<'_, '_>,
    ) -> Result<()> {
        let (monitor, primitive) = (self.file.source.monitor, reader.primitive);
        let Some(kept) = reader.kept(self.wanted.attributes)? else {
            if self.exact.is_none() {
                monitor.warn(&format!("{} has no positions and is left out", reader.part));
            }
            self.raw.skipped += 1;
            return Ok(());
        };
        if let Some(skipped) = reader.points_or_lines(&kept)? {
            self.raw.skipped += skipped;
            return Ok(());
        }
        self.spans.push(Span {
            first: [self.raw.positions.len(), self.raw.normals.len(), self.raw.uvs.len()],
            accessors: [Some(kept.positions), kept.normals, kept.uvs],
            node: placed.node,
            part: reader.part.clone(),
        });
        let mut triangles = reader.read(&kept, self.raw.positions.len())?;
        if triangles.skipped > 0 && self.exact.is_none() {
            let indices = self.file.count(primitive.indices.unwrap_or(kept.positions))?;
            monitor.warn(&format!(
                "{}: the last of its {indices} indices form no whole triangle and are left out",
                reader.part
            ));
        }
        selection.retain(index, &mut triangles.corners);
        let first = [self.raw.positions.len(), self.raw.normals.len()];
        match &mut self.raw.deformation {
            Some(deformation) => reader.deformation(&triangles, first, deformation)?,
            None => pose.apply(reader, &mut triangles)?,
        }
        self.start_group(placed.mesh, index, primitive.material);
        let world = if pose.is_skinned() { DAffine3::IDENTITY } else { placed.world };
        if transform::is_mirrored(&world) {
            // A mirrored mesh keeps its front sides (specification, §3.7.4).
            triangles.corners.iter_mut().for_each(|corners| *corners = transform::turned(*corners, true));
        }
        if self.wanted.materials {
            self.append_looks(reader, &triangles)?;
        }
        self.append(&triangles, &primitive.faces, &world)
    }

    /// Adds the colours and the second texture coordinates of the corners of a primitive's
    /// triangles, which will be appended next.
    fn append_looks(&mut self, reader: &PrimitiveReader<'_, '_>, triangles: &Triangles) -> Result<()> {
        warn_without_coordinates(reader, triangles);
        let (colors, uvs) = (reader.colors(triangles)?, second_coordinates(reader, triangles)?);
        let first = self.raw.triangles.len();
        let of = |rows: Vec<u32>| {
            let corners = triangles.corners.iter();
            corners.map(move |triangle| triangle.map(|row| rows[row as usize]))
        };
        let recorder = &mut self.raw.materials.colors;
        if let Some(colors) = colors {
            let rows = colors.into_iter().map(|color| recorder.row(color)).collect();
            recorder.add(first, of(rows));
        }
        let recorder = &mut self.raw.materials.second_uvs;
        if let Some(uvs) = uvs {
            let rows = uvs.into_iter().map(|uv| recorder.row(uv)).collect();
            recorder.add(first, of(rows), [0; 2]);
        }
        Ok(())
    }

    /// Notes that the triangles of a primitive follow. It is the same group wherever its mesh is
    /// placed.
    fn start_group(&mut self, mesh: usize, index: usize, material: Option<usize>) {
        if !self.wanted.groups {
            return;
        }
        let GroupNumbers { groups, materials, numbers } = &mut self.groups;
        let (document, recorder) = (&self.file.document, &mut self.raw.groups);
        let group = *groups.entry((mesh, index)).or_insert_with(|| {
            let material = material.map(|number| {
                *materials.entry(number).or_insert_with(|| {
                    numbers.push(number);
                    recorder.material(material_name(document, number))
                })
            });
            let GltfMesh { name, primitives, .. } = &document.meshes[mesh];
            let mut name = if name.is_empty() { format!("mesh {mesh}") } else { name.clone() };
            if primitives.len() > 1 {
                name = format!("{name}/{index}");
            }
            recorder.group(name, material)
        });
        recorder.start(self.raw.triangles.len(), group);
    }

    /// Appends a primitive's rows in world space.
    fn append(&mut self, triangles: &Triangles, faces: &Faces, world: &DAffine3) -> Result<()> {
        let (raw, corners) = (&mut self.raw, &triangles.corners);
        raw.skipped += triangles.skipped + faces.skipped;
        raw.polygons += faces.polygons;
        raw.concave.add(&faces.concave, raw.triangles.len());
        check_triangles((raw.triangles.len() + corners.len()) as u64)?;
        let rows_from = |first: usize| {
            let row = move |i: u32| first as u32 + i;
            corners.iter().map(move |triangle| triangle.map(row))
        };
        let absent = std::iter::repeat_n([NONE; 3], corners.len());
        let first = [raw.positions.len(), raw.normals.len(), raw.uvs.len()];
        if let Some(exact) = &mut self.exact {
            exact.extend(triangles.positions.iter().map(|p| transform::exact_point(world, *p)));
        }
        raw.positions.extend(triangles.positions.iter().map(|p| transform::point(world, *p)));
        raw.triangles.extend(rows_from(first[0]));
        match &triangles.normals {
            Some(normals) => {
                raw.normals.extend(normals.iter().map(|n| transform::normal(world, *n)));
                raw.normal_rows.extend(rows_from(first[1]));
            }
            None if self.wanted.attributes != Keep::None => raw.normal_rows.extend(absent.clone()),
            None => {}
        }
        match &triangles.uvs {
            Some(uvs) => {
                raw.uvs.extend(uvs);
                raw.uv_rows.extend(rows_from(first[2]));
            }
            None if self.wanted.attributes == Keep::All => raw.uv_rows.extend(absent),
            None => {}
        }
        Ok(())
    }
}

/// Returns the name of a material, or its number where it has none.
fn material_name(document: &GltfDocument, number: usize) -> String {
    let name = document.materials.get(number).and_then(|material| material.get("name")?.as_str());
    name.filter(|name| !name.is_empty()).map_or_else(|| format!("material {number}"), str::to_owned)
}

/// Returns the bits of the texture coordinates that a texture of the material has in a second set,
/// if there is such a texture.
fn second_coordinates(
    reader: &PrimitiveReader<'_, '_>,
    triangles: &Triangles,
) -> Result<Option<Vec<[u32; 2]>>> {
    let source = reader.file.source;
    let material = reader.primitive.material.and_then(|number| reader.file.document.materials.get(number));
    // Reading the material reports what is malformed.
    let set = material.and_then(|value| Material::deserialize(value).ok()?.second_set());
    let Some(name) = set.map(|set| format!("TEXCOORD_{set}")) else { return Ok(None) };
    let Some(uvs) = reader.optional::<2>(triangles, &name)? else {
        source.monitor.warn(&format!("{}: it has no {name}; (0, 0) is taken everywhere", reader.part));
        return Ok(None);
    };
    if let Some(row) = uvs.iter().position(|uv| !uv.iter().all(|x| x.is_finite())) {
        let message = format!("expected a finite texture coordinate, found {:?}", uvs[row]);
        let part = format!("{} {name} row {row}", reader.part);
        let hint = "export the model again, or compile without --materials";
        return Err(source.error_in_part("BTH-I008", part, message, hint));
    }
    // Adding 0 turns -0 into 0.
    Ok(Some(uvs.into_iter().map(|uv| uv.map(|x| (x + 0.0).to_bits())).collect()))
}

/// Warns if the material of a primitive has a base colour texture and the primitive no coordinates
/// for it.
fn warn_without_coordinates(reader: &PrimitiveReader<'_, '_>, triangles: &Triangles) {
    let material = reader.primitive.material.and_then(|m| reader.file.document.materials.get(m));
    let texture = material.and_then(|m| m.get("pbrMetallicRoughness")?.get("baseColorTexture"));
    if texture.is_some() && triangles.uvs.is_none() {
        let warning = format!("{}: its texture has no coordinates; (0, 0) is taken everywhere", reader.part);
        reader.file.source.monitor.warn(&warning);
    }
}
