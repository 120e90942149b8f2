//! Classifies wrong answers, and measures errors of t.

use super::exact_answers::{Exact, Geometry};
use bth::rays::{Hit, Ray};

/// The class of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AnswerClass {
    Right,
    FalseMiss,
    Leak,
    Ghost,
    WrongNeighbour,
}

/// Numbers of answers by what is wrong with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Defects {
    /// Answers.
    pub(crate) rays: u64,
    /// Nothing was found though something is hit.
    pub(crate) false_misses: u64,
    /// The nearest triangle was passed through: another behind it was found.
    pub(crate) leaks: u64,
    /// A triangle was found that the ray does not hit, or not within its range.
    pub(crate) ghosts: u64,
    /// A ghost, but the triangle shares a vertex with the right one.
    pub(crate) wrong_neighbours: u64,
}

impl Defects {
    /// The kinds of wrong answers and their numbers.
    pub(super) fn kinds(&self) -> [(&'static str, u64); 4] {
        [
            ("false_misses", self.false_misses),
            ("leaks", self.leaks),
            ("ghosts", self.ghosts),
            ("wrong_neighbours", self.wrong_neighbours),
        ]
    }

    /// Counts what is wrong with answers, relative to the geometry that was traced.
    pub(super) fn count(
        &mut self,
        geometry: &Geometry,
        neighbours: &Neighbours<'_>,
        rays: &[Ray],
        truth: &[Exact],
        hits: &[Hit],
    ) {
        for ((ray, exact), hit) in rays.iter().zip(truth).zip(hits) {
            self.rays += 1;
            match classify(geometry, neighbours, ray, exact, hit) {
                AnswerClass::Right => {}
                AnswerClass::FalseMiss => self.false_misses += 1,
                AnswerClass::Leak => self.leaks += 1,
                AnswerClass::Ghost => self.ghosts += 1,
                AnswerClass::WrongNeighbour => self.wrong_neighbours += 1,
            }
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

fn classify(
    geometry: &Geometry,
    neighbours: &Neighbours<'_>,
    ray: &Ray,
    exact: &Exact,
    hit: &Hit,
) -> AnswerClass {
    let (right, found) = (exact.hit.primitive.triangle, hit.primitive.triangle);
    match (exact.hit.is_hit(), hit.is_hit()) {
        (false, false) => return AnswerClass::Right,
        (true, false) => return AnswerClass::FalseMiss,
        _ if right == found => return AnswerClass::Right,
        _ => {}
    }
    match (geometry.crossing(ray, right), geometry.crossing(ray, found)) {
        (Some(right), Some(found)) if found.t == right.t => AnswerClass::Right,
        (Some(right), Some(found)) if found.t > right.t => AnswerClass::Leak,
        // It is before the nearest hit within the range of the ray, so it is not within that range.
        (_, Some(_)) => AnswerClass::Ghost,
        (_, None) if neighbours.touch(right, found) => AnswerClass::WrongNeighbour,
        (_, None) => AnswerClass::Ghost,
    }
}

/// The smallest error that this share of the errors does not exceed; zero if there are none.
pub(super) fn quantile(mut errors: Vec<f64>, share: f64) -> f64 {
    errors.sort_by(f64::total_cmp);
    let rank = (share * errors.len() as f64).ceil() as usize;
    errors.get(rank.max(1) - 1).copied().unwrap_or_default()
}

/// Errors of t if the right triangle or one that touches it was found, relative to t and in units of the last place of
/// the exact t.
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
        assert_eq!(verdict(exact.hit), AnswerClass::Right);
        assert_eq!(verdict(Hit::MISS), AnswerClass::FalseMiss);
        assert_eq!(verdict(name(behind.expect("the target lies behind"))), AnswerClass::Leak);
        assert_eq!(verdict(name(beside)), AnswerClass::WrongNeighbour);
        assert_eq!(verdict(name(elsewhere)), AnswerClass::Ghost);
    }
}
