//! How surfaces look: parameters of materials, textures as image files, a second set of texture
//! coordinates, and vertex colours. A file keeps them with `bthc compile --materials`. Nothing is
//! decoded here.

use crate::rays::Hit;
use crate::scene::Scene;
use crate::surface::interpolated_uv;
use bth_format::layout::{
    ALPHA_BLEND, ALPHA_MASK, FILTER_NEAREST, MATERIAL_DOUBLE_SIDED, MATERIAL_UNLIT, NONE, UV_SET_FIRST,
    UV_SET_SECOND, WRAP_CLAMP, WRAP_MIRROR,
};

/// What the alpha of a material means. Alpha is the product of the fourth components of the base colour,
/// the base colour texture and the vertex colour.
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
    /// Red, green, blue and alpha; to be multiplied by the texel of the texture and the vertex colour.
    pub base_color: [f32; 4],
    /// Texture of the base colour, an index below [`Scene::texture_count`].
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
    /// The image file: PNG, JPEG or WebP. Red, green and blue of its texels are sRGB, alpha is linear.
    pub bytes: &'a [u8],
    /// For u and for v.
    pub wrap: [Wrap; 2],
    /// True if the nearest texel is taken. Otherwise four texels are made linear and interpolated
    /// bilinearly.
    pub nearest: bool,
    /// The set of its texture coordinates: 0 for [`SurfacePoint::uv`](crate::SurfacePoint::uv), 1 for a second one;
    /// [`Scene::texture_coordinates`] has both.
    pub uv_set: u32,
    /// Rows of the transform from (u, v, 1), where u and v are the coordinates of its set, to
    /// coordinates of the image. There (0, 0) is the upper left corner, (1, 1) the lower right one, and
    /// the center of texel (i, j) is at ((i + ½) / width, (j + ½) / height).
    pub transform: [[f32; 3]; 2],
}

impl Scene {
    /// How a material of an object looks. `None` if the file keeps only its name, or if there is no such
    /// object or material. The material of a hit is
    /// [`SurfacePoint::material`](crate::SurfacePoint::material).
    ///
    /// ```no_run
    /// let scene = bth::open("house.bth")?;
    /// for material in 0..scene.material_count(0) {
    ///     let name = scene.material_name(0, material);
    ///     if let Some(look) = scene.material(0, material) {
    ///         let image = look.base_color_texture.and_then(|texture| scene.texture(0, texture));
    ///         println!("{name}: {:?}, image of {} bytes", look.base_color, image.map_or(0, |i| i.bytes.len()));
    ///     }
    /// }
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn material(&self, object: u32, material: u32) -> Option<Material> {
        let (file, row) = self.objects().locate(object)?;
        let row = *file.materials(row).parameters.get(material as usize)?;
        let texture = |row: u32| (row != NONE).then_some(row);
        Some(Material {
            base_color: row.base_color,
            base_color_texture: texture(row.base_color_texture),
            emissive: row.emissive,
            emissive_texture: texture(row.emissive_texture),
            alpha: match row.alpha_mode {
                ALPHA_MASK => Alpha::Mask(row.alpha_cutoff),
                ALPHA_BLEND => Alpha::Blend,
                _ => Alpha::Opaque,
            },
            double_sided: row.flags & MATERIAL_DOUBLE_SIDED != 0,
            unlit: row.flags & MATERIAL_UNLIT != 0,
        })
    }

    /// Number of textures of an object; 0 if the file keeps none or there is no such object.
    pub fn texture_count(&self, object: u32) -> u32 {
        self.objects().locate(object).map_or(0, |(file, row)| file.materials(row).textures.len() as u32)
    }

    /// A texture of an object; `None` if there is no such object or texture.
    pub fn texture(&self, object: u32, texture: u32) -> Option<Texture<'_>> {
        let (file, row) = self.objects().locate(object)?;
        let row = file.materials(row).textures.get(texture as usize)?;
        let images = file.images();
        let image = images.row_of(row.image)?;
        Some(Texture {
            image,
            bytes: images.file(image)?,
            wrap: row.wrap.map(|wrap| match wrap {
                WRAP_MIRROR => Wrap::Mirror,
                WRAP_CLAMP => Wrap::Clamp,
                _ => Wrap::Repeat,
            }),
            nearest: row.filter == FILTER_NEAREST,
            uv_set: row.uv_set,
            transform: row.transform,
        })
    }

    /// The texture coordinates of a set at a hit, interpolated. Set 0 is the set of
    /// [`SurfacePoint::uv`](crate::SurfacePoint::uv). `None` if the file keeps none of the set, or if
    /// there is no such instance, triangle or set.
    pub fn texture_coordinates(&self, hit: &Hit, uv_set: u32) -> Option<[f32; 2]> {
        let object = self.object_at(hit.primitive)?;
        let triangle = hit.primitive.triangle;
        match uv_set {
            UV_SET_FIRST => {
                let (u, v) = (f64::from(hit.u), f64::from(hit.v));
                interpolated_uv(self.view(object), triangle, [1.0 - u - v, u, v])
            }
            UV_SET_SECOND => {
                let (file, row) = self.objects().locate(object)?;
                file.materials(row).second_uv_at(triangle, hit.u, hit.v)
            }
            _ => None,
        }
    }

    /// The vertex colour at a hit, interpolated linearly: linear red, green, blue and alpha. `None` if
    /// the file keeps none, or if there is no such instance or triangle.
    pub fn vertex_color(&self, hit: &Hit) -> Option<[f32; 4]> {
        let object = self.object_at(hit.primitive)?;
        let (file, row) = self.objects().locate(object)?;
        file.materials(row).color_at(hit.primitive.triangle, hit.u, hit.v)
    }
}

impl Texture<'_> {
    /// Coordinates of the image at the texture coordinates of a surface.
    pub fn coordinates(&self, uv: [f32; 2]) -> [f32; 2] {
        let [u, v] = uv.map(f64::from);
        self.transform.map(|[a, b, c]| (f64::from(a) * u + f64::from(b) * v + f64::from(c)) as f32)
    }
}
