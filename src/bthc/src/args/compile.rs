//! Options of `bthc compile`.

use super::cache::Keeping;
use super::choices::*;
use super::common::{DEFORMING, EXIT_CODES, GLTF, KEPT, SMALLER, TETRAHEDRA, positive, threads};
use super::gltf::Gltf;
use super::jobs::Jobs;
use super::selection::Selection;
use crate::failure::Failure;
use bth_compile::Monitor;
use bth_format::layout::GridBits;
use bth_import::Keep;
use clap::Args as Group;
use std::path::PathBuf;

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
    /// What to build. By default bth, with --deformable bvh.
    #[arg(long, value_enum)]
    pub(crate) structure: Option<Structure>,
    /// How polygons of more than three corners become triangles in OBJ, PLY, OFF and STL. Fans cover more than a polygon that is concave.
    #[arg(long, value_enum, default_value_t = Polygons::Fans)]
    pub(crate) polygons: Polygons,
    /// Shading attributes to keep.
    #[arg(long, help_heading = KEPT, value_enum, default_value_t = Attributes::None)]
    pub(crate) attributes: Attributes,
    /// Keep groups of triangles, materials and names, so that hits lead back to parts of the source: see docs/models.md.
    #[arg(long, help_heading = KEPT)]
    pub(crate) names: bool,
    /// Keep how materials look: base colour, emission, alpha, sidedness, their textures, and vertex colours: see docs/models.md.
    /// Includes --attributes all and --names.
    #[arg(long, help_heading = KEPT)]
    pub(crate) materials: bool,
    /// glTF materials whose alpha makes holes, through which rays pass: see docs/models.md.
    #[arg(long, help_heading = KEPT, value_enum, default_value_t = Alpha::None, value_name = "MATERIALS")]
    pub(crate) alpha: Alpha,
    /// Leave out images and material libraries that are missing, broken or too large, each with a warning, in place of an error: see
    /// docs/models.md.
    #[arg(long, help_heading = KEPT)]
    pub(crate) lenient_materials: bool,
    /// Leave out the positions and triangles of the source (tracing does not need them).
    #[arg(long, help_heading = KEPT)]
    pub(crate) no_geometry: bool,
    /// Directions in which rays that start on a triangle meet nothing, and distances within which they do not, so that rays end at once
    /// or begin later where a caller says on which triangle they start: 20 bytes a triangle, or 8 for `distances` alone. With `auto` what
    /// is worth its bytes. By default auto, but none where fast compiling (--quality fast) or small files (--coordinates, --max-error,
    /// --compact) are asked for, or for objects of more than a million triangles.
    #[arg(long, help_heading = KEPT, value_enum, value_name = "WHERE", conflicts_with = "deformable")]
    pub(crate) free_directions: Option<Free>,
    /// The second of three distances that are told apart, an eighth of it, it and four times it, as a share of the diagonal of the
    /// object's box.
    #[arg(long, help_heading = KEPT, value_name = "SHARE", value_parser = positive, default_value_t = 0.0625)]
    pub(crate) free_reach: f64,
    /// Bits of a coordinate of a triangle leaf: f32, 21 or 16 over the object's box. Fewer make smaller files; vertices
    /// move to the nearest points of a grid. By default f32, or what --max-error asks for.
    #[arg(long, help_heading = SMALLER, value_name = "BITS", value_enum)]
    pub(crate) coordinates: Option<Coordinates>,
    /// Greatest distance that a vertex may move: in the units of the object (0.001), or as a share of the diagonal of its box
    /// (0.01%). The fewest bits that honour it are taken; with --coordinates, more is refused.
    #[arg(long, help_heading = SMALLER, value_name = "DISTANCE", value_parser = str::parse::<bth_compile::coordinates::MaxError>)]
    pub(crate) max_error: Option<bth_compile::coordinates::MaxError>,
    /// The smallest tetrahedralizations: short for `--tets tet16 --subtrees prune
    /// --free-directions none`. Some 100 bytes a triangle where all
    /// triangles are in tetrahedra, in place of 180 to 200.
    #[arg(long, help_heading = SMALLER, conflicts_with_all = ["tets", "subtrees"])]
    pub(crate) compact: bool,
    /// Keep what new positions at run time need, for objects that deform: see docs/deforming.md. All vertices keep the order of the
    /// source. The object is a BVH.
    #[arg(long, help_heading = DEFORMING, conflicts_with_all = ["coordinates", "max_error", "no_geometry", "compact", "rigid_parts"])]
    pub(crate) deformable: bool,
    /// Poses over which the tree of an object is built whose vertices move by themselves, 1 to 16, by default 8; more take longer. 1
    /// builds it for the first pose.
    #[arg(long, help_heading = DEFORMING, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(crate) poses: Option<u32>,
    /// Most ranges of time that get a tree of their own, where one tree for all poses would cost rays too much, by default 4; each takes
    /// memory.
    #[arg(long, help_heading = DEFORMING, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    pub(crate) segments: Option<u32>,
    #[command(flatten)]
    pub(crate) selection: Selection,
    /// For scenes: let the rays of their cameras, lights and frames decide how trees are built and what is tetrahedralized, more than
    /// rays from everywhere. What none of them meets is not tetrahedralized.
    #[arg(long)]
    pub(crate) for_scene: bool,
    /// Threads; 0 for one per processor. The result does not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Print the reports of all stages as one JSON object on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Record that stores a tetrahedron.
    #[arg(long, help_heading = TETRAHEDRA, value_enum, default_value_t = Record::Link32, value_name = "RECORD")]
    pub(crate) tets: Record,
    /// The BVH under each tet leaf: rays that do not start on a known surface take it, and are much faster so.
    /// By default kept with `--structure bth`, and pruned with `tets`.
    #[arg(long, help_heading = TETRAHEDRA, value_enum)]
    pub(crate) subtrees: Option<Subtrees>,
    /// Seconds that an attempt to tetrahedralize a node may take; by default according to its size. Up to four attempts are made with
    /// other points, and the second in a row that takes too long is the last. A worker has 20 seconds to start besides.
    #[arg(long, help_heading = TETRAHEDRA, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub(crate) tet_deadline: Option<u64>,
    /// Memory of a tetrahedralization worker, in MiB.
    #[arg(long, help_heading = TETRAHEDRA, value_name = "MIB", value_parser = clap::value_parser!(u64).range(16..=1_048_576))]
    pub(crate) tet_memory: Option<u64>,
    /// Make one object of a glTF file: its scene at rest, in world space, without hierarchy and animation.
    #[arg(long, help_heading = GLTF, conflicts_with_all = ["scene", "animation", "rate", "at_rest", "rigid_parts", "strict"])]
    pub(crate) flatten: bool,
    #[command(flatten)]
    pub(crate) gltf: Gltf,
    #[command(flatten)]
    pub(crate) jobs: Jobs,
    #[command(flatten)]
    pub(crate) keeping: Keeping,
}

/// Triangles of the largest objects of which free directions are found unless that is asked for: some ten seconds on two cores.
pub(crate) const DEFAULT_MOST_TRIANGLES: usize = 1_000_000;

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
            lenient_materials: self.lenient_materials,
            polygons: self.polygons.into(),
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
                None => !self.compact && structure == Structure::Bth,
            },
            geometry: !self.no_geometry,
            deformable: self.deformable,
            motion: self.motion(),
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

    fn motion(&self) -> bth_compile::pipeline::MotionOptions {
        let usual = bth_compile::pipeline::MotionOptions::default();
        bth_compile::pipeline::MotionOptions {
            poses: self.poses.unwrap_or(usual.poses),
            segments: self.segments.unwrap_or(usual.segments),
        }
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
        bth_compile::coordinates::CoordinateOptions { bits, max_error }
    }
}
