//! Flat models: the default scene's meshes in world space, in node traversal order, or single meshes in their own space.

use glam::DAffine3;
use std::collections::HashMap;

use crate::deformation::RawDeformation;
use crate::error::{Place, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::buffer::Buffers;
use crate::gltf::document::{self, GRAPH};
use crate::gltf::extensions::SUPPORTED;
use crate::gltf::materials::{self, SharedMaterials};
use crate::gltf::placed_mesh::{GltfPart, PlacedMesh, placed_meshes};
use crate::gltf::primitive::{PrimitiveReader, Triangles};
use crate::gltf::rest_pose::RestPose;
use crate::gltf::rigid_parts::{KeptTriangles, Selection};
use crate::gltf::schema::{GltfDocument, GltfMesh, Primitive};
use crate::gltf::transform;
use crate::mesh::{Keep, Wanted};
use crate::raw::{Raw, RowKind, check_triangles};
use crate::rows::NONE;
use crate::source::Source;

/// Where the rows of one primitive of one node begin.
struct Span {
    first: [usize; 3],
    accessors: [Option<usize>; 3],
    node: Option<usize>,
    mesh: usize,
    primitive: usize,
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
    accessors: &'r Accessors<'d>,
    raw: Raw<'a>,
    spans: Vec<Span>,
    keep: Keep,
    /// `None` where the caller does not want groups.
    groups: Option<GroupNumbers>,
    /// Whether the caller wants vertex colours.
    colors: bool,
}

/// Reads a glTF or GLB file: its default scene, else its first, else all root nodes, at rest and without hidden nodes. Lines count each segment, points each point as skipped.
pub(crate) fn read<'a>(source: &'a Source<'a>, wanted: Wanted) -> Result<Raw<'a>> {
    let (document, binary) = document::read(source, &SUPPORTED)?;
    if document.extensions_used.iter().any(|name| name == "EXT_mesh_gpu_instancing") {
        source.monitor.warn("EXT_mesh_gpu_instancing is ignored: each of its meshes is read once");
    }
    let (placed, hidden) = placed_meshes(source, &document)?;
    if hidden > 0 {
        source
            .monitor
            .warn(&format!("{hidden} nodes with meshes are left out: KHR_node_visibility hides them"));
    }
    let has_skin = |placed: &PlacedMesh| placed.node.is_some_and(|node| document.nodes[node].skin.is_some());
    let deforms = |placed: &PlacedMesh| has_skin(placed) || document.has_targets(placed.mesh);
    if !document.animations.is_empty() && placed.iter().any(deforms) {
        source.monitor.warn("animations are ignored: meshes with skins or morph targets are read at rest");
    }
    let shared = SharedMaterials::default();
    let accessors =
        Accessors { source, document: &document, buffers: Buffers::new(source, &document, binary) };
    let raw = read_placed(source, &accessors, (wanted, &shared), (&placed, false))?;
    shared.report(source);
    Ok(raw)
}

/// Reads one part of the document of accessors, which other parts may share with it: then each buffer is read once.
pub(crate) fn read_part<'a>(
    source: &'a Source<'a>,
    accessors: &Accessors<'_>,
    part: GltfPart,
    wanted: (Wanted, &SharedMaterials),
) -> Result<Raw<'a>> {
    let placed = [part.placed(source, accessors.document)?];
    read_placed(source, accessors, wanted, (&placed, matches!(part, GltfPart::Deforming { .. })))
}

/// Reads placed meshes; those that are `deforming` without moving their vertices.
fn read_placed<'a>(
    source: &'a Source<'a>,
    accessors: &Accessors<'_>,
    (wanted, shared): (Wanted, &SharedMaterials),
    (placed, deforming): (&[PlacedMesh], bool),
) -> Result<Raw<'a>> {
    let no_place = Box::new(|_: RowKind, _: usize| Place::File(source.path.to_owned()));
    let mut flattener = Flattener {
        accessors,
        raw: Raw::new("gltf", no_place),
        spans: Vec::new(),
        keep: wanted.attributes,
        groups: wanted.groups.then(GroupNumbers::default),
        colors: wanted.materials,
    };
    if deforming {
        flattener.raw.deformation = Some(RawDeformation::default());
    }
    for (done, mesh) in placed.iter().enumerate() {
        source.progress(source.data.len() / placed.len() * done)?;
        flattener.mesh(mesh)?;
    }
    let Flattener { mut raw, spans, groups, .. } = flattener;
    if let (true, Some(GroupNumbers { numbers, .. })) = (wanted.materials, groups) {
        materials::read(accessors, shared, &numbers, (wanted.unreadable, &mut raw.materials))?;
    }
    if raw.normals.is_empty() {
        raw.normal_rows.clear();
    }
    if raw.uvs.is_empty() {
        raw.uv_rows.clear();
    }
    Ok(Raw { locate: Box::new(move |kind, row| locate(source, &spans, kind, row)), ..raw })
}

fn locate(source: &Source<'_>, spans: &[Span], kind: RowKind, row: usize) -> Place {
    let kind = kind as usize;
    let span = &spans[spans.partition_point(|span| span.first[kind] <= row).saturating_sub(1)];
    let accessor = span.accessors[kind]
        .map_or(String::new(), |a| format!(" accessor {a} row {}", row - span.first[kind]));
    let node = span.node.map_or(String::new(), |node| format!("node {node} "));
    let part = format!("{node}mesh {} primitive {}{accessor}", span.mesh, span.primitive);
    Place::Part(source.path.to_owned(), part)
}

impl Flattener<'_, '_, '_> {
    fn mesh(&mut self, placed: &PlacedMesh) -> Result<()> {
        let (document, source) = (self.accessors.document, self.accessors.source);
        let Some(GltfMesh { primitives, .. }) = document.meshes.get(placed.mesh) else {
            let message = format!("expected a mesh below {}, found {}", document.meshes.len(), placed.mesh);
            let part =
                placed.node.map_or_else(|| format!("mesh {}", placed.mesh), |node| format!("node {node}"));
            return Err(source.error_in_part(GRAPH, part, message, "export the model again"));
        };
        // Nothing but their joint moves the vertices of a rigid part.
        let pose = match (&self.raw.deformation, placed.kept) {
            (Some(_), _) | (None, KeptTriangles::Part(_)) => RestPose::default(),
            (None, _) => RestPose::new(self.accessors, placed.node, placed.mesh)?,
        };
        let selection = placed.kept.of_mesh(self.accessors, placed.mesh)?;
        for (index, primitive) in primitives.iter().enumerate() {
            source.monitor.check()?;
            self.primitive((placed, &pose, &selection), index, primitive)?;
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        (placed, pose, selection): (&PlacedMesh, &RestPose, &Selection),
        index: usize,
        primitive: &Primitive,
    ) -> Result<()> {
        let part = format!("mesh {} primitive {index}", placed.mesh);
        let reader = PrimitiveReader { accessors: self.accessors, primitive, part };
        let Some(kept) = reader.kept(self.keep)? else {
            let warning = format!("{} has no positions and is left out", reader.part);
            self.accessors.source.monitor.warn(&warning);
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
            mesh: placed.mesh,
            primitive: index,
        });
        let mut triangles = reader.read(&kept, self.raw.positions.len())?;
        if triangles.skipped > 0 {
            let indices = self.accessors.count(primitive.indices.unwrap_or(kept.positions))?;
            let warning = format!(
                "{}: the last of its {indices} indices form no whole triangle and are left out",
                reader.part
            );
            self.accessors.source.monitor.warn(&warning);
        }
        selection.retain(index, &mut triangles.corners);
        let first = [self.raw.positions.len(), self.raw.normals.len()];
        match &mut self.raw.deformation {
            Some(deformation) => reader.deformation(&triangles, first, deformation)?,
            None => pose.apply(&reader, &mut triangles)?,
        }
        let (mut colors, mut second_uvs) = (None, None);
        if self.colors {
            warn_without_coordinates(&reader, &triangles);
            colors = vertex_colors(&reader, &triangles)?;
            second_uvs = second_coordinates(&reader, &triangles)?;
        }
        self.start_group(placed.mesh, index, primitive.material);
        let world = if pose.is_skinned() { DAffine3::IDENTITY } else { placed.world };
        let mirrored = transform::is_mirrored(&world);
        self.append_colors(colors.as_deref(), &triangles.corners, mirrored);
        self.append_second_uvs(second_uvs.as_deref(), &triangles.corners, mirrored);
        self.append(&triangles, &world)
    }

    /// Adds the second set of texture coordinates, as bits, of the corners of a primitive's triangles, which will be appended next.
    fn append_second_uvs(&mut self, uvs: Option<&[[u32; 2]]>, corners: &[[u32; 3]], mirrored: bool) {
        let Some(uvs) = uvs else { return };
        let recorder = &mut self.raw.materials.second_uvs;
        let rows: Vec<u32> = uvs.iter().map(|uv| recorder.row(*uv)).collect();
        let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let corners = corners.iter().map(|triangle| turned(triangle).map(|row| rows[row as usize]));
        recorder.add(self.raw.triangles.len(), corners, [0; 2]);
    }

    /// Adds the colours of the corners of a primitive's triangles, which will be appended next.
    fn append_colors(&mut self, colors: Option<&[[f32; 4]]>, corners: &[[u32; 3]], mirrored: bool) {
        let Some(colors) = colors else { return };
        let recorder = &mut self.raw.materials.colors;
        let rows: Vec<u32> = colors.iter().map(|color| recorder.row(*color)).collect();
        let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let corners = corners.iter().map(|triangle| turned(triangle).map(|row| rows[row as usize]));
        recorder.add(self.raw.triangles.len(), corners);
    }

    /// Notes that the triangles of a primitive follow. It is the same group wherever its mesh is placed.
    fn start_group(&mut self, mesh: usize, index: usize, material: Option<usize>) {
        let Some(GroupNumbers { groups, materials, numbers }) = &mut self.groups else { return };
        let (document, recorder) = (self.accessors.document, &mut self.raw.groups);
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

    /// Appends a primitive's rows in world space. A mirrored mesh keeps its front sides (specification, §3.7.4).
    fn append(&mut self, triangles: &Triangles, world: &DAffine3) -> Result<()> {
        let (raw, corners) = (&mut self.raw, &triangles.corners);
        raw.skipped += triangles.skipped;
        check_triangles((raw.triangles.len() + corners.len()) as u64)?;
        let mirrored = transform::is_mirrored(world);
        let rows_from = |first: usize| {
            let row = move |i: u32| first as u32 + i;
            let turned = move |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
            corners.iter().map(move |triangle| turned(triangle).map(row))
        };
        let absent = std::iter::repeat_n([NONE; 3], corners.len());
        let first = [raw.positions.len(), raw.normals.len(), raw.uvs.len()];
        raw.positions.extend(triangles.positions.iter().map(|p| transform::point(world, *p)));
        raw.triangles.extend(rows_from(first[0]));
        match &triangles.normals {
            Some(normals) => {
                raw.normals.extend(normals.iter().map(|n| transform::normal(world, *n)));
                raw.normal_rows.extend(rows_from(first[1]));
            }
            None if self.keep != Keep::None => raw.normal_rows.extend(absent.clone()),
            None => {}
        }
        match &triangles.uvs {
            Some(uvs) => {
                raw.uvs.extend(uvs);
                raw.uv_rows.extend(rows_from(first[2]));
            }
            None if self.keep == Keep::All => raw.uv_rows.extend(absent),
            None => {}
        }
        Ok(())
    }
}

/// The name of a material, or its number where it has none.
fn material_name(document: &GltfDocument, number: usize) -> String {
    let name = document.materials.get(number).and_then(|material| material.get("name")?.as_str());
    name.filter(|name| !name.is_empty()).map_or_else(|| format!("material {number}"), str::to_owned)
}

/// The colours of a primitive's vertices (`COLOR_0`), linear, if it has some.
fn vertex_colors(reader: &PrimitiveReader<'_, '_>, triangles: &Triangles) -> Result<Option<Vec<[f32; 4]>>> {
    let Some(accessor) = reader.primitive.attributes.get("COLOR_0") else { return Ok(None) };
    if reader.accessors.document.accessors.get(*accessor).is_some_and(|a| a.shape == "VEC3") {
        let colors = reader.optional::<3>(triangles, "COLOR_0")?;
        return Ok(colors.map(|colors| colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()));
    }
    reader.optional::<4>(triangles, "COLOR_0")
}

/// The bits of the texture coordinates of a primitive's vertices that a texture of its material has beside those that are kept for
/// all purposes, if there is such a texture.
fn second_coordinates(
    reader: &PrimitiveReader<'_, '_>,
    triangles: &Triangles,
) -> Result<Option<Vec<[u32; 2]>>> {
    let (source, document) = (reader.accessors.source, reader.accessors.document);
    let material = reader.primitive.material.and_then(|number| document.materials.get(number));
    let Some(set) = material.and_then(materials::second_set) else { return Ok(None) };
    let name = format!("TEXCOORD_{set}");
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

/// Warns if the material of a primitive has a base colour texture and the primitive no coordinates for it.
fn warn_without_coordinates(reader: &PrimitiveReader<'_, '_>, triangles: &Triangles) {
    let material = reader.primitive.material.and_then(|m| reader.accessors.document.materials.get(m));
    let texture = material.and_then(|m| m.get("pbrMetallicRoughness")?.get("baseColorTexture"));
    if texture.is_some() && triangles.uvs.is_none() {
        let warning = format!("{}: its texture has no coordinates; (0, 0) is taken everywhere", reader.part);
        reader.accessors.source.monitor.warn(&warning);
    }
}
