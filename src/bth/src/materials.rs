//! How surfaces look: parameters of materials, textures as image files, a second set of texture
//! coordinates, and vertex colours. A file keeps them with `bthc compile --materials`. Nothing is
//! decoded here.

/// What the alpha of a material means. Alpha is the product of the fourth components of the base
/// colour, the base colour texture and the vertex colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Nothing.
    Opaque,
    /// There is a surface where alpha is at least this cutoff.
    Mask(f32),
    /// Alpha is the share of light that the surface stops.
    Blend,
}

/// How a material looks. Colours are linear, with the primaries of sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Red, green, blue and alpha; to be multiplied by the texel of the texture and the vertex
    /// colour.
    pub base_color: [f32; 4],
    /// Texture of the base colour, an index below
    /// [`Scene::texture_count`](crate::Scene::texture_count).
    pub base_color_texture: Option<u32>,
    /// Red, green and blue of the emitted radiance; to be multiplied by the texel of the texture.
    pub emissive: [f32; 3],
    /// Texture of the emission.
    pub emissive_texture: Option<u32>,
    /// What alpha means.
    pub alpha: Alpha,
    /// True if the back of triangles is seen too.
    pub double_sided: bool,
    /// True if the base colour is shown as it is, without light.
    pub unlit: bool,
    /// How glossy it is; `None` for matte materials.
    pub gloss: Option<Gloss>,
}

/// How glossy a material is, as in glTF 2.0 (appendix B), and the textures that shape its surface.
/// Their texels are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// From 0, not metallic, to 1; to be multiplied by blue of the texture.
    pub metallic: f32,
    /// From 0, smooth, to 1; to be multiplied by green of the texture.
    pub roughness: f32,
    /// Texture of both.
    pub metallic_roughness_texture: Option<u32>,
    /// Texture of normals: red to the right, green up, blue out of the surface, 0 to 1 for -1 to 1.
    pub normal_texture: Option<u32>,
    /// Factor of the first two components of these normals.
    pub normal_scale: f32,
    /// Texture whose red is the share of light from all around that reaches the surface.
    pub occlusion_texture: Option<u32>,
    /// How much that texture counts, from 0 to 1.
    pub occlusion_strength: f32,
}

/// The gloss of a matte material.
impl Default for Gloss {
    fn default() -> Gloss {
        Gloss {
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
        }
    }
}

/// How texture coordinates beyond 0 and 1 find texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    Repeat,
    /// The image repeats, every second time mirrored.
    Mirror,
    /// The texels at the edge continue.
    Clamp,
}

/// A texture of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture<'a> {
    /// Index of its image: equal for all textures with the same image of a file.
    pub image: u32,
    /// The image file: PNG, JPEG or WebP. Red, green and blue of texels of colours are sRGB; alpha
    /// and the texels of [`Gloss`] are linear.
    pub bytes: &'a [u8],
    /// For u and for v.
    pub wrap: [Wrap; 2],
    /// True if the nearest texel is taken. Otherwise four texels are made linear and interpolated
    /// bilinearly.
    pub nearest: bool,
    /// The set of its texture coordinates: 0 for [`SurfacePoint::uv`](crate::SurfacePoint::uv), 1
    /// for a second one; [`Scene::texture_coordinates`](crate::Scene::texture_coordinates) has
    /// both.
    pub uv_set: u32,
    /// Rows of the transform from (u, v, 1), where u and v are the coordinates of its set, to
    /// coordinates of the image. There (0, 0) is the upper left corner, (1, 1) the lower right one,
    /// and the center of texel (i, j) is at ((i + ½) / width, (j + ½) / height).
    pub transform: [[f32; 3]; 2],
}

impl Texture<'_> {
    /// Coordinates of the image at the texture coordinates of a surface.
    pub fn coordinates(&self, uv: [f32; 2]) -> [f32; 2] {
        let [u, v] = uv.map(f64::from);
        self.transform.map(|[a, b, c]| (f64::from(a) * u + f64::from(b) * v + f64::from(c)) as f32)
    }
}
