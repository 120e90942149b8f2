//! The options of `record` and `summary`.

use clap::Args;
use std::path::PathBuf;

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
