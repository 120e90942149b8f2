//! The contenders of `scenes`: our compiled files, and Embree's instances.

use super::source::Source;
use crate::rivals::embree::{self, InstancePlace, Variant};
use crate::structures::BATCH;
use crate::tracer::{Batch, Tracer};
use anyhow::{Context, Result, anyhow};
use bth::Scene;
use bth::rays::Hit;
use bth_compile::costs::Select;
use bth_compile::pipeline::{CompileOptions, Structure};
use std::path::Path;
use std::time::Instant;

/// A contender that can be built.
pub(super) struct ContenderKind {
    pub(super) name: &'static str,
    how: How,
}

enum How {
    /// Compiled like this, traced in batches of so many rays.
    Ours(fn(&mut CompileOptions), usize),
    Embree(Variant),
}

/// All contenders. The second is the plain BVH: its hits are what later rays start from, and others are compared with it.
pub(super) const CONTENDERS: [ContenderKind; 7] = [
    ContenderKind { name: "bth", how: How::Ours(|_| {}, BATCH) },
    ContenderKind { name: "bvh", how: How::Ours(|options| options.structure = Structure::Bvh, BATCH) },
    ContenderKind { name: "bth, paper's rule", how: How::Ours(by_the_paper, BATCH) },
    ContenderKind { name: "bth single", how: How::Ours(|_| {}, 1) },
    ContenderKind { name: "embree", how: How::Embree(embree::DEFAULT) },
    ContenderKind { name: "embree robust", how: How::Embree(embree::ROBUST) },
    ContenderKind { name: "embree hq packet16", how: How::Embree(embree::PACKETS) },
];

fn by_the_paper(options: &mut CompileOptions) {
    options.costs.select = Select::Paper;
}

/// A frame, and the transforms of all instances in it.
pub(super) struct Frame {
    number: i32,
    places: Vec<InstancePlace>,
}

impl Frame {
    /// The transforms of all instances of a scene at its current time.
    pub(super) fn of(scene: &Scene, number: i32) -> Frame {
        let place = |i: u32| {
            let rows = Some(scene.instance(i)).filter(|v| v.visible).map(|v| v.to_world);
            rows.map(|rows| rows.map(|row| row.map(|x| x as f32)))
        };
        Frame { number, places: (0..scene.instance_count()).map(place).collect() }
    }
}

/// A scene that can be set to a frame and traced.
pub(super) trait Moving {
    /// Sets another time, so that the next frame needs a whole update.
    fn hide(&mut self) -> Result<()>;
    /// Sets a frame.
    fn show(&mut self, frame: &Frame) -> Result<()>;
    /// Nearest hits.
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]);
}

/// A contender.
pub(super) struct MovingContender {
    pub(super) name: &'static str,
    pub(super) ours: bool,
    pub(super) moving: Box<dyn Moving>,
    pub(super) build_s: f64,
    /// Share of the objects' triangles in tetrahedra.
    pub(super) in_tets: f64,
}

/// A compiled scene.
pub(super) struct CompiledScene {
    pub(super) bytes: Vec<u8>,
    in_tets: f64,
    seconds: f64,
}

/// Compiles a scene.
pub(super) fn compile(source: &Source, kind: &ContenderKind) -> Result<CompiledScene> {
    let How::Ours(set, _) = kind.how else { return Err(anyhow!("not one of ours")) };
    let mut options = CompileOptions::default();
    set(&mut options);
    let start = Instant::now();
    let (compiled, report) = bth_compile::scene::compile(
        &source.manifest,
        &source.folder,
        Path::new(&source.name),
        &options,
        &bth_compile::Silent,
    )?;
    let seconds = start.elapsed().as_secs_f64();
    let triangles: u64 = report.objects.iter().map(|o| o.triangles).sum();
    let in_tets: u64 = report.objects.iter().map(|o| o.tet_triangles).sum();
    Ok(CompiledScene { bytes: compiled.bytes, in_tets: in_tets as f64 / triangles.max(1) as f64, seconds })
}

/// Builds a contender; Embree takes the geometry of the objects from `shown`.
pub(super) fn build(source: &Source, kind: &ContenderKind, shown: &Scene) -> Result<MovingContender> {
    let batch = match &kind.how {
        How::Ours(_, batch) => *batch,
        How::Embree(variant) => return build_embree(variant, kind.name, shown),
    };
    let compiled = compile(source, kind)?;
    let scene = bth::from_bytes(&compiled.bytes).context("a file that was just compiled")?;
    let (build_s, in_tets) = (compiled.seconds, compiled.in_tets);
    Ok(MovingContender {
        name: kind.name,
        ours: true,
        moving: Box::new(OurScene(scene, batch)),
        build_s,
        in_tets,
    })
}

/// Builds Embree's instances of the same objects.
fn build_embree(variant: &Variant, name: &'static str, shown: &Scene) -> Result<MovingContender> {
    let start = Instant::now();
    let objects = (0..shown.object_count()).map(|i| {
        let view = shown.object(i);
        (embree::padded(view.positions), view.triangles.to_vec())
    });
    let object_of: Vec<u32> = (0..shown.instance_count()).map(|i| shown.object_of(i)).collect();
    let instances = embree::build_instances(objects.collect(), &object_of, variant, 1)?;
    let (build_s, moving) = (start.elapsed().as_secs_f64(), Box::new(instances));
    Ok(MovingContender { name, ours: false, moving, build_s, in_tets: 0.0 })
}

/// One of our scenes, and how many rays are traced together.
struct OurScene(Scene, usize);

impl Moving for OurScene {
    fn hide(&mut self) -> Result<()> {
        // A time before the first frame.
        self.0.set_seconds(-1e3)?;
        Ok(())
    }

    fn show(&mut self, frame: &Frame) -> Result<()> {
        self.0.set_frame(frame.number)?;
        Ok(())
    }

    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (batch, hits) in batch.chunks(self.1).zip(hits.chunks_mut(self.1)) {
            self.0.batch(batch.rays).nearest(hits);
        }
    }
}

impl Moving for embree::EmbreeScene {
    fn hide(&mut self) -> Result<()> {
        Ok(())
    }

    fn show(&mut self, frame: &Frame) -> Result<()> {
        self.place(&frame.places);
        Ok(())
    }

    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        Tracer::nearest(self, batch, hits);
    }
}
