//! Closest points in scenes.

use super::Closest;
use super::order::along_curve;
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

    /// Stores for each point what [`Self::closest`] returns. Many points in one call are faster: they are searched in an order in
    /// which each is close to the one before.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn closest_batch(&self, points: &[[f32; 3]], radius: f32, closest: &mut [Option<Closest>]) {
        assert_eq!(points.len(), closest.len(), "as many results as points");
        let mut searcher = Searcher::new(self);
        let mut order = Vec::new();
        for (points, closest) in points.chunks(CHUNK).zip(closest.chunks_mut(CHUNK)) {
            if points.len() < MIN_ORDERED {
                (0..points.len()).for_each(|i| closest[i] = searcher.closest(points[i], radius));
                continue;
            }
            along_curve(points, &mut order);
            for entry in &order {
                let i = *entry as u32 as usize;
                closest[i] = searcher.closest(points[i], radius);
            }
        }
    }
}

/// Number of points that are ordered together.
const CHUNK: usize = 1 << 20;
/// Fewer points are searched in the order in which they are given.
const MIN_ORDERED: usize = 32;

/// Searches of a scene.
struct Searcher<'a> {
    scene: &'a Scene,
    /// The object and the index of the only visible instance, if its object space is world space.
    sole: Option<(&'a ObjectView<'a>, u32)>,
    /// The instances that were searched before.
    placed: HashMap<u32, PlacedObject>,
    /// The search of the point before.
    previous: Option<Search>,
}

impl<'a> Searcher<'a> {
    fn new(scene: &'a Scene) -> Searcher<'a> {
        let sole = match scene.world() {
            None => (scene.object_count() == 1).then_some((0, 0)),
            Some(world) => world.sole().map(|(instance, object)| (object, instance)),
        };
        let sole = sole.map(|(object, instance)| (scene.view(object), instance));
        Searcher { scene, sole, placed: HashMap::new(), previous: None }
    }

    /// As [`Scene::closest`].
    fn closest(&mut self, point: [f32; 3], radius: f32) -> Option<Closest> {
        let mut search = Search::new(point, radius)?;
        // The triangle of the point before gives a bound, which never changes the result. For points farther from each other than
        // from the surface it is of no use.
        if let Some(previous) = self.previous.as_ref().filter(|previous| previous.is_near(&point)) {
            search.offer_result(previous);
        }
        self.search(&mut search);
        self.previous = Some(search);
        search.answer(radius)
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
                    // Inserted into the children of this node, of which the nearest comes last.
                    let nearer = stack[first..].iter().rev().take_while(|entry| entry.0 < squared).count();
                    stack.insert(stack.len() - nearer, (squared, child));
                }
            }
        }
    }

    fn search_instance(&mut self, world: &World, instance: u32, search: &mut Search) {
        let scene = self.scene;
        let placed = match self.placed.entry(instance) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let Some(placed) = world.placed(scene.objects(), instance) else { return };
                let object = scene.view(placed.object);
                entry.insert(PlacedObject::new(placed, object))
            }
        };
        search_placed(scene.view(placed.object()), placed, instance, search);
    }
}

impl Scene {
    /// The distance of a point in world space to the closest triangle as [`Self::closest`] reports it, negative if the scene
    /// contains the point ([`Self::contains`]). Infinite if nothing can be hit; NaN if the point is not finite. The sign is as
    /// good as the meshes are closed.
    pub fn signed_distance(&self, point: [f32; 3]) -> f32 {
        let mut distance = 0.0;
        self.signed_distance_batch(&[point], std::slice::from_mut(&mut distance));
        distance
    }

    /// As [`Self::signed_distance`], for each of the points.
    ///
    /// # Panics
    /// If there are not as many distances as points.
    pub fn signed_distance_batch(&self, points: &[[f32; 3]], distances: &mut [f32]) {
        assert_eq!(points.len(), distances.len(), "as many distances as points");
        const CHUNK: usize = 1024;
        let (mut closest, mut inside) = (vec![None; CHUNK.min(points.len())], [false; CHUNK]);
        for (points, distances) in points.chunks(CHUNK).zip(distances.chunks_mut(CHUNK)) {
            let (closest, inside) = (&mut closest[..points.len()], &mut inside[..points.len()]);
            self.closest_batch(points, f32::INFINITY, closest);
            self.contains_batch(points, inside);
            for i in 0..points.len() {
                let is_finite = points[i].iter().all(|x| x.is_finite());
                let distance = closest[i].map_or(f32::INFINITY, |closest| closest.distance);
                distances[i] = match (is_finite, inside[i] && distance > 0.0) {
                    (false, _) => f32::NAN,
                    (true, true) => -distance,
                    (true, false) => distance,
                };
            }
        }
    }
}
