//! Where a command writes its results.

use super::values::file_name;
use clap::Args;
use std::path::PathBuf;

/// Where results go besides standard output.
#[derive(Clone, Debug, Default, Args)]
pub struct Output {
    /// Write JSON there.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Draw SVG charts into this folder.
    #[arg(long, value_name = "DIR")]
    pub svg: Option<PathBuf>,
    /// Keep a report in this folder: DATE-NAME.md, DATE-NAME.json and charts.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Name of the report; by default that of the measurement.
    #[arg(long, value_name = "NAME", value_parser = file_name)]
    pub name: Option<String>,
}
