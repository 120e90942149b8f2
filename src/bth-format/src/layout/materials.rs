//! How surfaces look: parameters of materials, textures and their images. Specification:
//! "Materials".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// How a material looks.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct MaterialParameters {
    /// Linear red, green and blue, and alpha.
    pub base_color: [f32; 4],
    /// Emitted radiance: linear red, green and blue.
    pub emissive: [f32; 3],
    /// Min alpha at which there is a surface, in [`ALPHA_MASK`].
    pub alpha_cutoff: f32,
    /// [`ALPHA_OPAQUE`], [`ALPHA_MASK`] or [`ALPHA_BLEND`].
    pub alpha_mode: u32,
    /// [`MATERIAL_DOUBLE_SIDED`] and [`MATERIAL_UNLIT`].
    pub flags: u32,
    /// Row of `TEXTURES`, or [`super::NONE`].
    pub base_color_texture: u32,
    /// Row of `TEXTURES`, or [`super::NONE`].
    pub emissive_texture: u32,
    /// Zero.
    pub reserved: [u32; 4],
}

/// How glossy a material is, and which textures shape its surface.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct GlossParameters {
    /// From 0, not metallic, to 1.
    pub metallic: f32,
    /// From 0, smooth, to 1.
    pub roughness: f32,
    /// Factor of the first two components of the normals of the texture.
    pub normal_scale: f32,
    /// How much the texture of occlusion counts, from 0 to 1.
    pub occlusion_strength: f32,
    /// Row of `TEXTURES`, or [`super::NONE`]: green is roughness, blue metallic.
    pub metallic_roughness_texture: u32,
    /// Row of `TEXTURES`, or [`super::NONE`].
    pub normal_texture: u32,
    /// Row of `TEXTURES`, or [`super::NONE`]: red is the share of light from all around.
    pub occlusion_texture: u32,
    /// Zero.
    pub reserved: u32,
}

/// Alpha means nothing.
pub const ALPHA_OPAQUE: u32 = 0;
/// There is a surface where alpha is at least the cutoff.
pub const ALPHA_MASK: u32 = 1;
/// Alpha is the share of light that the surface stops.
pub const ALPHA_BLEND: u32 = 2;
/// Bit of [`MaterialParameters::flags`]: the back of triangles is seen too.
pub const MATERIAL_DOUBLE_SIDED: u32 = 1;
/// Bit of [`MaterialParameters::flags`]: the base color is shown without light.
pub const MATERIAL_UNLIT: u32 = 2;

/// An image on a surface.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Texture {
    /// Name of its image.
    pub image: [u8; 16],
    /// For each coordinate [`WRAP_REPEAT`], [`WRAP_MIRROR`] or [`WRAP_CLAMP`].
    pub wrap: [u32; 2],
    /// [`FILTER_LINEAR`] or [`FILTER_NEAREST`].
    pub filter: u32,
    /// Rows of the transform from the coordinates (u, v, 1) to coordinates of the image.
    pub transform: [[f32; 3]; 2],
    /// [`UV_SET_FIRST`] or [`UV_SET_SECOND`].
    pub uv_set: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

/// The texture takes its coordinates from `UVS`.
pub const UV_SET_FIRST: u32 = 0;
/// The texture takes its coordinates from `SECOND_UVS`.
pub const UV_SET_SECOND: u32 = 1;

/// The image repeats.
pub const WRAP_REPEAT: u32 = 0;
/// The image repeats, every second time mirrored.
pub const WRAP_MIRROR: u32 = 1;
/// The texels at the edge go on.
pub const WRAP_CLAMP: u32 = 2;
/// The four texels around a point are interpolated.
pub const FILTER_LINEAR: u32 = 0;
/// The nearest texel is taken.
pub const FILTER_NEAREST: u32 = 1;

/// Where the bytes of an image file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Image {
    /// The first 128 bits of the BLAKE3 hash of its bytes.
    pub name: [u8; 16],
    /// Its first byte in `IMAGE_BYTES`.
    pub first: u64,
    /// Its number of bytes.
    pub length: u64,
}

assert_layout! {
    MaterialParameters 64 { base_color 0, emissive 16, alpha_cutoff 28, alpha_mode 32, flags 36, base_color_texture 40,
        emissive_texture 44, reserved 48 }
    GlossParameters 32 { metallic 0, roughness 4, normal_scale 8, occlusion_strength 12, metallic_roughness_texture 16,
        normal_texture 20, occlusion_texture 24, reserved 28 }
    Texture 64 { image 0, wrap 16, filter 24, transform 28, uv_set 52, reserved 56 }
    Image 32 { name 0, first 16, length 24 }
}
