//! The parts of a glTF document that describe geometry, scenes and animations (glTF 2.0
//! specification, §5). docs/decisions.md says why these are not the structures of `gltf-json`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

/// Extensions by name, each parsed where it is read.
pub(super) type Extensions = BTreeMap<String, Value>;

/// The document.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct GltfDocument {
    pub(super) asset: GltfAsset,
    pub(super) extensions_required: Vec<String>,
    pub(super) extensions_used: Vec<String>,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<GltfScene>,
    pub(super) nodes: Vec<GltfNode>,
    pub(super) meshes: Vec<GltfMesh>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
    pub(super) skins: Vec<GltfSkin>,
    // Parsed at use: what is malformed there must not fail the import of meshes.
    pub(super) animations: Vec<Value>,
    pub(super) cameras: Vec<Value>,
    pub(super) materials: Vec<Value>,
    pub(super) textures: Value,
    pub(super) images: Value,
    pub(super) samplers: Value,
    pub(super) extensions: Extensions,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct GltfAsset {
    pub(super) version: String,
    /// The version that readers of the document must know.
    pub(super) min_version: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct GltfScene {
    pub(super) name: String,
    pub(super) nodes: Vec<usize>,
}

/// A node. Numbers are f64 so that world transforms round once, when positions become f32.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct GltfNode {
    pub(super) name: String,
    pub(super) children: Vec<usize>,
    pub(super) camera: Option<usize>,
    pub(super) extensions: Extensions,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    /// Weights of the morph targets. They replace the mesh's own.
    pub(super) weights: Option<Vec<f64>>,
}

/// A skin. Its skeleton root has no bearing on positions and is not read.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct GltfSkin {
    pub(super) name: String,
    pub(super) inverse_bind_matrices: Option<usize>,
    pub(super) joints: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct GltfMesh {
    pub(super) name: String,
    pub(super) primitives: Vec<Primitive>,
    /// Default weights of the morph targets.
    pub(super) weights: Option<Vec<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    pub(super) mode: Option<u64>,
    /// Morph targets: accessors by the names of attributes, parsed where they are read.
    pub(super) targets: Vec<Value>,
    pub(super) extensions: Extensions,
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

#[derive(Deserialize)]
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
