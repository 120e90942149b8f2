//! Triangles that overlap a box or a ball.
//!
//! These queries are rare and may have many results, so there is one plain walk for them, without vectors: it tests boxes in world
//! space, in f64 and conservatively, and decides the triangles of the leaves that it reaches.

use super::placed::PlacedObject;
use crate::instances::{INSTANCE, World};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::point_triangle::squared_distance;
use crate::intersect::triangle_box;
use crate::rays::PrimitiveRef;
use crate::scene::Scene;
use bth_format::exact::is_zero_area;
use bth_format::layout::{Child, NONE, TetLeaf, WIDTH, WideNode};
use bth_format::object::ObjectView;
use std::ops::ControlFlow;

/// A closed set of points in world space.
trait Region {
    /// Whether a box may have a point in common with the region: false only if it certainly has none.
    fn may_overlap(&self, lower: [f64; 3], upper: [f64; 3]) -> bool;
    /// Whether a triangle overlaps the region.
    fn overlaps(&self, corners: [[f32; 3]; 3]) -> bool;
}

/// A box of finite coordinates.
struct BoxRegion {
    lower: [f32; 3],
    upper: [f32; 3],
}

impl BoxRegion {
    /// `None` if the box contains no finite point or a coordinate is NaN.
    fn new(lower: [f32; 3], upper: [f32; 3]) -> Option<BoxRegion> {
        let is_number = lower.iter().chain(&upper).all(|x| !x.is_nan());
        let (lower, upper) = (lower.map(|x| x.max(f32::MIN)), upper.map(|x| x.min(f32::MAX)));
        (is_number && (0..3).all(|k| lower[k] <= upper[k])).then_some(BoxRegion { lower, upper })
    }
}

impl Region for BoxRegion {
    fn may_overlap(&self, lower: [f64; 3], upper: [f64; 3]) -> bool {
        (0..3).all(|k| lower[k] <= f64::from(self.upper[k]) && f64::from(self.lower[k]) <= upper[k])
    }
    fn overlaps(&self, corners: [[f32; 3]; 3]) -> bool {
        triangle_box::overlaps(self.lower, self.upper, corners)
    }
}

/// A ball.
struct BallRegion {
    center: [f32; 3],
    radius: f32,
}

impl BallRegion {
    /// `None` if the centre is not finite or the radius is negative or NaN.
    fn new(center: [f32; 3], radius: f32) -> Option<BallRegion> {
        (center.iter().all(|x| x.is_finite()) && radius >= 0.0).then_some(BallRegion { center, radius })
    }
}

impl Region for BallRegion {
    fn may_overlap(&self, lower: [f64; 3], upper: [f64; 3]) -> bool {
        /// Covers the rounding to f32 by which the radius is decided, and those of this function.
        const SLACK: f64 = 1.0 + 1.0 / (1 << 20) as f64;
        let mut squared = 0.0;
        for k in 0..3 {
            let center = f64::from(self.center[k]);
            let outside = (lower[k] - center).max(center - upper[k]).max(0.0);
            squared += outside * outside;
        }
        squared.sqrt() <= (f64::from(self.radius) + f64::from(f32::from_bits(1))) * SLACK
    }
    fn overlaps(&self, corners: [[f32; 3]; 3]) -> bool {
        squared_distance(self.center, corners).0.sqrt() as f32 <= self.radius
    }
}

impl Scene {
    /// Whether a triangle and an axis-aligned box in world space have a point in common. Both are closed, so that touching
    /// counts; the answer is exact. A box that is infinite in some direction is allowed; one with a `lower` above its `upper` or
    /// a NaN is empty. The corners of instances are transformed in f64 and rounded to f32 in world space.
    pub fn overlaps_box(&self, lower: [f32; 3], upper: [f32; 3]) -> bool {
        BoxRegion::new(lower, upper).is_some_and(|region| self.any_in(&region))
    }

    /// Replaces the contents of `triangles` by all triangles that overlap a box as defined at [`Self::overlaps_box`], by
    /// ascending instance and triangle.
    pub fn triangles_in_box(&self, lower: [f32; 3], upper: [f32; 3], triangles: &mut Vec<PrimitiveRef>) {
        triangles.clear();
        if let Some(region) = BoxRegion::new(lower, upper) {
            self.all_in(&region, triangles);
        }
    }

    /// Whether a triangle overlaps a ball in world space: whether its distance from the centre, rounded to f32 as
    /// [`Self::closest`] reports it, does not exceed the radius. False if the centre is not finite, or the radius is negative or
    /// NaN.
    pub fn overlaps_sphere(&self, center: [f32; 3], radius: f32) -> bool {
        BallRegion::new(center, radius).is_some_and(|region| self.any_in(&region))
    }

    /// Replaces the contents of `triangles` by all triangles that overlap a ball as defined at [`Self::overlaps_sphere`], by
    /// ascending instance and triangle.
    pub fn triangles_in_sphere(&self, center: [f32; 3], radius: f32, triangles: &mut Vec<PrimitiveRef>) {
        triangles.clear();
        if let Some(region) = BallRegion::new(center, radius) {
            self.all_in(&region, triangles);
        }
    }

    fn any_in(&self, region: &dyn Region) -> bool {
        self.visit_in(region, &mut |_| ControlFlow::Break(())).is_break()
    }

    fn all_in(&self, region: &dyn Region, triangles: &mut Vec<PrimitiveRef>) {
        let mut found = Vec::new();
        let _ = self.visit_in(region, &mut |PrimitiveRef { instance, triangle }| {
            found.push(u64::from(instance) << 32 | u64::from(triangle));
            ControlFlow::Continue(())
        });
        found.sort_unstable();
        triangles.extend(
            found.iter().map(|&key| PrimitiveRef { instance: (key >> 32) as u32, triangle: key as u32 }),
        );
    }

    /// Visits the triangles that overlap a region, until the visitor breaks.
    fn visit_in(&self, region: &dyn Region, visit: &mut Visitor<'_>) -> ControlFlow<()> {
        match self.world() {
            Some(world) => self.visit_world(world, region, visit),
            None => (0..self.object_count()).try_for_each(|object| {
                RegionWalk { object: self.view(object), instance: object, placed: None, region }.visit(visit)
            }),
        }
    }

    /// As [`Self::visit_in`], for the instances of a scene.
    fn visit_world(&self, world: &World, region: &dyn Region, visit: &mut Visitor<'_>) -> ControlFlow<()> {
        let mut stack = if world.top.is_empty() { Vec::new() } else { vec![0] };
        while let Some(code) = stack.pop() {
            if code & INSTANCE == 0 {
                let node = world.top.node(code);
                let overlaps = |slot: usize| {
                    let [lower, upper] = slot_box(node, slot);
                    region.may_overlap(lower, upper)
                };
                stack.extend(
                    (0..WIDTH).filter(|&i| node.child[i] != NONE && overlaps(i)).map(|i| node.child[i]),
                );
            } else if let Some(placed) = world.placed(self.objects(), code & !INSTANCE) {
                let object = self.view(placed.object);
                let placed = PlacedObject::new(placed, object);
                let instance = code & !INSTANCE;
                RegionWalk { object, instance, placed: Some(&placed), region }.visit(visit)?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// What is done with a triangle.
type Visitor<'a> = dyn FnMut(PrimitiveRef) -> ControlFlow<()> + 'a;

/// The box of a node's child.
fn slot_box(node: &WideNode, slot: usize) -> [[f64; 3]; 2] {
    [0, 1].map(|end| [0, 1, 2].map(|k| f64::from(node.bounds[k][end][slot])))
}

/// The walk through an object.
struct RegionWalk<'a> {
    object: &'a ObjectView<'a>,
    instance: u32,
    /// `None` where object space is world space.
    placed: Option<&'a PlacedObject>,
    region: &'a dyn Region,
}

impl RegionWalk<'_> {
    fn visit(&self, visit: &mut Visitor<'_>) -> ControlFlow<()> {
        let mut stack = vec![self.object.header.root];
        while let Some(code) = stack.pop() {
            let (mut indexed, mut raw) = (None, None);
            match Child::from_code(code) {
                Some(Child::Node(line)) => self.enter(self.object.node(line), &mut stack),
                Some(Child::Indexed(at)) => self.leaf(self.object.indexed(at, &mut indexed), visit)?,
                Some(Child::Raw(at)) => self.leaf(self.object.raw(at, &mut raw), visit)?,
                Some(Child::Tets(row)) => {
                    let leaf = &self.object.tet_leaves[row as usize];
                    match leaf.subtree {
                        NONE => self.faces(leaf, visit)?,
                        subtree => stack.push(subtree),
                    }
                }
                None => {}
            }
        }
        ControlFlow::Continue(())
    }

    /// Pushes the children of a node that may overlap the region.
    fn enter(&self, node: &WideNode, stack: &mut Vec<u32>) {
        for slot in (0..WIDTH).filter(|&slot| node.child[slot] != NONE) {
            let [lower, upper] = slot_box(node, slot);
            let [lower, upper] =
                self.placed.map_or([lower, upper], |placed| placed.box_in_world(lower, upper));
            if self.region.may_overlap(lower, upper) {
                stack.push(node.child[slot]);
            }
        }
    }

    fn leaf(&self, block: &impl TriangleBlock, visit: &mut Visitor<'_>) -> ControlFlow<()> {
        (0..block.triangles().min(WIDTH as u32)).try_for_each(|i| {
            let id = || self.object.triangle_ids[(block.first() + i) as usize];
            self.triangle(block.corners(i as usize), id, visit)
        })
    }

    /// Visits the constrained faces of a tet leaf.
    fn faces(&self, leaf: &TetLeaf, visit: &mut Visitor<'_>) -> ControlFlow<()> {
        let faces = &self.object.tet_faces[leaf.first_face as usize..][..leaf.faces as usize];
        faces.iter().try_for_each(|face| {
            let corners = face.vertex.map(|v| self.object.tet_vertices[v as usize].position);
            self.triangle(corners, || face.triangle, visit)
        })
    }

    /// Visits a triangle, given its corners in object space, if it overlaps the region.
    fn triangle(
        &self,
        corners: [[f32; 3]; 3],
        id: impl Fn() -> u32,
        visit: &mut Visitor<'_>,
    ) -> ControlFlow<()> {
        let world = self.placed.map_or(corners, |placed| placed.corners_in_world(corners));
        // Triangles of zero area are no part of the surface; only the leaves of deformable objects hold some.
        if !self.region.overlaps(world) || (self.object.is_deformable() && is_zero_area(corners)) {
            return ControlFlow::Continue(());
        }
        visit(PrimitiveRef { instance: self.instance, triangle: id() })
    }
}
