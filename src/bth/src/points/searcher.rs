//! Closest points in all instances of a scene.

use super::Closest;
use super::nearest::{PointGoal, PointInstance, search_instance};
use super::placed::PlacedObject;
use super::search::Search;
use crate::instances::World;
use crate::scene::Scene;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// The only visible instance of a scene if its object space is world space.
pub(super) fn sole_instance(scene: &Scene) -> Option<PointInstance<'_>> {
    let (object, instance) = match scene.world() {
        None => (scene.object_count() == 1).then_some((0, 0))?,
        Some(world) => world.sole().map(|(instance, object)| (object, instance))?,
    };
    Some(PointInstance { object: scene.view(object), instance, placed: None })
}

/// The objects of a scene without instances.
pub(super) fn objects(scene: &Scene) -> impl Iterator<Item = PointInstance<'_>> {
    let instance = |object| PointInstance { object: scene.view(object), instance: object, placed: None };
    (0..scene.object_count()).map(instance)
}

/// The transform of an instance; `None` if it is not visible.
pub(super) fn placed(scene: &Scene, world: &World, instance: u32) -> Option<PlacedObject> {
    let placed = world.placed(scene.objects(), instance)?;
    Some(PlacedObject::new(placed, scene.view(placed.object)))
}

/// Searches of a scene.
pub(super) struct Searcher<'a> {
    scene: &'a Scene,
    sole: Option<PointInstance<'a>>,
    /// The instances that were searched before.
    placed: HashMap<u32, PlacedObject>,
    /// The search of the point before.
    previous: Option<Search>,
}

impl<'a> Searcher<'a> {
    pub(super) fn new(scene: &'a Scene) -> Searcher<'a> {
        Searcher { scene, sole: sole_instance(scene), placed: HashMap::new(), previous: None }
    }

    /// Like [`Scene::closest`].
    pub(super) fn closest(&mut self, point: [f32; 3], radius: f32) -> Option<Closest> {
        let mut search = Search::new(point, radius)?;
        // The triangle of the point before gives a bound, which never changes the result. It is of
        // no use for points farther from each other than from the surface.
        if let Some(previous) = self.previous.as_ref().filter(|previous| previous.is_near(&point)) {
            search.offer_result(previous);
        }
        self.search(&mut search);
        self.previous = Some(search);
        search.answer(radius)
    }

    fn search(&mut self, search: &mut Search) {
        match (self.sole, self.scene.world()) {
            (Some(sole), _) => {
                search_instance(sole, PointGoal::Closest(search));
            }
            (None, Some(world)) => self.search_world(world, search),
            (None, None) => objects(self.scene).for_each(|object| {
                search_instance(object, PointGoal::Closest(search));
            }),
        }
    }

    /// Searches the instances of a scene, nearest boxes first.
    fn search_world(&mut self, world: &World, search: &mut Search) {
        let scene = self.scene;
        world.enumerate_near(search.point, search.squared, &mut |instance| {
            let placed = match self.placed.entry(instance) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => match placed(scene, world, instance) {
                    Some(placed) => entry.insert(placed),
                    None => return Some(search.squared),
                },
            };
            let object = scene.view(placed.object());
            let at = PointInstance { object, instance, placed: Some(placed) };
            search_instance(at, PointGoal::Closest(search));
            Some(search.squared)
        });
    }
}
