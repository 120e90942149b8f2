//! The parts of a glTF document that describe geometry, scenes and animations (glTF 2.0 specification, §5).
//!
//! Structures of our own rather than those of `gltf-json`: docs/decisions.md says why.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

/// Extensions by name, each parsed where it is read.
pub(crate) type Extensions = BTreeMap<String, Value>;

/// The document.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct GltfDocument {
    pub(crate) asset: GltfAsset,
    pub(crate) extensions_required: Vec<String>,
    pub(crate) extensions_used: Vec<String>,
    pub(crate) scene: Option<usize>,
    pub(crate) scenes: Vec<GltfScene>,
    pub(crate) nodes: Vec<GltfNode>,
    pub(crate) meshes: Vec<GltfMesh>,
    pub(crate) accessors: Vec<Accessor>,
    pub(crate) buffer_views: Vec<BufferView>,
    pub(crate) buffers: Vec<Buffer>,
    pub(crate) skins: Vec<GltfSkin>,
    /// Parsed as [`Animation`] lazily: a malformed animation must not fail mesh import.
    pub(crate) animations: Vec<Value>,
    /// Parsed as [`GltfCamera`] lazily, for the same reason.
    pub(crate) cameras: Vec<Value>,
    /// Parsed as [`Material`] lazily, for the same reason.
    pub(crate) materials: Vec<Value>,
    pub(crate) extensions: Extensions,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct GltfAsset {
    pub(crate) version: String,
    /// The least version that readers of the document must know.
    pub(crate) min_version: Option<String>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct GltfScene {
    pub(crate) name: String,
    pub(crate) nodes: Vec<usize>,
}

/// A node. Numbers are f64 so that world transforms round once, when positions become f32.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct GltfNode {
    pub(crate) name: String,
    pub(crate) children: Vec<usize>,
    pub(crate) camera: Option<usize>,
    pub(crate) extensions: Extensions,
    pub(crate) mesh: Option<usize>,
    pub(crate) skin: Option<usize>,
    pub(crate) matrix: Option<[f64; 16]>,
    pub(crate) translation: Option<[f64; 3]>,
    pub(crate) rotation: Option<[f64; 4]>,
    pub(crate) scale: Option<[f64; 3]>,
    /// Weights of the mesh's morph targets, in place of those of the mesh.
    pub(crate) weights: Option<Vec<f64>>,
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

#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct Primitive {
    pub(crate) attributes: BTreeMap<String, usize>,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<usize>,
    pub(crate) mode: Option<u64>,
    /// Morph targets: accessors by the names of attributes, parsed where they are read.
    pub(crate) targets: Vec<Value>,
    pub(crate) extensions: Extensions,
}

/// KHR_draco_mesh_compression of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct DracoCompression {
    pub(crate) buffer_view: usize,
    /// Unique identifiers of the stream's attributes by the names of the primitive's attributes.
    #[serde(default)]
    pub(crate) attributes: BTreeMap<String, u32>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub(crate) buffer_view: Option<usize>,
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u64,
    pub(crate) normalized: bool,
    pub(crate) count: u64,
    #[serde(rename = "type")]
    pub(crate) shape: String,
    pub(crate) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(crate) struct Sparse {
    pub(crate) count: u64,
    pub(crate) indices: SparseIndices,
    pub(crate) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseIndices {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseValues {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    pub(crate) byte_stride: Option<u64>,
    #[serde(default)]
    pub(crate) extensions: Extensions,
}

/// EXT_meshopt_compression (or KHR_meshopt_compression) of a buffer view: where its stream is and what it holds.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct MeshoptCompression {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    pub(crate) byte_stride: u64,
    pub(crate) count: u64,
    pub(crate) mode: String,
    pub(crate) filter: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub(crate) uri: Option<String>,
    pub(crate) byte_length: u64,
    #[serde(default)]
    pub(crate) extensions: Extensions,
}

/// EXT_meshopt_compression of a buffer: whether it only stands in for compressed buffer views.
#[derive(Deserialize, Default)]
#[serde(default)]
pub(crate) struct MeshoptFallback {
    pub(crate) fallback: bool,
}

/// The textures of a material that texture coordinates can be for.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct Material {
    pub(crate) pbr_metallic_roughness: MetallicRoughness,
    pub(crate) normal_texture: Option<TextureReference>,
    pub(crate) occlusion_texture: Option<TextureReference>,
    pub(crate) emissive_texture: Option<TextureReference>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct MetallicRoughness {
    pub(crate) base_color_texture: Option<TextureReference>,
    pub(crate) metallic_roughness_texture: Option<TextureReference>,
}

/// A material's use of a texture.
#[derive(Deserialize, Default, Clone)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct TextureReference {
    /// Number of the set of texture coordinates: n for `TEXCOORD_n`.
    pub(crate) tex_coord: u32,
    pub(crate) extensions: Extensions,
}

/// KHR_texture_transform of a texture reference.
#[derive(Deserialize, Clone, Copy)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct TextureTransform {
    pub(crate) offset: [f64; 2],
    /// Radians, counter-clockwise in the image, whose second coordinate grows downwards.
    pub(crate) rotation: f64,
    pub(crate) scale: [f64; 2],
    /// Replaces the reference's own set of texture coordinates.
    pub(crate) tex_coord: Option<u32>,
}

impl Default for TextureTransform {
    fn default() -> Self {
        TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

#[derive(Deserialize)]
pub(crate) struct Animation {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) channels: Vec<Channel>,
    pub(crate) samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
pub(crate) struct Channel {
    pub(crate) sampler: usize,
    pub(crate) target: Target,
}

#[derive(Deserialize)]
pub(crate) struct Target {
    pub(crate) node: Option<usize>,
    pub(crate) path: String,
}

#[derive(Deserialize)]
pub(crate) struct Sampler {
    pub(crate) input: usize,
    pub(crate) output: usize,
    pub(crate) interpolation: Option<String>,
}

#[derive(Deserialize)]
pub(crate) struct GltfCamera {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) perspective: Option<Perspective>,
    pub(crate) orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Perspective {
    pub(crate) aspect_ratio: Option<f64>,
    pub(crate) yfov: f64,
    pub(crate) znear: f64,
    pub(crate) zfar: Option<f64>,
}

#[derive(Deserialize)]
pub(crate) struct Orthographic {
    pub(crate) xmag: f64,
    pub(crate) ymag: f64,
    pub(crate) znear: f64,
    pub(crate) zfar: f64,
}

/// A light of KHR_lights_punctual.
#[derive(Deserialize)]
pub(crate) struct GltfLight {
    #[serde(default)]
    pub(crate) name: String,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) color: Option<[f64; 3]>,
    pub(crate) intensity: Option<f64>,
    pub(crate) range: Option<f64>,
    #[serde(default)]
    pub(crate) spot: Spot,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct Spot {
    pub(crate) inner_cone_angle: Option<f64>,
    pub(crate) outer_cone_angle: Option<f64>,
}

/// KHR_lights_punctual of a node.
#[derive(Deserialize)]
pub(crate) struct LightReference {
    pub(crate) light: usize,
}

/// EXT_mesh_gpu_instancing of a node.
#[derive(Deserialize)]
pub(crate) struct Instancing {
    #[serde(default)]
    pub(crate) attributes: BTreeMap<String, usize>,
}

/// KHR_node_visibility of a node.
#[derive(Deserialize)]
pub(crate) struct Visibility {
    pub(crate) visible: Option<bool>,
}
