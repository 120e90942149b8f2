//! Classifies wrong answers, and measures errors of t.

use super::exact_answers::{Exact, Geometry};
use bth::rays::{Hit, Ray};

/// The kinds of wrong answers: nothing was found though something is hit; the nearest triangle was
/// passed through and another behind it was found; a triangle was found that the ray does not hit,
/// or not within its range; the same, but the triangle shares a vertex with the right one.
pub(super) const KINDS: [&str; 4] = ["false_misses", "leaks", "ghosts", "wrong_neighbours"];
const FALSE_MISS: Option<usize> = Some(0);
const LEAK: Option<usize> = Some(1);
const GHOST: Option<usize> = Some(2);
const WRONG_NEIGHBOUR: Option<usize> = Some(3);

/// Adds the number of wrong answers of each kind, relative to the geometry that was traced.
pub(super) fn count(
    counts: &mut [u64; 4],
    geometry: &Geometry,
    neighbours: &Neighbours<'_>,
    rays: &[Ray],
    truth: &[Exact],
    hits: &[Hit],
) {
    for ((ray, exact), hit) in rays.iter().zip(truth).zip(hits) {
        if let Some(kind) = classify(geometry, neighbours, ray, exact, hit) {
            counts[kind] += 1;
        }
    }
}

/// Triangles that share vertices.
pub(super) struct Neighbours<'a>(pub &'a [[u32; 3]]);

impl Neighbours<'_> {
    /// Returns true if two triangles share a vertex.
    fn touch(&self, a: u32, b: u32) -> bool {
        let corners = |t: u32| self.0.get(t as usize);
        corners(a).zip(corners(b)).is_some_and(|(a, b)| a.iter().any(|v| b.contains(v)))
    }
}

/// The kind of a wrong answer; `None` if it is right.
fn classify(
    geometry: &Geometry,
    neighbours: &Neighbours<'_>,
    ray: &Ray,
    exact: &Exact,
    hit: &Hit,
) -> Option<usize> {
    let (right, found) = (exact.hit.primitive.triangle, hit.primitive.triangle);
    match (exact.hit.is_hit(), hit.is_hit()) {
        (false, false) => return None,
        (true, false) => return FALSE_MISS,
        _ if right == found => return None,
        _ => {}
    }
    match (geometry.crossing(ray, right), geometry.crossing(ray, found)) {
        (Some(right), Some(found)) if found.t == right.t => None,
        (Some(right), Some(found)) if found.t > right.t => LEAK,
        // It is before the nearest hit within the range of the ray, so it is not within that range.
        (_, Some(_)) => GHOST,
        (_, None) if neighbours.touch(right, found) => WRONG_NEIGHBOUR,
        (_, None) => GHOST,
    }
}

/// The smallest error that this share of the errors does not exceed; zero without errors.
pub(super) fn quantile(mut errors: Vec<f64>, share: f64) -> f64 {
    errors.sort_by(f64::total_cmp);
    let rank = (share * errors.len() as f64).ceil() as usize;
    errors.get(rank.max(1) - 1).copied().unwrap_or_default()
}

/// Errors of t if the right triangle or one that touches it was found, relative to t and in units
/// of the last place of the exact t.
pub(super) fn errors_of_t(neighbours: &Neighbours<'_>, truth: &[Exact], hits: &[Hit]) -> [Vec<f64>; 2] {
    let (mut relative, mut ulp) = (Vec::new(), Vec::new());
    for (exact, hit) in truth.iter().zip(hits).filter(|(e, h)| e.hit.is_hit() && h.is_hit()) {
        let (right, found) = (exact.hit.primitive.triangle, hit.primitive.triangle);
        if (right == found || neighbours.touch(right, found)) && exact.t > 0.0 {
            let error = (f64::from(hit.t) - exact.t).abs();
            let nearest = exact.t as f32;
            relative.push(error / exact.t);
            ulp.push(error / (f64::from(nearest.next_up()) - f64::from(nearest)));
        }
    }
    [relative, ulp]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::aimed_rays;
    use crate::model::Model;
    use crate::structures;
    use bth::rays::PrimitiveRef;

    #[test]
    fn quantiles_are_values_that_occur() {
        let errors: Vec<f64> = (1..=200).rev().map(f64::from).collect();
        assert_eq!([0.5, 0.99, 1.0].map(|share| quantile(errors.clone(), share)), [100.0, 198.0, 200.0]);
        assert_eq!(quantile(vec![], 0.5), 0.0);
    }

    /// Every kind of defect, made on purpose.
    #[test]
    fn defects_are_told_apart() {
        let model = Model::load("torus-knot:320").unwrap();
        let bytes = structures::compile(&model, &structures::BVH).unwrap().bytes;
        let geometry = Geometry::new(&bytes).unwrap();
        let neighbours = Neighbours(&model.mesh.triangles);
        let set = aimed_rays::set(&model, aimed_rays::Target::Vertices, 200);
        let truth = geometry.answers(&set, 1).unwrap();
        let i = (0..200).find(|&i| truth[i].hit.is_hit() && truth[i].hit.t < 0.9).unwrap();
        let (ray, exact) = (&set.rays[i], &truth[i]);
        let name = |triangle| Hit { primitive: PrimitiveRef { instance: 0, triangle }, ..exact.hit };
        let verdict = |hit: Hit| classify(&geometry, &neighbours, ray, exact, &hit);
        let all = 0..model.triangles() as u32;
        let is_hit = |t: &u32| geometry.crossing(ray, *t).is_some();
        let right = exact.hit.primitive.triangle;
        let behind = all
            .clone()
            .filter(is_hit)
            .find(|t| geometry.crossing(ray, *t).unwrap().t > geometry.crossing(ray, right).unwrap().t);
        let beside = all.clone().find(|t| !is_hit(t) && neighbours.touch(*t, right)).unwrap();
        let elsewhere = all.clone().find(|t| !is_hit(t) && !neighbours.touch(*t, right)).unwrap();
        assert_eq!(verdict(exact.hit), None);
        assert_eq!(verdict(Hit::MISS), FALSE_MISS);
        assert_eq!(verdict(name(behind.expect("the target lies behind"))), LEAK);
        assert_eq!(verdict(name(beside)), WRONG_NEIGHBOUR);
        assert_eq!(verdict(name(elsewhere)), GHOST);
    }
}
