//! A view of one object: its sections as typed slices, and its nodes and leaves by child code.
//!
//! [`crate::File::object`] and [`crate::File::check`] make views. Reading nodes and leaves of a
//! view that was not checked may panic; it never reads out of bounds.

mod bounds;
mod exact;
mod free;
mod groups;
mod leaves;
mod nodes;
mod opacity;
mod places;
mod view;

pub use bounds::{GREATEST_IN_F32, ObjectBounds, WIDENED_RANGE, far_away};
pub use exact::{EXACT_RANGE, ExactPositions, relative_to_anchor};
pub use leaves::Unpacked;
pub(crate) use nodes::MAX_LINES;
pub use nodes::NodeBase;
pub use view::ObjectView;
