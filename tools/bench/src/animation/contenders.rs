//! Trees over the triangles of a frame: refitted or built anew, ours and Embree's.

use super::frame_mesh::FrameMesh;
use crate::clock::Clock;
use crate::rivals::embree::{self, EmbreeScene};
use crate::structures::BATCH;
use crate::tracer::{Batch, Tracer};
use anyhow::Result;
use bth::rays::Hit;
use bth::{Scene, SceneBuilder};
use bth_compile::Silent;
use bth_compile::memory::{TriangleMesh, open};
use bth_compile::pipeline::{CompileOptions, Structure};

/// Names of the contenders.
pub(super) const NAMES: [&str; 4] = ["bth", "bth anew", "embree refit", "embree anew"];

/// Something that traces the rays of a frame.
pub(super) trait Contender {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]);
}

impl Contender for Scene {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (batch, hits) in batch.chunks(BATCH).zip(hits.chunks_mut(BATCH)) {
            self.batch(batch.rays).nearest(hits);
        }
    }
}

impl Contender for EmbreeScene {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        Tracer::nearest(self, batch, hits);
    }
}

/// The trees of a scene that moves.
pub(super) struct Trees {
    /// The compiled scene.
    pub(super) shown: Scene,
    /// The triangles of a frame, compiled for it and placed as they are.
    anew: Scene,
    /// Whether all instances are placed by the identity, so that both of ours have the same triangles, bit for bit.
    pub(super) same_triangles: bool,
    refit: EmbreeScene,
    rebuilt: EmbreeScene,
}

impl Trees {
    /// The trees of a scene at its first frame.
    pub(super) fn new(shown: Scene) -> Result<Trees> {
        let mesh = FrameMesh::of(&shown);
        let built =
            |variant| embree::build(embree::padded(&mesh.positions), mesh.triangles.clone(), variant, 1);
        let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let same_triangles = (0..shown.instance_count()).all(|row| shown.instance(row).to_world == identity);
        let (refit, rebuilt) = (built(&embree::REFIT)?, built(&embree::DEFAULT)?);
        Ok(Trees { anew: anew(&mesh)?, shown, same_triangles, refit, rebuilt })
    }

    /// Brings all trees to a frame; returns the seconds, by [`NAMES`].
    pub(super) fn bring_to(&mut self, frame: i32, mesh: &FrameMesh) -> Result<[f64; 4]> {
        self.shown.set_seconds(-1e3)?;
        let mut done = Ok(());
        let shown = &mut self.shown;
        let update = || Clock::ThreadCpu.time(|| done = shown.set_frame(frame).map(drop));
        let updating = rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(update);
        done?;
        let mut done = Ok(());
        let compiling = Clock::Wall.time(|| done = anew(mesh).map(|scene| self.anew = scene));
        done?;
        let [refitting, rebuilding] = [&mut self.refit, &mut self.rebuilt].map(|scene| {
            scene.store_positions(&mesh.positions);
            Clock::ThreadCpu.time(|| scene.commit_positions())
        });
        Ok([updating, compiling, refitting, rebuilding])
    }

    /// All of them, by [`NAMES`].
    pub(super) fn contenders(&self) -> [&dyn Contender; 4] {
        [&self.shown, &self.anew, &self.refit, &self.rebuilt]
    }
}

/// A scene of a mesh, compiled for it without tetrahedra, in a scene with an instance as compiled scenes have them.
fn anew(mesh: &FrameMesh) -> Result<Scene> {
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let triangles = TriangleMesh { positions: &mesh.positions, triangles: &mesh.triangles };
    let file = open(triangles, &options, &Silent)?;
    let mut builder = SceneBuilder::new();
    let object = builder.add(&file);
    builder.instance(object, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0])?;
    builder.commit()?;
    Ok(builder.into_scene())
}
