//! The command line: one definition feeds parsing, help, completions and the manual page.

use crate::cache_args::{Cache, Keeping};
use crate::jobs_args::Jobs;
use bth::layout::GridBits;
use bth_compile::mesh::Keep;
use clap::{Args as Group, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

pub(crate) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  a check failed (verify, cache verify), or files differ (diff)
    2  wrong usage
    3  bad input: the model or the compiled file cannot be used
    4  a file could not be read or written
    5  the model exceeds a limit of the format
   70  internal error; please report it
  130  cancelled";

/// Compiles triangle models into BTH files, for tracing rays without building anything at the start.
#[derive(Debug, Parser)]
#[command(name = "bthc", version, after_help = EXIT_CODES, max_term_width = 100)]
pub(crate) struct Args {
    /// Instruction set for tracing: scalar, avx2 or avx512. By default what BTH_ISA says, else the best of this
    /// machine. Answers do not depend on it.
    #[arg(long, global = true, value_name = "ISA")]
    pub(crate) isa: Option<bth::Isa>,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Compile(Box<Compile>),
    Cache(Cache),
    Diff(Diff),
    Import(Import),
    Info(Info),
    Verify(Verify),
    Explain(Explain),
    Calibrate(Calibrate),
    Marks(Marks),
    Trace(Trace),
    Completions(Completions),
    /// Print the manual page (roff).
    Man,
}

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
    #[arg(long, conflicts_with_all = ["scene", "animation", "rate", "strict"])]
    pub(crate) flatten: bool,
    #[command(flatten)]
    pub(crate) gltf: Gltf,
    /// What to build.
    #[arg(long, value_enum, default_value_t = Structure::Bth)]
    pub(crate) structure: Structure,
    #[command(flatten)]
    pub(crate) selection: Selection,
    /// Record that stores a tetrahedron.
    #[arg(long, value_enum, default_value_t = Record::Link32, value_name = "RECORD")]
    pub(crate) tets: Record,
    /// Bits of a coordinate of a triangle leaf: f32, 21 or 16 over the object's box. Fewer make smaller files; vertices
    /// move to the nearest points of a grid. By default f32, or what --max-error asks for.
    #[arg(long, value_name = "BITS", value_enum)]
    pub(crate) coordinates: Option<Coordinates>,
    /// Greatest distance that a vertex may move: in the units of the object (0.001), or as a share of the diagonal of its box
    /// (0.01%). The fewest bits that honour it are taken; with --coordinates, more is refused.
    #[arg(long, value_name = "DISTANCE", value_parser = str::parse::<bth_compile::coordinates::MaxError>)]
    pub(crate) max_error: Option<bth_compile::coordinates::MaxError>,
    /// Shading attributes to keep.
    #[arg(long, value_enum, default_value_t = Attributes::None)]
    pub(crate) attributes: Attributes,
    /// The BVH under each tet leaf: rays that do not start on a known surface take it, and are much faster so.
    /// By default kept with `--structure bth` and pruned with `tets`.
    #[arg(long, value_enum)]
    pub(crate) subtrees: Option<Subtrees>,
    /// The smallest tetrahedralizations: short for `--tets tet16 --subtrees prune`. Some 100 bytes a triangle where all
    /// triangles are in tetrahedra, in place of 180 to 200.
    #[arg(long, conflicts_with_all = ["tets", "subtrees"])]
    pub(crate) compact: bool,
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
    /// Animation by name or number, `all` or `none`. Of two that move the same thing the first is taken.
    #[arg(long, value_name = "ANIMATION", default_value = "all")]
    pub(crate) animation: String,
    /// Frames per second.
    #[arg(long, default_value_t = 24.0, value_parser = positive)]
    pub(crate) rate: f64,
    /// Refuse what would be ignored: skins, morph targets, animations of other things.
    #[arg(long)]
    pub(crate) strict: bool,
}

impl Gltf {
    /// The options of the import.
    pub(crate) fn options(&self) -> bth_compile::scene::ImportOptions {
        use bth_compile::scene::Chosen;
        let animation = match self.animation.as_str() {
            "all" => Chosen::All,
            "none" => Chosen::None,
            name => Chosen::One(name.to_owned()),
        };
        bth_compile::scene::ImportOptions {
            scene: self.scene.clone(),
            animation,
            rate: self.rate,
            strict: self.strict,
        }
    }
}

/// Write a scene manifest from a glTF scene, to be edited and compiled. It refers to the meshes of the glTF file,
/// so it must stand beside it or in a folder above.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Import {
    /// The glTF or GLB file.
    pub(crate) model: PathBuf,
    /// The manifest; by default the model's name with the extension .manifest, beside it.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) gltf: Gltf,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
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
    /// Bytes that tracing may read for each triangle, the BVH included; what saves least for its size stays BVH.
    #[arg(long, value_name = "BYTES", value_parser = positive)]
    pub(crate) max_bytes_per_triangle: Option<f64>,
    /// Seconds of one thread for tetrahedralization, as the profile estimates them; what saves least for its time
    /// stays BVH.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    pub(crate) budget: Option<f64>,
    /// For scenes: let the rays of their cameras, lights and frames decide, instead of rays from everywhere. What none of
    /// them meets is not tetrahedralized.
    #[arg(long)]
    pub(crate) for_scene: bool,
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

/// A finite positive number.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("expected a number above 0".into()),
    }
}

/// Show what a BTH file contains.
#[derive(Debug, Group)]
pub(crate) struct Info {
    /// The compiled file.
    #[arg(required_unless_present = "cpu")]
    pub(crate) file: Option<PathBuf>,
    /// Show the processor's features that tracing may use.
    #[arg(long)]
    pub(crate) cpu: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Check a BTH file completely: hashes, indices and geometry.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Verify {
    /// The compiled file.
    pub(crate) file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Compare two compiled files by content: objects, sections, options that made them.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Diff {
    /// A compiled file.
    pub(crate) first: PathBuf,
    /// Another one.
    pub(crate) second: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Show which nodes of a model would be tetrahedralized, which not, and why, with the costs.
#[derive(Debug, Group)]
pub(crate) struct Explain {
    /// The model.
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) selection: Selection,
    /// Tetrahedralize the chosen nodes and measure, too: predicted beside measured costs.
    #[arg(long)]
    pub(crate) measure: bool,
    /// Also draw the model, coloured by what its triangles are in and by what a bounce costs, as a PNG.
    #[arg(long, value_name = "FILE")]
    pub(crate) picture: Option<PathBuf>,
    /// Nodes to show, largest first; 0 for all.
    #[arg(long, default_value_t = 20, value_name = "N")]
    pub(crate) top: usize,
    /// Threads; 0 for one per processor.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Measure what tracing costs on this machine, for `--profile`. Takes below a minute without models.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Calibrate {
    /// Models to measure on besides our own; they must be free of bad contacts.
    pub(crate) models: Vec<PathBuf>,
    /// The profile.
    #[arg(short, long, value_name = "FILE", default_value = "bth-profile.json")]
    pub(crate) output: PathBuf,
    /// Rounds of which the fastest counts.
    #[arg(long, default_value_t = 15, value_name = "N", value_parser = rounds)]
    pub(crate) rounds: usize,
    /// Print the profile as one JSON object on standard output, too.
    #[arg(long)]
    pub(crate) json: bool,
}

/// List the triangles of a model that are in bad contact with another one, and so cannot be
/// tetrahedralized together: crossings, overlaps, T-junctions, duplicates.
#[derive(Debug, Group)]
pub(crate) struct Marks {
    /// The model.
    pub(crate) model: PathBuf,
    /// Also write the triangles that were read, as a .tris file.
    #[arg(long, value_name = "FILE")]
    pub(crate) tris: Option<PathBuf>,
    /// Threads; 0 for one per processor.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Print one JSON object, with the ids as `bad_triangles`.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Trace the rays of a .rays file and write a .hits file.
#[derive(Debug, Group)]
pub(crate) struct Trace {
    /// The compiled file.
    pub(crate) file: PathBuf,
    /// The rays.
    pub(crate) rays: PathBuf,
    /// Where the hits go.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Ask only whether anything is hit: the triangle of a hit is 0 and t is 0.
    #[arg(long)]
    pub(crate) any: bool,
    /// A .from file: the triangle that each ray starts on. Changes speed only.
    #[arg(long, value_name = "FILE", conflicts_with = "exact")]
    pub(crate) from: Option<PathBuf>,
    /// Compare every ray with every triangle in exact arithmetic instead of walking the structure: the truth to
    /// compare with, some million times slower on large models. Instances count where their transforms put them,
    /// without the rounding of rays in the object's space.
    #[arg(long)]
    pub(crate) exact: bool,
    /// Threads; 0 for one per processor.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Print a completion script.
#[derive(Debug, Group)]
pub(crate) struct Completions {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Structure {
    /// A BVH, some nodes of which are tetrahedralized where that pays.
    Bth,
    /// A BVH only.
    Bvh,
    /// One tetrahedralization of the whole model; fails if its triangles cross.
    Tets,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Subtrees {
    /// Keep them: some 32 bytes a triangle more.
    Keep,
    /// Leave them out: all rays walk the tetrahedra.
    Prune,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    Fast,
    Balanced,
    Best,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Estimator {
    /// From the number of triangles.
    FaceCount,
    /// From the average depth of the BVH.
    AverageDepth,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Select {
    /// What saves most time of all rays.
    Best,
    /// The paper's rule: from the root down, the first nodes whose tetrahedra are cheaper for rays from outside.
    Paper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OptimizeFor {
    /// Rays from outside only.
    Camera,
    /// Rays that start on known surfaces only.
    Secondary,
    /// Three rays from surfaces for one from outside.
    Balanced,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Probe {
    /// Steps of sampled rays, priced by the profile: the same on every machine.
    Steps,
    /// Nothing: all that was built stays.
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Record {
    /// 32 bytes, fastest.
    Link32,
    /// 32 bytes.
    Tet32,
    /// 20 bytes.
    Tet20,
    /// 16 bytes.
    Tet16,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Attributes {
    /// Positions only.
    None,
    /// Shading normals.
    Normals,
    /// Shading normals and texture coordinates.
    All,
}

/// A number of rounds that ends.
fn rounds(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if (1..=10_000).contains(&n) => Ok(n),
        _ => Err("expected a number from 1 to 10000".to_owned()),
    }
}

/// A number of threads that a machine may have.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= 4096 => Ok(n),
        _ => Err("expected a number from 0 to 4096".to_owned()),
    }
}

impl From<Attributes> for Keep {
    fn from(attributes: Attributes) -> Self {
        match attributes {
            Attributes::None => Keep::None,
            Attributes::Normals => Keep::Normals,
            Attributes::All => Keep::All,
        }
    }
}

impl From<Record> for bth::layout::RecordKind {
    fn from(record: Record) -> Self {
        match record {
            Record::Link32 => Self::Link32,
            Record::Tet32 => Self::Tet32,
            Record::Tet20 => Self::Tet20,
            Record::Tet16 => Self::Tet16,
        }
    }
}

impl From<Quality> for bth_compile::bvh::Quality {
    fn from(quality: Quality) -> Self {
        match quality {
            Quality::Fast => Self::Fast,
            Quality::Balanced => Self::Balanced,
            Quality::Best => Self::Best,
        }
    }
}

impl From<Estimator> for bth_compile::costs::Estimator {
    fn from(estimator: Estimator) -> Self {
        match estimator {
            Estimator::FaceCount => Self::FaceCount,
            Estimator::AverageDepth => Self::AverageDepth,
        }
    }
}

impl From<Select> for bth_compile::costs::Select {
    fn from(select: Select) -> Self {
        match select {
            Select::Best => Self::Best,
            Select::Paper => Self::Paper,
        }
    }
}

impl From<OptimizeFor> for bth_compile::costs::OptimizeFor {
    fn from(rays: OptimizeFor) -> Self {
        match rays {
            OptimizeFor::Camera => Self::Camera,
            OptimizeFor::Secondary => Self::Secondary,
            OptimizeFor::Balanced => Self::Balanced,
        }
    }
}

impl From<Probe> for bth_compile::costs::Probe {
    fn from(probe: Probe) -> Self {
        match probe {
            Probe::Steps => Self::Steps,
            Probe::Off => Self::Off,
        }
    }
}

/// Bits of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Coordinates {
    /// As in the source.
    F32,
    /// 21 bits.
    #[value(name = "21")]
    B21,
    /// 16 bits.
    #[value(name = "16")]
    B16,
}

impl From<Structure> for bth_compile::pipeline::Structure {
    fn from(structure: Structure) -> Self {
        match structure {
            Structure::Bth => Self::Bth,
            Structure::Bvh => Self::Bvh,
            Structure::Tets => Self::Tets,
        }
    }
}

impl Compile {
    /// The options of the compiler that this command line stands for.
    ///
    /// # Errors
    /// If the profile cannot be used.
    pub(crate) fn options(&self) -> bth_compile::Result<bth_compile::pipeline::Options> {
        let mut options = bth_compile::pipeline::Options {
            structure: self.structure.into(),
            attributes: self.attributes.into(),
            record: if self.compact { Record::Tet16 } else { self.tets }.into(),
            coordinates: self.coordinates(),
            keep_subtrees: match self.subtrees {
                Some(subtrees) => subtrees == Subtrees::Keep,
                None => self.structure == Structure::Bth && !self.compact,
            },
            geometry: !self.no_geometry,
            ..Default::default()
        };
        self.selection.apply(&mut options)?;
        if let Some(seconds) = self.tet_deadline {
            options.tets.deadline = std::time::Duration::from_secs(seconds);
            options.tets.deadline_per_triangle = std::time::Duration::ZERO;
        }
        if let Some(mib) = self.tet_memory {
            options.tets.memory = mib << 20;
        }
        Ok(options)
    }

    fn coordinates(&self) -> bth_compile::coordinates::Options {
        let bits = match self.coordinates {
            // Asked for by name: nothing moves, whatever may.
            Some(Coordinates::F32) => return Default::default(),
            Some(Coordinates::B21) => Some(GridBits::B21),
            Some(Coordinates::B16) => Some(GridBits::B16),
            None => None,
        };
        bth_compile::coordinates::Options { bits, max_error: self.max_error }
    }
}

impl Selection {
    /// Sets the options that concern the selection.
    ///
    /// # Errors
    /// If the profile cannot be used.
    pub(crate) fn apply(&self, options: &mut bth_compile::pipeline::Options) -> bth_compile::Result<()> {
        options.bvh.quality = self.quality.into();
        let costs = &mut options.costs;
        costs.estimator = self.estimator.into();
        costs.select = self.select.into();
        costs.optimize_for = self.optimize_for.into();
        costs.probe = self.probe.into();
        costs.for_scene = self.for_scene;
        costs.max_bytes_per_triangle = self.max_bytes_per_triangle;
        costs.budget = self.budget;
        costs.c_tet = self.c_tet;
        if self.profile.as_os_str() != "default" {
            costs.profile = bth_compile::costs::Profile::read(&self.profile)?;
        }
        if let Some(triangles) = self.min_tet_triangles {
            costs.minimum_triangles = triangles;
        }
        Ok(())
    }
}
