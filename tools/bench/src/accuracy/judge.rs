//! What is wrong with answers, and by how much.

use super::truth::{Exact, Geometry};
use bth::rays::{Hit, Ray};
use serde::Serialize;

/// What an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Right,
    FalseMiss,
    Leak,
    Ghost,
    WrongNeighbour,
}

/// Answers by what is wrong with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Defects {
    /// Answers.
    pub rays: u64,
    /// Nothing was found, though something is hit.
    pub false_misses: u64,
    /// The nearest triangle was passed through: another behind it was found.
    pub leaks: u64,
    /// A triangle was found that the ray does not meet, or not within its range.
    pub ghosts: u64,
    /// As a ghost, but the triangle shares a vertex with the right one.
    pub wrong_neighbours: u64,
}

impl Defects {
    /// Wrong answers of any kind.
    pub fn all(&self) -> u64 {
        self.false_misses + self.leaks + self.ghosts + self.wrong_neighbours
    }

    /// The same over more rays.
    pub fn add(&mut self, other: &Defects) {
        self.rays += other.rays;
        self.false_misses += other.false_misses;
        self.leaks += other.leaks;
        self.ghosts += other.ghosts;
        self.wrong_neighbours += other.wrong_neighbours;
    }

    fn count(&mut self, verdict: Verdict) {
        self.rays += 1;
        match verdict {
            Verdict::Right => {}
            Verdict::FalseMiss => self.false_misses += 1,
            Verdict::Leak => self.leaks += 1,
            Verdict::Ghost => self.ghosts += 1,
            Verdict::WrongNeighbour => self.wrong_neighbours += 1,
        }
    }
}

/// Triangles that share vertices.
pub struct Neighbours<'a>(pub &'a [[u32; 3]]);

impl Neighbours<'_> {
    /// Whether two triangles share a vertex.
    fn touch(&self, a: u32, b: u32) -> bool {
        let corners = |t: u32| self.0.get(t as usize);
        corners(a).zip(corners(b)).is_some_and(|(a, b)| a.iter().any(|v| b.contains(v)))
    }
}

/// Counts what is wrong with answers, all relative to the geometry that was traced.
pub fn defects(
    geometry: &Geometry,
    neighbours: &Neighbours<'_>,
    rays: &[Ray],
    truth: &[Exact],
    hits: &[Hit],
) -> Defects {
    let mut defects = Defects::default();
    for ((ray, exact), hit) in rays.iter().zip(truth).zip(hits) {
        defects.count(judge(geometry, neighbours, ray, exact, hit));
    }
    defects
}

fn judge(geometry: &Geometry, neighbours: &Neighbours<'_>, ray: &Ray, exact: &Exact, hit: &Hit) -> Verdict {
    let (right, found) = (exact.hit.surface.triangle, hit.surface.triangle);
    match (exact.hit.is_hit(), hit.is_hit()) {
        (false, false) => return Verdict::Right,
        (true, false) => return Verdict::FalseMiss,
        _ if right == found => return Verdict::Right,
        _ => {}
    }
    match (geometry.crossing(ray, right), geometry.crossing(ray, found)) {
        (Some(right), Some(found)) if found.t == right.t => Verdict::Right,
        (Some(right), Some(found)) if found.t > right.t => Verdict::Leak,
        // Before the nearest hit within the range: not within it.
        (_, Some(_)) => Verdict::Ghost,
        (_, None) if neighbours.touch(right, found) => Verdict::WrongNeighbour,
        (_, None) => Verdict::Ghost,
    }
}

/// Quantiles of an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Half of the errors are at most this.
    pub median: f64,
    /// 99 % are.
    pub most: f64,
    /// All are.
    pub max: f64,
}

impl Spread {
    /// Of these errors; zero if there are none.
    pub fn of(mut errors: Vec<f64>) -> Spread {
        errors.sort_by(f64::total_cmp);
        // The least that so many of them do not exceed.
        let at = |share: f64| {
            let rank = (share * errors.len() as f64).ceil() as usize;
            errors.get(rank.max(1) - 1).copied().unwrap_or_default()
        };
        Spread { median: at(0.5), most: at(0.99), max: at(1.0) }
    }
}

/// Errors of t where the right triangle, one that touches it or one at the same t was found, relative to t and in units
/// of the last place of the exact t.
pub fn errors_of_t(neighbours: &Neighbours<'_>, truth: &[Exact], hits: &[Hit]) -> [Vec<f64>; 2] {
    let (mut relative, mut ulp) = (Vec::new(), Vec::new());
    for (exact, hit) in truth.iter().zip(hits).filter(|(e, h)| e.hit.is_hit() && h.is_hit()) {
        let (right, found) = (exact.hit.surface.triangle, hit.surface.triangle);
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
    use crate::model::Model;
    use crate::ours;
    use bth::rays::Surface;

    #[test]
    fn quantiles_are_values_that_occur() {
        let spread = Spread::of((1..=200).rev().map(f64::from).collect());
        assert_eq!(spread, Spread { median: 100.0, most: 198.0, max: 200.0 });
        assert_eq!(Spread::of(vec![]), Spread::default());
    }

    /// Every kind of defect, made on purpose.
    #[test]
    fn defects_are_told_apart() {
        let model = Model::load("torus-knot:320").unwrap();
        let bytes = ours::compile(&model, &ours::BVH).unwrap().bytes;
        let geometry = Geometry::new(&bytes).unwrap();
        let neighbours = Neighbours(&model.mesh.triangles);
        let set = crate::accuracy::aimed::set(&model, crate::accuracy::aimed::Target::Vertices, 200);
        let truth = geometry.answers(&set, 1).unwrap();
        let i = (0..200).find(|&i| truth[i].hit.is_hit() && truth[i].hit.t < 0.9).unwrap();
        let (ray, exact) = (&set.rays[i], &truth[i]);
        let name = |triangle| Hit { surface: Surface { instance: 0, triangle }, ..exact.hit };
        let verdict = |hit: Hit| judge(&geometry, &neighbours, ray, exact, &hit);
        let all = 0..model.triangles() as u32;
        let met = |t: &u32| geometry.crossing(ray, *t).is_some();
        let right = exact.hit.surface.triangle;
        let behind = all
            .clone()
            .filter(met)
            .find(|t| geometry.crossing(ray, *t).unwrap().t > geometry.crossing(ray, right).unwrap().t);
        let beside = all.clone().find(|t| !met(t) && neighbours.touch(*t, right)).unwrap();
        let elsewhere = all.clone().find(|t| !met(t) && !neighbours.touch(*t, right)).unwrap();
        assert_eq!(verdict(exact.hit), Verdict::Right);
        assert_eq!(verdict(Hit::MISS), Verdict::FalseMiss);
        assert_eq!(verdict(name(behind.expect("the target lies behind"))), Verdict::Leak);
        assert_eq!(verdict(name(beside)), Verdict::WrongNeighbour);
        assert_eq!(verdict(name(elsewhere)), Verdict::Ghost);
    }
}
