//! The instances of a scene, for queries about points, and the search for closest points in them.

use super::nearest::{PointGoal, PointInstance, search_instance};
use super::search::Search;
use super::wide_search::{Radius, WideSearch};
use super::{Closest, Closest64};
use crate::instances::World;
use crate::nodes::placed::{NarrowPoint, PlacedObject};
use crate::scene::Scene;
use std::cell::Cell;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// A receiver of instances, by number. It returns true to end a query.
pub(super) type InstanceVisitor<'a> = dyn FnMut(u32) -> bool + 'a;

/// The instances of a scene.
pub(super) struct Instances<'a> {
    scene: &'a Scene,
    /// The only visible instance, if its object space is world space.
    sole: Option<PointInstance<'a>>,
    /// The instances that were searched before.
    placed: HashMap<u32, PlacedObject>,
}

impl<'a> Instances<'a> {
    pub(super) fn new(scene: &'a Scene) -> Instances<'a> {
        let in_world = |world: &World| world.sole().map(|(instance, object)| (object, instance));
        let only = (scene.object_count() == 1).then_some((0, 0));
        let sole = scene.world().map_or(only, in_world);
        let at = |(object, instance)| PointInstance { object: scene.view(object), instance, placed: None };
        Instances { scene, sole: sole.map(at), placed: HashMap::new() }
    }

    /// Returns true if f32 queries are decided in f32: everything lies in world space as f32.
    pub(super) fn is_narrow(&self) -> bool {
        match self.sole {
            Some(sole) => sole.object.exact.is_empty(),
            None => {
                let mut objects = (0..self.scene.object_count()).map(|object| self.scene.view(object));
                self.scene.world().is_none() && objects.all(|object| object.exact.is_empty())
            }
        }
    }

    /// Returns true if there are no boxes of instances to go by: all objects lie in world space.
    pub(super) fn are_all_in_world_space(&self) -> bool {
        self.sole.is_some() || self.scene.world().is_none()
    }

    /// Calls `visit` with each instance, or in a world with those that `near` passes to its
    /// receiver, until it returns true. Returns true then. All are placed unless `narrow` is set.
    pub(super) fn any(
        &mut self,
        narrow: bool,
        near: impl FnOnce(&World, &mut InstanceVisitor<'_>) -> bool,
        visit: &mut dyn FnMut(PointInstance<'_>) -> bool,
    ) -> bool {
        let Instances { scene, sole, placed } = self;
        let in_world_space = PlacedObject::untransformed();
        let identity = (!narrow).then_some(&in_world_space);
        match (sole, scene.world()) {
            (Some(sole), _) => visit(PointInstance { placed: identity, ..*sole }),
            (None, None) => (0..scene.object_count()).any(|instance| {
                visit(PointInstance { object: scene.view(instance), instance, placed: identity })
            }),
            (None, Some(world)) => near(world, &mut |instance| {
                let placed = match placed.entry(instance) {
                    Entry::Occupied(entry) => entry.into_mut(),
                    Entry::Vacant(entry) => {
                        let to_world = world.row(scene.objects(), instance).to_world;
                        let Some(placement) = world.placed(instance) else { return false };
                        entry.insert(PlacedObject::new(&to_world, placement.inverse.linear))
                    }
                };
                let object = scene.view(world.object_of(scene.objects(), instance));
                visit(PointInstance { object, instance, placed: Some(placed) })
            }),
        }
    }

    /// Like [`Self::any`], for the instances near the point of a search, nearest boxes first.
    /// `visit` may make the limit of the search smaller.
    pub(super) fn any_near(
        &mut self,
        search: &mut WideSearch,
        mut visit: impl FnMut(PointInstance<'_>, &mut WideSearch) -> bool,
    ) -> bool {
        let in_world_space = PlacedObject::untransformed();
        let NarrowPoint { point, off } = NarrowPoint::new(search.point, 0.0);
        let squared = |limit| in_world_space.squared_in_object(limit, off);
        let (exact, distance) = (search.point, Cell::new(search.limit));
        let limit = Cell::new(squared(search.limit));
        self.any(
            false,
            |world, visit| match world.groups() {
                None => world.enumerate_near(point, limit.get(), &mut |instance| {
                    (!visit(instance)).then(|| limit.get())
                }),
                Some(_) => {
                    let limits: (&dyn Fn() -> f64, &dyn Fn() -> f64) = (&|| distance.get(), &|| limit.get());
                    world.enumerate_near_in_groups((exact, point), limits, visit)
                }
            },
            &mut |at| {
                let ended = visit(at, search);
                distance.set(search.limit);
                limit.set(squared(search.limit));
                ended
            },
        )
    }
}

/// Searches of a scene.
pub(super) struct Searcher<'a> {
    instances: Instances<'a>,
    /// The searches of the point before.
    previous: Option<Search>,
    previous_wide: Option<WideSearch>,
}

impl<'a> Searcher<'a> {
    pub(super) fn new(scene: &'a Scene) -> Searcher<'a> {
        Searcher { instances: Instances::new(scene), previous: None, previous_wide: None }
    }

    /// Like [`Scene::closest`].
    pub(super) fn closest(&mut self, point: [f32; 3], radius: f32) -> Option<Closest> {
        if !self.instances.is_narrow() {
            return self.search(point.map(f64::from), Radius::Reported(radius))?.narrow_answer();
        }
        let mut search = Search::new(point, radius)?;
        // The triangle of the point before gives a bound, which never changes the result. It is of
        // no use for points farther from each other than from the surface.
        if let Some(previous) = self.previous.as_ref().filter(|previous| previous.is_near(&point)) {
            search.offer_result(previous);
        }
        match self.instances.sole {
            Some(sole) => _ = search_instance(sole, PointGoal::Closest(&mut search)),
            None => {
                let visit = &mut |at: PointInstance<'_>| search_instance(at, PointGoal::Closest(&mut search));
                self.instances.any(true, |_, _| false, visit);
            }
        }
        self.previous = Some(search);
        search.answer(radius)
    }

    /// Like [`Scene::closest_f64`].
    pub(super) fn closest_f64(&mut self, point: [f64; 3], radius: f64) -> Option<Closest64> {
        self.search(point, Radius::Exact(radius))?.answer()
    }

    /// Searches for the closest triangle as real numbers.
    fn search(&mut self, point: [f64; 3], radius: Radius) -> Option<&WideSearch> {
        let mut search = WideSearch::new(point, radius)?;
        if let Some(previous) = self.previous_wide.as_ref().filter(|previous| previous.is_near(&point)) {
            search.offer_result(previous);
        }
        let visit = |at: PointInstance<'_>, search: &mut WideSearch| {
            search_instance(at, PointGoal::WideClosest(search))
        };
        self.instances.any_near(&mut search, visit);
        Some(self.previous_wide.insert(search))
    }
}
