//! Nearest and any hit among all triangles.

use crate::crossing::{Crossing, crossing, to_f64};
use bth::rays::Ray;
use num_rational::BigRational;

/// An exact nearest hit.
#[derive(Clone, Debug)]
pub struct Truth<Id = u32> {
    /// Where the first of `triangles` is met.
    pub at: Crossing,
    /// All triangles that are met at exactly this t, ascending.
    pub triangles: Vec<Id>,
}

impl<Id> Truth<Id> {
    /// t of the nearest hit.
    pub fn t(&self) -> &BigRational {
        &self.at.t
    }
    /// t rounded to f64.
    pub fn t_f64(&self) -> f64 {
        to_f64(&self.at.t)
    }
}

/// Whether a hit counts: t, rounded to f32 as it is reported, lies within the ray's range.
fn in_range(ray: &Ray, t: &BigRational) -> bool {
    let reported = to_f64(t) as f32;
    ray.tmin <= reported && reported <= ray.tmax && reported < f32::INFINITY
}

/// The nearest of crossings that come in ascending order of their triangles.
pub(crate) fn nearest_of<Id: Clone>(
    ray: &Ray,
    crossings: impl Iterator<Item = (Id, Crossing)>,
) -> Option<Truth<Id>> {
    let mut best: Option<Truth<Id>> = None;
    for (id, at) in crossings {
        if !in_range(ray, &at.t) {
            continue;
        }
        match &mut best {
            Some(b) if at.t > b.at.t => {}
            Some(b) if at.t == b.at.t => b.triangles.push(id),
            _ => best = Some(Truth { at, triangles: vec![id] }),
        }
    }
    best
}

/// The nearest exact hit whose t, rounded to f32 as it is reported, lies within the ray's range. Ids are rows of
/// `corners`.
pub fn nearest(corners: &[[[f32; 3]; 3]], ray: &Ray) -> Option<Truth> {
    let rows = corners.iter().enumerate();
    nearest_of(ray, rows.filter_map(|(id, &triangle)| Some((id as u32, crossing(ray, triangle)?))))
}

/// Whether any triangle is hit within the ray's range.
pub fn any(corners: &[[[f32; 3]; 3]], ray: &Ray) -> bool {
    corners.iter().any(|&triangle| crossing(ray, triangle).is_some_and(|at| in_range(ray, &at.t)))
}
