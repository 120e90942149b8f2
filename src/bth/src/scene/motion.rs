//! Motion of a [`Scene`]: its time, the transforms of instances and nodes at that time, and
//! positions of objects.

use crate::animation::normals::corner_normal;
use crate::clock;
use crate::instances::World;
use crate::objects::Objects;
use crate::refit::OwnPositions;
use crate::scene::Scene;
use crate::update::Update;
use bth_format::{Code, Error, File, SceneView};

/// An instance at the scene's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceView {
    /// Index of its object; `u32::MAX` if a scene builder has removed the instance.
    pub object: u32,
    /// Index of the node to which it is attached, in the file of its object; `u32::MAX` in a file
    /// without scene sections and for instances that the caller of a scene builder has placed.
    pub node: u32,
    /// Transform from object space to world space: the rows of a 3×4 matrix that is applied to
    /// columns (x, y, z, 1).
    pub to_world: [[f64; 4]; 3],
    /// True if rays can hit it: it is neither hidden nor scaled to zero, and its object has
    /// triangles. Always true in a file without scene sections.
    pub visible: bool,
}

/// Checks the scene sections of a file, and that every visible instance can be placed at the first
/// frame. The sections of objects are not checked.
///
/// # Errors
/// Those of [`File::check_scene`], and `BTH-S001` or `BTH-S002` as for [`Scene::set_seconds`].
pub fn check_first_frame(file: &File) -> Result<(), Error> {
    World::new(&Objects::of_file(file.clone())).map(drop)
}

/// Checks that a time is finite.
pub(crate) fn check_time(seconds: f64) -> Result<(), Error> {
    if seconds.is_finite() {
        return Ok(());
    }
    Err(Error::of_call(Code::NotFinite, "a finite time", format!("{seconds}")))
}

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
        check_time(seconds)?;
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
        self.world().map_or(self.object_count(), |world| world.placements.len() as u32)
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
        let Some(world) = self.world() else {
            assert!(instance < self.object_count(), "an instance below instance_count");
            let row = |k: usize| std::array::from_fn(|j| f64::from(u8::from(j == k)));
            let to_world = [row(0), row(1), row(2)];
            return InstanceView {
                object: instance,
                node: bth_format::layout::NONE,
                to_world,
                visible: true,
            };
        };
        let visible = world.placements[instance as usize].is_some();
        let row = world.row(self.objects(), instance);
        InstanceView { object: row.object, node: row.node, to_world: row.to_world.rows(), visible }
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
        let placement = world.placements[instance as usize].as_ref().expect("an instance that can be seen");
        placement.inverse.normal(normal)
    }

    /// Lower and upper end of a box in world space that contains an instance and is slightly
    /// enlarged to cover roundings; `None` if the instance is not visible.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance_bounds(&self, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        let Some(world) = self.world() else {
            let object = self.object(instance).header;
            return (object.root != bth_format::layout::NONE).then_some((object.lower, object.upper));
        };
        world.bounds(self.objects(), instance)
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
        self.refit_object(object, |own| own.stage(positions))
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
        self.refit_object(object, |own| own.stage_between(ends, share))
    }

    /// Stages positions of an object, refits it, and places its instances again. After an error the
    /// scene is unchanged.
    fn refit_object(
        &mut self,
        object: u32,
        stage: impl FnOnce(&mut OwnPositions) -> Result<(), Error>,
    ) -> Result<Update, Error> {
        let start = clock::now();
        let (objects, world) = self.parts_mut();
        stage(objects.own_positions(object)?)?;
        let refitted = objects.refit(&[object], start);
        let placed = match world {
            Some(world) => world.place_again(objects, &[object]),
            None => Ok(Update { visible: objects.count() as usize, ..Update::default() }),
        };
        match placed {
            Ok(update) => Ok(update.with_refit(refitted)),
            Err(failed) => {
                objects.undo_refit(&[object]);
                if let Some(world) = world {
                    world.forget_parts(&[object]);
                }
                Err(failed.error(&format!("instance {}", failed.instance)))
            }
        }
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

    /// The normals at the corners of a triangle, turned from the normals in the file by the
    /// deformer of its object; of any length. `None` if nothing deforms the object.
    pub(crate) fn deformed_normals(
        &self,
        object: u32,
        triangle: u32,
        normals: [[f32; 3]; 3],
    ) -> Option<[[f64; 3]; 3]> {
        let pose = self.world()?.animation.pose_of(object)?;
        let (file, row) = self.file_of(object);
        let view = self.view(object);
        let (corners, vertices) =
            (view.corners.get(triangle as usize)?, view.triangles.get(triangle as usize)?);
        let deformation = file.deformation(row);
        Some([0, 1, 2].map(|k| corner_normal(&deformation, pose, corners[k], normals[k], vertices[k])))
    }
}
