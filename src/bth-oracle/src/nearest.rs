//! The nearest hit and any hit among all triangles, by testing every one.

use crate::intersection::{Intersection, intersection, to_f64};
use bth::rays::Ray;
use num_rational::BigRational;

/// An exact nearest hit.
#[derive(Clone, Debug)]
pub struct ExactHit<Id = u32> {
    /// The intersection with the first of `triangles`.
    pub at: Intersection,
    /// All triangles with an intersection at exactly this t, ascending.
    pub triangles: Vec<Id>,
}

impl<Id> ExactHit<Id> {
    /// t of the nearest hit.
    pub fn t(&self) -> &BigRational {
        &self.at.t
    }
    /// t rounded to f64.
    pub fn t_f64(&self) -> f64 {
        to_f64(&self.at.t)
    }
}

/// Returns true if a hit counts: t, rounded to f32 as it is reported, lies within the ray's range.
fn in_range(ray: &Ray, t: &BigRational) -> bool {
    let reported = to_f64(t) as f32;
    ray.tmin <= reported && reported <= ray.tmax && reported.is_finite()
}

/// The nearest of the intersections, which must come in ascending order of their triangles.
pub(crate) fn nearest_of<Id: Clone>(
    ray: &Ray,
    intersections: impl Iterator<Item = (Id, Intersection)>,
) -> Option<ExactHit<Id>> {
    let mut best: Option<ExactHit<Id>> = None;
    for (id, at) in intersections {
        if !in_range(ray, &at.t) {
            continue;
        }
        match &mut best {
            Some(b) if at.t > b.at.t => {}
            Some(b) if at.t == b.at.t => b.triangles.push(id),
            _ => best = Some(ExactHit { at, triangles: vec![id] }),
        }
    }
    best
}

/// The nearest exact hit whose t, rounded to f32 as it is reported, lies within the ray's range.
/// Ids are rows of `corners`.
pub fn nearest(corners: &[[[f32; 3]; 3]], ray: &Ray) -> Option<ExactHit> {
    let rows = corners.iter().enumerate();
    nearest_of(ray, rows.filter_map(|(id, &triangle)| Some((id as u32, intersection(ray, triangle)?))))
}

/// Returns true if any triangle is hit within the ray's range.
pub fn any(corners: &[[[f32; 3]; 3]], ray: &Ray) -> bool {
    corners.iter().any(|&triangle| intersection(ray, triangle).is_some_and(|at| in_range(ray, &at.t)))
}
