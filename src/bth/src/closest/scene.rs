//! Closest points in scenes.

use super::Closest;
use super::placed::PlacedObject;
use super::search::Search;
use super::walk::{search_object, search_placed};
use crate::instances::{INSTANCE, World};
use crate::scene::Scene;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

impl Scene {
    /// The point of the scene's triangles that is closest to a point in world space, if its distance, rounded to f32 as reported,
    /// does not exceed `radius`. `None` also if the point is not finite, or the radius is negative or NaN.
    ///
    /// Distances are exact to 0.55 units in the last place. The closest triangle is that of least squared distance as computed
    /// in f64 with a relative error below 2^-27, from the point and the triangle alone; among equal ones it is that of least
    /// instance, then of least id. Distances to a shared edge or vertex are equal for all triangles that share it. The result
    /// is thus the same whatever the acceleration structures in the file, the instruction set and the batch. Triangles without
    /// area are no surface, as for rays. The corners of instances are transformed in f64 and rounded to f32 in world space.
    ///
    /// ```no_run
    /// let scene = bth::open("bunny.bth")?;
    /// if let Some(closest) = scene.closest([0.0, 0.1, 1.0], f32::INFINITY) {
    ///     println!("{} to triangle {}", closest.distance, closest.primitive.triangle);
    /// }
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn closest(&self, point: [f32; 3], radius: f32) -> Option<Closest> {
        let mut closest = None;
        self.closest_batch(&[point], radius, std::slice::from_mut(&mut closest));
        closest
    }

    /// Stores for each point what [`Self::closest`] returns. Points that are adjacent in the slice and close to each other are
    /// fastest.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn closest_batch(&self, points: &[[f32; 3]], radius: f32, closest: &mut [Option<Closest>]) {
        assert_eq!(points.len(), closest.len(), "as many results as points");
        let mut searcher = Searcher::new(self);
        let mut previous: Option<Search> = None;
        for (point, closest) in points.iter().zip(closest) {
            let Some(mut search) = Search::new(*point, radius) else {
                *closest = None;
                continue;
            };
            // The triangle of the point before gives a bound, which never changes the result. For points farther from each other
            // than from the surface it is of no use.
            if let Some(previous) = previous.as_ref().filter(|previous| previous.is_near(point)) {
                search.offer_result(previous);
            }
            searcher.search(&mut search);
            *closest = search.answer(radius);
            previous = Some(search);
        }
    }
}

/// Searches of a scene.
struct Searcher<'a> {
    scene: &'a Scene,
    /// The object and the index of the only visible instance, if its object space is world space.
    sole: Option<(&'a ObjectView<'a>, u32)>,
    /// The instances that were searched before.
    placed: HashMap<u32, PlacedObject>,
}

impl<'a> Searcher<'a> {
    fn new(scene: &'a Scene) -> Searcher<'a> {
        let sole = match scene.world() {
            None => (scene.object_count() == 1).then_some((0, 0)),
            Some(world) => world.sole().map(|(instance, object)| (object, instance)),
        };
        let sole = sole.map(|(object, instance)| (scene.view(object), instance));
        Searcher { scene, sole, placed: HashMap::new() }
    }

    fn search(&mut self, search: &mut Search) {
        match (self.sole, self.scene.world()) {
            (Some((object, instance)), _) => search_object(object, instance, search),
            (None, Some(world)) => self.search_world(world, search),
            (None, None) => {
                for object in 0..self.scene.object_count() {
                    search_object(self.scene.view(object), object, search);
                }
            }
        }
    }

    /// Searches the instances of a scene, nearest boxes first.
    fn search_world(&mut self, world: &World, search: &mut Search) {
        if world.top.is_empty() {
            return;
        }
        let mut stack = vec![(0.0, 0)];
        while let Some((squared, code)) = stack.pop() {
            if squared > search.squared {
                continue;
            }
            if code & INSTANCE != 0 {
                let instance = code & !INSTANCE;
                self.search_instance(world, instance, search);
                continue;
            }
            let node = world.top.node(code);
            let first = stack.len();
            for (slot, &child) in node.child.iter().enumerate().filter(|(_, child)| **child != NONE) {
                let mut squared = 0.0;
                for k in 0..3 {
                    let [lower, upper] = [0, 1].map(|end| f64::from(node.bounds[k][end][slot]));
                    let point = f64::from(search.point[k]);
                    let outside = (lower - point).max(point - upper).max(0.0);
                    squared += outside * outside;
                }
                // The boxes are wider than the triangles by far more than these roundings.
                if squared <= search.squared {
                    stack.push((squared, child));
                }
            }
            stack[first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
    }

    fn search_instance(&mut self, world: &World, instance: u32, search: &mut Search) {
        let scene = self.scene;
        let placed = match self.placed.entry(instance) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let Some(placed) = world.placed(scene.file(), instance) else { return };
                let object = scene.view(placed.object);
                entry.insert(PlacedObject::new(placed, object))
            }
        };
        search_placed(scene.view(placed.object()), placed, instance, search);
    }
}
