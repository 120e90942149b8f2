//! Options for compiling many models, and for build systems.

use super::common::{JOBS, output_file};
use bth_compile::Shard;
use clap::Args as Group;
use std::path::PathBuf;

/// How many models are compiled at once, and output for build systems.
#[derive(Clone, Debug, Group)]
pub(crate) struct Jobs {
    /// Models that are compiled at once; they share the threads. By default the number of threads.
    #[arg(short, long, help_heading = JOBS, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(crate) jobs: Option<u32>,
    /// Memory of all models and objects of scenes that are compiled at once, in MiB, estimated from
    /// the sizes of their files; by default what the machine has left. One is compiled in any case.
    #[arg(long, help_heading = JOBS, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) memory: Option<u64>,
    /// Say what would be done and why, and do nothing.
    #[arg(long, help_heading = JOBS, conflicts_with_all = ["depfile", "watch"])]
    pub(crate) dry_run: bool,
    /// Also write which files the outputs depend on, for Make and Ninja.
    #[arg(long, help_heading = JOBS, value_name = "FILE", value_parser = output_file())]
    pub(crate) depfile: Option<PathBuf>,
    /// Format of a model from standard input: obj, ply, stl, off, glb, fbx or 3mf; by default by
    /// its content.
    #[arg(long, help_heading = JOBS, value_name = "FORMAT", value_parser = ["obj", "ply", "stl", "off", "glb", "fbx", "3mf"])]
    pub(crate) format: Option<String>,
    /// Go on: compile again whenever one of the files changes, until Ctrl-C.
    #[arg(long, help_heading = JOBS, conflicts_with_all = ["json", "in_cache", "depfile"])]
    pub(crate) watch: bool,
    /// Stop, as on Ctrl-C, when standard input ends: for programs that start this one and may
    /// themselves be ended.
    #[arg(long, help_heading = JOBS)]
    pub(crate) end_with_input: bool,
    /// Compile only part I of N of the models (from 1), or of a scene's objects into the cache: for
    /// many machines. With --in-cache also of the parts in which large objects are built.
    #[arg(long, help_heading = JOBS, value_name = "I/N", value_parser = shard, conflicts_with_all = ["watch", "depfile"])]
    pub(crate) shard: Option<Shard>,
}

fn shard(text: &str) -> Result<Shard, String> {
    let shard = |(i, n): (&str, &str)| Some(Shard { number: i.parse().ok()?, of: n.parse().ok()? });
    text.split_once('/')
        .and_then(shard)
        .filter(|shard| 1 <= shard.number && shard.number <= shard.of)
        .ok_or_else(|| format!("expected I/N with I from 1 to N, such as 2/8, found {text:?}"))
}
