//! The command line: one definition feeds parsing, help, completions and the manual page.

use bth_compile::mesh::Keep;
use clap::{Args as Group, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  a check failed (verify)
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
    Compile(Compile),
    Import(Import),
    Info(Info),
    Verify(Verify),
    Explain(Explain),
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
    /// The model or scene; what ends with .manifest or .toml is a scene manifest.
    pub(crate) model: PathBuf,
    /// The compiled file; by default the model's name with the extension .bth, beside it.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
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
    /// Shading attributes to keep.
    #[arg(long, value_enum, default_value_t = Attributes::None)]
    pub(crate) attributes: Attributes,
    /// The BVH under each tet leaf: rays that do not start on a known surface take it, and are much faster so.
    /// By default kept with `--structure bth` and pruned with `tets`.
    #[arg(long, value_enum)]
    pub(crate) subtrees: Option<Subtrees>,
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

/// Show which nodes of a model would be tetrahedralized, which not, and why, with the costs.
#[derive(Debug, Group)]
pub(crate) struct Explain {
    /// The model.
    pub(crate) model: PathBuf,
    #[command(flatten)]
    pub(crate) selection: Selection,
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
    #[arg(long, value_name = "FILE")]
    pub(crate) from: Option<PathBuf>,
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

/// A number of threads that a machine may have.
fn threads(text: &str) -> Result<usize, String> {
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
    pub(crate) fn options(&self) -> bth_compile::pipeline::Options {
        let mut options = bth_compile::pipeline::Options {
            structure: self.structure.into(),
            attributes: self.attributes.into(),
            record: self.tets.into(),
            keep_subtrees: match self.subtrees {
                Some(subtrees) => subtrees == Subtrees::Keep,
                None => self.structure == Structure::Bth,
            },
            geometry: !self.no_geometry,
            ..Default::default()
        };
        self.selection.apply(&mut options);
        if let Some(seconds) = self.tet_deadline {
            options.tets.deadline = std::time::Duration::from_secs(seconds);
            options.tets.deadline_per_triangle = std::time::Duration::ZERO;
        }
        if let Some(mib) = self.tet_memory {
            options.tets.memory = mib << 20;
        }
        options
    }
}

impl Selection {
    /// Sets the options that concern the selection.
    pub(crate) fn apply(&self, options: &mut bth_compile::pipeline::Options) {
        options.bvh.quality = self.quality.into();
        options.costs.estimator = self.estimator.into();
        if let Some(triangles) = self.min_tet_triangles {
            options.costs.minimum_triangles = triangles;
        }
        if let Some(nanoseconds) = self.c_tet {
            options.costs.c_tet = nanoseconds;
        }
    }
}
