//! What all parts of a scene's compilation share.

use super::keeper::Keeper;
use crate::cached::Cache;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::pipeline::{ObjectKeys, tetgen_in_keys};
use std::sync::Arc;

/// What all parts of a scene's compilation share.
pub(super) struct Context<'a> {
    pub(super) options: &'a CompileOptions,
    pub(super) cache: &'a Cache<'a>,
    /// The name of the tetrahedralizer in keys; `None` when objects may not be kept.
    pub(super) tetgen: Option<String>,
    /// The keys of objects, if they may be kept.
    pub(super) keys: Option<Arc<ObjectKeys>>,
    /// Keeps the objects until the file is written.
    pub(super) keeper: Arc<Keeper>,
    pub(super) monitor: &'a dyn Monitor,
}

impl<'a> Context<'a> {
    /// The context of a compilation through a cache.
    ///
    /// # Errors
    /// Cancelled.
    pub(super) fn new(
        options: &'a CompileOptions,
        cache: &'a Cache<'a>,
        monitor: &'a dyn Monitor,
    ) -> Result<Self> {
        let tetgen = tetgen_in_keys(options, cache, monitor)?;
        let keys = tetgen.as_ref().map(|tetgen| Arc::new(ObjectKeys::new(options, tetgen)));
        Ok(Self { options, cache, tetgen, keys, keeper: Arc::new(Keeper::on_disk(cache)), monitor })
    }

    /// The same context with another monitor.
    pub(super) fn with_monitor<'b>(&'b self, monitor: &'b dyn Monitor) -> Context<'b> {
        let Self { options, cache, ref tetgen, ref keys, ref keeper, .. } = *self;
        let (tetgen, keys, keeper) = (tetgen.clone(), keys.clone(), keeper.clone());
        Context { options, cache, tetgen, keys, keeper, monitor }
    }
}
