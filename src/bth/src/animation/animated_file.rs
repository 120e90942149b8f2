//! What an update of the animation of a file is given.

use crate::nodes::NodeHierarchy;
use bth_format::File;

/// A file of a scene, with its nodes at a time.
#[derive(Clone, Copy)]
pub(crate) struct AnimatedFile<'a> {
    pub(crate) file: &'a File,
    /// Index in the scene of its first object.
    pub(crate) first_object: u32,
    /// The nodes as at the time.
    pub(crate) hierarchy: &'a NodeHierarchy,
    pub(crate) seconds: f64,
}
