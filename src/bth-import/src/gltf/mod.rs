//! glTF and GLB: the default scene's meshes, flattened to world space in node traversal order.

pub(crate) mod accessor;
pub(crate) mod buffer;
pub(crate) mod json;
pub mod scene;
mod scene_tracks;
mod transform;

pub use buffer::external_files;
pub use scene_tracks::Chosen;

use crate::error::{Error, Place, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::buffer::{Buffers, split};
use crate::gltf::json::{Mesh, Node, Primitive, Root};
use crate::gltf::transform::Transform;
use crate::mesh::Keep;
use crate::raw::{NONE, Raw, Row, check_rows, check_triangles};
use crate::source::{INDEX, INDEX_HINT, MALFORMED, MALFORMED_HINT, Source, UNSUPPORTED};

const EXTENSION: &str = "BTH-I011";
/// The nodes do not make a forest, or refer to what is not there.
pub(crate) const GRAPH: &str = "BTH-I012";

/// Required extensions that do not change where triangles are, or that are read.
pub(crate) const SUPPORTED: [&str; 17] = [
    "KHR_mesh_quantization",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_",
    "KHR_texture_",
    "KHR_xmp",
    "EXT_lights_",
    "EXT_texture_",
    "MSFT_texture_dds",
    "MSFT_packing_",
    "ADOBE_materials_",
    "AGI_articulations",
    "AGI_stk_metadata",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "EXT_instance_features",
    "KHR_audio",
];

/// Extensions of nodes that scenes read and flat models cannot.
pub(crate) const SCENE_EXTENSIONS: [&str; 2] = ["EXT_mesh_gpu_instancing", "KHR_node_visibility"];

/// The error for a required extension that is not read.
pub(crate) fn unsupported_extension(source: &Source<'_>, name: &str) -> Error {
    let message = format!("expected no required extension that changes geometry, found {name}");
    let hint = match name {
        "KHR_draco_mesh_compression" => "decompress the model, for example with gltf-transform copy",
        _ if name.ends_with("meshopt_compression") => {
            "decompress the model, for example with gltf-transform copy"
        }
        _ => "export the model without this extension",
    };
    source.error_in_part(EXTENSION, name, message, hint)
}

/// Where the rows of one primitive of one node begin.
struct Span {
    first: [usize; 3],
    accessors: [Option<usize>; 3],
    /// `None` when the mesh is read in its own space.
    node: Option<usize>,
    mesh: usize,
    primitive: usize,
}

struct Reader<'r, 'a> {
    accessors: Accessors<'r>,
    raw: Raw<'a>,
    spans: Vec<Span>,
    keep: Keep,
}

/// Reads the document of a glTF or GLB file and refuses required extensions that are not among `supported`
/// (those that end with `_` stand for all that begin so). Also gives the binary chunk of a GLB.
pub(crate) fn document<'a>(source: &Source<'a>, supported: &[&str]) -> Result<(Root, Option<&'a [u8]>)> {
    source.fetched()?;
    let (json, binary) = split(source)?;
    let root: Root = serde_json::from_slice(json).map_err(|e| {
        let message = format!("expected a glTF document, found: {e}");
        source.error_in_part(MALFORMED, "JSON", message, MALFORMED_HINT)
    })?;
    if !root.asset.version.starts_with("2.") {
        let message = format!("expected glTF 2, found version \"{}\"", root.asset.version);
        return Err(source.error_in_part(UNSUPPORTED, "asset", message, "convert the model to glTF 2.0"));
    }
    let supported =
        |name: &String| supported.iter().any(|s| name == s || s.ends_with('_') && name.starts_with(s));
    match root.extensions_required.iter().find(|name| !supported(name)) {
        Some(name) => Err(unsupported_extension(source, name)),
        None => Ok((root, binary)),
    }
}

/// Reads a glTF or GLB file: its default scene, else its first, else all root nodes. Skins and morph
/// targets stay in the mesh's own pose. Lines count each segment, points each point as skipped.
pub(super) fn read<'a>(source: &'a Source<'a>, keep: Keep) -> Result<Raw<'a>> {
    let (root, binary) = document(source, &SUPPORTED)?;
    if root.extensions_used.iter().any(|name| name == "EXT_mesh_gpu_instancing") {
        source.monitor.warn("EXT_mesh_gpu_instancing is ignored: each of its meshes is read once");
    }
    let instances = instances(source, &root)?;
    if instances.iter().any(|&(node, _, _)| root.nodes[node].skin.is_some()) {
        source.monitor.warn("skins are ignored: skinned meshes are read in their bind pose");
    }
    let morphs = |&(_, mesh, _): &(usize, usize, Transform)| has_targets(&root, mesh);
    if instances.iter().any(morphs) {
        source.monitor.warn("morph targets are ignored: meshes are read without them");
    }
    let buffers = Buffers::new(source, &root, binary);
    let instances = instances.iter().map(|(node, mesh, transform)| (Some(*node), *mesh, transform));
    read_instances(source, Accessors { source, root: &root, buffers }, keep, instances)
}

/// Reads one mesh of a document in its own space.
pub(super) fn read_mesh<'a>(
    source: &'a Source<'a>,
    root: &Root,
    binary: Option<&'a [u8]>,
    mesh: usize,
    keep: Keep,
) -> Result<Raw<'a>> {
    let buffers = Buffers::new(source, root, binary);
    let instance = (None, mesh, &Transform::IDENTITY);
    read_instances(source, Accessors { source, root, buffers }, keep, std::iter::once(instance))
}

/// Whether a mesh has morph targets.
pub(crate) fn has_targets(root: &Root, mesh: usize) -> bool {
    root.meshes.get(mesh).is_some_and(|m| m.primitives.iter().any(|p| !p.targets.is_empty()))
}

fn read_instances<'a, 't>(
    source: &'a Source<'a>,
    accessors: Accessors<'_>,
    keep: Keep,
    instances: impl ExactSizeIterator<Item = (Option<usize>, usize, &'t Transform)>,
) -> Result<Raw<'a>> {
    let no_place = Box::new(|_: Row, _: usize| Place::File(source.path.to_owned()));
    let mut reader = Reader { accessors, raw: Raw::new("gltf", no_place), spans: Vec::new(), keep };
    let count = instances.len();
    for (done, (node, mesh, transform)) in instances.enumerate() {
        source.progress(source.data.len() / count * done)?;
        reader.mesh(node, mesh, transform)?;
    }
    let Reader { mut raw, spans, .. } = reader;
    if raw.normals.is_empty() {
        raw.normal_rows.clear();
    }
    if raw.uvs.is_empty() {
        raw.uv_rows.clear();
    }
    Ok(Raw { locate: Box::new(move |kind, row| locate(source, &spans, kind, row)), ..raw })
}

fn locate(source: &Source<'_>, spans: &[Span], kind: Row, row: usize) -> Place {
    let kind = kind as usize;
    let span = &spans[spans.partition_point(|span| span.first[kind] <= row).saturating_sub(1)];
    let accessor = span.accessors[kind]
        .map_or(String::new(), |a| format!(" accessor {a} row {}", row - span.first[kind]));
    let node = span.node.map_or(String::new(), |node| format!("node {node} "));
    let part = format!("{node}mesh {} primitive {}{accessor}", span.mesh, span.primitive);
    Place::Part(source.path.to_owned(), part)
}

/// The scene's nodes that have a mesh, in depth-first order, with their world transforms.
fn instances(source: &Source<'_>, root: &Root) -> Result<Vec<(usize, usize, Transform)>> {
    let error =
        |part: String, message: &str| source.error_in_part(GRAPH, part, message, "export the model again");
    let roots = match root.scenes.get(root.scene.unwrap_or(0)) {
        Some(scene) => scene.nodes.clone(),
        None if root.scene.is_some() => {
            return Err(error(format!("scene {}", root.scene.unwrap_or(0)), "it does not exist"));
        }
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            for &child in root.nodes.iter().flat_map(|node| &node.children) {
                is_child.get_mut(child).into_iter().for_each(|c| *c = true);
            }
            (0..root.nodes.len()).filter(|&node| !is_child[node]).collect()
        }
    };
    let mut instances = Vec::new();
    let mut visited = vec![false; root.nodes.len()];
    let mut stack: Vec<_> = roots.into_iter().rev().map(|node| (node, Transform::IDENTITY)).collect();
    while let Some((index, parent)) = stack.pop() {
        let part = || format!("node {index}");
        let node = root.nodes.get(index).ok_or_else(|| error(part(), "it does not exist"))?;
        if std::mem::replace(&mut visited[index], true) {
            return Err(error(part(), "expected a node with one parent, found it twice in the scene"));
        }
        let world = parent.times(&local(node));
        if let Some(mesh) = node.mesh {
            instances.push((index, mesh, world.clone()));
        }
        stack.extend(node.children.iter().rev().map(|&child| (child, world.clone())));
    }
    Ok(instances)
}

fn local(node: &Node) -> Transform {
    match node.matrix {
        Some(matrix) => Transform::from_columns(matrix),
        None => Transform::from_parts(
            node.translation.unwrap_or([0.0; 3]),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ),
    }
}

impl Reader<'_, '_> {
    fn mesh(&mut self, node: Option<usize>, mesh: usize, transform: &Transform) -> Result<()> {
        let Some(Mesh { primitives, .. }) = self.accessors.root.meshes.get(mesh) else {
            let message = format!("expected a mesh below {}, found {mesh}", self.accessors.root.meshes.len());
            let part = node.map_or_else(|| format!("mesh {mesh}"), |node| format!("node {node}"));
            return Err(self.accessors.source.error_in_part(GRAPH, part, message, "export the model again"));
        };
        for (index, primitive) in primitives.iter().enumerate() {
            self.accessors.source.monitor.check()?;
            self.primitive(node, [mesh, index], primitive, transform)?;
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        node: Option<usize>,
        [mesh, index]: [usize; 2],
        p: &Primitive,
        world: &Transform,
    ) -> Result<()> {
        let source = self.accessors.source;
        let part = || format!("mesh {mesh} primitive {index}");
        let Some(&positions) = p.attributes.get("POSITION") else {
            if let Some(name) = p.extensions.keys().find(|name| name.contains("compression")) {
                return Err(unsupported_extension(source, name));
            }
            source.monitor.warn(&format!("{} has no positions and is left out", part()));
            self.raw.skipped += 1;
            return Ok(());
        };
        let no_data = |a: usize| {
            self.accessors
                .root
                .accessors
                .get(a)
                .is_some_and(|a| a.buffer_view.is_none() && a.sparse.is_none())
        };
        if no_data(positions)
            && let Some(name) = p.extensions.keys().find(|name| name.contains("compression"))
        {
            return Err(unsupported_extension(source, name));
        }
        let mode = p.mode.unwrap_or(4);
        if mode <= 3 {
            let count = self.accessors.count(p.indices.unwrap_or(positions))?;
            self.raw.skipped += match mode {
                1 => count / 2,
                3 => count.saturating_sub(1),
                _ => count,
            };
            return Ok(());
        }
        let normals = p.attributes.get("NORMAL").copied().filter(|_| self.keep != Keep::None);
        let uvs = p.attributes.get("TEXCOORD_0").copied().filter(|_| self.keep == Keep::All);
        let first = [self.raw.positions.len(), self.raw.normals.len(), self.raw.uvs.len()];
        let accessors = [Some(positions), normals, uvs];
        self.spans.push(Span { first, accessors, node, mesh, primitive: index });

        // Refuse before anything large is made.
        let rows = self.accessors.count(positions)?;
        check_rows((first[0] as u64).saturating_add(rows))?;
        let positions = self.accessors.vectors::<3>(positions)?;
        let indices = match p.indices {
            Some(accessor) => self.accessors.indices(accessor)?,
            None => (0..rows as u32).collect(),
        };
        if let Some((at, found)) = indices.iter().enumerate().find(|(_, row)| u64::from(**row) >= rows) {
            let place = match p.indices {
                Some(accessor) => format!("{} accessor {accessor} row {at}", part()),
                None => part(),
            };
            let message = format!("expected an index below {rows}, found {found}");
            return Err(source.error_in_part(INDEX, place, message, INDEX_HINT));
        }
        let corners = corners(mode, &indices).ok_or_else(|| {
            let message = format!("expected a mode from 0 to 6, found {mode}");
            source.error_in_part(MALFORMED, part(), message, "export the model again")
        })?;
        self.raw.skipped += skipped(mode, indices.len());
        check_triangles((self.raw.triangles.len() + corners.len()) as u64)?;

        // A mirrored mesh keeps its front sides (specification, §3.7.4).
        let mirrored = world.is_mirrored();
        let rows_from = |first: usize| {
            let row = move |i: u32| first as u32 + i;
            corners
                .iter()
                .map(move |&[a, b, c]| if mirrored { [a, c, b].map(row) } else { [a, b, c].map(row) })
        };
        self.raw.positions.extend(positions.iter().map(|p| world.point(*p)));
        self.raw.triangles.extend(rows_from(first[0]));
        let short = |accessor: usize, found: usize| {
            let message = format!("expected {rows} rows as in POSITION, found {found}");
            source.error_in_part(INDEX, format!("{} accessor {accessor}", part()), message, INDEX_HINT)
        };
        let absent = std::iter::repeat_n([NONE; 3], corners.len());
        match normals {
            Some(accessor) => {
                let normals = self.accessors.vectors::<3>(accessor)?;
                if normals.len() as u64 != rows {
                    return Err(short(accessor, normals.len()));
                }
                self.raw.normals.extend(normals.iter().map(|n| world.normal(*n)));
                self.raw.normal_rows.extend(rows_from(first[1]));
            }
            None if self.keep != Keep::None => self.raw.normal_rows.extend(absent.clone()),
            None => {}
        }
        match uvs {
            Some(accessor) => {
                let uvs = self.accessors.vectors::<2>(accessor)?;
                if uvs.len() as u64 != rows {
                    return Err(short(accessor, uvs.len()));
                }
                self.raw.uvs.extend(uvs);
                self.raw.uv_rows.extend(rows_from(first[2]));
            }
            None if self.keep == Keep::All => self.raw.uv_rows.extend(absent),
            None => {}
        }
        Ok(())
    }
}

/// Triangles of a primitive (specification, §3.7.2.1); `None` for an unknown mode.
fn corners(mode: u64, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    Some(match mode {
        4 => indices.as_chunks::<3>().0.to_vec(),
        5 => crate::raw::strip(indices).collect(),
        6 => {
            let first = indices.first().copied().unwrap_or_default();
            indices.get(1..).unwrap_or_default().windows(2).map(|w| [w[0], w[1], first]).collect()
        }
        _ => return None,
    })
}

/// Incomplete faces of a primitive of triangles: 0 or 1.
fn skipped(mode: u64, indices: usize) -> u64 {
    u64::from(if mode == 4 { !indices.is_multiple_of(3) } else { (1..3).contains(&indices) })
}
