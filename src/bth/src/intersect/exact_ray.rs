//! Rays as decisions need them: with the line that f32 only approximates.

use super::exact::{Estimate, Intersection, estimate, with_exact_volume};
use super::exact_line::ExactLine;
use super::long::LongLine;
use super::origin::{RoundedLine, RoundedOrigin};
use super::start_point::StartPoint;
use super::vector::wide;
use crate::rays::Ray;
use crate::simd::LANES;
use bth_format::layout::{NONE, WIDTH};

/// A ray in the space of an object.
#[derive(Clone, Copy)]
pub(crate) struct ExactRay<'a> {
    /// The ray as f32 knows it, with its range of t.
    pub(crate) ray: &'a Ray,
    pub(crate) line: LineSource<'a>,
    /// If the ray starts on a triangle of the object: the child code of its leaf, and its slot.
    own: Option<[u32; 2]>,
}

/// Where the line of a ray is known exactly.
#[derive(Clone, Copy)]
pub(crate) enum LineSource<'a> {
    /// In the ray of f32.
    Ray,
    /// It starts on a triangle of the object, along the direction of f32.
    Start(&'a StartPoint),
    /// In world space, where the object is placed: the ray with this index.
    World(&'a dyn WorldLines, usize),
}

/// The lines of rays in world space, as the object sees that they go through.
pub(crate) trait WorldLines {
    /// The line of a ray in the space of the object, in the units of t of the ray of f32.
    fn line(&self, ray: usize) -> RoundedLine;
    /// Sets the lines of up to sixteen rays, whose indices are counted from `first` on.
    fn lanes(&self, first: usize, rays: &[u32], of_lanes: &mut LineLanes);
    /// The line of the first of consecutive rays, if all of them have its origin and errors.
    fn common_origin(&self, first: usize, count: usize) -> Option<RoundedLine>;
    /// The same line with more digits, where there is one.
    fn long(&self, ray: usize) -> Option<LongLine>;
    /// The same line exactly. It is constructed for each decision, which are rare.
    fn exact(&self, ray: usize) -> ExactLine;
    /// Where a ray starts, if that is on a triangle of this object.
    fn start(&self, ray: usize) -> Option<&StartPoint>;
    /// The range of t of a ray in f64, in the units of its line, which is compared with t as it is.
    /// `None` for rays whose range and t are numbers of f32.
    fn range(&self, ray: usize) -> Option<[f64; 2]>;
    /// Returns true if all rays start on triangles: only hits at t > 0 count.
    fn are_from_starts(&self) -> bool;
}

impl<'a> ExactRay<'a> {
    /// A ray of f32.
    #[inline(always)]
    pub(crate) fn plain(ray: &'a Ray) -> ExactRay<'a> {
        ExactRay { ray, line: LineSource::Ray, own: None }
    }

    /// A ray with its line.
    #[inline(always)]
    pub(crate) fn new(ray: &'a Ray, line: LineSource<'a>) -> ExactRay<'a> {
        let own = match line {
            LineSource::Ray => None,
            LineSource::Start(start) => Some([start.leaf, start.slot]),
            LineSource::World(lines, ray) => lines.start(ray).map(|start| [start.leaf, start.slot]),
        };
        ExactRay { ray, line, own }
    }

    /// Where the ray starts, if that is on a triangle of the object.
    #[inline(always)]
    pub(crate) fn start(&self) -> Option<&'a StartPoint> {
        match self.line {
            LineSource::Ray => None,
            LineSource::Start(start) => Some(start),
            LineSource::World(lines, ray) => lines.start(ray),
        }
    }

    /// The bit of the triangle on which the ray starts if it is in the leaf with this child code: a
    /// ray does not hit it.
    #[inline(always)]
    pub(crate) fn own_triangle(&self, leaf: u32) -> u32 {
        self.own.map_or(0, |[own, slot]| u32::from(own == leaf) << (slot % WIDTH as u32))
    }

    /// The line in f64.
    #[inline(always)]
    pub(crate) fn rounded(&self) -> RoundedLine {
        match self.line {
            LineSource::Ray => RoundedLine::of_ray(self.ray),
            LineSource::Start(&StartPoint { origin, .. }) => {
                RoundedLine { origin, direction: wide(self.ray.direction), direction_error: 0.0 }
            }
            LineSource::World(lines, ray) => lines.line(ray),
        }
    }
}

/// The intersection of a line in world space with a triangle, given its corners in the space of the
/// object, if it counts. `may_matter` is called with bounds of t where only exact arithmetic can
/// tell.
pub(crate) fn intersect_in_world(
    (lines, ray): (&dyn WorldLines, usize),
    corners: [[f64; 3]; 3],
    may_matter: impl FnOnce([f64; 2]) -> bool,
) -> Option<Intersection> {
    let (line, counts) = (lines.line(ray), |found: &Intersection| found.t > 0.0 || !lines.are_from_starts());
    match estimate(line, line.direction, corners) {
        Estimate::Missed => None,
        Estimate::Intersects(found) => Some(found).filter(counts),
        Estimate::Open(_, t) if t[1] <= 0.0 && lines.are_from_starts() || !may_matter(t) => None,
        Estimate::Open(uncertain, _) => {
            let found = with_exact_volume(&line, corners, &uncertain).map(Some);
            let found = found.or_else(|| lines.long(ray).and_then(|line| line.decide(corners)));
            let found = found.unwrap_or_else(|| lines.exact(ray).intersection(corners));
            let found = found.filter(counts)?;
            Some(uncertain.if_accurate().unwrap_or(found))
        }
    }
}

/// The lines of the rays of a batch.
#[derive(Clone, Copy)]
pub(crate) enum Lines<'a> {
    /// The rays of f32 themselves.
    Rays,
    /// For each ray its start; rays whose start is on no triangle begin at their f32 origins.
    Starts(&'a [StartPoint]),
    /// Lines in world space. The first ray of the batch has this index.
    World(&'a dyn WorldLines, usize),
}

impl<'a> Lines<'a> {
    /// The line of a ray.
    #[inline(always)]
    pub(crate) fn of(self, ray: usize) -> LineSource<'a> {
        match self {
            Lines::Rays => LineSource::Ray,
            Lines::Starts(starts) => match starts.get(ray).filter(|start| start.is_on_triangle()) {
                Some(start) => LineSource::Start(start),
                None => LineSource::Ray,
            },
            Lines::World(lines, first) => LineSource::World(lines, first + ray),
        }
    }

    /// Returns true if rays may start on triangles.
    pub(crate) fn have_starts(self) -> bool {
        match self {
            Lines::Rays => false,
            Lines::Starts(_) => true,
            Lines::World(lines, _) => lines.are_from_starts(),
        }
    }

    /// Returns true if the rays of f32 hold the lines exactly.
    #[inline(always)]
    pub(crate) fn are_rays(self) -> bool {
        matches!(self, Lines::Rays)
    }

    /// The lines of the rays from `first` on.
    #[inline(always)]
    pub(crate) fn from(self, first: usize) -> Lines<'a> {
        match self {
            Lines::Rays => Lines::Rays,
            Lines::Starts(starts) => Lines::Starts(starts.get(first..).unwrap_or(&[])),
            Lines::World(lines, before) => Lines::World(lines, before + first),
        }
    }

    /// The line of a ray in f64.
    #[inline(always)]
    pub(crate) fn rounded(self, ray: usize, of_f32: &Ray) -> RoundedLine {
        ExactRay { ray: of_f32, line: self.of(ray), own: None }.rounded()
    }

    /// Sets the lines of up to sixteen rays, given their indices and the rays of the batch.
    #[inline(always)]
    pub(crate) fn lanes(self, at: &[u32], rays: &[Ray], of_lanes: &mut LineLanes) {
        match self {
            Lines::World(lines, first) => lines.lanes(first, at, of_lanes),
            _ => {
                for (lane, ray) in at.iter().map(|ray| *ray as usize).enumerate().take(LANES) {
                    of_lanes.set(lane, &self.rounded(ray, &rays[ray]));
                }
            }
        }
    }

    /// The child code of the leaf of the triangle on which a ray starts, and its slot there; `NONE`
    /// if it starts on no triangle of the object.
    #[inline(always)]
    pub(crate) fn own(self, ray: usize) -> [u32; 2] {
        let start = match self.of(ray) {
            LineSource::Ray => None,
            LineSource::Start(start) => Some(start),
            LineSource::World(lines, ray) => lines.start(ray),
        };
        start.map_or([NONE; 2], |start| [start.leaf, start.slot])
    }
}

/// Lines of sixteen rays in f64, by axis.
pub(crate) struct LineLanes {
    pub(crate) origin: [[f64; LANES]; 3],
    pub(crate) direction: [[f64; LANES]; 3],
    /// Errors of the origin and of the direction, as in [`RoundedLine`].
    pub(crate) error: [[f64; LANES]; 2],
}

impl LineLanes {
    pub(crate) const NONE: Self =
        LineLanes { origin: [[0.0; LANES]; 3], direction: [[1.0; LANES]; 3], error: [[0.0; LANES]; 2] };

    /// Sets the line of a lane.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, line: &RoundedLine) {
        let RoundedLine { origin: RoundedOrigin(point, off), direction, direction_error } = line;
        for k in 0..3 {
            (self.origin[k][lane], self.direction[k][lane]) = (point[k], direction[k]);
        }
        (self.error[0][lane], self.error[1][lane]) = (*off, *direction_error);
    }

    /// The direction of a lane.
    #[inline(always)]
    pub(crate) fn direction_of(&self, lane: usize) -> [f64; 3] {
        [self.direction[0][lane], self.direction[1][lane], self.direction[2][lane]]
    }

    /// The line of a lane.
    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> RoundedLine {
        let [[x, y, z], direction] =
            [&self.origin, &self.direction].map(|of| [of[0][lane], of[1][lane], of[2][lane]]);
        RoundedLine {
            origin: RoundedOrigin([x, y, z], self.error[0][lane]),
            direction,
            direction_error: self.error[1][lane],
        }
    }
}
