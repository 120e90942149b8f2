//! The parts of a glTF document that describe geometry, scenes and animations (glTF 2.0
//! specification, §5). docs/decisions.md says why these are not the structures of `gltf-json`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use crate::concave::ConcavePolygons;

/// Extensions by name, each parsed where it is read.
pub(crate) type Extensions = BTreeMap<String, Value>;

/// The document.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct GltfDocument {
    pub(crate) asset: GltfAsset,
    pub(super) extensions_required: Vec<String>,
    pub(super) extensions_used: Vec<String>,
    pub(crate) scene: Option<usize>,
    pub(crate) scenes: Vec<GltfScene>,
    pub(crate) nodes: Vec<GltfNode>,
    pub(crate) meshes: Vec<GltfMesh>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
    pub(crate) skins: Vec<GltfSkin>,
    // Parsed at use: what is malformed there must not fail the import of meshes.
    pub(crate) animations: Vec<Value>,
    pub(crate) cameras: Vec<Value>,
    pub(crate) materials: Vec<Value>,
    pub(crate) textures: Value,
    pub(crate) images: Value,
    pub(crate) samplers: Value,
    pub(crate) extensions: Extensions,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct GltfAsset {
    pub(crate) version: String,
    /// The version that readers of the document must know.
    pub(crate) min_version: Option<String>,
    /// Of a document that is made from another format: the units and axes of the file.
    #[serde(skip)]
    pub(crate) space: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct GltfScene {
    pub(crate) name: String,
    pub(crate) nodes: Vec<usize>,
}

/// A node. Numbers are f64 so that world transforms round once, when positions become f32. There
/// may be millions, so numbers that most have not are boxed.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct GltfNode {
    pub(crate) name: String,
    pub(crate) children: Vec<usize>,
    pub(crate) camera: Option<usize>,
    pub(crate) extensions: Extensions,
    pub(crate) mesh: Option<usize>,
    pub(crate) skin: Option<usize>,
    pub(crate) matrix: Option<Box<[f64; 16]>>,
    pub(crate) translation: Option<Box<[f64; 3]>>,
    pub(crate) rotation: Option<Box<[f64; 4]>>,
    pub(crate) scale: Option<Box<[f64; 3]>>,
    /// Weights of the morph targets. They replace the mesh's own.
    pub(crate) weights: Option<Vec<f64>>,
}

impl GltfNode {
    /// Translation, rotation and scale, which count where there is no matrix.
    pub(crate) fn parts(&self) -> ([f64; 3], [f64; 4], [f64; 3]) {
        let (translation, rotation) = (self.translation.as_deref(), self.rotation.as_deref());
        let rotation = rotation.copied().unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let scale = self.scale.as_deref().copied().unwrap_or([1.0; 3]);
        (translation.copied().unwrap_or_default(), rotation, scale)
    }
}

/// A skin. Its skeleton root has no bearing on positions and is not read.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct GltfSkin {
    pub(crate) name: String,
    pub(crate) inverse_bind_matrices: Option<usize>,
    pub(crate) joints: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct GltfMesh {
    pub(crate) name: String,
    pub(crate) primitives: Vec<Primitive>,
    /// Default weights of the morph targets.
    pub(crate) weights: Option<Vec<f64>>,
}

#[derive(Deserialize, Default, Clone)]
#[serde(default)]
pub(crate) struct Primitive {
    pub(crate) attributes: BTreeMap<String, usize>,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<usize>,
    pub(crate) mode: Option<u64>,
    /// Morph targets: accessors by the names of attributes, parsed where they are read.
    pub(crate) targets: Vec<Value>,
    pub(crate) extensions: Extensions,
    /// Of a document that is made from another format: what its faces were.
    #[serde(skip)]
    pub(crate) faces: Faces,
}

/// What the faces of a primitive were before they became triangles.
#[derive(Clone, Default)]
pub(crate) struct Faces {
    /// Those of more than three corners.
    pub(crate) polygons: u64,
    /// Those of fewer than three.
    pub(crate) skipped: u64,
    pub(crate) concave: ConcavePolygons,
}

/// KHR_draco_mesh_compression of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct DracoCompression {
    pub(super) buffer_view: usize,
    /// Unique identifiers of the stream's attributes by the names of the primitive's attributes.
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, u32>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    pub(super) byte_offset: u64,
    pub(super) component_type: u64,
    pub(super) normalized: bool,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
    #[serde(default)]
    pub(super) extensions: Extensions,
}

/// EXT_meshopt_compression or KHR_meshopt_compression of a buffer view: where its stream is and
/// what it holds.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct MeshoptCompression {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: u64,
    pub(super) count: u64,
    pub(super) mode: String,
    pub(super) filter: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: u64,
    #[serde(default)]
    pub(super) extensions: Extensions,
}

/// EXT_meshopt_compression of a buffer: true if the buffer only replaces compressed buffer views.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct MeshoptFallback {
    pub(super) fallback: bool,
}

#[derive(Deserialize)]
pub(super) struct Animation {
    pub(super) channels: Vec<Channel>,
    pub(super) samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
pub(super) struct Channel {
    pub(super) sampler: usize,
    pub(super) target: Target,
}

#[derive(Deserialize)]
pub(super) struct Target {
    pub(super) node: Option<usize>,
    pub(super) path: String,
}

#[derive(Deserialize)]
pub(super) struct Sampler {
    pub(super) input: usize,
    pub(super) output: usize,
    pub(super) interpolation: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct GltfCamera {
    #[serde(default)]
    pub(super) name: String,
    pub(super) perspective: Option<Perspective>,
    pub(super) orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Perspective {
    pub(super) aspect_ratio: Option<f64>,
    pub(super) yfov: f64,
    pub(super) znear: f64,
    pub(super) zfar: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub(super) xmag: f64,
    pub(super) ymag: f64,
    pub(super) znear: f64,
    pub(super) zfar: f64,
}

/// A light of KHR_lights_punctual.
#[derive(Deserialize)]
pub(super) struct GltfLight {
    #[serde(default)]
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) color: Option<[f64; 3]>,
    pub(super) intensity: Option<f64>,
    pub(super) range: Option<f64>,
    #[serde(default)]
    pub(super) spot: Spot,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Spot {
    pub(super) inner_cone_angle: Option<f64>,
    pub(super) outer_cone_angle: Option<f64>,
}

/// KHR_lights_punctual of a node.
#[derive(Deserialize)]
pub(super) struct LightReference {
    pub(super) light: usize,
}

/// EXT_mesh_gpu_instancing of a node.
#[derive(Deserialize)]
pub(super) struct Instancing {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, usize>,
}

/// KHR_node_visibility of a node.
#[derive(Deserialize)]
pub(super) struct Visibility {
    pub(super) visible: Option<bool>,
}
