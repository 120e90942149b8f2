//! Options that decide how trees are built and which nodes are tetrahedralized.

use super::choices::*;
use super::common::{SMALLER, TETRAHEDRA, positive};
use crate::failure::Failure;
use crate::ray_files;
use bth_compile::Monitor;
use bth_compile::sampling::KnownRays;
use clap::Args as Group;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How nodes are selected for tetrahedralization.
#[derive(Clone, Debug, Group)]
pub(crate) struct Selection {
    /// Effort of the BVH builder.
    #[arg(long, value_enum, default_value_t = Quality::Balanced)]
    pub(crate) quality: Quality,
    /// How the steps of a ray through a tetrahedralization are estimated.
    #[arg(long, help_heading = TETRAHEDRA, value_enum, default_value_t = Estimator::FaceCount)]
    pub(crate) estimator: Estimator,
    /// How nodes are selected.
    #[arg(long, help_heading = TETRAHEDRA, value_enum, default_value_t = Select::Best)]
    pub(crate) select: Select,
    /// Which rays the file is for.
    #[arg(long, value_enum, default_value_t = OptimizeFor::Balanced)]
    pub(crate) optimize_for: OptimizeFor,
    /// What tracing costs: `default`, or a file that `bthc calibrate` wrote. Files of one profile are the same
    /// on every machine.
    #[arg(long, help_heading = TETRAHEDRA, value_name = "PROFILE", default_value = "default")]
    pub(crate) profile: PathBuf,
    /// Most bytes that tracing may read for each triangle of an object, the BVH included; what saves least for its size
    /// stays BVH. A BVH that is larger by itself is a warning.
    #[arg(long, help_heading = SMALLER, value_name = "BYTES", value_parser = positive)]
    pub(crate) max_bytes_per_triangle: Option<f64>,
    /// Seconds of one thread for tetrahedralization, as the profile estimates them; what saves least for its time
    /// stays BVH.
    #[arg(long, help_heading = TETRAHEDRA, value_name = "SECONDS", value_parser = positive)]
    pub(crate) budget: Option<f64>,
    /// Rays that will be traced through the model, such as those of a light baker or of a view, in a .rays file (see `bthc trace`). The
    /// tree is built for them more than for rays from everywhere, so that they take fewer steps. Answers do not depend on it.
    #[arg(long, value_name = "FILE")]
    pub(crate) rays: Option<PathBuf>,
    /// What decides, when the tetrahedra are there, whether they stay.
    #[arg(long, help_heading = TETRAHEDRA, value_enum, default_value_t = Probe::Steps)]
    pub(crate) probe: Probe,
    /// Least number of triangles that is worth a tetrahedralization.
    #[arg(long, help_heading = TETRAHEDRA, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) min_tet_triangles: Option<u32>,
    /// Nanoseconds that a step through a tetrahedron is taken to cost; less means more tetrahedra.
    #[arg(long, help_heading = TETRAHEDRA, value_name = "NANOSECONDS", value_parser = positive)]
    pub(crate) c_tet: Option<f64>,
}

impl Selection {
    /// The file that holds the profile.
    pub(crate) fn profile_file(&self) -> Option<&PathBuf> {
        Some(&self.profile).filter(|profile| profile.as_os_str() != "default")
    }

    /// The files that options name.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.rays.iter().chain(self.profile_file())
    }

    /// Sets the options that concern the selection.
    ///
    /// # Errors
    /// If the profile or the known rays cannot be used.
    pub(crate) fn apply(
        &self,
        options: &mut bth_compile::pipeline::CompileOptions,
        monitor: &dyn Monitor,
    ) -> Result<(), Failure> {
        options.bvh.quality = self.quality.into();
        let costs = &mut options.costs;
        costs.estimator = self.estimator.into();
        costs.select = self.select.into();
        costs.optimize_for = self.optimize_for.into();
        costs.probe = self.probe.into();
        costs.max_bytes_per_triangle = self.max_bytes_per_triangle;
        costs.budget = self.budget;
        costs.c_tet = self.c_tet;
        if let Some(profile) = self.profile_file() {
            costs.profile = bth_compile::costs::Profile::read(profile)?;
        }
        if let Some(path) = &self.rays {
            costs.rays = Some(Arc::new(known_rays(path, monitor)?));
        }
        if let Some(triangles) = self.min_tet_triangles {
            costs.minimum_triangles = triangles;
        }
        Ok(())
    }
}

/// The rays of a file. Those that cannot be traced are left out, with a warning.
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
