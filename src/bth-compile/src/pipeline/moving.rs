//! Objects whose vertices move by themselves: one BVH for all poses, or several for ranges of time where one would cost too much.

use super::clock::timed;
use super::motion::{MotionReport, SegmentReport};
use super::object::{self, Object, TracedMesh};
use super::report::TetReports;
use super::{Clock, StageReports};
use crate::bvh::{self, Costs, PoseOptions, Poses};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use bth_format::SequenceView;
use bth_format::layout::Segment;
use bth_import::{Mesh, Sequence};

/// A range is divided if its tree costs more than this on average, relative to trees that are built for each pose alone.
const TOO_DEAR: f64 = 1.05;
/// Dividing a range must reduce its mean ratio at least by this much.
const LEAST_GAIN: f64 = 0.03;
/// Times of comparison with trees of a single pose, for each segment that there may be.
const TIMES_PER_SEGMENT: usize = 2;

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
        let view = SequenceView { times: &self.times, positions: &self.positions, segments: &[] };
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

/// A range of time and the tree for it.
struct Range {
    first: f64,
    last: f64,
    traced: TracedMesh,
    bvh: bvh::BvhReport,
    /// For each time of comparison in the range the cost relative to a tree for that pose alone.
    ratios: Vec<f64>,
}

impl Range {
    fn mean(&self) -> f64 {
        mean(self.ratios.iter().copied())
    }
}

/// What all ranges share.
struct Compiler<'a> {
    source: &'a dyn PoseSource,
    options: &'a CompileOptions,
    monitor: &'a dyn Monitor,
    /// Times of comparison and the costs of trees that are built for these poses alone.
    alone: Vec<(f64, f64)>,
}

/// Compiles a mesh whose vertices move into an object, with objects of its segments behind it. `options` are those of deformable
/// objects ([`CompileOptions::of_deforming`]).
pub(crate) fn compile_moving(
    (mesh, source): (Mesh, &dyn PoseSource),
    options: &CompileOptions,
    clock: &mut Clock,
    monitor: &dyn Monitor,
) -> Result<(Object, StageReports)> {
    let motion = options.motion;
    let mut compiler = Compiler { source, options, monitor, alone: Vec::new() };
    let several = motion.poses > 1 && !mesh.triangles.is_empty();
    let ranges = clock.time("bvh", || {
        if several {
            compiler.alone = compiler.alone(&mesh)?;
        }
        compiler.ranges(mesh)
    })?;
    let report = compiler.report(&ranges);
    let rows: Vec<Segment> = (0..).zip(&ranges).map(|(object, range)| segment(range.first, object)).collect();
    let mut objects = Vec::with_capacity(ranges.len());
    let mut reports = None;
    for range in ranges {
        let Range { traced, bvh, .. } = range;
        let (object, collapse) =
            clock.time("collapse", || object::join(traced, Vec::new(), None, options, monitor))?;
        reports.get_or_insert((bvh, TetReports::default(), collapse));
        objects.push(object);
    }
    let mut first = objects.remove(0);
    if !objects.is_empty() {
        first.segments = rows;
        first.segment_objects = objects;
    }
    first.motion = Some(report);
    let (bvh, tets, collapse) = reports.unwrap_or_default();
    Ok((first, StageReports::new(None, (bvh, None), tets, collapse)))
}

fn segment(first: f64, object: u32) -> Segment {
    Segment { first, object, reserved: 0 }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0u32, 0.0), |(count, sum), value| (count + 1, sum + value));
    if count == 0 { 1.0 } else { sum / f64::from(count) }
}

/// The middles of equal parts of a range of time.
fn middles((first, last): (f64, f64), count: usize) -> Vec<f64> {
    let step = (last - first) / count as f64;
    (0..count).map(|part| first + (part as f64 + 0.5) * step).collect()
}

impl Compiler<'_> {
    fn pose_options(&self) -> PoseOptions {
        PoseOptions { effort: self.options.bvh.quality.effort(), keep_zero_area: true }
    }

    /// The costs by which trees are compared: of rays alone, not of the size of files.
    fn costs(&self) -> Costs {
        Costs { line: 0.0, ..self.options.collapse.costs }
    }

    /// The positions at those of some times at which all are finite.
    fn finite(&self, times: impl IntoIterator<Item = f64>) -> Vec<(f64, Vec<[f32; 3]>)> {
        let posed = times.into_iter().map(|seconds| (seconds, self.source.positions_at(seconds)));
        posed.filter(|(_, rows)| rows.as_flattened().iter().all(|x| x.is_finite())).collect()
    }

    /// The tree of a mesh over some poses, and what its nodes are worth on average.
    fn tree(&self, mesh: &Mesh, positions: &[Vec<[f32; 3]>]) -> Result<(TreeOfPoses, bvh::BvhReport)> {
        let poses = Poses::new(mesh, positions)?;
        let (tree, report) = timed(|| bvh::build_poses(mesh, &poses, &self.pose_options(), self.monitor))?;
        let probabilities = poses.probabilities(mesh, &tree);
        Ok((TreeOfPoses { tree, probabilities }, report))
    }

    /// The cost of the best wide form of a tree in each pose.
    fn cost(&self, mesh: &Mesh, tree: &TreeOfPoses, positions: &[Vec<[f32; 3]>]) -> Result<Vec<f64>> {
        let weighed = tree.weighed();
        let costs = self.costs();
        let options = bvh::CollapseOptions { keep_subtrees: false, costs, ..self.options.collapse };
        let (wide, _) = bvh::collapse(mesh, weighed, &[], &options, self.monitor)?;
        let poses = Poses::new(mesh, positions)?;
        Ok(bvh::pose_costs(mesh, &wide, &costs, &poses).into_iter().map(|pose| pose.cost).collect())
    }

    /// Times of comparison, and the costs of trees that are built for these poses alone.
    fn alone(&self, mesh: &Mesh) -> Result<Vec<(f64, f64)>> {
        let count = TIMES_PER_SEGMENT * self.options.motion.segments.max(1) as usize;
        let one = |(seconds, positions): (f64, Vec<[f32; 3]>)| {
            let positions = vec![positions];
            let posed = Mesh {
                positions: positions[0].clone(),
                triangles: mesh.triangles.clone(),
                ..Mesh::default()
            };
            let (tree, _) = self.tree(&posed, &positions)?;
            Ok((seconds, self.cost(&posed, &tree, &positions)?[0]))
        };
        self.finite(middles(self.source.range(), count)).into_iter().map(one).collect()
    }

    /// The tree for a range of time.
    fn range(&self, mesh: Mesh, (first, last): (f64, f64)) -> Result<Range> {
        let mut positions: Vec<_> = match self.options.motion.poses {
            0 | 1 => Vec::new(),
            poses => {
                let times = middles((first, last), (poses as usize).min(bvh::MAX_POSES));
                self.finite(times).into_iter().map(|(_, rows)| rows).collect()
            }
        };
        if positions.is_empty() {
            positions.push(mesh.positions.clone());
        }
        let (tree, bvh) = self.tree(&mesh, &positions)?;
        let within: Vec<_> = self.alone.iter().filter(|(t, _)| first <= *t && *t <= last).collect();
        let mut ratios = Vec::with_capacity(within.len());
        if !within.is_empty() {
            // At most as many poses at a time as the types allow.
            for part in within.chunks(bvh::MAX_POSES) {
                let poses: Vec<_> =
                    part.iter().map(|(seconds, _)| self.source.positions_at(*seconds)).collect();
                let costs = self.cost(&mesh, &tree, &poses)?;
                ratios.extend(costs.iter().zip(part).map(|(cost, (_, alone))| ratio(*cost, *alone)));
            }
        }
        let TreeOfPoses { tree, probabilities } = tree;
        let traced = TracedMesh { mesh, on_grid: None, tree, probabilities: Some(probabilities) };
        Ok(Range { first, last, traced, bvh, ratios })
    }

    /// The whole clip, divided while the dearest range is too dear and its halves are enough cheaper.
    fn ranges(&self, mesh: Mesh) -> Result<Vec<Range>> {
        let geometry =
            Mesh { positions: mesh.positions.clone(), triangles: mesh.triangles.clone(), ..Mesh::default() };
        let mut ranges = vec![self.range(mesh, self.source.range())?];
        let mut settled = vec![false];
        while ranges.len() < self.options.motion.segments.max(1) as usize {
            let excess = |row: &usize| ranges[*row].ratios.iter().map(|ratio| ratio - 1.0).sum::<f64>();
            let too_dear = |row: &usize| {
                !settled[*row] && ranges[*row].ratios.len() > 1 && ranges[*row].mean() > TOO_DEAR
            };
            let worst = (0..ranges.len()).filter(too_dear).max_by(|a, b| excess(a).total_cmp(&excess(b)));
            let Some(worst) = worst else { break };
            let Range { first, last, .. } = ranges[worst];
            let middle = first + 0.5 * (last - first);
            let left = self.range(geometry.clone(), (first, middle))?;
            let right = self.range(geometry.clone(), (middle, last))?;
            let after = mean(left.ratios.iter().chain(&right.ratios).copied());
            if ranges[worst].mean() - after < LEAST_GAIN {
                settled[worst] = true;
                continue;
            }
            // The first range keeps the mesh with all its attributes.
            let whole = std::mem::replace(&mut ranges[worst], left);
            if worst == 0 {
                ranges[0].traced.mesh = whole.traced.mesh;
            }
            ranges.insert(worst + 1, right);
            settled.insert(worst + 1, false);
        }
        Ok(ranges)
    }

    fn report(&self, ranges: &[Range]) -> MotionReport {
        let all = || ranges.iter().flat_map(|range| range.ratios.iter().copied());
        let sequence = ranges.first().and_then(|range| range.traced.mesh.sequence.as_ref());
        let one = |range: &Range| SegmentReport { first: range.first, cost_ratio: range.mean() };
        MotionReport {
            frames: sequence.map_or(0, |s| s.times.len() as u64),
            poses: self.options.motion.poses.clamp(1, bvh::MAX_POSES as u32),
            cost_ratio: mean(all()),
            worst_cost_ratio: all().fold(1.0, f64::max),
            segments: ranges.iter().map(one).collect(),
            position_bytes: sequence.map_or(0, |s| size_of_val(&s.positions[..]) as u64),
        }
    }
}

/// A tree and the probabilities of its nodes.
struct TreeOfPoses {
    tree: bvh::BinaryBvh,
    probabilities: Vec<f64>,
}

impl TreeOfPoses {
    fn weighed(&self) -> bvh::Weighed<'_> {
        bvh::Weighed { bvh: &self.tree, probabilities: Some(&self.probabilities) }
    }
}

/// The cost relative to that of a tree for the pose alone; 1 where neither is known, as for meshes on one line.
fn ratio(cost: f64, alone: f64) -> f64 {
    if alone > 0.0 { cost / alone } else { 1.0 }
}
