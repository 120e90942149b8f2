//! The sets of queries: seeded, and the same numbers for everybody.

use super::aimed_rays::{self, Target};
use super::exact::{ExactAnswer, Surface};
use super::instances;
use crate::model::{Model, position};
use crate::rays::{Camera, cosine_weighted, on_sphere, perpendicular};
use bth::Scene;
use bth::rays::{PrimitiveRef, Ray, Start};
use bth_import::Mesh;
use bth_random::Rng;
use bth_scenes::{Model as Mesh32, catalogue};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// What is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Query {
    /// The first triangle along a ray.
    Nearest,
    /// Is a point inside of a closed surface?
    Inside,
    /// Do two points of the surface see each other? Every pair is asked in both directions, one
    /// after the other.
    Visible,
}

/// A point of a surface that a ray has reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// The exact point.
    pub(super) start: Start,
    /// The same, rounded to f64.
    pub(super) point: DVec3,
    /// Unit normal, to the side from which the ray came.
    pub(super) normal: DVec3,
    /// Unit vector back along that ray.
    pub(super) back: DVec3,
    /// How far that ray went.
    pub(super) travelled: f64,
}

/// One query.
#[derive(Clone, Debug)]
pub(super) struct Question {
    /// Start of the ray, or the point.
    pub(super) origin: [f64; 3],
    /// Direction of the ray.
    pub(super) direction: [f64; 3],
    /// The place of the surface where the ray starts, if it does.
    pub(super) from: Option<Place>,
    /// The place of the surface that may be seen.
    pub(super) to: Option<Place>,
}

/// A set.
pub(super) struct Set {
    /// Name in tables.
    pub(super) name: &'static str,
    /// What it is, for the page.
    pub(super) about: &'static str,
    pub(super) query: Query,
    /// True if positions, origins and directions are f32.
    pub(super) single: bool,
    /// True if neighbouring rays are similar; Embree takes this as a flag.
    pub(super) coherent: bool,
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The same as instances of one object, one after the other.
    pub(super) scene: Option<Arc<Scene>>,
    pub(super) questions: Vec<Question>,
    /// The exact answers.
    pub(super) truths: Vec<ExactAnswer>,
}

/// The exact answer to a question about a surface; `None` if definitions would decide it.
type Solve = fn(&Surface, &Question) -> Option<ExactAnswer>;

pub(super) const NEAREST: Solve = |surface, q| surface.nearest(q.origin, q.direction);
const FROM_START: Solve = |surface, q| Some(surface.nearest_from_start(&q.from?.start, q.direction));
const INSIDE: Solve = |surface, q| surface.inside(q.origin);
const VISIBLE: Solve = |surface, q| Some(surface.visible(&q.from?.start, &q.to?.start));

impl Set {
    /// A set of at most `count` of these questions.
    pub(super) fn new(
        (name, about): (&'static str, &'static str),
        query: Query,
        surface: &Surface,
        questions: Vec<Question>,
        solve: Solve,
        count: usize,
    ) -> Set {
        let truths: Vec<_> = questions.par_iter().map(|question| solve(surface, question)).collect();
        let both = questions.into_iter().zip(truths).filter_map(|(question, truth)| Some((question, truth?)));
        let (questions, truths) = both.take(count).unzip();
        let (positions, triangles) = (surface.positions.clone(), surface.triangles.clone());
        let (single, coherent, scene) = (true, false, None);
        Set { name, about, query, single, coherent, positions, triangles, scene, questions, truths }
    }

    /// Positions rounded to f32, as a model.
    pub(super) fn model(&self) -> Mesh32 {
        let positions = self.positions.iter().map(|p| p.map(|x| x as f32)).collect();
        Mesh32 { positions, triangles: self.triangles.clone() }
    }

    /// Length of the diagonal of the bounding box.
    pub(super) fn diagonal(&self) -> f64 {
        let points = || self.positions.iter().map(|p| DVec3::from_array(*p));
        let lower = points().fold(DVec3::INFINITY, DVec3::min);
        points().fold(DVec3::NEG_INFINITY, DVec3::max).distance(lower)
    }

    /// The places that the rays of the set reach.
    fn places(&self, surface: &Surface) -> Vec<Option<Place>> {
        let place = |(question, truth): (&Question, &ExactAnswer)| {
            let ExactAnswer::Hit { t, weights: [u, v], triangles } = truth else { return None };
            let primitive = PrimitiveRef { instance: 0, triangle: triangles[0] };
            let start = Start { primitive, u: *u as f32, v: *v as f32 };
            let (normal, direction) = (surface.normal(triangles[0]), DVec3::from_array(question.direction));
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let point = DVec3::from_array(surface.point(&start));
            Some(Place {
                start,
                point,
                normal,
                back: -direction.normalize(),
                travelled: t * direction.length(),
            })
        };
        self.questions.iter().zip(&self.truths).map(place).collect()
    }
}

/// Makes all sets of about `count` queries.
pub(super) fn all(count: usize) -> Vec<Set> {
    // A model in metres, about as wide as a house.
    let mut gyroid = named("gyroid", count.clamp(2000, 100_000));
    gyroid.positions.as_flattened_mut().iter_mut().for_each(|x| *x *= 8.0);
    let surface = wide(&gyroid);
    let of = |names, query, questions, solve| Set::new(names, query, &surface, questions, solve, count);

    let names = ("camera", "rays of a camera that sees a whole gyroid");
    let camera = of(names, Query::Nearest, camera_rays(&gyroid, count), NEAREST);
    let camera = Set { coherent: true, ..camera };
    let seen: Vec<Place> = camera.places(&surface).into_iter().flatten().collect();

    let mut rng = Rng::new(1);
    let bounce = |from: &Place| {
        let direction = single(cosine_weighted(&mut rng, from.normal));
        Question { from: Some(*from), ..plain(from.point.to_array(), direction) }
    };
    let names = ("bounces", "from the points that the camera sees, in cosine-weighted directions");
    let bounces = of(names, Query::Nearest, seen.iter().map(bounce).collect(), FROM_START);

    let names = ("vertices and edges", "rays exactly through vertices and middles of edges of the gyroid");
    let aimed = of(names, Query::Nearest, aimed_rays(&gyroid, count, 0.0), NEAREST);
    let names =
        ("inside", "points of the gyroid's box: random, exactly above vertices, and 1e-6 off the surface");
    let inside = of(names, Query::Inside, points(&surface, count), INSIDE);
    let pairs = pairs(&seen, &bounces, &surface);
    let names = (
        "visibility",
        "between random points that the camera sees, and between such a point and what a bounce from there \
         hits; each pair in both directions",
    );
    let pairs = of(names, Query::Visible, pairs, VISIBLE);

    let hard = |names, model: &Mesh32| {
        // Some rays run in planes of tiles, and are skipped.
        let rays = aimed_rays(model, 2 * count, 0.3);
        Set::new(names, Query::Nearest, &wide(model), rays, NEAREST, count)
    };
    let names = (
        "slivers",
        "48 cylinders as CAD systems triangulate them: fans of needles, and sides 12,000 times as long as wide; \
         rays through vertices, through middles of edges, and at random",
    );
    let slivers = hard(names, &cylinders());
    let names = ("tiles", "a wall of boxes in brick bond that touch each other; rays as for the slivers");
    let tiles = hard(names, &bricks());
    let (instances, national) = (instances::touching(count), national(count));
    vec![camera, bounces, aimed, slivers, tiles, instances, national, inside, pairs]
}

fn named(name: &str, faces: usize) -> Mesh32 {
    (catalogue::find(name).expect("a model of the catalogue").make)(faces as u32)
}

fn wide(model: &Mesh32) -> Surface {
    Surface::new(model.positions.iter().map(|p| p.map(f64::from)).collect(), model.triangles.clone())
}

/// A vector rounded to f32.
fn single(v: DVec3) -> [f64; 3] {
    v.to_array().map(|x| f64::from(x as f32))
}

pub(super) fn plain(origin: [f64; 3], direction: [f64; 3]) -> Question {
    Question { origin, direction, from: None, to: None }
}

fn of_ray(ray: &Ray) -> Question {
    plain(ray.origin.map(f64::from), ray.direction.map(f64::from))
}

/// As the other commands have models.
fn measured(Mesh32 { positions, triangles }: &Mesh32) -> Model {
    let (positions, triangles) = (positions.clone(), triangles.clone());
    Model::in_memory("", Mesh { positions, triangles, ..Mesh::default() })
}

fn camera_rays(model: &Mesh32, count: usize) -> Vec<Question> {
    let bounds = measured(model).bounds();
    let points: Vec<DVec3> = model.positions.iter().map(|p| position(*p)).collect();
    // Tiles of 4×4 pixels; three to two.
    let half = ((count as f64 / 6.0).sqrt() / 4.0).ceil() as u32 * 4;
    let (from, size) = (DVec3::new(0.8, 0.5, 1.0), (3 * half, 2 * half));
    let camera = Camera::framing(&points, bounds.center(), bounds.diagonal(), from, size);
    camera.rays().iter().map(of_ray).collect()
}

/// Rays exactly through vertices and middles of edges, in turn; a share of them at random instead.
fn aimed_rays(model: &Mesh32, count: usize, random: f64) -> Vec<Question> {
    let model = measured(model);
    let [vertices, edges] = [Target::Vertices, Target::Edges].map(|t| aimed_rays::rays(&model, t, count / 2));
    let mut rng = Rng::new(5);
    let (middle, radius) = (model.bounds().center(), 0.55 * model.bounds().diagonal());
    let both = vertices.into_iter().zip(edges).flat_map(|(a, b)| [a, b]);
    let aimed = |ray| {
        if rng.unit_f64() >= random {
            return of_ray(&ray);
        }
        let (p, q) = (middle + on_sphere(&mut rng) * radius, middle + on_sphere(&mut rng) * radius);
        plain(single(p), single((q - p).normalize()))
    };
    both.map(aimed).collect()
}

fn pairs(seen: &[Place], bounces: &Set, surface: &Surface) -> Vec<Question> {
    let mut rng = Rng::new(8);
    let other = |a: &Place| (*a, seen[rng.below(seen.len() as u64) as usize]);
    let random: Vec<_> = seen.iter().step_by(4).map(other).collect();
    let near = bounces.questions.iter().zip(bounces.places(surface));
    let near = near.filter_map(|(question, to)| Some((question.from?, to?))).step_by(2);
    let segment = |(a, b): (Place, Place)| {
        let ends = Question { from: Some(a), to: Some(b), ..plain([0.0; 3], [0.0; 3]) };
        Question { origin: a.point.to_array(), direction: (b.point - a.point).to_array(), ..ends }
    };
    // A triangle does not hide its points from each other; that would ask about offsets alone.
    let apart = |(a, b): &(Place, Place)| a.start.primitive != b.start.primitive;
    near.chain(random).filter(apart).flat_map(|(a, b)| [segment((a, b)), segment((b, a))]).collect()
}

/// A third of the points is random, a third has two coordinates of a vertex, so that rays along an
/// axis hit it, and a third is close to the surface.
fn points(surface: &Surface, count: usize) -> Vec<Question> {
    let mut rng = Rng::new(9);
    let point = |i: usize| {
        let random = DVec3::from_array([(); 3].map(|()| rng.between(-8.0, 8.0)));
        let id = rng.below(surface.triangles.len() as u64) as u32;
        let [a, b, c] = surface.corners(id).map(DVec3::from_array);
        let off = surface.normal(id) * [3e-5, -3e-5][rng.below(2) as usize];
        plain(single([random, a.with_z(random.z), (a + b + c) / 3.0 + off][i % 3]), [0.0; 3])
    };
    (0..count).map(point).collect()
}

/// Cylinders of 192 sides, 12 m long and 6 cm wide, nearly along axes.
fn cylinders() -> Mesh32 {
    const SIDES: u32 = 192;
    let (mut rng, mut model) = (Rng::new(3), Mesh32::default());
    for i in 0..48 {
        let along = (DVec3::AXES[i % 3] + on_sphere(&mut rng) * 0.02).normalize();
        let (side, up) = perpendicular(along);
        let middle = DVec3::from_array([(); 3].map(|()| rng.between(-6.0, 6.0)));
        let low = model.positions.len() as u32;
        let high = low + SIDES + 1;
        for center in [middle - along * 6.0, middle + along * 6.0] {
            let angle = |i: u32| (TAU * f64::from(i) / f64::from(SIDES)).sin_cos();
            let ring = (0..SIDES).map(|i| center + (side * angle(i).1 + up * angle(i).0) * 0.03);
            model.positions.extend(std::iter::once(center).chain(ring).map(|p| p.as_vec3().to_array()));
        }
        for (i, j) in (1..=SIDES).map(|i| (i, i % SIDES + 1)) {
            let (a, b, c, d) = (low + i, low + j, high + i, high + j);
            model.triangles.extend([[low, b, a], [high, c, d], [a, b, d], [a, d, c]]);
        }
    }
    model
}

/// Boxes in brick bond: eight coordinates of each, shared with no other box, so that they touch
/// with coplanar faces, T-junctions and common borders.
fn bricks() -> Mesh32 {
    const FACES: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut model = Mesh32::default();
    for brick in 0..12 * 12 * 12 {
        let [x, y, z] = [brick / 144, brick / 12 % 12, brick % 12].map(f64::from);
        let lower = DVec3::new(2.0 * x + z % 2.0, y + 0.5 * (z % 2.0), z) + 0.25;
        let first = model.positions.len() as u32;
        let corner =
            |i: u32| lower + DVec3::new(2.0 * f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
        model.positions.extend((0..8).map(|i| corner(i).as_vec3().to_array()));
        let triangles = FACES.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        model.triangles.extend(triangles.map(|t| t.map(|v| v + first)));
    }
    model
}

/// A building in national coordinates, turned by 23.4 degrees, and rays within it.
fn national(count: usize) -> Set {
    let hall = named("hall", count.clamp(2000, 20_000));
    let (sin, cos) = 23.4f64.to_radians().sin_cos();
    let place = |p: &[f32; 3]| {
        let [x, y, z] = p.map(f64::from);
        [5.5e6 + cos * x - sin * y, 4.2e5 + sin * x + cos * y, 300.0 + z]
    };
    let surface = Surface::new(hall.positions.iter().map(place).collect(), hall.triangles);
    let mut rng = Rng::new(4);
    let mut point = || {
        let id = rng.below(surface.triangles.len() as u64) as u32;
        let [a, b, c] = surface.corners(id).map(DVec3::from_array);
        a.lerp(b.lerp(c, rng.unit_f64()), rng.unit_f64().sqrt())
    };
    // From the middle between two points of surfaces, mostly in the building.
    let ray = |_| {
        let (origin, target) = (point().midpoint(point()), point());
        plain(origin.to_array(), (target - origin).normalize().to_array())
    };
    let names = (
        "national coordinates",
        "rays in a building at (5.5e6, 4.2e5, 300) m; vertices, origins and directions are f64",
    );
    let rays = (0..count + count / 8).map(ray).collect();
    Set { single: false, ..Set::new(names, Query::Nearest, &surface, rays, NEAREST, count) }
}
