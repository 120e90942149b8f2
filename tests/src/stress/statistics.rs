//! Counts of hits and defects over many rays.

use super::grid::Quotient;
use super::rays::{Aimed, Kind, Target};
use super::shapes::Shape;
use bth::rays::Hit;

/// Bins of the histogram of errors of t: eighths of an ulp, the last for all that is greater.
const BINS: usize = 8 * 8 + 1;

/// Counts over many rays.
#[derive(Clone, Debug)]
pub struct Statistics {
    /// Rays. Each went through all structures.
    pub rays: u64,
    /// Rays traced, over structures, instruction sets and kinds of query.
    pub traced: u64,
    /// Rays that hit.
    pub hits: u64,
    /// Rays compared with every triangle.
    pub compared: u64,
    /// The line is known to hit a triangle within the range, but neither that one was found nor one
    /// before it.
    pub misses: u64,
    /// A ray from inside a closed surface found nothing.
    pub leaks: u64,
    /// A triangle was reported that the line does not hit, or outside the range.
    pub ghosts: u64,
    /// Answers whose bits depend on structure, record, instruction set or batch.
    pub different: u64,
    /// Other triangle than the nearest of all.
    pub wrong: u64,
    /// Error of t in eighths of an ulp.
    histogram: [u64; BINS],
    /// Greatest error of t, in ulp.
    pub worst: f64,
    /// The first few defects, in words.
    pub examples: Vec<String>,
}

impl Default for Statistics {
    fn default() -> Self {
        Statistics {
            rays: 0,
            traced: 0,
            hits: 0,
            compared: 0,
            misses: 0,
            leaks: 0,
            ghosts: 0,
            different: 0,
            wrong: 0,
            histogram: [0; BINS],
            worst: 0.0,
            examples: Vec::new(),
        }
    }
}

impl Statistics {
    /// Defects of every kind.
    pub fn defects(&self) -> u64 {
        self.misses + self.leaks + self.ghosts + self.different + self.wrong
    }

    /// Error of t, in ulp, that 99 % of the hits stay within: the upper end of a bin.
    pub fn error_at_99_percent(&self) -> f64 {
        let most = self.hits - self.hits / 100;
        let mut sum = 0;
        let bin = self.histogram.iter().position(|n| {
            sum += n;
            sum >= most
        });
        bin.map_or(0.0, |bin| if bin + 1 == BINS { self.worst } else { (bin + 1) as f64 / 8.0 })
    }

    /// Adds another.
    pub fn add(&mut self, other: &Statistics) {
        self.rays += other.rays;
        self.traced += other.traced;
        self.hits += other.hits;
        self.compared += other.compared;
        self.misses += other.misses;
        self.leaks += other.leaks;
        self.ghosts += other.ghosts;
        self.different += other.different;
        self.wrong += other.wrong;
        self.histogram.iter_mut().zip(&other.histogram).for_each(|(a, b)| *a += b);
        self.worst = self.worst.max(other.worst);
        self.examples.extend(other.examples.iter().take(8usize.saturating_sub(self.examples.len())).cloned());
    }

    fn example(&mut self, what: &str, shape: &Shape, aimed: &Aimed, hit: &Hit) {
        self.add_example(format_args!("{what}: {}: {aimed:?} {hit:?}", shape.name));
    }

    pub(super) fn add_example(&mut self, example: std::fmt::Arguments<'_>) {
        if self.examples.len() < 8 {
            self.examples.push(example.to_string());
        }
    }

    /// Checks an answer against what is known about its ray.
    pub fn check(&mut self, shape: &Shape, aimed: &Aimed, hit: &Hit) {
        self.rays += 1;
        let ray = &aimed.ray;
        if hit.is_hit() {
            self.hits += 1;
            let exact = shape.grid.intersection(ray, hit.primitive.triangle);
            if exact.is_none() || !within(ray.range, hit.t) {
                self.ghosts += 1;
                self.example("ghost", shape, aimed, hit);
            } else if let Some(exact) = exact {
                self.error(exact.value(), hit.t);
            }
        } else if aimed.kind == Kind::Inside && !shape.inside.is_empty() {
            self.leaks += 1;
            self.example("leak", shape, aimed, hit);
        }
        let known = self::known(shape, aimed).map(|t| t.value() as f32).filter(|t| within(ray.range, *t));
        if known.is_some_and(|t| !hit.is_hit() || hit.t > t) {
            self.misses += 1;
            self.example("miss", shape, aimed, hit);
        }
    }

    pub(super) fn error(&mut self, exact: f64, t: f32) {
        let ulp = f64::from(t.abs().next_up()) - f64::from(t.abs());
        let error = (f64::from(t) - exact).abs() / ulp;
        self.worst = self.worst.max(error);
        self.histogram[((error * 8.0) as usize).min(BINS - 1)] += 1;
    }

    /// Compares an answer with every triangle.
    pub fn compare_with_all(&mut self, shape: &Shape, aimed: &Aimed, hit: &Hit) {
        self.compared += 1;
        let (grid, mut nearest) = (&shape.grid, f32::INFINITY);
        let mut least = u32::MAX;
        for row in 0..grid.triangles.len() as u32 {
            let Some(t) = grid.intersection(&aimed.ray, row).map(|t| t.value() as f32) else { continue };
            if within(aimed.ray.range, t) && t < nearest {
                (nearest, least) = (t, row);
            }
        }
        let right = match hit.is_hit() {
            // t is rounded to half an ulp, so among triangles at the same rounded t any may be the
            // nearest.
            true => hit.t <= nearest && (hit.primitive.triangle == least || hit.t == nearest),
            false => nearest == f32::INFINITY,
        };
        if !right {
            self.wrong += 1;
            self.example("wrong", shape, aimed, hit);
        }
    }
}

fn within([tmin, tmax]: [f32; 2], t: f32) -> bool {
    tmin <= t && t <= tmax && t.is_finite()
}

/// The t at which the line is known to hit a triangle: one at the target vertex or edge whose plane
/// does not contain the line.
fn known(shape: &Shape, aimed: &Aimed) -> Option<Quotient> {
    let (vertex, other) = match aimed.through? {
        Target::Vertex(vertex) => (vertex, vertex),
        Target::Edge([vertex, other]) => (vertex, other),
    };
    let around = shape.around[vertex as usize].iter();
    let mut at = around.filter(|row| shape.grid.triangles[**row as usize].contains(&other));
    at.find_map(|row| shape.grid.intersection(&aimed.ray, *row))
}
