//! The surface at a hit: positions, normals, texture coordinates, group, material and names, from
//! the sections of the source that a file keeps. The queries are methods of [`Scene`]
//! (`hits/mod.rs`).
//!
//! The corners of a triangle come from its leaf. Compiling decides what else a file keeps: normals
//! and texture coordinates with `--attributes`, groups, materials and names with `--names`, how
//! materials look with `--materials`.

use crate::animation::normals::corner_normal;
use crate::intersect::start::corners_by_id;
use crate::materials::{Alpha, Gloss, Material, Texture, Wrap};
use crate::rays::{Hit, PrimitiveRef};
use crate::scene::Scene;
use bth_format::exact::{Dyadic, dyadic_cross, dyadic_difference, dyadic_vector};
use bth_format::layout::{
    ALPHA_BLEND, ALPHA_MASK, FILTER_NEAREST, MATERIAL_DOUBLE_SIDED, MATERIAL_UNLIT, NONE, UV_SET_FIRST,
    UV_SET_SECOND, WRAP_CLAMP, WRAP_MIRROR,
};
use bth_format::object::ObjectView;

/// The surface at a point of a triangle, as [`Scene::surface`] finds it. Positions and normals are
/// in world space unless their name says otherwise, normals have length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point: the triangle's vertices weighted by the hit's barycentric coordinates, in f64. It
    /// lies on the triangle but for the rounding of these coordinates to f32, which the ray's
    /// `origin + t * direction` does not.
    pub position: [f64; 3],
    /// The point in the space of the object.
    pub object_position: [f64; 3],
    /// The normal of the triangle's plane, on the side from which the object's vertices are seen
    /// counterclockwise. A mirrored instance shows the same sides of its object as others do.
    pub geometric_normal: [f64; 3],
    /// Like [`Self::geometric_normal`], in the space of the object.
    pub object_geometric_normal: [f64; 3],
    /// The normals of the source at the vertices, interpolated, on whatever side the source has
    /// them. The geometric normal where the file keeps none, where the object has new positions,
    /// where the normals of the vertices cancel out, and instead of a vertex's normal of zeros.
    pub normal: [f64; 3],
    /// Like [`Self::normal`], in the space of the object.
    pub object_normal: [f64; 3],
    /// Texture coordinates, interpolated; `None` if the file keeps none.
    pub uv: Option<[f32; 2]>,
    /// Index of the object.
    pub object: u32,
    /// Index of the group of the object's triangles; 0 if the file keeps no groups. Its name is
    /// [`Scene::group_name`].
    pub group: u32,
    /// Index of the object's material; `None` if the group has none or the file keeps none. Its
    /// name is [`Scene::material_name`].
    pub material: Option<u32>,
}

/// Implements [`Scene::surface`].
pub(crate) fn surface_at(scene: &Scene, hit: &Hit) -> Option<SurfacePoint> {
    let PrimitiveRef { instance, triangle: id } = hit.primitive;
    let object = object_at(scene, hit.primitive)?;
    if scene.world().is_some_and(|world| world.placed(instance).is_none()) {
        return None;
    }
    let view = scene.object(object);
    let corners = corners_by_id(&view, id)?;
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let weights = [1.0 - u - v, u, v];
    let object_position = weighted(weights, corners);
    let object_geometric_normal = plane_normal(corners)?;
    let object_normal = interpolated_normal(scene, (object, id), weights, object_geometric_normal);
    let to_world = |normal: [f64; 3]| match scene.world() {
        None => normal,
        Some(_) => unit(scene.normal_to_world(instance, normal)).unwrap_or(normal),
    };
    let group = view.group_of(id);
    Some(SurfacePoint {
        position: transformed(&scene.instance(instance).to_world, object_position),
        object_position,
        geometric_normal: to_world(object_geometric_normal),
        object_geometric_normal,
        normal: to_world(object_normal),
        object_normal,
        uv: interpolated_uv(&view, id, weights),
        object,
        group,
        material: view.material_of(group),
    })
}

/// Implements [`Scene::material`].
pub(crate) fn material(scene: &Scene, object: u32, material: u32) -> Option<Material> {
    let (file, row) = scene.objects().locate(object)?;
    let materials = file.materials(row);
    let row = *materials.parameters.get(material as usize)?;
    let texture = |row: u32| (row != NONE).then_some(row);
    let gloss = materials.gloss.get(material as usize).map(|gloss| Gloss {
        metallic: gloss.metallic,
        roughness: gloss.roughness,
        metallic_roughness_texture: texture(gloss.metallic_roughness_texture),
        normal_texture: texture(gloss.normal_texture),
        normal_scale: gloss.normal_scale,
        occlusion_texture: texture(gloss.occlusion_texture),
        occlusion_strength: gloss.occlusion_strength,
    });
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
        gloss,
    })
}

/// Implements [`Scene::texture`].
pub(crate) fn texture(scene: &Scene, object: u32, texture: u32) -> Option<Texture<'_>> {
    let (file, row) = scene.objects().locate(object)?;
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

/// Implements [`Scene::texture_coordinates`].
pub(crate) fn texture_coordinates(scene: &Scene, hit: &Hit, uv_set: u32) -> Option<[f32; 2]> {
    let object = object_at(scene, hit.primitive)?;
    let triangle = hit.primitive.triangle;
    match uv_set {
        UV_SET_FIRST => {
            let (u, v) = (f64::from(hit.u), f64::from(hit.v));
            interpolated_uv(scene.view(object), triangle, [1.0 - u - v, u, v])
        }
        UV_SET_SECOND => {
            let (file, row) = scene.objects().locate(object)?;
            file.materials(row).second_uv_at(triangle, hit.u, hit.v)
        }
        _ => None,
    }
}

/// The object of a triangle; `None` if there is no such instance.
pub(crate) fn object_at(scene: &Scene, primitive: PrimitiveRef) -> Option<u32> {
    let object = (primitive.instance < scene.instance_count()).then(|| scene.object_of(primitive.instance));
    object.filter(|object| *object != NONE)
}

/// The interpolated normal at barycentric weights of a triangle, in the space of the object. What
/// deforms the object turns normals, too.
fn interpolated_normal(
    scene: &Scene,
    (object, id): (u32, u32),
    weights: [f64; 3],
    geometric: [f64; 3],
) -> [f64; 3] {
    let view = scene.view(object);
    let Some(corners) = attribute(view, view.normals, id) else { return geometric };
    let zero = |normal: &[f32; 3]| normal.iter().all(|x| *x == 0.0);
    if corners.iter().all(zero) {
        return geometric;
    }
    let deformed = deformed_normals(scene, (object, id), corners);
    let normals = [0, 1, 2].map(|k| match &deformed {
        _ if zero(&corners[k]) => geometric,
        Some(deformed) => unit(deformed[k]).unwrap_or(geometric),
        None => corners[k].map(f64::from),
    });
    unit(weighted(weights, normals)).unwrap_or(geometric)
}

/// The normals at the corners of a triangle, turned from the normals in the file by the deformer of
/// its object; of any length. `None` if nothing deforms the object.
fn deformed_normals(
    scene: &Scene,
    (object, triangle): (u32, u32),
    normals: [[f32; 3]; 3],
) -> Option<[[f64; 3]; 3]> {
    let pose = scene.world()?.animation.pose_of(object)?;
    let (file, row) = scene.file_of(object);
    let view = scene.view(object);
    let (corners, vertices) = (view.corners.get(triangle as usize)?, view.triangles.get(triangle as usize)?);
    let deformation = file.deformation(row);
    Some([0, 1, 2].map(|k| corner_normal(&deformation, pose, corners[k], normals[k], vertices[k])))
}

/// Bounds the error of a component of a vector product relative to its products' sizes: it has at
/// most 7 roundings of half an epsilon.
const CROSS_ERROR: f64 = 8.0 * f64::EPSILON;

/// Normals are computed exactly if the error bound of f64 exceeds this share of their largest
/// component.
const NORMAL_ERROR: f64 = 1.0 / (1u64 << 40) as f64;

/// The normal of a triangle's plane; `None` for a triangle of zero area, which is never hit.
fn plane_normal([a, b, c]: [[f64; 3]; 3]) -> Option<[f64; 3]> {
    let edge = |to: [f64; 3]| [0, 1, 2].map(|k| to[k] - a[k]);
    let (e, f) = (edge(b), edge(c));
    let products = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| (e[i] * f[j], e[j] * f[i]));
    let normal = products.map(|(p, q)| p - q);
    // Products of differences of coordinates neither overflow nor underflow in f64.
    let error = products.iter().fold(0.0, |most: f64, (p, q)| most.max(p.abs() + q.abs())) * CROSS_ERROR;
    let greatest = normal.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    unit(if error <= NORMAL_ERROR * greatest { normal } else { exact_normal([a, b, c]) })
}

/// The normal of a triangle's plane, each component rounded once.
#[cold]
fn exact_normal(corners: [[f64; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(dyadic_vector);
    let normal = dyadic_cross(&dyadic_difference(&b, &a), &dyadic_difference(&c, &a));
    normal.each_ref().map(Dyadic::to_f64)
}

/// The interpolated texture coordinates at barycentric weights.
fn interpolated_uv(view: &ObjectView<'_>, id: u32, weights: [f64; 3]) -> Option<[f32; 2]> {
    let corners = attribute(view, view.uvs, id)?;
    Some(weighted(weights, corners.map(|uv| uv.map(f64::from))).map(|x| x as f32))
}

/// The attributes of a triangle's corners, if the file keeps them.
fn attribute<const N: usize>(view: &ObjectView<'_>, rows: &[[f32; N]], id: u32) -> Option<[[f32; N]; 3]> {
    let [a, b, c] = view.corners.get(id as usize)?.map(|row| rows.get(row as usize).copied());
    Some([a?, b?, c?])
}

/// The sum of weighted vectors.
fn weighted<const N: usize>(weights: [f64; 3], [a, b, c]: [[f64; N]; 3]) -> [f64; N] {
    std::array::from_fn(|k| weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k])
}

/// A point after a transform with rows of four.
pub(crate) fn transformed(rows: &[[f64; 4]; 3], p: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3])
}

/// A vector divided by its length; `None` for zero and for what is not finite. It is divided by its
/// largest component first, since the squares of components may overflow or underflow.
fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let greatest = v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let v = v.map(|x| x / greatest);
    if !(greatest > 0.0 && v.iter().all(|x| x.is_finite())) {
        return None;
    }
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    Some(v.map(|x| x / length))
}
