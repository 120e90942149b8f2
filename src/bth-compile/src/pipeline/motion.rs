//! Reports of objects whose vertices move by themselves.

use serde::{Deserialize, Serialize};

/// What the trees of an object whose vertices move cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotionReport {
    /// Frames of the sequence.
    pub frames: u64,
    /// Poses over which the cost of each tree is summed.
    pub poses: u32,
    /// Expected cost of a ray, relative to trees that are built for each pose alone: the mean over some times.
    pub cost_ratio: f64,
    /// The greatest of these ratios.
    pub worst_cost_ratio: f64,
    /// The ranges of time that have a tree of their own.
    pub segments: Vec<SegmentReport>,
    /// Bytes of the positions of all frames.
    pub position_bytes: u64,
}

/// A range of time with a tree of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SegmentReport {
    /// Seconds from which it applies.
    pub first: f64,
    /// As [`MotionReport::cost_ratio`], over the times in this range.
    pub cost_ratio: f64,
}
