//! The command line.

use crate::failure::Failure;
use clap::{Parser, ValueEnum};
use std::path::{Path, PathBuf};

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    2  wrong usage
    3  bad input: the compiled file cannot be used
    4  a file could not be read or written";

/// Renders a compiled BTH file to a PNG picture.
#[derive(Debug, Parser)]
#[command(name = "bth-play", version, after_help = EXIT_CODES, max_term_width = 100)]
pub(crate) struct Args {
    /// The compiled file.
    #[arg(required_unless_present = "completions")]
    file: Option<PathBuf>,
    /// The picture (PNG).
    #[arg(short, long, value_name = "PNG", required_unless_present = "completions")]
    output: Option<PathBuf>,
    /// Width and height of the picture.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub(crate) size: (u32, u32),
    /// What to show.
    #[arg(long, value_enum, default_value_t = Mode::Shaded)]
    pub(crate) mode: Mode,
    /// Eye and target, in the model's space; by default the camera shows the whole model.
    #[arg(long, value_name = "EX,EY,EZ,TX,TY,TZ", value_parser = parse_camera, allow_hyphen_values = true, conflicts_with_all = ["yaw", "pitch", "inside"])]
    pub(crate) camera: Option<[f64; 6]>,
    /// Degrees around the model, from its front.
    #[arg(long, default_value_t = 35.0, allow_hyphen_values = true, value_parser = parse_finite)]
    pub(crate) yaw: f64,
    /// Degrees above the horizon.
    #[arg(long, default_value_t = 20.0, allow_hyphen_values = true, value_parser = parse_finite)]
    pub(crate) pitch: f64,
    /// Magnification.
    #[arg(long, default_value_t = 1.0, value_parser = parse_positive)]
    pub(crate) zoom: f64,
    /// Vertical field of view in degrees; by default 32, and 75 from inside.
    #[arg(long, value_parser = parse_fov)]
    pub(crate) fov: Option<f64>,
    /// The axis of the model that points up.
    #[arg(long, value_enum, default_value_t = Axis::Y)]
    pub(crate) up: Axis,
    /// Look from a point within the model, for rooms.
    #[arg(long, conflicts_with_all = ["yaw", "pitch"])]
    pub(crate) inside: bool,
    /// Samples per pixel.
    #[arg(long, default_value_t = 16, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) spp: u32,
    /// No ground under the model.
    #[arg(long)]
    pub(crate) no_ground: bool,
    /// Threads; 0 for one per processor. The picture does not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = parse_threads)]
    pub(crate) threads: usize,
    /// Map the file instead of reading and checking it. It must be as bthc wrote it, and nobody may
    /// change it meanwhile.
    #[arg(long)]
    pub(crate) map: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print a completion script for this shell and end.
    #[arg(long, value_name = "SHELL", exclusive = true)]
    pub(crate) completions: Option<clap_complete::Shell>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Mode {
    /// Clay under two lights.
    Shaded,
    /// Normals as colours.
    Normals,
    /// Ambient occlusion.
    Ao,
    /// Heat map of the traversal steps of camera rays.
    Steps,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Axis {
    Y,
    Z,
}

impl Args {
    /// The compiled file and the picture; clap has seen to it that they are there.
    pub(crate) fn paths(&self) -> Result<(&Path, &Path), Failure> {
        match (&self.file, &self.output) {
            (Some(file), Some(output)) => Ok((file, output)),
            _ => Err(Failure::Usage("a file and an output are needed".to_owned())),
        }
    }
}

impl Mode {
    /// As on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Mode::Shaded => "shaded",
            Mode::Normals => "normals",
            Mode::Ao => "ao",
            Mode::Steps => "steps",
        }
    }
}

fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= 4096 => Ok(n),
        _ => Err("expected a number from 0 to 4096".to_owned()),
    }
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X']).ok_or("expected WIDTHxHEIGHT, such as 1280x720")?;
    let parse = |s: &str| match s.parse::<u32>() {
        Ok(n) if (1..=16384).contains(&n) => Ok(n),
        _ => Err(format!("expected a number of pixels from 1 to 16384, found {s:?}")),
    };
    Ok((parse(parts.0)?, parse(parts.1)?))
}

fn parse_camera(text: &str) -> Result<[f64; 6], String> {
    let numbers = text.split(',').map(|s| parse_finite(s.trim())).collect::<Result<Vec<_>, _>>()?;
    let camera: [f64; 6] =
        numbers.try_into().map_err(|n: Vec<f64>| format!("expected six numbers, found {}", n.len()))?;
    if camera[..3] == camera[3..] {
        return Err("the eye and the target are the same point".to_owned());
    }
    Ok(camera)
}

fn parse_finite(text: &str) -> Result<f64, String> {
    text.parse::<f64>()
        .ok()
        .filter(|n| n.is_finite())
        .ok_or_else(|| format!("expected a finite number, found {text:?}"))
}

fn parse_positive(text: &str) -> Result<f64, String> {
    parse_finite(text)
        .ok()
        .filter(|n| *n > 0.0)
        .ok_or_else(|| format!("expected a number above 0, found {text:?}"))
}

fn parse_fov(text: &str) -> Result<f64, String> {
    parse_finite(text)
        .ok()
        .filter(|n| (0.01..=175.0).contains(n))
        .ok_or_else(|| format!("expected degrees from 0.01 to 175, found {text:?}"))
}
