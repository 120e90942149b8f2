//! Options that decide how trees are built and which nodes are tetrahedralized.

use super::choices::*;
use crate::failure::Failure;
use crate::ray_files;
use bth_compile::Monitor;
use bth_compile::sampling::KnownRays;
use bth_compile::settings::{self, Setting};
use clap::Args as Group;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How nodes are selected for tetrahedralization.
#[derive(Clone, Debug, Group)]
pub(crate) struct Selection {
    /// Effort of the BVH builder.
    #[arg(long, value_enum, default_value_t = Quality::Balanced)]
    pub(crate) quality: Quality,
    /// Rays that will be traced through the model, such as a light baker's, in a .rays file (see
    /// `bthc trace`). The tree is built so that they take fewer steps. Answers do not depend on it.
    #[arg(long, value_name = "FILE")]
    pub(crate) rays: Option<PathBuf>,
    /// Change a setting for experts; --help lists the keys.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse, long_help = settings::long_help())]
    pub(crate) settings: Vec<Setting>,
}

impl Selection {
    /// Sets the options that concern the selection.
    ///
    /// # Errors
    /// If the known rays cannot be used.
    pub(crate) fn apply(
        &self,
        options: &mut bth_compile::pipeline::CompileOptions,
        monitor: &dyn Monitor,
    ) -> Result<(), Failure> {
        options.bvh.quality = self.quality.into();
        if let Some(path) = &self.rays {
            options.costs.rays = Some(Arc::new(known_rays(path, monitor)?));
        }
        for setting in &self.settings {
            setting.apply(options);
        }
        Ok(())
    }
}

/// Reads the rays of a file. Skips rays that cannot be traced, with a warning.
///
/// # Errors
/// If the file cannot be read, or none can be traced.
fn known_rays(path: &Path, monitor: &dyn Monitor) -> Result<KnownRays, Failure> {
    // Build systems ask for the age of the file, too.
    bth_files::regular_file(path).map_err(|e| Failure::file("BTH-O090", path, &e))?;
    let rays = ray_files::read_rays(path)?;
    let (known, left_out) = KnownRays::of(&rays);
    if known.count() == 0 {
        let message = format!("expected rays that can be traced, found none of {}", rays.len());
        let hint = "rays need finite numbers, a direction, and a tmin of at most tmax, which may be infinite";
        return Err(Failure::ray_file(path, 16, message, hint));
    }
    if left_out > 0 {
        let path = path.display();
        monitor.warn(&format!("{path}: {left_out} of {} rays cannot be traced and do not count", rays.len()));
    }
    Ok(known)
}
