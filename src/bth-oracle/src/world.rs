//! Exact queries to a whole scene: every triangle of every instance, transformed exactly.

use crate::geometry::{Triangle, triangles};
use crate::intersection::{
    Intersection, Point, certainly_missed, has_line, integer, intersect_exactly, intersection, to_f64,
};
use crate::nearest::{ExactHit, nearest_of};
use crate::starts::{ExactStart, has_direction, range};
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef, Ray, StartRay};
use bth_format::layout::{Opacity, opacity_at};
use num_bigint::BigInt;

/// The units of f64, 2^-1074, and of f32, 2^-149.
const UNITS: [u32; 2] = [1074, 149];

/// The visible instances of a scene at the time to which it is set. Vertices are transformed to
/// world space by the f64 matrix of the instance without any rounding, whereas the runtime
/// transforms the ray into the space of the object and rounds it there. Answers for transformed
/// instances therefore differ from the runtime's by that rounding. For instances without a
/// transform both give the same answers. Transparent parts of triangles are not hit.
#[derive(Debug)]
pub struct World {
    instances: Vec<Instance>,
}

#[derive(Debug)]
struct Instance {
    number: u32,
    /// From object to world space, rows of the matrix; `None` for the identity.
    to_world: Option<[[f64; 4]; 3]>,
    triangles: Vec<Triangle>,
    /// Rows of OPACITY and OPACITY_MICRO.
    opacity: [Vec<u32>; 2],
}

/// A finite f64 as an integer, in units of 2^-1074.
fn integer_f64(x: f64) -> BigInt {
    assert!(x.is_finite());
    let (exponent, fraction) = ((x.to_bits() >> 52) & 0x7ff, x.to_bits() & ((1 << 52) - 1));
    let magnitude = match exponent {
        0 => BigInt::from(fraction),
        e => BigInt::from(fraction | (1 << 52)) << (e - 1),
    };
    if x.is_sign_negative() { -magnitude } else { magnitude }
}

impl World {
    /// Collects the triangles of the visible instances.
    pub fn new(scene: &Scene) -> Self {
        let identity: [[f64; 4]; 3] =
            std::array::from_fn(|row| std::array::from_fn(|k| f64::from(u8::from(row == k))));
        let instance = |number: u32| {
            let view = scene.instance(number);
            let object = scene.object(view.object);
            view.visible.then(|| Instance {
                number,
                to_world: Some(view.to_world).filter(|rows| *rows != identity),
                triangles: triangles(&object),
                opacity: [object.opacity.to_vec(), object.opacity_micro.to_vec()],
            })
        };
        World { instances: (0..scene.instance_count()).filter_map(instance).collect() }
    }

    /// Triangles of all instances.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|instance| instance.triangles.len()).sum()
    }

    /// The nearest exact hit.
    pub fn nearest(&self, ray: &Ray) -> Option<ExactHit<PrimitiveRef>> {
        nearest_of(ray, self.intersections(ray))
    }

    /// The nearest exact hit as the runtime reports hits: t, u and v rounded to f32. Among equal
    /// hits, the smallest instance and triangle win.
    pub fn hit(&self, ray: &Ray) -> Hit {
        as_reported(self.nearest(ray))
    }

    /// Returns true if any triangle is hit within the ray's range.
    pub fn any(&self, ray: &Ray) -> bool {
        self.intersections(ray).any(|found| nearest_of(ray, std::iter::once(found)).is_some())
    }

    /// The nearest exact hit of a ray from a start. The instance on which it starts sees the exact
    /// point, others see it rounded to f32, at t >= 0, as in the runtime. Among hits of instances
    /// with equal reported t, rounded to f32, the smallest instance wins.
    pub fn nearest_from_start(&self, ray: &StartRay) -> Option<ExactHit<PrimitiveRef>> {
        let PrimitiveRef { instance, triangle } = ray.start.primitive;
        let own = self.instances.iter().find(|other| other.number == instance)?;
        let of = own.triangles.iter().find(|other| other.id == triangle)?;
        let start = ExactStart::new(&own.exact(of.corners), ray.start.u, ray.start.v)?;
        if !has_direction(ray) {
            return None;
        }
        let one = BigInt::from(1) << (UNITS[0] + UNITS[1]);
        let wide = start.rounded(&one);
        let greatest = of.corners.iter().flatten().fold(0.0, |most: f64, x| most.max(f64::from(x.abs())));
        let misses = |corners: [[f32; 3]; 3]| {
            let from = corners.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - wide[k]));
            own.to_world.is_none() && certainly_missed(ray.direction.map(f64::from), from, 2.0 * greatest)
        };
        let rounded = Ray { origin: wide.map(|x| x as f32), ..range(ray) };
        let direction = ray.direction.map(|x| integer(x) << UNITS[0]);
        let of_instance = |other: &Instance| {
            let found = other.triangles.iter().filter_map(|triangle| {
                let primitive = PrimitiveRef { instance: other.number, triangle: triangle.id };
                let at = if other.number == instance {
                    if misses(triangle.corners) {
                        return None;
                    }
                    start.intersection(&direction, &other.exact(triangle.corners))?
                } else {
                    other.intersection(&rounded, triangle.corners)?
                };
                other.blocks(triangle.id, &at).then_some((primitive, at))
            });
            nearest_of(&rounded, found)
        };
        let reported = |hit: &ExactHit<PrimitiveRef>| hit.t_f64() as f32;
        // Of equal ones the first.
        self.instances.iter().filter_map(of_instance).min_by(|a, b| reported(a).total_cmp(&reported(b)))
    }

    /// As [`Self::hit`], for a ray from a start.
    pub fn hit_from_start(&self, ray: &StartRay) -> Hit {
        as_reported(self.nearest_from_start(ray))
    }

    /// Counts the triangles that the whole line of a ray hits, in both directions. Each costs the
    /// search for a hit as much as many that it misses.
    pub fn crossed(&self, ray: &Ray) -> usize {
        self.intersections(ray).count()
    }

    fn intersections<'a>(&'a self, ray: &'a Ray) -> impl Iterator<Item = (PrimitiveRef, Intersection)> + 'a {
        self.instances.iter().filter(|_| has_line(ray)).flat_map(move |instance| {
            instance.triangles.iter().filter_map(move |triangle| {
                let primitive = PrimitiveRef { instance: instance.number, triangle: triangle.id };
                let at = instance.intersection(ray, triangle.corners)?;
                instance.blocks(triangle.id, &at).then_some((primitive, at))
            })
        })
    }
}

impl Instance {
    /// The intersection of the line of a ray with a triangle.
    fn intersection(&self, ray: &Ray, corners: [[f32; 3]; 3]) -> Option<Intersection> {
        match &self.to_world {
            None => intersection(ray, corners),
            Some(rows) => intersection_in_world(ray, rows, corners),
        }
    }

    /// Returns true if a point of a triangle is not transparent.
    fn blocks(&self, triangle: u32, at: &Intersection) -> bool {
        let [rows, words] = &self.opacity;
        let [u, v] = [&at.u, &at.v].map(|x| to_f64(x) as f32);
        opacity_at(rows, words, triangle, u, v) != Opacity::Transparent
    }

    /// The corners of a triangle in world space, in units of 2^-(1074 + 149).
    fn exact(&self, corners: [[f32; 3]; 3]) -> [Point; 3] {
        match &self.to_world {
            None => corners.map(|p| p.map(|x| integer(x) << UNITS[0])),
            Some(rows) => corners.map(|p| in_world(rows, p)),
        }
    }
}

/// A hit as the runtime reports it; among equal hits, the smallest instance and triangle win.
fn as_reported(hit: Option<ExactHit<PrimitiveRef>>) -> Hit {
    let rounded = |x: &_| to_f64(x) as f32;
    hit.map_or(Hit::MISS, |truth| Hit {
        t: rounded(&truth.at.t),
        u: rounded(&truth.at.u),
        v: rounded(&truth.at.v),
        primitive: truth.triangles[0],
    })
}

/// A point that the rows of a matrix transform to world space, in units of 2^-(1074 + 149).
fn in_world(rows: &[[f64; 4]; 3], p: [f32; 3]) -> Point {
    let p = p.map(integer);
    std::array::from_fn(|k| {
        let [a, b, c, moved] = rows[k].map(integer_f64);
        a * &p[0] + b * &p[1] + c * &p[2] + (moved << UNITS[1])
    })
}

/// The intersection with a triangle that the rows of a matrix transform to world space.
fn intersection_in_world(ray: &Ray, rows: &[[f64; 4]; 3], corners: [[f32; 3]; 3]) -> Option<Intersection> {
    let wide = |v: [f32; 3]| v.map(f64::from);
    let (origin, direction) = (wide(ray.origin), wide(ray.direction));
    let mut magnitude: f64 = 0.0;
    let from = corners.map(wide).map(|p| {
        std::array::from_fn(|k| {
            let [a, b, c, moved] = rows[k];
            let terms = [a * p[0], b * p[1], c * p[2], moved, -origin[k]];
            // Five terms with one rounding each and four sums: below 8 roundings of the sum of
            // their magnitudes.
            magnitude = magnitude.max(8.0 * terms.iter().map(|x| x.abs()).sum::<f64>());
            terms.iter().sum()
        })
    });
    if certainly_missed(direction, from, magnitude) {
        return None;
    }
    let widen = |v: [f32; 3]| v.map(|x| integer(x) << UNITS[0]);
    intersect_exactly(&widen(ray.origin), &widen(ray.direction), &corners.map(|p| in_world(rows, p)))
}
