//! Reasons for which an attempt to tetrahedralize a node fails.

use bth_tetgen_protocol::Failure;

/// Why an attempt failed.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum AttemptError {
    /// The worker did not start, or has another version of the protocol.
    Start(String),
    /// The worker died.
    Died(String),
    /// The deadline passed.
    TimedOut,
    /// The worker reported a failure of TetGen.
    Failed(Failure, String),
    /// The answer of the worker is not valid.
    Answer(String),
    /// The triangles or their box cannot be sent to TetGen.
    Unfit(&'static str),
    /// The result fails the check.
    Defect(Defect),
}

impl AttemptError {
    /// Stable name, for counting.
    pub(super) fn name(&self) -> &'static str {
        match self {
            AttemptError::Start(_) => "worker_did_not_start",
            AttemptError::Died(_) => "worker_died",
            AttemptError::TimedOut => "timed_out",
            AttemptError::Failed(Failure::Memory, _) => "out_of_memory",
            AttemptError::Failed(Failure::Internal, _) => "tetgen_internal",
            AttemptError::Failed(Failure::Intersection, _) => "tetgen_intersection",
            AttemptError::Failed(Failure::TooSmall, _) => "tetgen_too_small",
            AttemptError::Failed(..) => "tetgen_other",
            AttemptError::Answer(_) => "bad_answer",
            AttemptError::Unfit(_) => "unfit_input",
            AttemptError::Defect(defect) => defect.name(),
        }
    }

    /// Returns true if the same attempt would fail in the same way on any machine at any time.
    pub(super) fn is_reproducible(&self) -> bool {
        matches!(self, AttemptError::Failed(..) | AttemptError::Unfit(_) | AttemptError::Defect(_))
    }

    /// Returns true if another attempt with other free-space points may succeed. TetGen exceeds its
    /// time on some points and not on others, but after that a large node is better replaced by its
    /// parts.
    pub(super) fn retry(&self, triangles: u32) -> bool {
        match self {
            AttemptError::Died(_) | AttemptError::Answer(_) => true,
            AttemptError::Defect(defect) => *defect != Defect::Duplicate,
            AttemptError::Failed(failure, _) => *failure != Failure::Memory,
            AttemptError::TimedOut => triangles <= 4096,
            AttemptError::Start(_) | AttemptError::Unfit(_) => false,
        }
    }
}

impl std::fmt::Display for AttemptError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())?;
        match self {
            AttemptError::Start(text)
            | AttemptError::Died(text)
            | AttemptError::Failed(_, text)
            | AttemptError::Answer(text) => {
                write!(f, ": {text}")
            }
            AttemptError::Unfit(text) => write!(f, ": {text}"),
            AttemptError::Defect(defect) => write!(f, ": {defect}"),
            AttemptError::TimedOut => Ok(()),
        }
    }
}

/// A defect of a tetrahedralization.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Defect {
    /// Points that were sent came back changed or not at all.
    Moved,
    /// There are more tetrahedra than rows can number.
    TooMany,
    /// This many tetrahedra are flat or inverted.
    Orientation(usize),
    /// A face has more than two tetrahedra, or two on the same side.
    Manifold,
    /// The hull is not the box's surface.
    Hull,
    /// The volumes do not add up to the box's.
    Volume,
    /// This many triangles are not faces, or are faces of the hull.
    Missing(usize),
    /// Two triangles are the same face.
    Duplicate,
}

impl Defect {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Defect::Moved => "points_moved",
            Defect::TooMany => "too_many_tets",
            Defect::Orientation(_) => "bad_orientation",
            Defect::Manifold => "faces_do_not_match",
            Defect::Hull => "hull_is_not_the_box",
            Defect::Volume => "volumes_do_not_add_up",
            Defect::Missing(_) => "triangles_missing",
            Defect::Duplicate => "duplicate_triangles",
        }
    }
}

impl std::fmt::Display for Defect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Defect::Orientation(n) => write!(f, "{n} tetrahedra are flat or inside out"),
            Defect::Missing(n) => write!(f, "{n} triangles are no faces"),
            other => f.write_str(other.name()),
        }
    }
}
