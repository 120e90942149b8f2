//! Options of `bthc compile`, and those that it shares with `import` and `explain`.

use super::cache::Keeping;
use super::choices::*;
use super::common::{EXIT_CODES, threads};
use super::jobs::Jobs;
use crate::failure::Failure;
use crate::ray_files;
use bth_compile::Monitor;
use bth_compile::sampling::KnownRays;
use bth_format::layout::GridBits;
use bth_import::Keep;
use clap::Args as Group;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Compile a model (OBJ, PLY, STL, OFF) or a scene (glTF, GLB, scene manifest) into a BTH file.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Compile {
    /// Models or scenes; what ends with .manifest or .toml is a scene manifest. `-` is a model from standard input.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<PathBuf>,
    /// The compiled file, or the folder for several; by default each model's name with the extension .bth, beside it. `-` is
    /// standard output.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) jobs: Jobs,
    #[command(flatten)]
    pub(crate) keeping: Keeping,
    /// Make one object of a glTF file: its scene at rest, in world space, without hierarchy and animation.
    #[arg(long, conflicts_with_all = ["scene", "animation", "rate", "at_rest", "rigid_parts", "strict"])]
    pub(crate) flatten: bool,
    #[command(flatten)]
    pub(crate) gltf: Gltf,
    /// What to build. By default bth, with --deformable bvh.
    #[arg(long, value_enum)]
    pub(crate) structure: Option<Structure>,
    #[command(flatten)]
    pub(crate) selection: Selection,
    /// For scenes: let the rays of their cameras, lights and frames decide how trees are built and what is tetrahedralized, more than
    /// rays from everywhere. What none of them meets is not tetrahedralized.
    #[arg(long)]
    pub(crate) for_scene: bool,
    /// Record that stores a tetrahedron.
    #[arg(long, value_enum, default_value_t = Record::Link32, value_name = "RECORD")]
    pub(crate) tets: Record,
    /// Bits of a coordinate of a triangle leaf: f32, 21 or 16 over the object's box. Fewer make smaller files; vertices
    /// move to the nearest points of a grid. By default f32, or what --max-error asks for.
    #[arg(long, value_name = "BITS", value_enum)]
    pub(crate) coordinates: Option<Coordinates>,
    /// Boxes of BVH nodes: f32, or 8 bits an end, which makes nodes of 192 bytes out of 448. No vertex moves, and no answer
    /// changes.
    #[arg(long, value_name = "BITS", value_enum, default_value_t = Boxes::F32)]
    pub(crate) boxes: Boxes,
    /// Greatest distance that a vertex may move: in the units of the object (0.001), or as a share of the diagonal of its box
    /// (0.01%). The fewest bits that honour it are taken; with --coordinates, more is refused.
    #[arg(long, value_name = "DISTANCE", value_parser = str::parse::<bth_compile::coordinates::MaxError>)]
    pub(crate) max_error: Option<bth_compile::coordinates::MaxError>,
    /// Directions in which rays that start on a triangle meet nothing, and distances within which they do not, so that rays end at once
    /// or begin later where a caller says on which triangle they start: 24 bytes a triangle, or 12 for `distances` alone. With `auto` what
    /// is worth its bytes. By default auto, but none where fast compiling (--quality fast) or small files (--coordinates, --max-error,
    /// --boxes, --compact) are asked for, or for objects of more than a million triangles.
    #[arg(long, value_enum, value_name = "WHERE", conflicts_with = "deformable")]
    pub(crate) free_directions: Option<Free>,
    /// The second of three distances that are told apart, an eighth of it, it and four times it, as a share of the diagonal of the
    /// object's box.
    #[arg(long, value_name = "SHARE", value_parser = positive, default_value_t = 0.0625)]
    pub(crate) free_reach: f64,
    /// Shading attributes to keep.
    #[arg(long, value_enum, default_value_t = Attributes::None)]
    pub(crate) attributes: Attributes,
    /// Keep groups of triangles, materials and names, so that hits lead back to parts of the source: see docs/models.md.
    #[arg(long)]
    pub(crate) names: bool,
    /// Keep how materials look: base colour, emission, alpha, sidedness, their textures, and vertex colours: see docs/models.md.
    /// Includes --attributes all and --names.
    #[arg(long)]
    pub(crate) materials: bool,
    /// glTF materials whose alpha makes holes, through which rays pass: see docs/models.md.
    #[arg(long, value_enum, default_value_t = Alpha::None, value_name = "MATERIALS")]
    pub(crate) alpha: Alpha,
    /// The BVH under each tet leaf: rays that do not start on a known surface take it, and are much faster so.
    /// By default kept with `--structure bth` and `--deformable`, and pruned with `tets`.
    #[arg(long, value_enum)]
    pub(crate) subtrees: Option<Subtrees>,
    /// The smallest tetrahedralizations: short for `--tets tet16 --subtrees prune
    /// --free-directions none`. Some 100 bytes a triangle where all
    /// triangles are in tetrahedra, in place of 180 to 200.
    #[arg(long, conflicts_with_all = ["tets", "subtrees"])]
    pub(crate) compact: bool,
    /// Keep what new positions at run time need, for objects that deform: see docs/deforming.md. All vertices keep the order of the
    /// source. The object is a BVH unless --structure says otherwise.
    #[arg(long, conflicts_with_all = ["coordinates", "max_error", "no_geometry", "compact", "rigid_parts"])]
    pub(crate) deformable: bool,
    /// Poses over which the tree of an object is built whose vertices move by themselves, 1 to 16; more take longer. 1 builds it for
    /// the first pose.
    #[arg(long, default_value_t = 8, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) poses: u32,
    /// Most ranges of time that get a tree of their own, where one tree for all poses would cost rays too much; each takes memory.
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    pub(crate) segments: u32,
    /// Leave out the positions and triangles of the source (tracing does not need them).
    #[arg(long)]
    pub(crate) no_geometry: bool,
    /// Threads; 0 for one per processor. The result does not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Seconds that the tetrahedralization of one node may take; by default according to its size.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub(crate) tet_deadline: Option<u64>,
    /// Memory of a tetrahedralization worker, in MiB.
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(16..=1_048_576))]
    pub(crate) tet_memory: Option<u64>,
    /// Print the reports of all stages as one JSON object on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// What of a glTF file becomes a scene.
#[derive(Clone, Debug, Group)]
#[command(next_help_heading = "Scenes from glTF")]
pub(crate) struct Gltf {
    /// Scene by name or number; by default the file's own choice.
    #[arg(long, value_name = "SCENE")]
    pub(crate) scene: Option<String>,
    /// Animation by name or number, `all` or `none`; by default the first. With `all`, of two that move the same thing the first is
    /// taken.
    #[arg(long, value_name = "ANIMATION")]
    pub(crate) animation: Option<String>,
    /// Frames per second; 24 by default.
    #[arg(long, value_parser = positive)]
    pub(crate) rate: Option<f64>,
    /// Leave meshes with skins and morph targets at rest; by default they deform where an animation moves them.
    #[arg(long)]
    pub(crate) at_rest: bool,
    /// Make instances of the parts of skinned meshes that one joint moves rigidly: updates of the time only place them, but rays that
    /// have to enter several instances are slower. See docs/scenes.md.
    #[arg(long, conflicts_with = "at_rest")]
    pub(crate) rigid_parts: bool,
    /// Refuse what would be ignored: animations of other things than nodes and morph weights.
    #[arg(long)]
    pub(crate) strict: bool,
}

impl Gltf {
    /// The first of these options that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let options = [
            ("--scene", self.scene.is_some()),
            ("--animation", self.animation.is_some()),
            ("--rate", self.rate.is_some()),
            ("--at-rest", self.at_rest),
            ("--rigid-parts", self.rigid_parts),
            ("--strict", self.strict),
        ];
        options.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }

    /// The options of the import.
    pub(crate) fn options(&self) -> bth_import::gltf::scene::ImportOptions {
        use bth_import::gltf::Chosen;
        let animation = match self.animation.as_deref() {
            None => Chosen::First,
            Some("all") => Chosen::All,
            Some("none") => Chosen::None,
            Some(name) => Chosen::One(name.to_owned()),
        };
        bth_import::gltf::scene::ImportOptions {
            scene: self.scene.clone(),
            animation,
            rate: self.rate.unwrap_or(24.0),
            deform: !self.at_rest,
            rigid_parts: self.rigid_parts,
            strict: self.strict,
        }
    }
}

/// How nodes are selected for tetrahedralization.
#[derive(Clone, Debug, Group)]
pub(crate) struct Selection {
    /// Effort of the BVH builder.
    #[arg(long, value_enum, default_value_t = Quality::Balanced)]
    pub(crate) quality: Quality,
    /// How the steps of a ray through a tetrahedralization are estimated.
    #[arg(long, value_enum, default_value_t = Estimator::FaceCount)]
    pub(crate) estimator: Estimator,
    /// How nodes are selected.
    #[arg(long, value_enum, default_value_t = Select::Best)]
    pub(crate) select: Select,
    /// Which rays the file is for.
    #[arg(long, value_enum, default_value_t = OptimizeFor::Balanced)]
    pub(crate) optimize_for: OptimizeFor,
    /// What tracing costs: `default`, or a file that `bthc calibrate` wrote. Files of one profile are the same
    /// on every machine.
    #[arg(long, value_name = "PROFILE", default_value = "default")]
    pub(crate) profile: PathBuf,
    /// Most bytes that tracing may read for each triangle of an object, the BVH included; what saves least for its size
    /// stays BVH. A BVH that is larger by itself is a warning.
    #[arg(long, value_name = "BYTES", value_parser = positive)]
    pub(crate) max_bytes_per_triangle: Option<f64>,
    /// Seconds of one thread for tetrahedralization, as the profile estimates them; what saves least for its time
    /// stays BVH.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    pub(crate) budget: Option<f64>,
    /// Rays that will be traced through the model, such as those of a light baker or of a view, in a .rays file (see `bthc trace`). The
    /// tree is built for them more than for rays from everywhere, so that they take fewer steps. Answers do not depend on it.
    #[arg(long, value_name = "FILE")]
    pub(crate) rays: Option<PathBuf>,
    /// What decides, when the tetrahedra are there, whether they stay.
    #[arg(long, value_enum, default_value_t = Probe::Steps)]
    pub(crate) probe: Probe,
    /// Least number of triangles that is worth a tetrahedralization.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) min_tet_triangles: Option<u32>,
    /// Nanoseconds that a step through a tetrahedron is taken to cost; less means more tetrahedra.
    #[arg(long, value_name = "NANOSECONDS", value_parser = positive)]
    pub(crate) c_tet: Option<f64>,
}

/// Triangles of the largest objects of which free directions are found unless that is asked for: some ten seconds on two cores.
pub(crate) const DEFAULT_MOST_TRIANGLES: usize = 1_000_000;

/// The rays of a file. Those that cannot be traced are left out, with a warning.
///
/// # Errors
/// If the file cannot be read, or none can be traced.
fn known_rays(path: &Path, monitor: &dyn Monitor) -> Result<KnownRays, Failure> {
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

/// A finite positive number.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("expected a number above 0".into()),
    }
}

impl Compile {
    /// The options of the compiler.
    ///
    /// # Errors
    /// If the profile or the known rays cannot be used.
    pub(crate) fn options(
        &self,
        monitor: &dyn Monitor,
    ) -> Result<bth_compile::pipeline::CompileOptions, Failure> {
        let structure = self.structure.unwrap_or(match self.deformable {
            true => Structure::Bvh,
            false => Structure::Bth,
        });
        let mut options = bth_compile::pipeline::CompileOptions {
            structure: structure.into(),
            attributes: if self.materials { Keep::All } else { self.attributes.into() },
            names: self.names || self.materials,
            materials: self.materials,
            alpha: self.alpha.into(),
            record: if self.compact { Record::Tet16 } else { self.tets }.into(),
            coordinates: self.coordinates(),
            free: bth_compile::free::FreeOptions {
                keep: self.free_directions().into(),
                reach: self.free_reach,
                most_triangles: self.free_directions.map_or(DEFAULT_MOST_TRIANGLES, |_| usize::MAX),
                ..Default::default()
            },
            keep_subtrees: match self.subtrees {
                Some(subtrees) => subtrees == Subtrees::Keep,
                // Where tetrahedra are turned over, rays of deformable objects take the BVH beside them.
                None => !self.compact && (self.deformable || structure == Structure::Bth),
            },
            geometry: !self.no_geometry,
            deformable: self.deformable,
            deformable_tets: self.deformable && structure == Structure::Bth,
            motion: bth_compile::pipeline::MotionOptions { poses: self.poses, segments: self.segments },
            ..Default::default()
        };
        self.selection.apply(&mut options, monitor)?;
        options.costs.for_scene = self.for_scene;
        if let Some(seconds) = self.tet_deadline {
            options.tets.deadline = std::time::Duration::from_secs(seconds);
            options.tets.deadline_per_triangle = std::time::Duration::ZERO;
        }
        if let Some(mib) = self.tet_memory {
            options.tets.memory = mib << 20;
        }
        Ok(options)
    }

    /// Who asks for fast compiling or small files gets nothing that only hinted rays use without asking for it.
    fn free_directions(&self) -> Free {
        let is_fast = self.selection.quality == Quality::Fast;
        let is_small = self.compact || self.coordinates() != Default::default();
        self.free_directions.unwrap_or(if is_fast || is_small { Free::None } else { Free::Auto })
    }

    fn coordinates(&self) -> bth_compile::coordinates::CoordinateOptions {
        let (bits, max_error) = match self.coordinates {
            // An explicit f32 keeps all vertices in place, whatever --max-error allows.
            Some(Coordinates::F32) => (None, None),
            Some(Coordinates::B21) => (Some(GridBits::B21), self.max_error),
            Some(Coordinates::B16) => (Some(GridBits::B16), self.max_error),
            None => (None, self.max_error),
        };
        let boxes = match self.boxes {
            Boxes::F32 => bth_compile::coordinates::Boxes::F32,
            Boxes::Bytes => bth_compile::coordinates::Boxes::Bytes,
        };
        bth_compile::coordinates::CoordinateOptions { bits, max_error, boxes }
    }
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
