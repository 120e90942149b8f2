//! The nearest hit, any hit and all hits among all triangles, by testing every one.

use crate::intersection::{IDENTITY, Intersection, Placed, to_f64};
use crate::number::Coordinate;
use crate::ray::ExactRay;
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

/// The nearest of the hits, which must come in ascending order of their triangles.
pub(crate) fn nearest_of<Id>(hits: impl Iterator<Item = (Id, Intersection)>) -> Option<ExactHit<Id>> {
    let mut best: Option<ExactHit<Id>> = None;
    for (id, at) in hits {
        match &mut best {
            Some(b) if at.t > b.at.t => {}
            Some(b) if at.t == b.at.t => b.triangles.push(id),
            _ => best = Some(ExactHit { at, triangles: vec![id] }),
        }
    }
    best
}

/// The triangle of a list by its row.
pub(crate) fn row<T: Coordinate>(corners: &[[[T; 3]; 3]], row: u32) -> Option<Placed<'static>> {
    corners.get(row as usize).map(|of| Placed::new(*of, &IDENTITY))
}

/// The hits in a ray's range, by ascending row.
fn hits<T: Coordinate>(corners: &[[[T; 3]; 3]], ray: ExactRay) -> impl Iterator<Item = (u32, Intersection)> {
    let line = ray.line(|primitive| row(corners, primitive.triangle));
    let one = move |(id, of): (usize, &[[T; 3]; 3])| {
        let at = line.as_ref()?.hit(&Placed::new(*of, &IDENTITY)).at()?;
        ray.accepts(&at.t).then_some((id as u32, at))
    };
    corners.iter().enumerate().filter_map(one)
}

/// The nearest exact hit whose t, rounded as it is reported, lies within the ray's range. Ids are
/// rows of `corners`; so are triangles on which rays start.
pub fn nearest<T: Coordinate>(corners: &[[[T; 3]; 3]], ray: impl Into<ExactRay>) -> Option<ExactHit> {
    nearest_of(hits(corners, ray.into()))
}

/// Returns true if any triangle is hit within the ray's range.
pub fn any<T: Coordinate>(corners: &[[[T; 3]; 3]], ray: impl Into<ExactRay>) -> bool {
    hits(corners, ray.into()).next().is_some()
}

/// All hits, by ascending t and then triangle.
pub fn all_hits<T: Coordinate>(
    corners: &[[[T; 3]; 3]],
    ray: impl Into<ExactRay>,
) -> Vec<(u32, Intersection)> {
    let mut hits: Vec<_> = hits(corners, ray.into()).collect();
    hits.sort_by(|(a, at_a), (b, at_b)| at_a.t.cmp(&at_b.t).then(a.cmp(b)));
    hits
}
