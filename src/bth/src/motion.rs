//! What moves in a scene: time, instances, nodes.

use crate::instances::{Update, World};
use crate::scene::Scene;
use bth_format::{Error, File, SceneView};

/// An instance at the scene's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceView {
    /// The object that stands there.
    pub object: u32,
    /// Node that carries it; `NONE` in files without a scene.
    pub node: u32,
    /// From the object's space to the world: rows of four, applied to columns (x, y, z, 1).
    pub to_world: [[f64; 4]; 3],
    /// Whether rays can meet it.
    pub visible: bool,
}

/// Checks that everything that is seen at a file's first frame can be placed; looks at nothing of the objects but their
/// headers.
///
/// # Errors
/// Those of [`File::check_scene`], and `BTH-S001` or `BTH-S002` with the node.
pub fn check_first_frame(file: &File) -> Result<(), Error> {
    World::new(file).map(drop)
}

impl Scene {
    /// The scene sections; `None` when the file has none: then each object stands once in the world, as it is.
    pub fn description(&self) -> Option<SceneView<'_>> {
        self.world().and_then(|_| self.file().scene())
    }

    /// Seconds at which the scene is shown; after opening those of its first frame.
    pub fn seconds(&self) -> f64 {
        self.world().map_or(0.0, |world| world.seconds)
    }

    /// Moves the scene to a time: evaluates tracks and rebuilds what moved. Does nothing without a scene.
    ///
    /// # Errors
    /// `BTH-S001` when the transform of an instance that can be seen cannot be inverted, `BTH-S002` when it is not
    /// finite or leads beyond the range of `f32`; with the node. The scene is then as it was.
    pub fn set_seconds(&mut self, seconds: f64) -> Result<Update, Error> {
        let (file, world) = self.parts_mut();
        world.as_mut().map_or(Ok(Update::default()), |world| world.update(file, seconds))
    }

    /// Moves the scene to a frame, which may lie outside its range.
    ///
    /// # Errors
    /// As [`Self::set_seconds`].
    pub fn set_frame(&mut self, frame: i32) -> Result<Update, Error> {
        let rate = self.description().map_or(1.0, |view| view.scene[0].rate);
        self.set_seconds(f64::from(frame) / rate)
    }

    /// Instances in the scene, seen or not.
    pub fn instance_count(&self) -> u32 {
        self.world().map_or(self.object_count(), |world| world.placed.len() as u32)
    }

    /// The object of an instance.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn object_of(&self, instance: u32) -> u32 {
        if self.world().is_some() { self.file().instances()[instance as usize].object } else { instance }
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
        let visible = world.placed[instance as usize].is_some();
        let row = self.file().instances()[instance as usize];
        let (to_world, _) = self.node(row.node);
        InstanceView { object: row.object, node: row.node, to_world, visible }
    }

    /// From a node's space to the world at the scene's time (rows of four, applied to columns (x, y, z, 1)), and
    /// whether the node can be seen.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn node(&self, node: u32) -> ([[f64; 4]; 3], bool) {
        self.world().expect("a file with nodes").node(self.file(), node)
    }

    /// A normal of an instance's object in the world: by the inverse transpose. Its length has no meaning.
    ///
    /// # Panics
    /// If there is no such instance, or it cannot be seen.
    pub fn normal_to_world(&self, instance: u32, normal: [f64; 3]) -> [f64; 3] {
        let Some(world) = self.world() else { return normal };
        let placed = world.placed[instance as usize].as_ref().expect("an instance that can be seen");
        placed.inverse.normal(normal)
    }

    /// World box of an instance, slightly larger than it; `None` when it cannot be seen.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance_bounds(&self, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        let Some(world) = self.world() else {
            let object = self.object(instance).header;
            return (object.root != bth_format::layout::NONE).then_some((object.lower, object.upper));
        };
        world.bounds(self.file(), instance)
    }

    /// Objects that rays have been traced in since the scene was opened; all of them in files without a scene.
    pub fn touched_objects(&self) -> usize {
        self.world().map_or(self.object_count() as usize, |world| world.touched())
    }

    /// Bytes on the heap: of the instances and the top level, and of the hierarchy.
    pub fn heap_bytes(&self) -> (usize, usize) {
        self.world().map_or((0, 0), |world| world.bytes())
    }
}
