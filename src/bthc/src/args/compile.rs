//! Options of `bthc compile`.

use super::cache::Keeping;
use super::choices::*;
use super::common::{DEFORMING, EXIT_CODES, GLTF, KEPT, SMALLER, threads};
use super::gltf::Gltf;
use super::jobs::Jobs;
use super::selection::Selection;
use crate::failure::Failure;
use bth_compile::Monitor;
use bth_compile::coordinates::{CoordinateOptions, MaxError};
use bth_compile::pipeline::CompileOptions;
use bth_format::layout::GridBits;
use bth_import::Keep;
use clap::Args as Group;
use std::path::PathBuf;

/// Compile a model (OBJ, PLY, STL, OFF) or a scene (glTF, GLB, FBX, 3MF, scene manifest) into a BTH
/// file.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Compile {
    /// Models or scenes. A name that ends with .manifest or .toml is a scene manifest; `-` is a
    /// model from standard input.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<PathBuf>,
    /// The compiled file, or the folder for several. By default each model's name with the
    /// extension .bth, in the model's folder. `-` is standard output.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// What to build. By default bth, with --deformable bvh.
    #[arg(long, value_enum)]
    pub(crate) structure: Option<Structure>,
    /// How polygons of more than three corners become triangles in OBJ, PLY, OFF and STL. Fans
    /// cover too much where a polygon is concave.
    #[arg(long, value_enum, default_value_t = Polygons::Fans)]
    pub(crate) polygons: Polygons,
    /// Numbers in which positions are kept: see docs/models.md. Objects in f64 are a BVH, keep the
    /// geometry of the source, and take about 12 bytes a triangle more.
    #[arg(long, value_enum, default_value_t = PositionNumbers::Auto, value_name = "NUMBERS")]
    pub(crate) positions: PositionNumbers,
    /// Shading attributes to keep.
    #[arg(long, help_heading = KEPT, value_enum, default_value_t = Attributes::None)]
    pub(crate) attributes: Attributes,
    /// Keep groups of triangles, materials and names, so that hits lead back to parts of the
    /// source: see docs/models.md.
    #[arg(long, help_heading = KEPT)]
    pub(crate) names: bool,
    /// Keep how materials look: base colour, emission, alpha, sidedness, textures, and vertex
    /// colours: see docs/models.md. Includes --attributes all and --names.
    #[arg(long, help_heading = KEPT)]
    pub(crate) materials: bool,
    /// glTF materials whose alpha makes holes that rays pass: see docs/models.md.
    #[arg(long, help_heading = KEPT, value_enum, default_value_t = Alpha::None, value_name = "MATERIALS")]
    pub(crate) alpha: Alpha,
    /// Warn of images and material libraries that are missing, broken or too large, and go on
    /// without them: see docs/models.md.
    #[arg(long, help_heading = KEPT)]
    pub(crate) lenient_materials: bool,
    /// Store no positions and triangles of the source. Tracing does not need them.
    #[arg(long, help_heading = KEPT)]
    pub(crate) no_geometry: bool,
    /// Keep directions and distances in which rays from a triangle hit nothing. Such rays end at
    /// once or begin later, if the caller names the triangle. Takes 20 bytes a triangle,
    /// `distances` 8, and most of the time of compiling. It pays for rays that start on open
    /// surfaces.
    #[arg(long, help_heading = KEPT, value_enum, default_value_t = Free::None, value_name = "WHERE", conflicts_with = "deformable")]
    pub(crate) free_directions: Free,
    /// Bits of a coordinate of a triangle leaf: f32, or 21 or 16 over the object's box. Fewer make
    /// smaller files; vertices move to the nearest points of a grid. By default f32, or what
    /// --max-error asks for.
    #[arg(long, help_heading = SMALLER, value_name = "BITS", value_enum)]
    pub(crate) coordinates: Option<Coordinates>,
    /// Max distance that a vertex may move: in the units of the object (0.001), or as a share of
    /// the diagonal of its box (0.01%). Takes the fewest bits that honour it; with --coordinates,
    /// fails if a vertex would move more.
    #[arg(long, help_heading = SMALLER, value_name = "DISTANCE", value_parser = str::parse::<MaxError>)]
    pub(crate) max_error: Option<MaxError>,
    /// Keep what new positions at run time need: see docs/deforming.md. All vertices keep the order
    /// of the source. The object is a BVH.
    #[arg(long, help_heading = DEFORMING, conflicts_with_all = ["coordinates", "max_error", "no_geometry", "rigid_parts"])]
    pub(crate) deformable: bool,
    #[command(flatten)]
    pub(crate) selection: Selection,
    /// Threads; 0 for one per processor. The result does not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Print the reports of all stages as one JSON object on standard output, with one of `jobs`
    /// for each model: see docs/bthc.schema.json.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but warnings and errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Make one object of a glTF, FBX or 3MF file: its scene at rest, in world space, without
    /// hierarchy and animation.
    #[arg(long, help_heading = GLTF, conflicts_with_all = ["scene", "animation", "rate", "at_rest", "rigid_parts", "strict"])]
    pub(crate) flatten: bool,
    #[command(flatten)]
    pub(crate) gltf: Gltf,
    #[command(flatten)]
    pub(crate) jobs: Jobs,
    #[command(flatten)]
    pub(crate) keeping: Keeping,
}

impl Compile {
    /// The options of the compiler.
    ///
    /// # Errors
    /// If the known rays cannot be used.
    pub(crate) fn options(&self, monitor: &dyn Monitor) -> Result<CompileOptions, Failure> {
        let structure = self.structure.unwrap_or(match self.deformable {
            true => Structure::Bvh,
            false => Structure::Bth,
        });
        let mut options = CompileOptions {
            structure: structure.into(),
            attributes: if self.materials { Keep::All } else { self.attributes.into() },
            names: self.names || self.materials,
            materials: self.materials,
            lenient_materials: self.lenient_materials,
            polygons: self.polygons.into(),
            positions: self.positions.into(),
            alpha: self.alpha.into(),
            coordinates: self.coordinates(),
            free: bth_compile::free::FreeOptions { keep: self.free_directions.into(), ..Default::default() },
            geometry: !self.no_geometry,
            deformable: self.deformable,
            ..Default::default()
        };
        self.selection.apply(&mut options, monitor)?;
        Ok(options)
    }

    fn coordinates(&self) -> CoordinateOptions {
        let (bits, max_error) = match self.coordinates {
            // An explicit f32 keeps all vertices in place, whatever --max-error allows.
            Some(Coordinates::F32) => (None, None),
            Some(Coordinates::B21) => (Some(GridBits::B21), self.max_error),
            Some(Coordinates::B16) => (Some(GridBits::B16), self.max_error),
            None => (None, self.max_error),
        };
        CoordinateOptions { bits, max_error }
    }
}
