//! Queries that report hits under conditions ([`Accept`]): the nearest, any, the k nearest, all in
//! order, and their number; and crossings of surfaces ([`crossings`]).
//!
//! The nearest hit and any hit take the kernel of single rays, whose goal tests the conditions
//! ([`conditions`]), if neither ray nor objects are in f64 and no object has tetrahedra. All other
//! queries enumerate the instances and the triangles that the conservative f32 tests do not exclude
//! ([`mod@search`]), nearer boxes first. They decide each exactly as the other queries do, and keep
//! what their collector wants ([`collect`]). So results depend neither on the instruction set nor
//! on the acceleration structures, and t, u and v have the same bits in all queries.
//!
//! These queries trace one ray at a time. Where nothing is excluded, the queries without conditions
//! find the nearest hit and any hit.

mod accept;
mod collect;
mod conditions;
mod crossings;
pub(crate) mod results;
mod search;

pub use accept::{Accept, Cull, Filter};
pub use crossings::Crossings;

use self::crossings::count_crossings;
use self::results::{append_all, append_each, append_nearest, store_each};
use crate::intersect::start::corners_by_id;
use crate::masks::Masks;
use crate::materials::{Material, Texture};
use crate::rays::{Hit, PrimitiveRef};
use crate::scene::Scene;
use crate::surface::{self, SurfacePoint};
use crate::trace_ray::TraceRay;

/// Queries for several hits, and with conditions. Hits are ordered by ascending t, then instance,
/// then triangle. Reported t are rounded to f32: among equal ones in one instance, the hit that is
/// nearer before rounding comes first. A closed triangle is hit at most once. A ray through an edge
/// or a vertex hits every triangle at it, so the number of hits on a closed surface may be odd.
impl Scene {
    /// The nearest hit of a ray in world space that is accepted. If everything is accepted, it is
    /// the result of [`Self::nearest`] to the bit.
    pub fn nearest_accepted<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> Option<Hit> {
        if self.accepts_everything(accept) {
            return self.nearest(ray);
        }
        ray.in_world(self, |ray| results::nearest(self, ray, accept))?
    }

    /// Returns true if a ray in world space has a hit that is accepted.
    pub fn any_accepted<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> bool {
        if self.accepts_everything(accept) {
            return self.any(ray);
        }
        ray.in_world(self, |ray| results::any(self, ray, accept)).unwrap_or(false)
    }

    /// Replaces `hits` by all hits of a ray in world space that are accepted, in order. The time
    /// grows with the number of triangles that the ray passes closely.
    ///
    /// ```
    /// use bth::Accept;
    /// use bth::rays::Ray;
    ///
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let ray = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
    /// let mut hits = Vec::new();
    /// scene.all_hits(&ray, &Accept::default(), &mut hits);
    /// assert_eq!(hits.iter().map(|hit| hit.t).collect::<Vec<_>>(), [1.0, 2.0]);
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn all_hits<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        hits.clear();
        append_all(self, ray, accept, &mut Vec::new(), hits);
    }

    /// Replaces `hits` by the first `k` of the hits that [`Self::all_hits`] returns, or by all if
    /// there are fewer. Nothing beyond is searched.
    pub fn nearest_hits<R: TraceRay>(&self, ray: &R, k: usize, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        hits.clear();
        append_nearest(self, ray, k, accept, hits);
    }

    /// Counts the hits that [`Self::all_hits`] returns, and stores none.
    pub fn count_hits<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> usize {
        results::count(self, ray, accept)
    }

    /// Stores for each ray the result of [`Self::nearest_accepted`], or [`Hit::MISS`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn nearest_accepted_batch<R: TraceRay>(&self, rays: &[R], accept: &Accept<'_>, hits: &mut [Hit]) {
        if self.accepts_everything(accept) {
            return self.batch(rays).nearest(hits);
        }
        store_each(rays, hits, |ray| self.nearest_accepted(ray, accept).unwrap_or(Hit::MISS));
    }

    /// Stores for each ray the result of [`Self::any_accepted`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn any_accepted_batch<R: TraceRay>(&self, rays: &[R], accept: &Accept<'_>, found: &mut [bool]) {
        if self.accepts_everything(accept) {
            return self.batch(rays).any(found);
        }
        store_each(rays, found, |ray| self.any_accepted(ray, accept));
    }

    /// Stores for each ray the result of [`Self::count_hits`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn count_hits_batch<R: TraceRay>(&self, rays: &[R], accept: &Accept<'_>, counts: &mut [usize]) {
        store_each(rays, counts, |ray| self.count_hits(ray, accept));
    }

    /// Replaces `hits` by the hits of all rays ([`Self::all_hits`]), one ray after the other, and
    /// `offsets` by one more number than there are rays: the hits of ray i are
    /// `hits[offsets[i]..offsets[i + 1]]`.
    pub fn all_hits_batch<R: TraceRay>(
        &self,
        rays: &[R],
        accept: &Accept<'_>,
        offsets: &mut Vec<usize>,
        hits: &mut Vec<Hit>,
    ) {
        let mut found = Vec::new();
        append_each(rays, offsets, hits, |ray, hits| append_all(self, ray, accept, &mut found, hits));
    }

    /// Does the same as [`Self::all_hits_batch`] with the `k` nearest hits of each ray
    /// ([`Self::nearest_hits`]).
    pub fn nearest_hits_batch<R: TraceRay>(
        &self,
        rays: &[R],
        k: usize,
        accept: &Accept<'_>,
        offsets: &mut Vec<usize>,
        hits: &mut Vec<Hit>,
    ) {
        append_each(rays, offsets, hits, |ray, hits| append_nearest(self, ray, k, accept, hits));
    }

    /// Counts the crossings of triangles by a ray in world space. Each passage through a closed
    /// surface counts once.
    ///
    /// Hits are not suited for this: a ray through an edge or a vertex hits all triangles at it,
    /// and a ray in the plane of a triangle does not hit it. Crossings are counted for the ray with
    /// its origin moved by (ε, ε², ε³) in world space, for an infinitely small ε > 0.
    /// This exact rule never hits an edge, a vertex or a plane. So a line crosses a surface
    /// without boundary as often in as out. Of two ranges of t that share an end, `[a, b]` and `[b,
    /// c]`, each crossing is in exactly one: t is compared with the ends exactly, without rounding.
    /// A ray without a line (see [`Scene`]) has no crossings, nor does a ray whose range is empty
    /// or a single t.
    ///
    /// A [`StartRay`](crate::rays::StartRay) counts the crossings of the moved line with a t above
    /// 0 on the line through the start itself, and none of a triangle through the start.
    ///
    /// The triangles of an instance are their exact images in world space. A mirrored instance
    /// keeps its front and back.
    ///
    /// ```
    /// use bth::rays::Ray;
    ///
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let ray = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
    /// // An even number for a closed model and a ray from outside.
    /// assert_eq!(scene.crossings(&ray).count, 2);
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn crossings<R: TraceRay>(&self, ray: &R) -> Crossings {
        ray.in_world(self, |ray| count_crossings(self, ray)).unwrap_or_default()
    }

    /// Stores for each ray the result of [`Self::crossings`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn crossings_batch<R: TraceRay>(&self, rays: &[R], crossings: &mut [Crossings]) {
        store_each(rays, crossings, |ray| self.crossings(ray));
    }

    /// Sets the mask of an instance. A ray can hit the instance only if its [`Accept::mask`] and
    /// this mask have a bit in common. At first all bits are set. Queries without [`Accept`] ignore
    /// masks. In a scene with groups `instance` is a row ([`Self::instance_path`]), and the mask of
    /// an instance has the bits that the masks of all rows on the way to it have.
    ///
    /// # Panics
    /// If `instance` is not below [`Self::row_count`].
    pub fn set_instance_mask(&mut self, instance: u32, mask: u32) {
        let count = self.row_count();
        assert!(instance < count, "expected an instance below {count}, found {instance}");
        self.masks_mut().set_instance(instance, mask);
    }

    /// Sets the mask of a group of triangles of an object, in all its instances. A ray must have a
    /// bit in common with the instance and a bit in common with the group.
    ///
    /// # Panics
    /// If there is no such object, or if it has no such group.
    pub fn set_group_mask(&mut self, object: u32, group: u32, mask: u32) {
        let count = self.group_count(object);
        assert!(group < count, "expected a group below {count}, found {group}");
        self.masks_mut().set_group(object, group, mask);
    }

    /// The mask of an instance, with groups of a row; all bits are set unless
    /// [`Self::set_instance_mask`] was called.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance_mask(&self, instance: u32) -> u32 {
        let count = self.row_count();
        assert!(instance < count, "expected an instance below {count}, found {instance}");
        self.masks().of_instance(instance)
    }

    /// The mask of a group of triangles of an object; all bits are set unless
    /// [`Self::set_group_mask`] was called.
    ///
    /// # Panics
    /// If there is no such object, or if it has no such group.
    pub fn group_mask(&self, object: u32, group: u32) -> u32 {
        let count = self.group_count(object);
        assert!(group < count, "expected a group below {count}, found {group}");
        self.masks().groups(object).map_or(u32::MAX, |groups| Masks::of_group(groups, group))
    }

    /// Number of groups of an object's triangles, at least 1.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn group_count(&self, object: u32) -> u32 {
        self.object(object).group_count()
    }

    /// Returns true if every hit is accepted.
    pub(crate) fn accepts_everything(&self, accept: &Accept<'_>) -> bool {
        let Accept { mask, cull, filter } = accept;
        self.masks().is_empty() && *mask != 0 && *cull == Cull::None && filter.is_none()
    }
}

/// What a file keeps of the surface at a hit.
impl Scene {
    /// The vertices of a triangle in the space of its object, as rays are tested against them: on
    /// the grid, if the file has one, or the positions in f64. They are read from the leaf of the
    /// triangle, which a ray that hit it has read, too. Triangles that no ray can hit are in no
    /// leaf: they are read from the source, and are `None` with `--no-geometry`. `None` if there is
    /// no such instance or triangle.
    pub fn triangle(&self, primitive: PrimitiveRef) -> Option<[[f64; 3]; 3]> {
        self.triangle_of(surface::object_at(self, primitive)?, primitive.triangle)
    }

    /// The vertices of a triangle of an object, as [`Self::triangle`] has them for its instances.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn triangle_of(&self, object: u32, triangle: u32) -> Option<[[f64; 3]; 3]> {
        corners_by_id(self.view(object), triangle)
    }

    /// The vertices of a triangle in world space, at the scene's time. In a mirrored instance they
    /// are seen clockwise from the front. `None` as for [`Self::triangle`].
    pub fn triangle_in_world(&self, primitive: PrimitiveRef) -> Option<[[f64; 3]; 3]> {
        let corners = self.triangle(primitive)?;
        let to_world = self.instance(primitive.instance).to_world;
        Some(corners.map(|corner| surface::transformed(&to_world, corner)))
    }

    /// The surface at a hit of this scene, at the scene's time. `None` for a miss, where
    /// [`Self::triangle`] is `None`, or if the instance is hidden by now.
    ///
    /// ```
    /// use bth::rays::Ray;
    ///
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let hit = scene.nearest(&Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]));
    /// let surface = hit.and_then(|hit| scene.surface(&hit)).expect("it is above the cube");
    /// assert_eq!((surface.position, surface.normal), ([0.25, 0.5, 1.0], [0.0, 0.0, 1.0]));
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn surface(&self, hit: &Hit) -> Option<SurfacePoint> {
        surface::surface_at(self, hit)
    }

    /// The group of a triangle of an object: 0 if the file keeps no groups. Costs O(log runs),
    /// where a run is a sequence of triangles of one group in the source.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn group_of(&self, object: u32, triangle: u32) -> u32 {
        self.object(object).group_of(triangle)
    }

    /// The name of a group of an object's triangles; empty if it has none or the file keeps none.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn group_name(&self, object: u32, group: u32) -> &str {
        self.object(object).group_name(group)
    }

    /// The material of a group; `None` if it has none or the file keeps none.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn group_material(&self, object: u32, group: u32) -> Option<u32> {
        self.object(object).material_of(group)
    }

    /// Number of materials of an object; 0 if the file keeps none.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn material_count(&self, object: u32) -> u32 {
        self.object(object).materials.len() as u32
    }

    /// The name of an object's material; empty if it has none or the file keeps none.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn material_name(&self, object: u32, material: u32) -> &str {
        self.object(object).material_name(material)
    }

    /// How a material of an object looks. `None` if the file keeps only its name, or if there is no
    /// such object or material. The material of a hit is
    /// [`SurfacePoint::material`](crate::SurfacePoint::material).
    ///
    /// ```no_run
    /// let scene = bth::open("house.bth")?;
    /// for material in 0..scene.material_count(0) {
    ///     let name = scene.material_name(0, material);
    ///     if let Some(look) = scene.material(0, material) {
    ///         let image = look.base_color_texture.and_then(|texture| scene.texture(0, texture));
    ///         let bytes = image.map_or(0, |image| image.bytes.len());
    ///         println!("{name}: {:?}, image of {bytes} bytes", look.base_color);
    ///     }
    /// }
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn material(&self, object: u32, material: u32) -> Option<Material> {
        surface::material(self, object, material)
    }

    /// Number of textures of an object; 0 if the file keeps none or there is no such object.
    pub fn texture_count(&self, object: u32) -> u32 {
        self.objects().locate(object).map_or(0, |(file, row)| file.materials(row).textures.len() as u32)
    }

    /// A texture of an object; `None` if there is no such object or texture.
    pub fn texture(&self, object: u32, texture: u32) -> Option<Texture<'_>> {
        surface::texture(self, object, texture)
    }

    /// The texture coordinates of a set at a hit, interpolated. Set 0 is the set of
    /// [`SurfacePoint::uv`](crate::SurfacePoint::uv). `None` if the file keeps none of the set, or
    /// if there is no such instance, triangle or set.
    pub fn texture_coordinates(&self, hit: &Hit, uv_set: u32) -> Option<[f32; 2]> {
        surface::texture_coordinates(self, hit, uv_set)
    }

    /// The vertex colour at a hit, interpolated linearly: linear red, green, blue and alpha. `None`
    /// if the file keeps none, or if there is no such instance or triangle.
    pub fn vertex_color(&self, hit: &Hit) -> Option<[f32; 4]> {
        let object = surface::object_at(self, hit.primitive)?;
        let (file, row) = self.objects().locate(object)?;
        file.materials(row).color_at(hit.primitive.triangle, hit.u, hit.v)
    }
}
