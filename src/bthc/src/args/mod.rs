//! The command line: one definition feeds parsing, help, completions and the manual page.

pub(crate) mod cache;
mod choices;
mod common;
mod compile;
mod gltf;
mod jobs;
mod selection;

pub(crate) use cache::*;
pub(crate) use compile::*;
pub(crate) use gltf::Gltf;

use clap::{Args as Group, Parser, Subcommand};
use common::{EXIT_CODES, output_file, threads};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Compiles triangle models into BTH files, for tracing rays without building anything at the
/// start.
#[derive(Debug, Parser)]
#[command(name = "bthc", version, disable_version_flag = true, arg_required_else_help = true, after_help = EXIT_CODES, max_term_width = 100)]
pub(crate) struct Args {
    /// Instruction set for tracing: scalar, sse4, neon, simd128, avx2 or avx512. By default what
    /// BTH_ISA says, else the best of this machine. Answers do not depend on it.
    #[arg(long, global = true, value_name = "ISA")]
    pub(crate) isa: Option<bth::Isa>,
    /// Print the version and end.
    #[arg(short = 'V', long)]
    pub(crate) version: bool,
    /// With --version: also the version of files, the target, instruction sets, features, and the
    /// TetGen that is found.
    #[arg(long, requires = "version")]
    pub(crate) verbose: bool,
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Compile(Box<Compile>),
    Cache(Cache),
    Diff(Diff),
    Import(Import),
    Info(Info),
    Verify(Verify),
    Marks(Marks),
    Positions(Positions),
    Trace(Trace),
    Completions(Completions),
    /// Print the manual page (roff).
    Man,
}

/// Write a scene manifest from a glTF, FBX or 3MF scene, to be edited and compiled. It refers to
/// the meshes of the file, so keep it in the folder of that file or above.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Import {
    /// The glTF, GLB, FBX or 3MF file.
    pub(crate) model: PathBuf,
    /// The manifest; by default the model's name with the extension .manifest, in the same folder.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) gltf: Gltf,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but warnings and errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Show what a BTH file or a model contains: boxes, names, materials; of a glTF, FBX or 3MF
/// file also its animations, and what a scene skips.
#[derive(Debug, Group)]
pub(crate) struct Info {
    /// The compiled file, or a model: OBJ, PLY, STL, OFF, glTF, GLB, FBX, 3MF.
    #[arg(required_unless_present = "cpu")]
    pub(crate) file: Option<PathBuf>,
    /// Show the processor's features that tracing may use.
    #[arg(long)]
    pub(crate) cpu: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Check a BTH file completely: hashes, indices and geometry, and with --deep the answers to sample
/// rays.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Verify {
    /// The compiled file.
    pub(crate) file: PathBuf,
    /// Trace sample rays through each object, too, in all ways, and compare them, and what is known
    /// of the directions in which they start, with every triangle in exact arithmetic.
    #[arg(long)]
    pub(crate) deep: bool,
    /// Rays of each object with --deep. By default what takes some seconds.
    #[arg(long, value_name = "N", requires = "deep")]
    pub(crate) rays: Option<NonZeroUsize>,
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

/// List the triangles of a model that are in bad contact with another one, and so cannot be
/// tetrahedralized together: crossings, overlaps, T-junctions, duplicates.
#[derive(Debug, Group)]
pub(crate) struct Marks {
    /// The model.
    pub(crate) model: PathBuf,
    /// Also write the triangles that were read, as a .tris file.
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    pub(crate) tris: Option<PathBuf>,
    /// Threads; 0 for one per processor.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub(crate) threads: usize,
    /// Print one JSON object, with the ids as `bad_triangles`.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Print where the vertices of a scene are at some times, as deformed by skins and morph targets:
/// one JSON object.
#[derive(Debug, Group)]
pub(crate) struct Positions {
    /// The compiled file.
    pub(crate) file: PathBuf,
    /// Seconds of the animation; by default the first frame.
    #[arg(long, value_name = "SECONDS", num_args = 1.., allow_negative_numbers = true, value_parser = finite)]
    pub(crate) seconds: Vec<f64>,
}

/// Trace the rays of a .rays file and write a .hits file.
#[derive(Debug, Group)]
pub(crate) struct Trace {
    /// The compiled file.
    pub(crate) file: PathBuf,
    /// The rays.
    pub(crate) rays: PathBuf,
    /// Where the hits go.
    #[arg(short, long, value_name = "FILE", value_parser = output_file())]
    pub(crate) output: PathBuf,
    /// Ask only whether anything is hit: the triangle of a hit is 0 and t is 0.
    #[arg(long)]
    pub(crate) any: bool,
    /// Compare every ray with every triangle in exact arithmetic instead of walking the structure:
    /// the truth to compare with, some million times slower on large models. Instances count where
    /// their transforms put them, without the rounding of rays in the object's space.
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

/// A finite number.
fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("expected a finite number".to_owned()),
    }
}
