//! Scenes: what they hold, their time and instances, and new positions of their objects.

pub(crate) mod motion;
mod open;

pub(crate) use motion::InstanceView;
pub use open::{from_bytes, from_file, map, open};

use crate::instances::{InstancePath, World};
use crate::masks::Masks;
use crate::objects::Objects;
use crate::update::Update;
use bth_format::SceneView;
use bth_format::error::Error;
use bth_format::file::File;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Lower and upper end of a box.
pub type Bounds = ([f32; 3], [f32; 3]);

/// An open file that can be traced. The instances of a file with scene sections are placed as at a
/// given time (see [`Scene::set_frame`]). In a file without scene sections, each object has one
/// instance with the same index, and object space is world space. A scene of several files, whose
/// instances the caller places, comes from a [`SceneBuilder`](crate::SceneBuilder).
///
/// Queries take `&self` and may run on any number of threads at once. A ray hits nothing if its
/// origin or direction is not finite, its direction is zero, `tmin` or `tmax` is NaN, or `tmin`
/// exceeds `tmax`.
///
/// Results are exact: a ray hits a closed triangle if and only if its line intersects the triangle
/// in real arithmetic at a t that, rounded to f32 as reported, lies in the closed interval from
/// `tmin` to `tmax`. Lines in the plane of a triangle do not hit it. Hits in an object are ordered
/// by t in f64, which is within 2^-28 of the exact one; among equal ones the triangle of the lowest
/// id is reported. Results depend neither on hints nor on the acceleration structures in the file.
/// The triangles of an instance are their images as real numbers. Triangles of objects with
/// positions in f64 have these corners. Among hits of equal t in several instances, the instance of
/// the lowest index is reported.
///
/// In files with opacity (`bthc compile --alpha`) rays pass through the transparent parts of
/// triangles: nearest hits, any hits, counts and lists of hits consider only hits on opaque parts.
/// Crossings, winding numbers, [`Self::contains`] and closest points are about the surface itself
/// and ignore opacity.
#[derive(Debug)]
pub struct Scene {
    objects: Objects,
    /// The instances at the scene's time; `None` if the scene is a file without scene sections.
    world: Option<World>,
    /// True if some triangle of some object may let rays pass.
    has_opacity: bool,
    /// True if some object has tetrahedra.
    has_tetrahedra: bool,
    /// The masks of instances and of groups of triangles.
    masks: Masks,
}

impl Scene {
    /// A scene of the objects of several files, without objects and instances yet.
    pub(crate) fn of_several_files() -> Scene {
        let (objects, world) = (Objects::of_several_files(), Some(World::empty()));
        Scene { objects, world, has_opacity: false, has_tetrahedra: false, masks: Masks::default() }
    }

    /// Adds the objects of another scene to a scene of several files; returns the index of the
    /// first.
    pub(crate) fn add_objects(&mut self, other: &Scene) -> u32 {
        let first = self.object_count();
        self.objects.add(&other.objects);
        if let Some(world) = &mut self.world {
            world.add_objects(self.objects.count());
            for object in first..self.objects.count() {
                let file = self.objects.locate(object).filter(|(_, row)| *row == 0);
                if let Some((file, _)) = file {
                    world.animation.add(file, object);
                }
            }
        }
        self.has_opacity |= other.has_opacity;
        self.has_tetrahedra |= other.has_tetrahedra;
        first
    }

    /// The instances; `None` if the file has no scene sections.
    pub(crate) fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    /// Returns true if some triangle of some object may let rays pass.
    pub(crate) fn has_opacity(&self) -> bool {
        self.has_opacity
    }

    /// Returns true if the kernel of single rays tests conditions on hits in all instances.
    pub(crate) fn tests_conditions_in_kernel(&self) -> bool {
        !self.has_tetrahedra && !self.objects.any_exact()
    }

    /// The masks of instances and of groups of triangles.
    pub(crate) fn masks(&self) -> &Masks {
        &self.masks
    }

    /// Mutable access to the masks.
    pub(crate) fn masks_mut(&mut self) -> &mut Masks {
        &mut self.masks
    }

    /// The objects, and mutable access to the instances.
    pub(crate) fn objects_and_world_mut(&mut self) -> (&Objects, &mut Option<World>) {
        (&self.objects, &mut self.world)
    }

    /// Mutable access to the objects and the instances.
    pub(crate) fn parts_mut(&mut self) -> (&mut Objects, &mut Option<World>) {
        (&mut self.objects, &mut self.world)
    }

    /// Mutable access to the objects.
    pub(crate) fn objects_mut(&mut self) -> &mut Objects {
        &mut self.objects
    }

    /// The objects.
    pub(crate) fn objects(&self) -> &Objects {
        &self.objects
    }

    /// The file of the scene.
    ///
    /// # Panics
    /// If the scene was made by a [`SceneBuilder`](crate::SceneBuilder): its objects come from any
    /// number of files, see [`Self::file_of`].
    pub fn file(&self) -> &File {
        self.objects.sole_file().expect("a scene that is a file; `file_of` is for scenes of several files")
    }

    /// The file of an object, and the object's index there, which in a scene that is a file is the
    /// same.
    ///
    /// # Panics
    /// If `object` is not less than [`Self::object_count`].
    pub fn file_of(&self, object: u32) -> (&File, u32) {
        self.objects.locate(object).expect("an object below object_count")
    }

    /// Number of objects.
    pub fn object_count(&self) -> u32 {
        self.objects.count()
    }

    /// The sections of an object, given its index.
    ///
    /// # Panics
    /// If `object` is not less than [`Self::object_count`].
    pub fn object(&self, object: u32) -> ObjectView<'_> {
        *self.view(object)
    }

    /// The sections of an object below [`Self::object_count`].
    #[inline]
    pub(crate) fn view(&self, object: u32) -> &ObjectView<'_> {
        self.objects.view(object)
    }

    /// A scene with given instances.
    #[cfg(test)]
    pub(crate) fn with_instances(file: File, world: World) -> Scene {
        Scene {
            objects: Objects::of_file(file),
            world: Some(world),
            has_opacity: false,
            has_tetrahedra: false,
            masks: Masks::default(),
        }
    }

    /// The object of a model whose only object was given no new positions and is opaque; `None`
    /// elsewhere, and before something was traced.
    #[inline(always)]
    pub(crate) fn sole_opaque(&self) -> Option<&ObjectView<'_>> {
        if self.world.is_none() && !self.has_opacity { self.objects.sole_view() } else { None }
    }

    /// The object and the index of the only visible instance, if there is exactly one and its
    /// object's space is world space. Rays then need no top level.
    #[inline(never)]
    pub(crate) fn sole(&self) -> Option<(&ObjectView<'_>, u32)> {
        let Some(world) = &self.world else {
            return (self.object_count() == 1).then(|| (self.view(0), 0));
        };
        let (instance, object) = world.sole()?;
        world.mark_traced(object);
        Some((self.view(object), instance))
    }

    /// The same if f32 holds the object.
    pub(crate) fn sole_in_f32(&self) -> Option<(&ObjectView<'_>, u32)> {
        self.sole().filter(|(object, _)| object.exact.is_empty())
    }

    /// Size in bytes of the sections that traversal reads.
    pub fn resident_bytes(&self) -> u64 {
        self.objects.resident_bytes()
    }
}

/// Motion: time, instances and nodes at that time, and positions of objects.
impl Scene {
    /// The scene sections; `None` if the file has none or a scene builder made the scene.
    pub fn description(&self) -> Option<SceneView<'_>> {
        self.world().and_then(|_| self.objects().sole_file()?.scene())
    }

    /// Time of the scene in seconds. After opening, it is the time of the first frame; 0 without
    /// scene sections.
    pub fn seconds(&self) -> f64 {
        self.world().map_or(0.0, |world| world.seconds)
    }

    /// Sets the time of the scene in seconds: evaluates the animation, refits the objects that
    /// skins and morph targets deform, places the instances that moved and rebuilds the top-level
    /// BVH. The time may lie outside of the range of frames; tracks are constant beyond their keys.
    /// Without scene sections, and in scenes of a scene builder, this has no effect.
    ///
    /// # Errors
    /// `BTH-S001` if the transform of a visible instance cannot be inverted, `BTH-S002` if the
    /// transform, the world box or the position of a vertex that deforms is not finite in `f32`, or
    /// the time is not finite. The error gives the node. The scene is then unchanged.
    pub fn set_seconds(&mut self, seconds: f64) -> Result<Update, Error> {
        motion::check_time(seconds)?;
        let (objects, world) = self.parts_mut();
        world.as_mut().map_or(Ok(Update::default()), |world| world.update(objects, seconds))
    }

    /// Sets the time of the scene to the time of a frame. The frame may lie outside of the range of
    /// frames.
    ///
    /// # Errors
    /// The errors of [`Self::set_seconds`].
    pub fn set_frame(&mut self, frame: i32) -> Result<Update, Error> {
        let rate = self.description().map_or(1.0, |view| view.scene[0].rate);
        self.set_seconds(f64::from(frame) / rate)
    }

    /// Number of instances in the scene, visible or not; in a scene of a scene builder, one more
    /// than the max id that was ever committed.
    pub fn instance_count(&self) -> u32 {
        self.world().map_or(self.object_count(), |world| world.instance_count())
    }

    /// The rows of the scene on the way to an instance: in the world first, of the object last.
    /// Without groups it is the instance's own number. In a file they are rows of its instances, in
    /// a scene of a scene builder ids.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance_path(&self, instance: u32) -> InstancePath {
        assert!(instance < self.instance_count(), "an instance below instance_count");
        self.world().map_or_else(|| InstancePath::of_row(instance), |world| world.path(instance))
    }

    /// The mask of an instance: bits that the masks of all rows on the way to it have.
    #[inline(always)]
    pub(crate) fn mask_of(&self, instance: u32) -> u32 {
        if self.masks.is_empty() { u32::MAX } else { self.stored_mask(instance) }
    }

    #[inline(never)]
    fn stored_mask(&self, instance: u32) -> u32 {
        match self.world() {
            Some(world) if world.groups().is_some() => {
                world.path(instance).iter().fold(u32::MAX, |mask, row| mask & self.masks.of_instance(*row))
            }
            _ => self.masks.of_instance(instance),
        }
    }

    /// Returns true if some instances are in groups, or show one.
    pub fn has_groups(&self) -> bool {
        self.world().is_some_and(|world| world.groups().is_some())
    }

    /// Number of rows: instances of objects and groups, in the world and in groups, each once. The
    /// same as [`Self::instance_count`] without groups.
    pub fn row_count(&self) -> u32 {
        self.world().map_or(self.object_count(), |world| world.row_count() as u32)
    }

    /// Index of an instance's object; `u32::MAX` if a scene builder has removed the instance.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn object_of(&self, instance: u32) -> u32 {
        let Some(world) = self.world() else {
            assert!(instance < self.object_count(), "an instance below instance_count");
            return instance;
        };
        world.object_of(self.objects(), instance)
    }

    /// An instance at the scene's time.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance(&self, instance: u32) -> InstanceView {
        motion::instance(self, instance)
    }

    /// The transform from a node's space to world space at the scene's time, as in
    /// [`InstanceView::to_world`], and whether the node is visible.
    ///
    /// # Panics
    /// If there is no such node, as in a file without scene sections or a scene of a scene builder.
    pub fn node(&self, node: u32) -> ([[f64; 4]; 3], bool) {
        self.world().expect("a file with nodes").node(self.objects(), node)
    }

    /// Transforms a normal from an instance's object space to world space, by the transpose of the
    /// inverse. The result is not normalized.
    ///
    /// # Panics
    /// In a file with scene sections, if there is no such instance or it is not visible.
    pub fn normal_to_world(&self, instance: u32, normal: [f64; 3]) -> [f64; 3] {
        let Some(world) = self.world() else { return normal };
        let placement = world.placed(instance).expect("an instance that can be seen");
        placement.inverse.normal(normal)
    }

    /// Lower and upper end of a box in world space that contains an instance and is slightly
    /// enlarged to cover roundings; `None` if the instance is not visible.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance_bounds(&self, instance: u32) -> Option<Bounds> {
        let Some(world) = self.world() else {
            let object = self.object(instance).header;
            return (object.root != NONE).then_some((object.lower, object.upper));
        };
        world.bounds(self.objects(), instance)
    }

    /// Boxes in world space that contain all that is visible: [`Self::instance_bounds`] of the
    /// visible instances, or with groups boxes of the rows in the world.
    pub fn visible_bounds(&self) -> Vec<Bounds> {
        match self.world().and_then(|world| world.row_boxes(self.objects())) {
            Some(boxes) => boxes,
            None => (0..self.instance_count()).filter_map(|i| self.instance_bounds(i)).collect(),
        }
    }

    /// Number of objects in which rays have been traced since the scene was opened; without scene
    /// sections, of all objects.
    pub fn touched_objects(&self) -> usize {
        self.world().map_or(self.object_count() as usize, |world| world.traced_objects())
    }

    /// Bytes on the heap: of the placed instances with the top-level BVH, and of the node hierarchy
    /// or the transforms that a scene builder was given. Both are 0 for a file without scene
    /// sections.
    pub fn heap_bytes(&self) -> (usize, usize) {
        self.world().map_or((0, 0), |world| world.bytes())
    }

    /// Number of vertices that [`Self::set_positions`] expects; `None` if the object was not
    /// compiled with `--deformable`.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn vertex_count(&self, object: u32) -> Option<usize> {
        let view = self.view(object);
        view.is_deformable().then_some(view.positions.len())
    }

    /// Gives an object new positions: one for each vertex of its source, in the source's order, in
    /// the space of the object. For a PLY or OFF file this is the order of its vertices, for OBJ
    /// the order of its `v` lines, for STL the order of the corners of its triangles, for triangles
    /// from memory the order of the arrays, and for glTF the vertices of one primitive after the
    /// other.
    ///
    /// The boxes of the object's nodes are computed again, by the threads of the current pool with
    /// the feature `rayon`, in memory that belongs to this scene. The file and other scenes with
    /// the same file do not change. All queries of this scene then answer for the new positions, as
    /// exactly as before. Triangles of zero area are not hit and are not part of the surface, as in
    /// a file that is compiled with these positions. The tree keeps the structure that was
    /// compiled: [`Update::deformed_cost_ratio`] tells how much worse it is for the new one.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S006` if it was not compiled with
    /// `--deformable`, `BTH-S007` if the number of positions is wrong or one is not finite,
    /// `BTH-S002` if the world box of an instance would not be finite, `BTH-O001` if there is not
    /// enough memory. The scene is then unchanged.
    pub fn set_positions(&mut self, object: u32, positions: &[[f32; 3]]) -> Result<Update, Error> {
        motion::refit_object(self, object, |own| own.stage(positions))
    }

    /// Like [`Self::set_positions`], but interpolates each position linearly between two times: at
    /// `share` of the way from the first to the second, from 0 to 1. For motion blur, where
    /// positions are known when the shutter opens and when it closes: set one share for each time
    /// at which the picture is sampled.
    ///
    /// A coordinate is (1 − `share`) · a + `share` · b in `f64`, rounded once to `f32`: exactly a
    /// or b at the ends, and never beyond them, so that the boxes of both ends together contain all
    /// that is between. Rays are traced as exactly as against any other positions.
    ///
    /// # Errors
    /// The errors of [`Self::set_positions`] for both ends, and `BTH-S007` if `share` is not from 0
    /// to 1. The scene is then unchanged.
    pub fn set_positions_between(
        &mut self,
        object: u32,
        ends: [&[[f32; 3]]; 2],
        share: f64,
    ) -> Result<Update, Error> {
        motion::refit_object(self, object, |own| own.stage_between(ends, share))
    }

    /// The positions of an object's vertices at the scene's time: from the file, from skins and
    /// morph targets, or from [`Self::set_positions`]. They are in the space of the object, or in
    /// world space if the object has a skin.
    /// [`ObjectView::triangles`](bth_format::ObjectView::triangles) refers to them. Empty if the
    /// file does not keep them (it was compiled with `--no-geometry`).
    ///
    /// # Panics
    /// If there is no such object.
    pub fn positions(&self, object: u32) -> &[[f32; 3]] {
        self.view(object).positions
    }

    /// The name of an object in the scene manifest, or of the glTF mesh; empty if the file keeps
    /// none.
    pub fn object_name(&self, object: u32) -> &str {
        self.objects().locate(object).map_or("", |(file, row)| file.object_name(row))
    }

    /// Box of the triangles of an object that can be hit, in the space of the object; `None` if it
    /// has no such triangle.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn object_bounds(&self, object: u32) -> Option<Bounds> {
        let header = self.object(object).header;
        (header.root != NONE).then_some((header.lower, header.upper))
    }

    /// Box in world space that contains all visible instances at the scene's time, slightly
    /// enlarged to cover roundings of transforms; `None` if nothing is visible. It is the union of
    /// all [`Self::instance_bounds`].
    pub fn bounds(&self) -> Option<Bounds> {
        self.visible_bounds().into_iter().reduce(|(lower, upper), (l, u)| {
            (
                std::array::from_fn(|k| f32::min(lower[k], l[k])),
                std::array::from_fn(|k| f32::max(upper[k], u[k])),
            )
        })
    }
}
