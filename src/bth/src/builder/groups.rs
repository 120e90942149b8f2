//! Groups of a scene builder: instances that are placed as a whole.

use super::SceneBuilder;
use super::instances::StagedInstance;
use crate::instances::object_of_group;
use bth_format::layout::NONE;
use bth_format::{Code, Error};

/// What an instance shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Content {
    /// An object, by its index.
    Object(u32),
    /// A group, by its number ([`SceneBuilder::add_group`]).
    Group(u32),
}

/// Groups: instances of objects and of other groups that are placed as a whole, any number of
/// times. A scene holds the instances of a group once. Queries answer as if each were written out:
/// hits number the instances of objects in the order of the ids in the world, in the place of an
/// instance of a group the instances in it, and so on inwards.
/// [`Scene::instance_path`](crate::Scene::instance_path) leads from that number to the ids.
impl SceneBuilder {
    /// Adds an empty group; returns its number. A group may show the groups that were added before
    /// it.
    pub fn add_group(&mut self) -> u32 {
        let (_, world) = self.scene.objects_and_world_mut();
        world.as_mut().map_or(0, |world| world.add_group())
    }

    /// Adds an instance of an object or a group, in a group or in the world; returns its id.
    /// `transform` maps the space of the content to the space of the group or the world, as in
    /// [`Self::instance`]. The transforms on the way to an object are multiplied in f64 from the
    /// world inwards, each product rounded; with the product it is what an instance in the world
    /// would be.
    ///
    /// The id is one of an instance for all other calls. A hidden instance hides what it shows, and
    /// rays must have a bit in common with the masks of all instances on the way to an object, and
    /// these with each other.
    ///
    /// ```
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// use bth::Content;
    ///
    /// let mut builder = bth::SceneBuilder::new();
    /// let cube = Content::Object(builder.add(&bth::from_bytes(CUBE)?));
    /// let at = |x: f64, y: f64| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, 0.0];
    /// let row = builder.add_group();
    /// let cubes = [0.0, 2.0, 4.0].map(|x| builder.place(cube, Some(row), &at(x, 0.0)));
    /// let rows = [0.0, 3.0].map(|y| builder.place(Content::Group(row), None, &at(0.0, y)));
    /// builder.commit()?;
    /// assert_eq!(builder.scene().instance_count(), 6);
    ///
    /// let ray = bth::rays::Ray::new([4.5, 3.5, 9.0], [0.0, 0.0, -1.0]);
    /// let hit = builder.scene().nearest(&ray).expect("the last cube of the second row");
    /// assert_eq!(hit.primitive.instance, 5);
    /// let [_, _, last] = cubes;
    /// let [_, second] = rows;
    /// assert_eq!(&*builder.scene().instance_path(5), [second?, last?]);
    /// # Ok::<(), bth::Error>(())
    /// ```
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S003` if there is no such group, or the content
    /// is not a group before `within`, `BTH-S005` if there are too many instances.
    pub fn place<T: Copy + Into<f64>>(
        &mut self,
        content: Content,
        within: Option<u32>,
        transform: &[T; 12],
    ) -> Result<u32, Error> {
        let count = self.scene.world().map_or(0, |world| world.group_count());
        let check = |group: u32, end: u32| {
            if group < end {
                return Ok(());
            }
            let expected = format!("a group below {end}: added before, and before that in which it is");
            Err(Error::of_call(Code::NoSuchInstance, expected, format!("group {group}")))
        };
        within.map_or(Ok(()), |group| check(group, count))?;
        let object = match content {
            Content::Object(object) => {
                self.check_object(object)?;
                object
            }
            Content::Group(group) => {
                check(group, within.unwrap_or(count))?;
                object_of_group(group)
            }
        };
        self.check_capacity(1)?;
        let (transform, within) = (transform.map(Into::into), within.unwrap_or(NONE));
        let staged = StagedInstance { transform, object, within, visible: true, ..StagedInstance::REMOVED };
        Ok(self.stage(staged))
    }
}
