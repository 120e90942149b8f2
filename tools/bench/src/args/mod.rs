//! The command line: one file for the options of each command.

mod accuracy;
mod animation;
mod compare;
mod costs;
mod inside;
mod instances;
mod load;
mod models;
mod output;
mod paper;
mod quality;
mod records;
mod refit;
mod run;
mod scales;
mod scenes;
mod shutter;
mod speed;
mod stress;
mod values;

pub use accuracy::Accuracy;
pub use animation::Animation;
pub use compare::Compare;
pub use costs::Costs;
pub use inside::Inside;
pub use instances::Instances;
pub use load::{Load, LoadScenes, Probe, Start, Starts};
pub use models::{Models, SeenFrom};
pub use output::Output;
pub use paper::Paper;
pub use quality::Quality;
pub use records::{RecordRows, Summary};
pub use refit::Refit;
pub use run::RunOptions;
pub use scales::Scales;
pub use scenes::Scenes;
pub use shutter::Shutter;
pub use speed::Speed;
pub use stress::Stress;

use clap::{Parser, Subcommand};

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
    /// Points inside and outside of closed models, every answer checked along two rays and samples exactly.
    Inside(Inside),
    /// Predictions of the cost model against measurements.
    Costs(Costs),
    /// The paper's tables on our models.
    Paper(Paper),
    /// What each step of the BVH builder is worth.
    Quality(Quality),
    /// Models of all sizes, with a vertex far out, and far from the origin: whether answers depend on the scale, and what rays take.
    Scales(Scales),
    /// Scenes that move: ours, and Embree with the same instances.
    Scenes(Scenes),
    /// Instances that the caller moves: setting their transforms and committing, ours and Embree's.
    Instances(Instances),
    /// Objects that deform: new positions of all vertices, ours and Embree's.
    Refit(Refit),
    /// Scenes whose objects deform: updates and rays over whole animations, beside trees made anew for each frame.
    Animation(Animation),
    /// Motion blur of objects that deform: positions of each time, between two refits, or of each ray.
    Shutter(Shutter),
    /// One start in a process of its own; `load` calls this.
    #[command(hide = true)]
    Probe(Probe),
}
