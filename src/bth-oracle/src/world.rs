//! Exact queries to a whole scene: every triangle of every instance, transformed exactly.

use crate::geometry::exact_triangles;
use crate::intersection::{Intersection, Placed, Rows, to_f64};
use crate::nearest::{ExactHit, nearest_of};
use crate::number::Coordinate;
use crate::ray::ExactRay;
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef};
use bth_format::layout::{Opacity, opacity_at};

/// Instances of triangles. The vertices of each are transformed to world space by its matrix as
/// real numbers, without any rounding. Transparent parts of triangles are not hit.
#[derive(Debug, Default)]
pub struct World {
    instances: Vec<Instance>,
}

#[derive(Debug)]
struct Instance {
    number: u32,
    to_world: Rows,
    /// Ids and corners.
    triangles: Vec<(u32, [[f64; 3]; 3])>,
    /// Rows of OPACITY and OPACITY_MICRO.
    opacity: [Vec<u32>; 2],
}

impl World {
    /// Collects the triangles of the visible instances of a scene at the time to which it is set.
    pub fn new(scene: &Scene) -> Self {
        let mut world = World::default();
        for number in 0..scene.instance_count() {
            let view = scene.instance(number);
            if view.visible {
                let object = scene.object(view.object);
                world.place(number, view.to_world, exact_triangles(&object));
                world.instances.last_mut().expect("it was placed").opacity =
                    [object.opacity.to_vec(), object.opacity_micro.to_vec()];
            }
        }
        world
    }

    /// Places opaque triangles, by ascending id, as an instance. Instances must come in ascending
    /// order of their numbers.
    pub fn place<T: Coordinate>(
        &mut self,
        number: u32,
        to_world: Rows,
        triangles: impl IntoIterator<Item = (u32, [[T; 3]; 3])>,
    ) {
        let wide = |(id, corners): (u32, [[T; 3]; 3])| (id, corners.map(|p| p.map(Into::into)));
        let triangles = triangles.into_iter().map(wide).collect();
        self.instances.push(Instance { number, to_world, triangles, opacity: Default::default() });
    }

    /// Triangles of all instances.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|instance| instance.triangles.len()).sum()
    }

    /// The nearest exact hit.
    pub fn nearest(&self, ray: impl Into<ExactRay>) -> Option<ExactHit<PrimitiveRef>> {
        let ray = ray.into();
        nearest_of(self.intersections(ray).filter(|(_, at)| ray.accepts(&at.t)))
    }

    /// The nearest exact hit as the runtime reports hits: t, u and v rounded to f32. Among equal
    /// hits, the smallest instance and triangle win.
    pub fn hit(&self, ray: impl Into<ExactRay>) -> Hit {
        let rounded = |x: &_| to_f64(x) as f32;
        self.nearest(ray).map_or(Hit::MISS, |truth| Hit {
            t: rounded(&truth.at.t),
            u: rounded(&truth.at.u),
            v: rounded(&truth.at.v),
            primitive: truth.triangles[0],
        })
    }

    /// Returns true if any triangle is hit within the ray's range.
    pub fn any(&self, ray: impl Into<ExactRay>) -> bool {
        let ray = ray.into();
        self.intersections(ray).any(|(_, at)| ray.accepts(&at.t))
    }

    /// The intersection of the whole line of a ray with a triangle of an instance.
    pub fn intersection(&self, ray: impl Into<ExactRay>, primitive: PrimitiveRef) -> Option<Intersection> {
        ray.into().line(|start| self.find(start))?.hit(&self.find(primitive)?).at()
    }

    /// Counts the triangles that the whole line of a ray hits, in both directions. Each costs the
    /// search for a hit as much as many that it misses.
    pub fn crossed(&self, ray: impl Into<ExactRay>) -> usize {
        self.intersections(ray.into()).count()
    }

    fn find(&self, primitive: PrimitiveRef) -> Option<Placed<'_>> {
        let row = self.instances.binary_search_by_key(&primitive.instance, |of| of.number).ok()?;
        let Instance { triangles, to_world, .. } = &self.instances[row];
        let row = triangles.binary_search_by_key(&primitive.triangle, |of| of.0).ok()?;
        Some(Placed::new(triangles[row].1, to_world))
    }

    fn intersections(&self, ray: ExactRay) -> impl Iterator<Item = (PrimitiveRef, Intersection)> + '_ {
        let line = ray.line(|start| self.find(start));
        line.into_iter().flat_map(|line| {
            self.instances.iter().flat_map(move |instance| {
                let line = line.clone();
                instance.triangles.iter().filter_map(move |(triangle, corners)| {
                    let at = line.hit(&Placed::new(*corners, &instance.to_world)).at()?;
                    let primitive = PrimitiveRef { instance: instance.number, triangle: *triangle };
                    instance.blocks(*triangle, &at).then_some((primitive, at))
                })
            })
        })
    }
}

impl Instance {
    /// Returns true if a point of a triangle is not transparent.
    fn blocks(&self, triangle: u32, at: &Intersection) -> bool {
        let [rows, words] = &self.opacity;
        let [u, v] = [&at.u, &at.v].map(|x| to_f64(x) as f32);
        opacity_at(rows, words, triangle, u, v) != Opacity::Transparent
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::RayOrigin;
    use num_rational::BigRational;

    const CORNERS: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    const DOWN: [f64; 3] = [0.0, 0.0, -1.0];

    /// Two images that share an edge as real numbers, at matrices whose products no f64 holds.
    fn mirrored() -> World {
        let (x, y) = (0.1, 1.0 / 3.0);
        let mut world = World::default();
        world.place(3, [[x, y, 0.0, 5.5e6], [0.0, x, 0.0, y], [0.0, 0.0, 1.0, 0.0]], [(7, CORNERS)]);
        world.place(4, [[-x, y, 0.0, 5.5e6], [0.0, x, 0.0, y], [0.0, 0.0, 1.0, 0.0]], [(2, CORNERS)]);
        world
    }

    fn primitive(instance: u32, triangle: u32) -> PrimitiveRef {
        PrimitiveRef { instance, triangle }
    }

    #[test]
    fn images_share_the_edge_as_real_numbers() {
        let world = mirrored();
        let both = [primitive(3, 7), primitive(4, 2)];
        let corner = ExactRay::double([5.5e6, 1.0 / 3.0, 2.0], DOWN);
        let found = world.nearest(corner).unwrap();
        assert_eq!((found.t_f64(), found.triangles), (2.0, both.to_vec()));
        // The steps of f64 here are 2^-30: only one of the triangles is hit on each side.
        let aside = |step: f64| world.nearest(ExactRay::double([5.5e6 + step, 0.3334, 2.0], DOWN)).unwrap();
        assert_eq!([1e-3, -1e-3].map(|step| aside(step).triangles), [[both[0]], [both[1]]]);
        assert_eq!(world.crossed(corner), 2);
        // From the middle of the edge, exactly, towards a third instance.
        let mut world = world;
        world.place(
            9,
            [[9.0, 0.0, 0.0, 5.5e6 - 3.0], [0.0, 9.0, 0.0, -3.0], [0.0, 0.0, 1.0, -1.0]],
            [(0, CORNERS)],
        );
        for (from, weights) in [(both[0], [0.0, 0.5]), (both[1], [0.0, 0.5])] {
            let ray =
                ExactRay { origin: RayOrigin::Start(from, weights), ..ExactRay::double([0.0; 3], DOWN) };
            let found = world.nearest(ray).unwrap();
            assert_eq!((found.t_f64(), found.triangles), (1.0, vec![primitive(9, 0)]));
            // u of the point 5.5e6 + y/2, exactly.
            let y = BigRational::from_float(1.0f64 / 3.0).unwrap();
            let u = (y / BigRational::from_integer(2.into()) + BigRational::from_integer(3.into()))
                / BigRational::from_integer(9.into());
            assert_eq!(found.at.u, u);
            assert!(!world.any(ExactRay { direction: [0.0, 0.0, 1.0], ..ray }), "both are left");
            assert_eq!(world.hit(ExactRay { range: [0.0, 0.5], ..ray }), Hit::MISS);
        }
    }

    #[test]
    fn equal_hits_are_ordered_by_instance_and_then_triangle() {
        let mut world = World::default();
        let rows = crate::intersection::IDENTITY;
        world.place(0, rows, [(1, CORNERS), (5, CORNERS)]);
        world.place(2, rows, [(0, CORNERS.map(|p| p.map(|x| x as f32)))]);
        let found = world.nearest(ExactRay::double([0.25, 0.25, 3.0], [0.0, 0.0, -2.0])).unwrap();
        assert_eq!(found.triangles, [primitive(0, 1), primitive(0, 5), primitive(2, 0)]);
        assert_eq!((found.t_f64(), world.triangle_count()), (1.5, 3));
    }
}
