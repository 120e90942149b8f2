//! Objects whose vertices move by themselves: one BVH for poses over the whole clip.

use super::report::MotionReport;
use super::traced::TracedMesh;
use crate::bvh::{self, PoseOptions, Poses};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::stage::Stage;
use bth_format::SequenceView;
use bth_import::{Mesh, Sequence};

/// The positions of an object at any time of its clip.
pub(crate) trait PoseSource: Sync {
    /// First and last time of the clip, seconds.
    fn range(&self) -> (f64, f64);
    /// A position for each row of the mesh's positions.
    fn positions_at(&self, seconds: f64) -> Vec<[f32; 3]>;
}

impl PoseSource for Sequence {
    fn range(&self) -> (f64, f64) {
        (self.times.first().copied().unwrap_or(0.0), self.times.last().copied().unwrap_or(0.0))
    }

    fn positions_at(&self, seconds: f64) -> Vec<[f32; 3]> {
        let rows = self.positions.len() / self.times.len().max(1);
        let view = SequenceView { times: &self.times, positions: &self.positions };
        let mut positions = vec![[0.0; 3]; rows];
        view.positions_at(view.locate(seconds), (rows, 0), &mut positions);
        positions
    }
}

/// Warns of options that have no effect on an object whose vertices move.
pub(crate) fn warn_of_options(name: &str, options: &CompileOptions, monitor: &dyn Monitor) {
    let without_effect = [
        (options.structure == Structure::Tets, "nothing is tetrahedralized"),
        (options.coordinates != Default::default(), "coordinates stay f32"),
        (!options.geometry, "the geometry of the source stays"),
        (options.free.keep.always(), "no free directions are kept"),
    ];
    let set_aside: Vec<_> =
        without_effect.into_iter().filter_map(|(differs, what)| differs.then_some(what)).collect();
    if !set_aside.is_empty() {
        monitor.warn(&format!("{name}: {}, since its vertices move", set_aside.join(", ")));
    }
}

/// Builds one tree for poses over the whole clip. The probabilities of its nodes are means over the
/// poses.
pub(super) struct BuildPoses<'a> {
    pub(super) mesh: Mesh,
    pub(super) source: &'a dyn PoseSource,
    pub(super) options: &'a CompileOptions,
}

impl Stage for BuildPoses<'_> {
    type Output = (TracedMesh, bvh::BvhReport);
    const NAME: &'static str = "bvh";
    const VERSION: &'static str = "2";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        let Self { mesh, source, options } = self;
        let positions = positions(&mesh, source, options.motion.poses);
        let poses = Poses::new(&mesh, &positions)?;
        let pose_options = PoseOptions { effort: options.bvh.quality.effort(), keep_zero_area: true };
        let (tree, report) = bvh::build_poses(&mesh, &poses, &pose_options, monitor)?;
        let probabilities = Some(poses.probabilities(&mesh, &tree));
        Ok((TracedMesh { mesh, on_grid: None, tree, probabilities }, report))
    }
}

/// The positions in the middles of `poses` equal parts of the clip. Skips poses that are not
/// finite. With one pose, or if none is finite, the positions of the mesh.
fn positions(mesh: &Mesh, source: &dyn PoseSource, poses: u32) -> Vec<Vec<[f32; 3]>> {
    let count = (poses as usize).min(bvh::MAX_POSES);
    let mut positions = Vec::new();
    if count > 1 {
        let (first, last) = source.range();
        let step = (last - first) / count as f64;
        let middles = (0..count).map(|part| first + (part as f64 + 0.5) * step);
        let is_finite = |rows: &Vec<[f32; 3]>| rows.as_flattened().iter().all(|x| x.is_finite());
        positions.extend(middles.map(|seconds| source.positions_at(seconds)).filter(is_finite));
    }
    if positions.is_empty() {
        positions.push(mesh.positions.clone());
    }
    positions
}

/// The report on a mesh whose vertices move.
pub(super) fn report(mesh: &Mesh, options: &CompileOptions) -> MotionReport {
    let sequence = mesh.sequence.as_ref();
    MotionReport {
        frames: sequence.map_or(0, |s| s.times.len() as u64),
        poses: options.motion.poses.clamp(1, bvh::MAX_POSES as u32),
        position_bytes: sequence.map_or(0, |s| size_of_val(&s.positions[..]) as u64),
    }
}
