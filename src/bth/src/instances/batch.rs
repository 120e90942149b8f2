//! Batches of rays through the instances: in rounds, sorted by object, so that each object gets many
//! rays at once.

use super::World;
use super::affine::ObjectRay;
use super::placed::Placed;
use super::walk::Walk;
use crate::file::File;
use crate::layout::NONE;
use crate::object::ObjectView;
use crate::rays::{Hit, Ray, Surface};
use crate::simd::{Isa, Kernel, Simd};
use crate::trace::{self, Scratch, Steps};
use std::cell::RefCell;

/// Rays that are under way together.
const CHUNK: usize = 1024;
/// Rays through one instance from which on they are traced apart from those through others: enough for a packet, if they go
/// together.
const PACKET: usize = 64;

/// A ray that is to be traced through an instance in this round.
#[derive(Clone, Copy, Debug)]
struct Visit {
    object: u32,
    ray: u32,
    instance: u32,
}

/// What a query makes of rays in an object.
trait Query {
    /// The greatest t of a ray that is still of interest; `None` when nothing is.
    fn tmax(&self, ray: usize) -> Option<f32>;
    /// Traces the visits of one object.
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]);
}

/// What the visits of a round share.
struct Round<'a> {
    world: &'a World,
    file: &'a File,
    rays: &'a [Ray],
    from: Option<&'a [Surface]>,
}

impl Round<'_> {
    /// The ray of a visit in the object's space.
    fn object_ray(&self, visit: Visit, tmax: f32) -> ObjectRay {
        self.world.placed_at(visit.instance).inverse.ray(&Ray { tmax, ..self.rays[visit.ray as usize] })
    }

    fn hint(&self, ray: usize, instance: u32) -> u32 {
        let from = self.from.map_or(Surface::NONE, |f| f[ray]);
        if from.instance == instance { from.triangle } else { NONE }
    }
}

/// Rays under way, whose memory a thread keeps.
#[derive(Default)]
struct Ways {
    /// Of each ray of a chunk.
    walks: Vec<Walk>,
    /// The rays that go on.
    active: Vec<u32>,
    visits: Visits,
}

/// What rays are to be traced through.
#[derive(Default)]
struct Visits {
    /// In order of the rays.
    all: Vec<Visit>,
    /// By instance.
    sorted: Vec<Visit>,
    /// Those through instances that few rays visit.
    few: Vec<Visit>,
    /// Where those of each instance go.
    place: Vec<u32>,
}

impl Visits {
    /// Fills `sorted`: by instance, of one in order of the rays.
    fn sort(&mut self, instances: usize) {
        let Visits { all, sorted, place, .. } = self;
        sorted.clear();
        if instances > 4 * all.len() {
            sorted.extend_from_slice(all);
            sorted.sort_unstable_by_key(|v| (v.instance, v.ray));
            return;
        }
        place.clear();
        place.resize(instances, 0);
        for visit in &*all {
            place[visit.instance as usize] += 1;
        }
        let mut next = 0;
        for count in &mut *place {
            next += std::mem::replace(count, next);
        }
        sorted.resize(all.len(), Visit { object: 0, ray: 0, instance: 0 });
        for visit in all {
            let at = &mut place[visit.instance as usize];
            sorted[*at as usize] = *visit;
            *at += 1;
        }
    }
}

thread_local! {
    static WAYS: RefCell<Ways> = RefCell::default();
}

/// Takes each ray that is under way to its next instance; those that have come to their end are under way no more.
struct Advance<'a, Q> {
    round: &'a Round<'a>,
    query: &'a Q,
    /// The ray of the first walk.
    first: usize,
    walks: &'a mut [Walk],
    active: &'a mut Vec<u32>,
    visits: &'a mut Visits,
}

impl<Q: Query> Kernel for Advance<'_, Q> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let world = self.round.world;
        let mut kept = 0;
        for at in 0..self.active.len() {
            let i = self.active[at];
            let ray = i as usize;
            let Some(tmax) = self.query.tmax(ray) else { continue };
            let walk = &mut self.walks[ray - self.first];
            let mut next = walk.next(s, &world.top, tmax);
            // There it has been.
            if next.is_some() && next == world.start_of(self.round.from, ray) {
                next = walk.next(s, &world.top, tmax);
            }
            let Some(instance) = next else { continue };
            self.visits.all.push(world.visit(ray, instance));
            self.active[kept] = i;
            kept += 1;
        }
        self.active.truncate(kept);
    }
}

impl World {
    /// Nearest hits; of equal t the instance of least number is reported.
    pub(crate) fn nearest(&self, file: &File, rays: &[Ray], from: Option<&[Surface]>, hits: &mut [Hit]) {
        hits.fill(Hit::MISS);
        trace::with_scratch(|scratch| {
            let mut query = Nearest { rays, hits, scratch, batch: Batch::default() };
            self.run(file, rays, from, &mut query);
        });
    }

    /// Whether anything is hit.
    pub(crate) fn any(&self, file: &File, rays: &[Ray], from: Option<&[Surface]>, found: &mut [bool]) {
        found.fill(false);
        trace::with_scratch(|scratch| {
            let mut query = Any { rays, found, scratch, batch: Batch::default() };
            self.run(file, rays, from, &mut query);
        });
    }

    /// As [`Self::nearest`] for one ray, with a count of the work within objects.
    pub(crate) fn nearest_counted(&self, file: &File, ray: &Ray, from: Surface) -> (Hit, Steps) {
        let mut query = Counted { ray, best: Hit::MISS, steps: Steps::default() };
        self.run(file, std::slice::from_ref(ray), Some(&[from]), &mut query);
        (query.best, query.steps)
    }

    fn run(&self, file: &File, rays: &[Ray], from: Option<&[Surface]>, query: &mut impl Query) {
        let round = Round { world: self, file, rays, from };
        // Taken out while they are in use, so that a panic leaves nothing half done behind.
        let mut ways = WAYS.take();
        let isa = Isa::chosen();
        for first in (0..rays.len()).step_by(CHUNK) {
            let end = (first + CHUNK).min(rays.len());
            let Ways { walks, active, visits } = &mut ways;
            walks.resize_with(walks.len().max(end - first), Walk::default);
            active.clear();
            visits.all.clear();
            // The instance that a ray starts on comes first: its answer shortens the ray at little cost.
            for i in first..end {
                if walks[i - first].start(&rays[i], &self.top) {
                    active.push(i as u32);
                    visits.all.extend(self.start_of(from, i).map(|instance| self.visit(i, instance)));
                }
            }
            self.trace(&round, query, visits);
            while !active.is_empty() {
                isa.run(Advance { round: &round, query, first, walks, active, visits });
                self.trace(&round, query, visits);
            }
        }
        WAYS.set(ways);
    }

    /// The instance that a ray is said to start on, if it can be seen.
    fn start_of(&self, from: Option<&[Surface]>, ray: usize) -> Option<u32> {
        let instance = from?[ray].instance;
        self.placed.get(instance as usize)?.is_some().then_some(instance)
    }

    fn visit(&self, ray: usize, instance: u32) -> Visit {
        Visit { object: self.placed_at(instance).object(), ray: ray as u32, instance }
    }

    /// The place of an instance that the top level holds.
    fn placed_at(&self, instance: u32) -> &Placed {
        self.placed[instance as usize].as_ref().expect("the top level holds instances with a place")
    }

    fn trace(&self, round: &Round<'_>, query: &mut impl Query, visits: &mut Visits) {
        // In the space of one instance neighbours stay neighbours, and take the same way.
        visits.sort(self.placed.len());
        let mut trace = |visits: &[Visit]| {
            self.touch(visits[0].object);
            let object = round.file.view(visits[0].object).expect("checked when opened");
            query.trace(round, object, visits);
        };
        visits.few.clear();
        for same in visits.sorted.chunk_by(|a, b| a.instance == b.instance) {
            if same.len() >= PACKET {
                trace(same);
            } else {
                visits.few.extend_from_slice(same);
            }
        }
        visits.few.sort_by_key(|v| v.object);
        visits.few.chunk_by(|a, b| a.object == b.object).for_each(trace);
        visits.all.clear();
    }
}

/// Rays that go through an object together.
#[derive(Default)]
struct Batch {
    visits: Vec<(Visit, f32)>,
    rays: Vec<Ray>,
    /// The triangle that each starts on.
    from: Vec<u32>,
    hits: Vec<Hit>,
    found: Vec<bool>,
}

impl Batch {
    fn clear(&mut self) {
        self.visits.clear();
        self.rays.clear();
        self.from.clear();
    }
    fn push(&mut self, visit: Visit, ray: ObjectRay, from: u32) {
        self.visits.push((visit, ray.t_scale));
        self.rays.push(ray.ray);
        self.from.push(from);
    }
    /// The triangles that rays start on, if that is of use: only in tetrahedra it is.
    fn hints(&self, object: &ObjectView<'_>) -> Option<&[u32]> {
        let some = !object.tet_leaves.is_empty() && self.from.iter().any(|from| *from != NONE);
        some.then_some(&self.from)
    }
}

struct Nearest<'a> {
    rays: &'a [Ray],
    hits: &'a mut [Hit],
    scratch: &'a mut Scratch,
    batch: Batch,
}

/// t of the world from t of an object; its own where they are the same.
fn world_t(t: f32, scale: f32) -> f32 {
    if scale == 1.0 { t } else { t * scale }
}

/// The better of two hits: least t, then least instance. A t that scaling moved out of the range is none.
fn better(ray: &Ray, best: &Hit, hit: &Hit, scale: f32) -> Option<Hit> {
    if !hit.is_hit() {
        return None;
    }
    let hit = Hit { t: world_t(hit.t, scale), ..*hit };
    let in_range = ray.tmin <= hit.t && hit.t <= ray.tmax && hit.is_hit();
    let nearer = hit.t < best.t || hit.t == best.t && hit.surface.instance < best.surface.instance;
    (in_range && nearer).then_some(hit)
}

impl Query for Nearest<'_> {
    fn tmax(&self, ray: usize) -> Option<f32> {
        Some(self.rays[ray].tmax.min(self.hits[ray].t))
    }
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]) {
        if visits.len() < trace::FEW {
            for &visit in visits {
                let i = visit.ray as usize;
                let ray = round.object_ray(visit, round.rays[i].tmax.min(self.hits[i].t));
                let from = round.hint(i, visit.instance);
                let hit = trace::nearest(object, &ray.ray, from, visit.instance, self.scratch);
                self.hits[i] =
                    better(&round.rays[i], &self.hits[i], &hit, ray.t_scale).unwrap_or(self.hits[i]);
            }
            return;
        }
        self.batch.clear();
        for &visit in visits {
            let i = visit.ray as usize;
            let ray = round.object_ray(visit, round.rays[i].tmax.min(self.hits[i].t));
            self.batch.push(visit, ray, round.hint(i, visit.instance));
        }
        let mut hits = std::mem::take(&mut self.batch.hits);
        hits.clear();
        hits.resize(visits.len(), Hit::MISS);
        let batch = &self.batch;
        trace::nearest_batch(object, &batch.rays, batch.hints(object), 0, self.scratch, &mut hits);
        for (&(visit, scale), hit) in batch.visits.iter().zip(&mut hits) {
            if hit.is_hit() {
                hit.surface.instance = visit.instance;
                let i = visit.ray as usize;
                self.hits[i] = better(&round.rays[i], &self.hits[i], hit, scale).unwrap_or(self.hits[i]);
            }
        }
        self.batch.hits = hits;
    }
}

struct Any<'a> {
    rays: &'a [Ray],
    found: &'a mut [bool],
    scratch: &'a mut Scratch,
    batch: Batch,
}

impl Query for Any<'_> {
    fn tmax(&self, ray: usize) -> Option<f32> {
        (!self.found[ray]).then(|| self.rays[ray].tmax)
    }
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]) {
        if visits.len() < trace::FEW {
            for &visit in visits {
                let i = visit.ray as usize;
                let (ray, from) = (round.object_ray(visit, self.rays[i].tmax), round.hint(i, visit.instance));
                self.found[i] |= trace::any(object, &ray.ray, from, self.scratch);
            }
            return;
        }
        self.batch.clear();
        for &visit in visits {
            let i = visit.ray as usize;
            let ray = round.object_ray(visit, self.rays[i].tmax);
            self.batch.push(visit, ray, round.hint(i, visit.instance));
        }
        let mut found = std::mem::take(&mut self.batch.found);
        found.clear();
        found.resize(visits.len(), false);
        let batch = &self.batch;
        trace::any_batch(object, &batch.rays, batch.hints(object), self.scratch, &mut found);
        for ((visit, _), found) in batch.visits.iter().zip(&found) {
            self.found[visit.ray as usize] |= *found;
        }
        self.batch.found = found;
    }
}

struct Counted<'a> {
    ray: &'a Ray,
    best: Hit,
    steps: Steps,
}

impl Query for Counted<'_> {
    fn tmax(&self, _: usize) -> Option<f32> {
        Some(self.ray.tmax.min(self.best.t))
    }
    fn trace(&mut self, round: &Round<'_>, object: &ObjectView<'_>, visits: &[Visit]) {
        for &visit in visits {
            let object_ray = round.object_ray(visit, self.ray.tmax.min(self.best.t));
            let from = round.hint(visit.ray as usize, visit.instance);
            let (hit, more) = trace::nearest_counted(object, &object_ray.ray, from, visit.instance);
            self.steps += more;
            self.best = better(self.ray, &self.best, &hit, object_ray.t_scale).unwrap_or(self.best);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::affine::Affine;
    use super::*;
    use crate::testing::Rng;

    const FILES: [&[u8]; 2] = [
        include_bytes!("../../../../format-spec/conformance/valid/two-objects.bth"),
        include_bytes!("../../../../format-spec/conformance/valid/two-levels.bth"),
    ];

    fn unit(rng: &mut Rng) -> f64 {
        rng.below(1 << 30) as f64 / (1u64 << 29) as f64 - 1.0
    }

    /// Rigid, scaled, mirrored, sheared, and often on a coarse grid, so that rays meet edges exactly.
    fn transform(rng: &mut Rng, spread: f64) -> Affine {
        let coarse = rng.below(3) == 0;
        let number = |rng: &mut Rng| if coarse { (unit(rng) * 2.0).round() } else { unit(rng) };
        let mut parts = [0.0; 10];
        parts.iter_mut().for_each(|x| *x = number(rng));
        parts[6] += 1.5;
        parts[7..].iter_mut().for_each(|x| *x += x.signum() * 0.01 + 0.02);
        parts[..3].iter_mut().for_each(|x| *x *= spread);
        let mut affine = Affine::from_parts(&parts);
        if rng.below(4) == 0 {
            let (row, column) = (rng.below(3) as usize, rng.below(3) as usize);
            affine.linear[row][column] += number(rng) * 50.0;
        }
        affine
    }

    fn world(file: &File, rng: &mut Rng, count: usize) -> (World, Vec<Affine>) {
        let spread = [0.0, 1.0, 4.0, 1e4][rng.below(4) as usize];
        let transforms: Vec<Affine> = (0..count).map(|_| transform(rng, spread)).collect();
        let place = |transform: &Affine, number: u64| {
            let number = (number % u64::from(file.object_count())) as u32;
            Placed::new(transform, number, file.object_header(number)).ok()
        };
        let placed = transforms.iter().map(|t| place(t, rng.next()).filter(|_| rng.below(8) > 0)).collect();
        (World::of_places(placed, file.object_count()), transforms)
    }

    /// All instances, one after another, without the top level.
    fn brute(world: &World, file: &File, ray: &Ray) -> Hit {
        let mut best = Hit::MISS;
        for (number, placed) in world.placed.iter().enumerate() {
            let Some(placed) = placed else { continue };
            let object = placed.inverse.ray(ray);
            let view = file.object(placed.object()).unwrap();
            let hit = trace::nearest(&view, &object.ray, NONE, number as u32, &mut Scratch::default());
            best = better(ray, &best, &hit, object.t_scale).unwrap_or(best);
        }
        best
    }

    fn rays(rng: &mut Rng, transforms: &[Affine], count: usize) -> Vec<Ray> {
        let targets = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.25, 0.0], [0.2, 0.3, 0.0]];
        (0..count)
            .map(|i| {
                let transform = &transforms[rng.below(transforms.len() as u64) as usize];
                let target = transform.apply(targets[rng.below(5) as usize]);
                // From close by to so far away that the boxes must be widened for the ray.
                let away = [0.0, 1.0, 10.0, 1e3, 1e5, 1e7, 1e12][rng.below(7) as usize];
                let mut origin = [0, 1, 2].map(|k| (target[k] + unit(rng) * away) as f32);
                if rng.below(3) == 0 {
                    let k = rng.below(3) as usize;
                    origin[k] = target[k] as f32;
                }
                let scale = [1.0, 1e-20, 1e15, 0.3][i % 4];
                let direction = [0, 1, 2].map(|k| ((target[k] - f64::from(origin[k])) * scale) as f32);
                let (tmin, tmax) = match rng.below(5) {
                    0 => (0.0, (1.0 / scale) as f32),
                    1 => ((1.0 / scale) as f32, f32::INFINITY),
                    2 => (f32::NEG_INFINITY, f32::INFINITY),
                    _ => (0.0, f32::INFINITY),
                };
                Ray { origin, tmin, direction, tmax }
            })
            .collect()
    }

    #[test]
    fn the_top_level_and_hints_change_no_answer() {
        let mut rng = Rng(11);
        let (mut hits_seen, mut far_hits, mut all) = (0, 0, 0);
        for round in 0..600 {
            let file = File::from_bytes(FILES[round % 2]).unwrap();
            let count = [1, 2, 7, 16, 17, 40, 300][round % 7];
            let (world, transforms) = world(&file, &mut rng, count);
            let rays = rays(&mut rng, &transforms, 40);
            let from: Vec<Surface> = rays
                .iter()
                .map(|_| Surface {
                    instance: rng.below(count as u64 + 2) as u32,
                    triangle: rng.below(3) as u32,
                })
                .collect();
            for from in [None, Some(from.as_slice())] {
                let mut hits = vec![Hit::MISS; rays.len()];
                let mut found = vec![false; rays.len()];
                world.nearest(&file, &rays, from, &mut hits);
                world.any(&file, &rays, from, &mut found);
                for (i, ray) in rays.iter().enumerate() {
                    let expected = brute(&world, &file, ray);
                    assert_eq!(hits[i], expected, "round {round}, ray {i}: {ray:?}");
                    assert_eq!(found[i], expected.is_hit(), "round {round}, ray {i}: {ray:?}");
                    if i % 8 == 0 {
                        assert_eq!(world.nearest_counted(&file, ray, Surface::NONE).0, expected);
                    }
                    let start = ray.origin.iter().fold(0.0f32, |m, x| m.max(x.abs()));
                    far_hits += u32::from(expected.is_hit() && start > world.top.reach);
                    hits_seen += u32::from(expected.is_hit());
                    all += 1;
                }
            }
        }
        assert!(hits_seen > all / 3 && far_hits > 500, "{hits_seen} of {all} hit, {far_hits} from afar");
    }

    #[test]
    fn rays_without_a_line_hit_nothing() {
        let file = File::from_bytes(FILES[0]).unwrap();
        let world = world(&file, &mut Rng(3), 50).0;
        let good = Ray { origin: [0.0; 3], tmin: 0.0, direction: [1.0; 3], tmax: 1.0 };
        for ray in [
            Ray { origin: [f32::NAN, 0.0, 0.0], ..good },
            Ray { direction: [0.0, -0.0, 0.0], ..good },
            Ray { direction: [f32::INFINITY, 0.0, 0.0], ..good },
            Ray { tmin: 2.0, ..good },
            Ray { tmax: f32::NAN, ..good },
            Ray { tmin: f32::NAN, ..good },
        ] {
            let (mut hit, mut found) = ([Hit::MISS], [true]);
            world.nearest(&file, &[ray], None, &mut hit);
            world.any(&file, &[ray], None, &mut found);
            assert_eq!((hit[0], found[0]), (Hit::MISS, false), "{ray:?}");
        }
    }
}
