//! Queries through groups: at a row that shows a group, the query goes on in the group's space with
//! the transform from the world that all rows on the way have together.
//!
//! Trees of groups only exclude instances. A line, point or region that was taken into a group's
//! space is off by roundings, and so are the transforms of instances, which are rounded products
//! ([`NodeGroup::off`](super::groups::NodeGroup::off)). Both widen what is tested.

use super::World;
use super::enumerate::{BoxInstances, GroupKernel, PointInstances};
use super::groups::{Groups, Level, RowContent, Shown};
use super::placement::Placement;
use crate::bvh::walk::run_walk;
use crate::intersect::origin::RoundedLine;
use crate::intersect::point_lanes::LanePoint;
use crate::intersect::region_box::RegionBox;
use crate::intersect::vector::minus;
use crate::nodes::affine::{Accuracy, Inverse, ObjectRay, greatest_below};
use crate::nodes::placed::{NarrowPoint, PlacedObject};
use crate::rays::Ray;
use crate::simd::Isa;

/// Receiver of placed instances: it returns the max t, rounded to f32, of hits that can still
/// change the result, or `None` to end.
type PlacedReceiver<'a> = &'a mut dyn FnMut(u32, &Placement) -> Option<f32>;

impl World {
    /// Calls `visit` with each visible instance whose box a ray in world space may enter, and with
    /// its placement, as [`Self::enumerate`] does. `line` returns the line of the ray, as exact as
    /// it is known.
    #[inline(always)]
    pub(crate) fn enumerate_placed(
        &self,
        ray: &Ray,
        line: impl FnOnce() -> RoundedLine,
        mut visit: impl FnMut(u32, &Placement) -> Option<f32>,
    ) -> bool {
        match self.groups() {
            None => self.enumerate(ray, &mut |instance| visit(instance, self.placement(instance))),
            Some(groups) => {
                let (tmin, tmax, line) = (ray.tmin, ray.tmax, line());
                RayWalk { world: self, groups, line, tmin, tmax, visit: &mut visit }.run(ray)
            }
        }
    }

    /// Like [`Self::enumerate_near`] through the rows of the world and the groups that they show:
    /// `limit` returns the distance from the point `exact`.
    pub(crate) fn enumerate_near_in_groups(
        &self,
        (exact, point): ([f64; 3], [f32; 3]),
        (limit, squared): (&dyn Fn() -> f64, &dyn Fn() -> f64),
        visit: &mut dyn FnMut(u32) -> bool,
    ) -> bool {
        let Some(groups) = self.groups() else { return false };
        let (mut walk, level) = (PointWalk { groups, point: exact, limit, visit }, groups.world());
        self.enumerate_near(point, squared(), &mut |row| (!walk.row(&level, row)).then(squared))
    }

    /// Calls `visit` with each visible instance whose box may overlap a region, until it returns
    /// true. Returns true then.
    pub(crate) fn enumerate_in_box(&self, region: [[f64; 3]; 2], visit: &mut dyn FnMut(u32) -> bool) -> bool {
        let Some(groups) = self.groups() else { return self.rows_in_box(region, visit) };
        let (mut walk, level) = (RegionWalk { groups, region, visit }, groups.world());
        self.rows_in_box(region, &mut |row| walk.row(&level, row))
    }
}

/// The walk of a ray.
struct RayWalk<'a> {
    world: &'a World,
    groups: &'a Groups,
    /// The line in world space, as exact as it is known.
    line: RoundedLine,
    tmin: f32,
    /// Max t of hits that can still change the result.
    tmax: f32,
    visit: PlacedReceiver<'a>,
}

impl RayWalk<'_> {
    /// Visits the instances that the ray may enter. Returns true if the receiver ended the walk.
    fn run(&mut self, ray: &Ray) -> bool {
        let (world, level) = (self.world, self.groups.world());
        world.enumerate(ray, &mut |row| self.row(&level, row))
    }

    /// Visits what a row shows. `None` to end, else the max t.
    fn row(&mut self, level: &Level, row: u32) -> Option<f32> {
        let Shown { to_world, content } = self.groups.show(level, row);
        if let Some((inverse, accuracy)) = to_world.inverse() {
            match content {
                RowContent::Instance(instance, object) => {
                    let t = (self.visit)(instance, &Placement::without_box(inverse, accuracy, object))?;
                    self.tmax = if t < self.tmax { t } else { self.tmax };
                }
                RowContent::Group(inner) if self.group(&inner, &inverse, accuracy) => return None,
                RowContent::Group(_) => {}
            }
        }
        Some(self.tmax)
    }

    /// Visits the instances of a group. Returns true to end.
    fn group(&mut self, level: &Level, inverse: &Inverse, accuracy: Accuracy) -> bool {
        let group = self.groups.group(level);
        if group.top.is_empty() {
            return false;
        }
        let mut line = inverse.line(accuracy, &self.line);
        line.origin.1 += group.off(inverse, accuracy);
        let ObjectRay { ray, t_scale, line } = ObjectRay::of(line, self.tmin, self.tmax);
        let greatest = |v: [f32; 3]| v.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        let errors = [line.origin.1, line.direction_error].map(|x| x as f32);
        let bounds = group.top.cube.for_lines(greatest(ray.origin), errors[0], errors[1]);
        // Depths are off by the error of the origin, which is a difference of t here.
        let off = f64::from(bounds.origin_error) / f64::from(greatest(ray.direction));
        let in_group = |t: f32| {
            let t = if t_scale == 1.0 { t } else { greatest_below(t, 1.0 / f64::from(t_scale), t_scale) };
            ((f64::from(t) + off) as f32).next_up()
        };
        let ray = Ray { tmax: in_group(self.tmax), ..ray };
        let visit = &mut |row| self.row(level, row).map(in_group);
        Isa::chosen().run(GroupKernel { top: &group.top, bounds: &bounds, ray: &ray, visit })
    }
}

/// The walk of a point.
pub(super) struct PointWalk<'a> {
    pub(super) groups: &'a Groups,
    pub(super) point: [f64; 3],
    /// The distance within which instances are visited.
    pub(super) limit: &'a dyn Fn() -> f64,
    /// Returns true to end the walk.
    pub(super) visit: &'a mut dyn FnMut(u32) -> bool,
}

impl PointWalk<'_> {
    /// Visits the instances near the point that a row shows. Returns true to end.
    pub(super) fn row(&mut self, level: &Level, row: u32) -> bool {
        let Shown { to_world, content } = self.groups.show(level, row);
        let level = match content {
            RowContent::Instance(instance, _) => return (self.visit)(instance),
            RowContent::Group(level) => level,
        };
        let (group, limit) = (self.groups.group(&level), self.limit);
        let Some((inverse, accuracy)) = to_world.inverse().filter(|_| !group.top.is_empty()) else {
            return false;
        };
        let placed = PlacedObject::new(&to_world, inverse.linear);
        let at = placed.point(self.point);
        let NarrowPoint { point, off } = NarrowPoint::new(at.point, at.error + group.off(&inverse, accuracy));
        let squared = || placed.squared_in_object(limit(), off);
        let point = LanePoint::new(point, group.top.greatest_coordinate());
        let (now, visit) = (squared(), &mut |row| (!self.row(&level, row)).then(squared));
        run_walk(&group.top.nodes(), &mut PointInstances { point, squared: now, visit })
    }
}

/// The walk of a region.
pub(super) struct RegionWalk<'a> {
    pub(super) groups: &'a Groups,
    pub(super) region: [[f64; 3]; 2],
    /// Returns true to end the walk.
    pub(super) visit: &'a mut dyn FnMut(u32) -> bool,
}

impl RegionWalk<'_> {
    /// Visits the instances that a row shows and that may overlap the region. Returns true to end.
    pub(super) fn row(&mut self, level: &Level, row: u32) -> bool {
        let Shown { to_world, content } = self.groups.show(level, row);
        let level = match content {
            RowContent::Instance(instance, _) => return (self.visit)(instance),
            RowContent::Group(level) => level,
        };
        let group = self.groups.group(&level);
        if group.top.is_empty() {
            return false;
        }
        let region = self.region.map(|end| minus(end, to_world.translation));
        let (greatest, off) = (group.top.greatest_coordinate(), group.off_in_world(&to_world));
        let region = RegionBox::new(region, &to_world.linear, greatest, off);
        run_walk(&group.top.nodes(), &mut BoxInstances { region, visit: &mut |row| self.row(&level, row) })
    }
}
