//! The contenders of `scenes`: our compiled scenes, scenes whose instances the program places, and
//! Embree's.

use super::source::Source;
use crate::rivals::embree::{self, EmbreeMesh, EmbreeScene, InstancePlace, Variant};
use crate::structures::{self, BATCH, Kind};
use crate::tracer::{Batch, Tracer};
use anyhow::{Context, Result, bail};
use bth::rays::Hit;
use bth::{Scene, SceneBuilder};
use std::time::Instant;

/// All contenders. Those from the fourth on need scenes whose objects do not deform.
pub(super) const NAMES: [&str; 7] =
    ["bth", "bvh", "bth single", "bth placed", "embree", "embree robust", "embree hq packet16"];

/// The contenders for a scene.
pub(super) fn names(shown: &Scene) -> &'static [&'static str] {
    let deforms = (0..shown.object_count()).any(|o| shown.positions(o) != shown.object(o).positions);
    if deforms { &NAMES[..3] } else { &NAMES }
}

/// A frame and the transforms of all instances.
pub(super) struct Frame {
    pub(super) number: i32,
    pub(super) places: Vec<InstancePlace>,
}

/// The transforms of all instances of a scene at its current time.
pub(super) fn places(scene: &Scene) -> Vec<InstancePlace> {
    let instances = (0..scene.instance_count()).map(|i| scene.instance(i));
    instances.map(|i| i.visible.then(|| i.to_world.map(|row| row.map(|x| x as f32)))).collect()
}

/// The objects and instances of a scene as Embree takes them.
pub(crate) struct Placed {
    pub(crate) objects: Vec<EmbreeMesh>,
    object_of: Vec<u32>,
    places: Vec<InstancePlace>,
}

impl Placed {
    /// Those of a scene at its current time.
    pub(crate) fn of(scene: &Scene) -> Placed {
        let objects = (0..scene.object_count()).map(|i| scene.object(i));
        Placed {
            objects: objects.map(|o| (embree::padded(o.positions), o.triangles.to_vec())).collect(),
            object_of: (0..scene.instance_count()).map(|i| scene.object_of(i)).collect(),
            places: places(scene),
        }
    }

    /// Builds Embree's scene of these instances.
    pub(crate) fn build(self, variant: &Variant, threads: usize) -> Result<EmbreeScene> {
        let mut scene = embree::build_instances(self.objects, &self.object_of, variant, threads)?;
        scene.place(&self.places);
        Ok(scene)
    }
}

/// A scene that can be set to a frame and traced.
pub(super) trait Moving: Send {
    /// Does what is not measured, so that the next frame needs a whole update.
    fn prepare(&mut self) -> Result<()> {
        Ok(())
    }
    /// Sets a frame; returns the seconds of its positions and refit, if known.
    fn show(&mut self, frame: &Frame) -> Result<f64>;
    /// Nearest hits.
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]);
}

/// A contender.
pub(super) struct MovingContender {
    pub(super) name: &'static str,
    pub(super) ours: bool,
    /// True if its answers must be the plain BVH's, to the last bit.
    pub(super) exact: bool,
    pub(super) moving: Box<dyn Moving>,
    pub(super) build_s: f64,
}

/// The plain BVH of a scene. Its hits are what later rays start from, and others are compared with
/// it.
pub(super) fn plain(source: &Source) -> Result<Scene> {
    opened(source, &structures::BVH)
}

fn opened(source: &Source, kind: &Kind) -> Result<Scene> {
    bth::from_bytes(&source.compile(&kind.options())?.bytes).context("a file that was just compiled")
}

/// Builds a contender; those that do not compile the scene take its geometry from `shown`.
pub(super) fn build(
    source: &Source,
    name: &'static str,
    shown: &Scene,
    threads: usize,
) -> Result<MovingContender> {
    let start = Instant::now();
    let instances = |variant: &Variant| -> Result<Box<dyn Moving>> {
        Ok(Box::new(Placed::of(shown).build(variant, threads)?))
    };
    let moving: Box<dyn Moving> = match name {
        "bth" => Box::new(CompiledScene { scene: opened(source, &structures::BTH)?, batch: BATCH }),
        "bvh" => Box::new(CompiledScene { scene: plain(source)?, batch: BATCH }),
        "bth single" => Box::new(CompiledScene { scene: opened(source, &structures::BTH)?, batch: 1 }),
        "bth placed" => Box::new(PlacedScene::new(shown, &plain(source)?)?),
        "embree" => instances(&embree::DEFAULT)?,
        "embree robust" => instances(&embree::ROBUST)?,
        "embree hq packet16" => instances(&embree::PACKETS)?,
        _ => bail!("there is no {name}"),
    };
    let build_s = start.elapsed().as_secs_f64();
    let exact = ["bth", "bvh", "bth single"].contains(&name);
    Ok(MovingContender { name, ours: !name.starts_with("embree"), exact, moving, build_s })
}

/// Traces rays in batches.
fn trace(scene: &Scene, batch: Batch<'_>, hits: &mut [Hit], size: usize) {
    for (batch, hits) in batch.chunks(size).zip(hits.chunks_mut(size)) {
        scene.batch(batch.rays).nearest(hits);
    }
}

/// A compiled scene, and the number of rays that are traced together.
struct CompiledScene {
    scene: Scene,
    batch: usize,
}

impl Moving for CompiledScene {
    fn prepare(&mut self) -> Result<()> {
        // A time before the first frame.
        self.scene.set_seconds(-1e3)?;
        Ok(())
    }

    fn show(&mut self, frame: &Frame) -> Result<f64> {
        Ok(self.scene.set_frame(frame.number)?.refit.as_secs_f64())
    }

    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        trace(&self.scene, batch, hits, self.batch);
    }
}

/// A scene of compiled objects whose instances the program places.
struct PlacedScene {
    builder: SceneBuilder,
    ids: Vec<u32>,
}

impl PlacedScene {
    fn new(shown: &Scene, objects: &Scene) -> Result<PlacedScene> {
        let mut builder = SceneBuilder::new();
        let first = builder.add(objects);
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let instances = (0..shown.instance_count()).map(|i| first + shown.object_of(i));
        let ids = instances.map(|object| builder.instance(object, &identity)).collect::<Result<_, _>>()?;
        Ok(PlacedScene { builder, ids })
    }
}

impl Moving for PlacedScene {
    fn show(&mut self, frame: &Frame) -> Result<f64> {
        let mut ids = Vec::with_capacity(self.ids.len());
        let mut transforms = Vec::with_capacity(self.ids.len());
        for (id, place) in self.ids.iter().zip(&frame.places) {
            if let Some([[a, b, c, d], [e, f, g, h], [i, j, k, l]]) = *place {
                ids.push(*id);
                transforms.push([a, b, c, d, e, f, g, h, i, j, k, l]);
            } else {
                self.builder.set_visible(*id, false)?;
            }
        }
        self.builder.set_transforms(&ids, &transforms)?;
        self.builder.commit()?;
        Ok(0.0)
    }

    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        trace(self.builder.scene(), batch, hits, BATCH);
    }
}

impl Moving for EmbreeScene {
    fn show(&mut self, frame: &Frame) -> Result<f64> {
        self.place(&frame.places);
        Ok(0.0)
    }

    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        Tracer::nearest(self, batch, hits);
    }
}
