//! The engines: what each is, how it leaves a surface, and how it is run.

use super::judge::EngineAnswer;
use super::process::Process;
use super::sets::{Place, Query, Question, Set};
use crate::clock::Clock;
use crate::model::Model;
use crate::rivals::{RIVALS, embree};
use crate::scenes::Placed;
use crate::structures::{BATCH, BTH};
use crate::tracer::{Batch, Tracer};
use anyhow::{Context, Result, anyhow, bail};
use bth::rays::{Hit, Ray, Ray64, Start, StartRay};
use bth::{Scene, TraceRay};
use bth_compile::memory::{self, PositionRows, TriangleMesh};
use bth_compile::{Silent, pipeline::CompileOptions};
use bth_import::{Mesh, Positions};
use glam::DVec3;
use serde::Deserialize;
use std::sync::Arc;

/// An engine, as `truth/engines.toml` lists it.
#[derive(Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Engine {
    /// Name in tables.
    pub(super) name: String,
    /// Where it comes from.
    pub(super) source: String,
    how: How,
    /// The numbers in which it computes.
    pub(super) computes: String,
    /// True if it is given rays in f32.
    pub(super) single: bool,
    /// It is asked one in this many of the queries, as it is slow.
    pub(super) one_in: usize,
    offset: Offset,
    /// Who says what offset.
    pub(super) offset_source: String,
}

impl Default for Engine {
    fn default() -> Engine {
        Engine {
            name: String::new(),
            source: String::new(),
            how: How::Ours,
            computes: "f32".to_owned(),
            single: true,
            one_in: 1,
            offset: Offset::Diagonal(1e-4),
            offset_source: "none is documented: 1e-4 of the diagonal along the ray".to_owned(),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum How {
    Ours,
    /// A rival of `speed`, by its name there.
    Rival(String),
    /// A program of the folder of engines.
    Program(String),
}

/// How far off the surface a ray starts that leaves it.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Offset {
    /// Not at all: the start is exact, or the engine is told the triangle to skip.
    None,
    /// Along the normal.
    Normal(f64),
    /// Along the new ray.
    Ray(f64),
    /// Back along the ray that came.
    Back(f64),
    /// Along the new ray, by this part of the model's diagonal.
    Diagonal(f64),
    /// Along the normal by 32 ulps of the largest coordinate or the way, where t begins, too.
    Ulps,
}

/// A query as an engine gets it: a ray, a point, or the segment from the origin by the direction.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    /// Row of the question in its set.
    pub(super) row: usize,
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    begin: f64,
    end: f64,
}

/// An engine that runs.
pub(super) trait Running {
    /// Builds the structure and keeps the queries.
    fn load(&mut self, set: &Set, asked: &[Asked]) -> Result<()>;
    /// Answers all queries; returns the seconds of processor time.
    fn run(&mut self) -> Result<(f64, Vec<EngineAnswer>)>;
}

impl Engine {
    /// All engines, ours first.
    pub(super) fn all() -> Result<Vec<Engine>> {
        #[derive(Deserialize)]
        struct File {
            engines: Vec<Engine>,
        }
        Ok(toml::from_str::<File>(include_str!("../../truth/engines.toml"))?.engines)
    }

    /// Returns true for bth with the caller's own numbers.
    pub(super) fn is_ours(&self) -> bool {
        matches!(self.how, How::Ours) && !self.single
    }

    /// Starts the engine.
    pub(super) fn start(&self) -> Result<Box<dyn Running>> {
        Ok(match &self.how {
            How::Ours => Box::new(Ours { single: self.single, ..Ours::default() }),
            How::Rival(name) => Box::new(LinkedRival { name: name.clone(), ..LinkedRival::default() }),
            How::Program(program) => Box::new(Process::start(program, &self.name)?),
        })
    }

    /// The queries of a set as this engine is asked them.
    pub(super) fn asked(&self, set: &Set) -> Vec<Asked> {
        let diagonal = set.diagonal();
        // Pairs stay together.
        let rows = (0..set.questions.len()).filter(|row| (row / 2).is_multiple_of(self.one_in));
        let asked = |row| {
            let Question { origin, direction, from, to } = &set.questions[row];
            let (origin, direction) = (DVec3::from_array(*origin), DVec3::from_array(*direction));
            let Some(from) = from else {
                return Asked { row, origin, direction, begin: 0.0, end: f64::INFINITY };
            };
            let unit = direction.normalize();
            let (origin, begin) = self.offset_start(from, unit, diagonal);
            let Some(to) = to else { return Asked { row, origin, direction, begin, end: f64::INFINITY } };
            let direction = self.offset_start(to, -unit, diagonal).0 - origin;
            Asked { row, origin, direction, begin: begin / direction.length(), end: 1.0 }
        };
        rows.map(asked).collect()
    }

    /// The start of a ray that leaves a place in a unit direction, and where its range begins.
    fn offset_start(&self, place: &Place, direction: DVec3, diagonal: f64) -> (DVec3, f64) {
        let rounded = |v: DVec3| if self.single { v.as_vec3().as_dvec3() } else { v };
        let point = rounded(place.point);
        let to_side = place.normal * place.normal.dot(direction).signum();
        let (by, begin) = match self.offset {
            Offset::None => (DVec3::ZERO, 0.0),
            Offset::Normal(by) => (to_side * by, 0.0),
            Offset::Ray(by) => (direction * by, 0.0),
            Offset::Back(by) => (place.back * by, 0.0),
            Offset::Diagonal(by) => (direction * (by * diagonal), 0.0),
            Offset::Ulps => {
                let by = 32.0 * f64::from(f32::EPSILON) * point.abs().max_element().max(place.travelled);
                (to_side * by, by)
            }
        };
        (rounded(point + by), begin)
    }
}

impl Asked {
    fn ray(&self) -> Ray {
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        Ray::new(narrow(self.origin), narrow(self.direction)).with_range(self.begin as f32, self.end as f32)
    }
}

/// The answer that a hit is; each instance has `triangles`.
fn answer(hit: &Hit, t: f64, triangles: u32) -> EngineAnswer {
    if hit.is_hit() {
        EngineAnswer { t, id: hit.primitive.instance * triangles + hit.primitive.triangle }
    } else {
        EngineAnswer::MISS
    }
}

/// Triangles of the object of a set's instances.
fn of_instance(set: &Set) -> u32 {
    set.scene.as_ref().map_or(0, |scene| scene.object(0).header.triangles)
}

/// Ours, as users are advised: rays from surfaces start at exact points, and what is in f64 stays
/// so.
#[derive(Default)]
struct Ours {
    /// True if everything is rounded to f32.
    single: bool,
    loaded: Option<(Arc<Scene>, Query)>,
    of_instance: u32,
    rays: Vec<Ray>,
    /// The same in f64, if the set is in f64.
    wide: Vec<Ray64>,
    starts: Vec<StartRay>,
    ends: Vec<Start>,
    points: Vec<[f32; 3]>,
}

impl Running for Ours {
    fn load(&mut self, set: &Set, asked: &[Asked]) -> Result<()> {
        if self.single && set.single {
            bail!("as bth");
        }
        let positions = if self.single { Positions::F32 } else { Positions::Auto };
        let options = CompileOptions { positions, ..BTH.options() };
        let mesh = TriangleMesh { positions: PositionRows::F64(&set.positions), triangles: &set.triangles };
        let scene = match &set.scene {
            Some(scene) => scene.clone(),
            None => Arc::new(memory::open(mesh, &options, &Silent)?),
        };
        self.loaded = Some((scene, set.query));
        self.of_instance = of_instance(set);
        self.rays = asked.iter().map(Asked::ray).collect();
        let wide = |of: &Asked| Ray64::new(of.origin.to_array(), of.direction.to_array());
        let is_wide = !self.single && !set.single;
        self.wide = asked.iter().filter(|_| is_wide).map(wide).collect();
        self.points = self.rays.iter().map(|ray| ray.origin).collect();
        let questions = || asked.iter().map(|asked| &set.questions[asked.row]).zip(&self.rays);
        self.starts = questions().filter_map(|(q, ray)| Some(q.from?.start.ray(ray.direction))).collect();
        self.ends = questions().filter_map(|(q, _)| Some(q.to?.start)).collect();
        Ok(())
    }

    fn run(&mut self) -> Result<(f64, Vec<EngineAnswer>)> {
        let (scene, query) = self.loaded.as_ref().context("nothing is loaded")?;
        let mut hits = vec![Hit::MISS; self.rays.len()];
        let mut flags = vec![false; self.rays.len()];
        let mut exact = vec![0.0; self.wide.len()];
        let seconds = Clock::ThreadCpu.time(|| match query {
            Query::Inside => scene.contains_batch(&self.points, &mut flags),
            Query::Visible => {
                for ((a, b), flag) in self.starts.iter().zip(&self.ends).zip(&mut flags) {
                    *flag = scene.visible(a.start, *b);
                }
            }
            Query::Nearest if !self.starts.is_empty() => trace(scene, &self.starts, &mut hits),
            Query::Nearest if !self.wide.is_empty() => {
                trace(scene, &self.wide, &mut hits);
                for ((ray, hit), t) in self.wide.iter().zip(&hits).zip(&mut exact) {
                    *t = scene.hit_f64(ray, hit).t;
                }
            }
            Query::Nearest => trace(scene, &self.rays, &mut hits),
        });
        let t = |(i, hit): (usize, &Hit)| exact.get(i).copied().unwrap_or(hit.t.into());
        let answers = match query {
            Query::Nearest => {
                hits.iter().enumerate().map(|of| answer(of.1, t(of), self.of_instance)).collect()
            }
            _ => flags.into_iter().map(EngineAnswer::flag).collect(),
        };
        Ok((seconds, answers))
    }
}

fn trace<R: TraceRay>(scene: &Scene, rays: &[R], hits: &mut [Hit]) {
    for (rays, hits) in rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
        scene.batch(rays).nearest(hits);
    }
}

/// A rival of `speed`.
#[derive(Default)]
struct LinkedRival {
    name: String,
    loaded: Option<(Box<dyn Tracer>, Query, Vec<Ray>)>,
    of_instance: u32,
    coherent: bool,
}

impl LinkedRival {
    fn build(&self, set: &Set) -> Result<Box<dyn Tracer>> {
        let variant = match &*self.name {
            "embree" => Some(embree::DEFAULT),
            "embree robust" => Some(embree::ROBUST),
            _ => None,
        };
        if let (Some(scene), Some(variant)) = (&set.scene, variant) {
            return Ok(Box::new(Placed::of(scene).build(&variant, 1)?));
        }
        let bth_scenes::Model { positions, triangles } = set.model();
        let model = Model::in_memory("", Mesh { positions, triangles, ..Mesh::default() });
        let rival = RIVALS.iter().find(|rival| rival.name == self.name).context("no such rival")?;
        Ok(rival.build(&model, 1)?.tracer)
    }
}

impl Running for LinkedRival {
    fn load(&mut self, set: &Set, asked: &[Asked]) -> Result<()> {
        if set.query == Query::Inside {
            bail!("has no such query");
        }
        let rays = asked.iter().map(Asked::ray).collect();
        // Crates may panic.
        let build = std::panic::AssertUnwindSafe(|| self.build(set));
        let tracer = std::panic::catch_unwind(build).map_err(|_| anyhow!("panics"))??;
        self.loaded = Some((tracer, set.query, rays));
        self.of_instance = of_instance(set);
        self.coherent = set.coherent;
        Ok(())
    }

    fn run(&mut self) -> Result<(f64, Vec<EngineAnswer>)> {
        let (tracer, query, rays) = self.loaded.as_ref().context("nothing is loaded")?;
        let batch = Batch { rays, starts: None, coherent: self.coherent };
        if *query == Query::Visible {
            let mut blocked = vec![false; rays.len()];
            let seconds = Clock::ThreadCpu.time(|| tracer.any(batch, &mut blocked));
            return Ok((seconds, blocked.into_iter().map(|blocked| EngineAnswer::flag(!blocked)).collect()));
        }
        let mut hits = vec![Hit::MISS; rays.len()];
        let seconds = Clock::ThreadCpu.time(|| tracer.nearest(batch, &mut hits));
        let found = |hit: &Hit| answer(hit, hit.t.into(), self.of_instance);
        Ok((seconds, hits.iter().map(found).collect()))
    }
}
