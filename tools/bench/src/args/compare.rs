//! The options of `compare`.

use super::models::SeenFrom;
use super::values::{at_least_one, share};
use crate::names::Names;
use clap::Args;
use std::path::PathBuf;

/// `compare`.
#[derive(Debug, Args)]
pub struct Compare {
    /// The build to compare with: a libbth.so.
    pub old: PathBuf,
    /// The build that may be faster.
    pub new: PathBuf,
    /// Model files, models of `bth-scenes list` by NAME or NAME:FACES, or compiled .bth files, which are used as they are. Builds
    /// of other versions of the format than this program need `OLD.bth,NEW.bth`: the model as compiled for each of them.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub seen_from: SeenFrom,
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
    /// Vector instructions of both builds, or of the old and the new one; the best that the machine has when absent.
    #[arg(long, value_name = "NAME[,NAME]")]
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
