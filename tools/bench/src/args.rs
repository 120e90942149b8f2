//! The command line.

use crate::names::Names;
use crate::rays::View;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

/// Measures bth beside other CPU ray tracers on identical rays.
#[derive(Debug, Parser)]
#[command(name = "bth-bench", version, max_term_width = 100)]
pub struct Arguments {
    /// What to measure.
    #[command(subcommand)]
    pub command: Command,
}

/// The measurements.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Rays per second of our structures and the rivals.
    Speed(Speed),
    /// Whether a build of libbth is faster than another, in one interleaved run. Exit code 3 if it is slower.
    Compare(Compare),
    /// Measures what a definition names and appends the rows to the record of this machine.
    Record(RecordRows),
    /// Writes the summary of all records.
    Summary(Summary),
    /// Run time and bytes against every kind of error, ours and rivals'.
    Accuracy(Accuracy),
    /// Opening a compiled file and tracing the first rays, against building at the start.
    Load(Load),
    /// Opening compiled scenes against building all their objects at the start.
    LoadScenes(LoadScenes),
    /// Hard rays on hard surfaces, every answer checked exactly: misses, leaks, ghosts, errors of t.
    Stress(Stress),
    /// Predictions of the cost model against measurements.
    Costs(Costs),
    /// The paper's tables on our models.
    Paper(Paper),
    /// What each step of the BVH builder is worth.
    Quality(Quality),
    /// Scenes that move: ours, and Embree with the same instances.
    Scenes(Scenes),
    /// One start in a process of its own; `load` calls this.
    #[command(hide = true)]
    Probe(Probe),
}

/// Which models, and from where they are seen.
#[derive(Debug, Args)]
pub struct Models {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Stand within the models, as is right for rooms; decided by each model when absent.
    #[arg(long, conflicts_with = "outside")]
    pub inside: bool,
    /// Stand outside of the models.
    #[arg(long)]
    pub outside: bool,
}

impl Models {
    /// The view that was asked for.
    pub fn view(&self) -> Option<View> {
        match (self.inside, self.outside) {
            (true, _) => Some(View::Inside),
            (_, true) => Some(View::Outside),
            _ => None,
        }
    }
}

/// Where results go besides standard output.
#[derive(Clone, Debug, Default, Args)]
pub struct Output {
    /// Write JSON there.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Draw SVG charts into this folder.
    #[arg(long, value_name = "DIR")]
    pub svg: Option<PathBuf>,
    /// Keep a record in this folder: DATE-NAME.md, DATE-NAME.json and charts.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Name of the record; by default that of the measurement.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
}

/// `speed`.
#[derive(Debug, Args)]
pub struct Speed {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    pub rays: usize,
    /// Rounds of which the median counts; one more comes before and warms up.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Numbers of threads to trace on: CPU time is measured for 1, wall-clock time for more.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1", value_parser = at_least_one)]
    pub threads: Vec<usize>,
    /// Only these tracers; a star at the end stands for any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub tracers: Names,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub sets: Names,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Small pictures and one round: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `compare`.
#[derive(Debug, Args)]
pub struct Compare {
    /// The build to compare with: a libbth.so.
    pub old: PathBuf,
    /// The build that may be faster.
    pub new: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 65_536, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the median counts; one more comes before and warms up.
    #[arg(long, value_name = "N", default_value_t = 11, value_parser = at_least_one)]
    pub rounds: usize,
    /// Rays in a call; 1 for one ray a call.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = at_least_one)]
    pub batch: usize,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub sets: Names,
    /// Vector instructions of both builds; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// A set is slower when its mean over the models is certainly (95 %) greater by more than this, such as `1%`.
    #[arg(long, value_name = "P%", default_value = "1%", value_parser = share)]
    pub worse: f64,
    /// Small pictures and one round: whether it works, not what is faster.
    #[arg(long)]
    pub quick: bool,
    /// Write JSON there.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// `record`.
#[derive(Debug, Args)]
pub struct RecordRows {
    /// Name of a file of benchmarks/definitions, without `.toml`.
    pub definition: String,
    /// Folder that holds `definitions/` and `record/`.
    #[arg(long, value_name = "DIR", default_value = "benchmarks")]
    pub folder: PathBuf,
    /// Folder of the models that definitions name by file.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub models: PathBuf,
    /// Small pictures and one round; prints the rows and appends nothing.
    #[arg(long)]
    pub quick: bool,
}

/// `summary`.
#[derive(Debug, Args)]
pub struct Summary {
    /// Folder that holds `definitions/` and `record/`; SUMMARY.md is written there.
    #[arg(long, value_name = "DIR", default_value = "benchmarks")]
    pub folder: PathBuf,
    /// Draw charts of the newest values into this folder, too.
    #[arg(long, value_name = "DIR")]
    pub charts: Option<PathBuf>,
    /// Only checks that SUMMARY.md is up to date.
    #[arg(long)]
    pub check: bool,
}

/// `accuracy`.
#[derive(Debug, Args)]
pub struct Accuracy {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the median time counts; one more comes before and warms up.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub rounds: usize,
    /// Only these tracers; a star at the end stands for any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub tracers: Names,
    /// One of this many rays is compared with every triangle in exact arithmetic.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = at_least_one)]
    pub one_in: usize,
    /// Small pictures, few rays and one round: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `load`.
#[derive(Debug, Args)]
pub struct Load {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub starts: Starts,
}

/// How programs start, and how often.
#[derive(Debug, Args)]
pub struct Starts {
    /// First rays to trace.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub rounds: usize,
    /// Numbers of threads to build and trace on.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1,2", value_parser = at_least_one)]
    pub threads: Vec<usize>,
    /// Folder for the compiled files: its storage is what a cold start reads from.
    #[arg(long, value_name = "DIR")]
    pub scratch: Option<PathBuf>,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `load-scenes`.
#[derive(Debug, Args)]
pub struct LoadScenes {
    /// Manifests or glTF files, or `objects:N` for N generated objects.
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub starts: Starts,
}

/// `stress`.
#[derive(Debug, Args)]
pub struct Stress {
    /// Rays to trace in all, in millions; each counts once for every structure and query that it goes through.
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub millions: u64,
    /// Size of the shapes: the number of their triangles grows with its square.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(i32).range(1..=64))]
    pub size: i32,
    /// One of this many rays is compared with every triangle.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = at_least_one)]
    pub one_in: usize,
    /// Start of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `costs`.
#[derive(Debug, Args)]
pub struct Costs {
    /// Models that the estimators are judged on: files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Models that constants are fitted on.
    #[arg(long, value_name = "MODEL,…", value_delimiter = ',', required = true)]
    pub fit: Vec<String>,
    /// Small models, on which every selection is measured.
    #[arg(long, value_name = "MODEL,…", value_delimiter = ',')]
    pub small: Vec<String>,
    /// Least triangles of a node.
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub least: u32,
    /// Most triangles of a node.
    #[arg(long, value_name = "N", default_value_t = 300_000)]
    pub most: u32,
    /// Nodes of a model, at most.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = at_least_one)]
    pub nodes: usize,
    /// Nodes of a model to fit on, at most; by default as many.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub fit_nodes: Option<usize>,
    /// Rounds of which the fastest counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub rounds: usize,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `paper`.
#[derive(Debug, Args)]
pub struct Paper {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Rounds of which the fastest counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    pub rounds: usize,
    /// Triangles of the largest model that gets a k-d tree, which takes long to build.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub most_kd: usize,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Small pictures: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `quality`.
#[derive(Debug, Args)]
pub struct Quality {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 60_000, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the fastest counts.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = at_least_one)]
    pub rounds: usize,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub sets: Names,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Small pictures and one round: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

/// `scenes`.
#[derive(Debug, Args)]
pub struct Scenes {
    /// Scenes of `bth-scenes list`, or manifests.
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Frames to measure, evenly over the range.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub frames: usize,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Width of the pictures, which are 16:9.
    #[arg(long, value_name = "PIXELS", default_value_t = 640, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub width: u32,
    /// Only these tracers; a star at the end stands for any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub tracers: Names,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Small pictures: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}

impl Scenes {
    /// Width and height, multiples of 4.
    pub fn size(&self) -> (u32, u32) {
        let width = self.width.next_multiple_of(4);
        (width, (width * 9 / 16).next_multiple_of(4))
    }
}

/// `probe`.
#[derive(Debug, Args)]
pub struct Probe {
    /// How to start.
    #[arg(long, value_enum)]
    pub start: crate::load::probe::Start,
    /// Numbers of threads to build and trace on.
    #[arg(long)]
    pub threads: usize,
    /// Vector instructions of our kernels.
    #[arg(long)]
    pub isa: Option<String>,
    /// How many of the rays are the first; all if absent.
    #[arg(long)]
    pub first: Option<usize>,
    /// Compiled file, or for a rival the triangles.
    pub file: PathBuf,
    /// The rays, the first of which hits.
    pub rays: PathBuf,
}

/// A share given in per cent.
fn share(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|n| n.trim().parse::<f64>().ok());
    number
        .filter(|p| (0.0..100.0).contains(p))
        .map(|p| p / 100.0)
        .ok_or_else(|| "expected a share such as 1%".to_owned())
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "expected a number from 1".to_owned())
}
