//! How the surface at a hit looks: base colour, alpha and emission, from factors, textures and
//! vertex colours.

use super::texels::{Texels, decode};
use crate::messages::warn;
use bth::rays::Hit;
use bth::{Alpha, Material, Scene, Wrap};
use bth_format::object::ObjectView;
use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The materials of all objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneMaterials {
    pub(super) objects: Vec<ObjectMaterials>,
    /// True if no object has any material or vertex colour.
    pub(super) is_empty: bool,
    /// True if some material lets rays pass by its alpha.
    pub(super) has_alpha: bool,
    /// True if some material is seen from the front only.
    pub(super) has_single_sided: bool,
}

/// The materials of an object.
#[derive(Clone, Debug, Default)]
pub(super) struct ObjectMaterials {
    /// `None` for materials with nothing but a name.
    pub(super) materials: Vec<Option<Material>>,
    /// `None` for textures whose image cannot be decoded.
    pub(super) textures: Vec<Option<LoadedTexture>>,
    pub(super) has_colors: bool,
}

/// A texture that can be sampled.
#[derive(Clone, Debug)]
pub(super) struct LoadedTexture {
    pub(super) texels: Arc<Texels>,
    pub(super) wrap: [Wrap; 2],
    pub(super) nearest: bool,
    pub(super) uv_set: u32,
    pub(super) transform: [[f32; 3]; 2],
}

/// How a point of a surface looks. Colours are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    /// The share of light that it reflects.
    pub(crate) base_color: Vec3,
    /// Radiance that it emits.
    pub(crate) emissive: Vec3,
    /// True if the base colour is shown as it is, without light.
    pub(crate) unlit: bool,
    /// How metallic and how rough it is; `None` for matte surfaces.
    pub(crate) gloss: Option<[f32; 2]>,
    /// The share of light from all around that reaches the surface.
    pub(crate) occlusion: f32,
    /// The normal of its texture: right, up and out of the surface.
    pub(crate) normal: Option<Vec3>,
}

impl Look {
    /// A matte surface.
    pub(crate) fn matte(base_color: Vec3) -> Self {
        Self { base_color, emissive: Vec3::ZERO, unlit: false, gloss: None, occlusion: 1.0, normal: None }
    }
}

impl ObjectMaterials {
    pub(super) fn is_empty(&self) -> bool {
        !self.has_colors && self.materials.iter().all(Option::is_none)
    }

    fn texture(&self, texture: Option<u32>) -> Option<&LoadedTexture> {
        texture.and_then(|row| self.textures.get(row as usize)?.as_ref())
    }

    /// The linear texel of a texture of colours at a hit; white without one.
    fn texel(&self, texture: Option<u32>, scene: &Scene, hit: &Hit) -> Vec4 {
        self.texture(texture).map_or(Vec4::ONE, |texture| {
            texture.texels.at(texture.coordinates(scene, hit), texture.wrap, texture.nearest)
        })
    }

    /// The texel of another texture at a hit; `None` without one.
    fn data(&self, texture: Option<u32>, scene: &Scene, hit: &Hit) -> Option<Vec4> {
        self.texture(texture).map(|texture| {
            texture.texels.data_at(texture.coordinates(scene, hit), texture.wrap, texture.nearest)
        })
    }
}

impl LoadedTexture {
    /// Coordinates of the image at a hit, from zeros where the file keeps none.
    fn coordinates(&self, scene: &Scene, hit: &Hit) -> [f32; 2] {
        let [u, v] = scene.texture_coordinates(hit, self.uv_set).unwrap_or_default().map(f64::from);
        self.transform.map(|[a, b, c]| (f64::from(a) * u + f64::from(b) * v + f64::from(c)) as f32)
    }

    /// The directions in the world in which the coordinates of the image grow, at any point of the
    /// triangle of a hit.
    fn directions(&self, scene: &Scene, hit: &Hit) -> Option<[DVec3; 2]> {
        let [a, b, c] = scene.triangle_in_world(hit.primitive)?.map(DVec3::from_array);
        let at = |u: f32, v: f32| DVec2::from(self.coordinates(scene, &Hit { u, v, ..*hit }).map(f64::from));
        let (e, f, origin) = (b - a, c - a, at(0.0, 0.0));
        let (s, t) = (at(1.0, 0.0) - origin, at(0.0, 1.0) - origin);
        let area = s.perp_dot(t);
        let along = [(e * t.y - f * s.y) / area, (f * s.x - e * t.x) / area];
        along.iter().all(|d| d.is_finite() && *d != DVec3::ZERO).then_some(along)
    }
}

/// A material of a scene that has no material, but vertex colours.
const WHITE: Material = Material {
    base_color: [1.0; 4],
    base_color_texture: None,
    emissive: [0.0; 3],
    emissive_texture: None,
    alpha: Alpha::Opaque,
    double_sided: true,
    unlit: false,
    gloss: None,
};

impl SceneMaterials {
    /// Returns true if nothing has a material or a vertex colour.
    pub(crate) fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// Returns true if rays may pass where a surface is hit: by alpha, and rays of the camera from
    /// the back.
    pub(crate) fn lets_pass(&self, camera: bool) -> bool {
        self.has_alpha || camera && self.has_single_sided
    }

    /// The material of a hit; `None` where nothing but a name is known of it.
    pub(crate) fn material(&self, scene: &Scene, view: &ObjectView<'_>, hit: &Hit) -> Option<&Material> {
        let object = &self.objects.get(scene.object_of(hit.primitive.instance) as usize)?;
        let material = view.material_of(view.group_of(hit.primitive.triangle))?;
        object.materials.get(material as usize)?.as_ref()
    }

    /// The base colour with alpha at a hit.
    fn base_color(&self, scene: &Scene, hit: &Hit, material: &Material) -> Vec4 {
        let object = &self.objects[scene.object_of(hit.primitive.instance) as usize];
        let factor = Vec4::from_array(material.base_color);
        let vertex = if object.has_colors { scene.vertex_color(hit) } else { None };
        let texel = object.texel(material.base_color_texture, scene, hit);
        factor * texel * vertex.map_or(Vec4::ONE, Vec4::from_array)
    }

    /// The alpha of a material's surface at a hit.
    pub(crate) fn alpha(&self, scene: &Scene, hit: &Hit, material: &Material) -> f32 {
        self.base_color(scene, hit, material).w
    }

    /// How the surface at a hit looks; `None` where it has neither material nor vertex colour.
    pub(crate) fn look(&self, scene: &Scene, view: &ObjectView<'_>, hit: &Hit) -> Option<Look> {
        let object = self.objects.get(scene.object_of(hit.primitive.instance) as usize)?;
        let material = match self.material(scene, view, hit) {
            Some(material) => material,
            None if object.has_colors => &WHITE,
            None => return None,
        };
        let base_color = self.base_color(scene, hit, material).truncate();
        let emissive = Vec3::from_array(material.emissive);
        let emissive = match material.emissive_texture {
            Some(_) if emissive != Vec3::ZERO => {
                emissive * object.texel(material.emissive_texture, scene, hit).truncate()
            }
            _ => emissive,
        };
        let mut look = Look { emissive, unlit: material.unlit, ..Look::matte(base_color) };
        if let Some(gloss) = &material.gloss {
            let texel = object.data(gloss.metallic_roughness_texture, scene, hit).unwrap_or(Vec4::ONE);
            look.gloss = Some([gloss.metallic * texel.z, gloss.roughness * texel.y]);
            let open = object.data(gloss.occlusion_texture, scene, hit).map_or(1.0, |texel| texel.x);
            look.occlusion = 1.0 + gloss.occlusion_strength * (open - 1.0);
            look.normal = object.data(gloss.normal_texture, scene, hit).map(|texel| {
                let [x, y, z] = (texel.truncate() * 2.0 - 1.0).to_array();
                Vec3::new(x * gloss.normal_scale, y * gloss.normal_scale, z)
            });
        }
        Some(look)
    }

    /// The normal of a look in the world; `smooth` is the unit normal of the surface, on its front.
    pub(crate) fn mapped_normal(
        &self,
        scene: &Scene,
        view: &ObjectView<'_>,
        hit: &Hit,
        look: &Look,
        smooth: DVec3,
    ) -> Option<DVec3> {
        let normal = look.normal?.as_dvec3();
        let object = self.objects.get(scene.object_of(hit.primitive.instance) as usize)?;
        let gloss = self.material(scene, view, hit)?.gloss?;
        let [right, down] = object.texture(gloss.normal_texture)?.directions(scene, hit)?;
        let right = right.reject_from_normalized(smooth).try_normalize()?;
        let up = smooth.cross(right);
        // Mirrored coordinates turn the other way.
        let up = if up.dot(down) > 0.0 { -up } else { up };
        (right * normal.x + up * normal.y + smooth * normal.z).try_normalize()
    }
}

impl SceneMaterials {
    /// Loads the materials of all objects of a scene. Skips an image that cannot be decoded, with a
    /// warning.
    pub(crate) fn load(scene: &Scene, file: &Path) -> Self {
        let images = decoded_images(scene, file);
        let objects: Vec<ObjectMaterials> =
            (0..scene.object_count()).map(|object| object_materials(scene, object, &images)).collect();
        let all = || objects.iter().flat_map(|object| &object.materials).flatten();
        let has = |holds: fn(&Material) -> bool| all().any(holds);
        Self {
            is_empty: objects.iter().all(ObjectMaterials::is_empty),
            has_alpha: has(|material| material.alpha != Alpha::Opaque),
            has_single_sided: has(|material| !material.double_sided),
            objects,
        }
    }
}

/// The images of all textures, by their indices, decoded in parallel.
fn decoded_images(scene: &Scene, file: &Path) -> BTreeMap<u32, Arc<Texels>> {
    let mut files: BTreeMap<u32, &[u8]> = BTreeMap::new();
    for object in 0..scene.object_count() {
        for texture in (0..scene.texture_count(object)).filter_map(|row| scene.texture(object, row)) {
            files.insert(texture.image, texture.bytes);
        }
    }
    let files: Vec<(u32, &[u8])> = files.into_iter().collect();
    let decoded: Vec<_> = files.par_iter().map(|(image, bytes)| (*image, decode(bytes))).collect();
    let mut images = BTreeMap::new();
    for (image, decoded) in decoded {
        match decoded {
            Ok(texels) => {
                images.insert(image, Arc::new(texels));
            }
            Err(what) => warn(&format!(
                "{}: image {image}: BTH-P005: it cannot be decoded and is left out: {what} (hint: save it again as PNG, or use \
                 --mode clay)",
                file.display()
            )),
        }
    }
    images
}

fn object_materials(scene: &Scene, object: u32, images: &BTreeMap<u32, Arc<Texels>>) -> ObjectMaterials {
    let texture = |row: u32| {
        let texture = scene.texture(object, row)?;
        Some(LoadedTexture {
            texels: images.get(&texture.image)?.clone(),
            wrap: texture.wrap,
            nearest: texture.nearest,
            uv_set: texture.uv_set,
            transform: texture.transform,
        })
    };
    let (file, row) = scene.file_of(object);
    ObjectMaterials {
        materials: (0..scene.material_count(object)).map(|row| scene.material(object, row)).collect(),
        textures: (0..scene.texture_count(object)).map(texture).collect(),
        has_colors: !file.materials(row).colors.is_empty(),
    }
}
