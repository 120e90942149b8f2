//! The options of `load`, `load-scenes` and `probe`.

use super::models::Models;
use super::output::Output;
use super::values::at_least_one;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::path::PathBuf;

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

/// How a program comes to a structure that it can trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// `bth::map`.
    Map,
    /// `bth::open`: reads and checks.
    Read,
    /// Embree builds from triangles in memory, as by default.
    Embree,
    /// As the line above, in Embree's robust mode.
    EmbreeRobust,
    /// Embree builds the objects of a scene and their instances.
    EmbreeScene,
    /// As the line above, in Embree's robust mode.
    EmbreeSceneRobust,
}

impl Start {
    /// As on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Start::Map => "map",
            Start::Read => "read",
            Start::Embree => "embree",
            Start::EmbreeRobust => "embree-robust",
            Start::EmbreeScene => "embree-scene",
            Start::EmbreeSceneRobust => "embree-scene-robust",
        }
    }
}

/// `probe`.
#[derive(Debug, Args)]
pub struct Probe {
    /// How to start.
    #[arg(long, value_enum)]
    pub start: Start,
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
