//! The command line.

use crate::failure::Failure;
use clap::{Parser, ValueEnum};
use std::path::{Path, PathBuf};

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    2  wrong usage
    3  bad input: the model or the compiled file cannot be used
    4  a file could not be read or written, or there is no display for a window
    5  a limit of the format or of the machine (memory, threads) is exceeded
   70  internal error; please report it
  130  cancelled, by Ctrl-C, SIGTERM or SIGHUP";

/// Where the window writes pictures by default.
pub(crate) const SCREENSHOT: &str = "bth-play.png";

/// Renders compiled BTH files and scenes to pictures and animations.
#[derive(Clone, Debug, Parser)]
#[command(name = "bth-play", version, after_help = EXIT_CODES, max_term_width = 100)]
pub(crate) struct Args {
    /// The compiled file; or a scene manifest (.manifest, .toml) or model, which is compiled first
    /// with the bthc next to this program and mapped from the cache.
    #[arg(required_unless_present_any = ["completions", "man"])]
    file: Option<PathBuf>,
    /// A picture (.png); numbered pictures (such as frames/####.png); an animation (.apng, .gif or
    /// .y4m); a video by ffmpeg (.mp4, .mov, .mkv or .webm); or `-` for YUV4MPEG2 on standard
    /// output.
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["completions", "man", "window"])]
    output: Option<PathBuf>,
    /// Show the file in a window: orbit, fly, play, scrub, change the mode; the picture is refined
    /// to --spp samples while nothing moves. H prints the keys.
    #[arg(long, conflicts_with_all = ["output", "shard", "tiles", "force"])]
    pub(crate) window: bool,
    /// Where the key P of the window writes the picture; by default bth-play.png.
    #[arg(long, value_name = "FILE", requires = "window", conflicts_with = "output")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Close the window after it has shown N pictures, and write the last to the file of
    /// --screenshot.
    #[arg(long, value_name = "N", requires = "window", conflicts_with = "output", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) window_frames: Option<u32>,
    /// Frames of a scene, both included, or one; by default the first for a picture, else all of
    /// them.
    #[arg(long, value_name = "A..B", value_parser = parse_frames, allow_hyphen_values = true)]
    pub(crate) frames: Option<(i32, i32)>,
    /// Render part I of N of the frames, or with --tiles of their tiles, from 1, for many machines;
    /// needs numbered pictures, or --tiles.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    pub(crate) shard: Option<(u32, u32)>,
    /// Cut each picture into columns and rows. With --shard, tiles are written next to the picture;
    /// without it they are put together, and those that are missing are rendered. The picture is
    /// the same as without --tiles.
    #[arg(long, value_name = "CxR", value_parser = parse_tiles)]
    pub(crate) tiles: Option<(u32, u32)>,
    /// Render frames again whose pictures are there and whole.
    #[arg(long)]
    pub(crate) force: bool,
    /// Instruction set: scalar, sse4, neon, simd128, avx2 or avx512. By default what BTH_ISA says,
    /// else the best of this machine. Pictures do not depend on it.
    #[arg(long, value_name = "ISA")]
    pub(crate) isa: Option<bth::Isa>,
    /// Width and height of the picture.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub(crate) size: (u32, u32),
    /// What to show.
    #[arg(long, value_enum, default_value_t = Mode::Shaded)]
    pub(crate) mode: Mode,
    /// Eye and target in world space, or the name of a camera of the scene. By default the scene's
    /// first choice; without one the camera shows the whole model.
    #[arg(long, value_name = "NAME|EX,EY,EZ,TX,TY,TZ", value_parser = parse_camera, allow_hyphen_values = true, conflicts_with_all = ["yaw", "pitch", "inside"])]
    pub(crate) camera: Option<View>,
    /// Degrees around the model, from its front; 35 by default.
    #[arg(long, allow_hyphen_values = true, value_parser = parse_finite)]
    pub(crate) yaw: Option<f64>,
    /// Degrees above the horizon; 20 by default.
    #[arg(long, allow_hyphen_values = true, value_parser = parse_finite)]
    pub(crate) pitch: Option<f64>,
    /// Magnification.
    #[arg(long, default_value_t = 1.0, value_parser = parse_positive)]
    pub(crate) zoom: f64,
    /// Vertical field of view in degrees; by default 32, and 75 from inside.
    #[arg(long, value_parser = parse_fov)]
    pub(crate) fov: Option<f64>,
    /// The axis of the model that points up; y by default.
    #[arg(long, value_enum)]
    pub(crate) up: Option<Axis>,
    /// Look from a point within the model, for rooms.
    #[arg(long, conflicts_with_all = ["yaw", "pitch"])]
    pub(crate) inside: bool,
    /// Samples per pixel.
    #[arg(long, default_value_t = 16, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) spp: u32,
    /// Motion blur: frames for which the shutter is open, around the time of each picture, such as
    /// 0.5. Each sample sees the scene at a different time. By default pictures show an instant.
    #[arg(long, value_name = "FRAMES", value_parser = parse_positive)]
    pub(crate) shutter: Option<f64>,
    /// Crease angle of models without normals: triangles turned from each other by less than these
    /// degrees look smooth. 0 shows facets.
    #[arg(long, value_name = "DEGREES", default_value_t = 30.0, value_parser = parse_crease)]
    pub(crate) smooth: f64,
    /// No ground below what is shown. Scenes with a floor get none, nor do rooms.
    #[arg(long)]
    pub(crate) no_ground: bool,
    /// Times that light is reflected, in mode path; 4 by default.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=64))]
    pub(crate) bounces: Option<u32>,
    /// Remove noise in mode path: with Open Image Denoise where it is installed (auto, which is the
    /// default, but never with --shard or --tiles), with the built-in filter, with Open Image
    /// Denoise, or not.
    #[arg(long, value_enum, default_value_t = Denoise::Auto)]
    pub(crate) denoise: Denoise,
    /// Stops by which mode path brightens light: 1 doubles it, -1 halves it. By default small
    /// pictures of the scene decide, for all frames alike.
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true, value_parser = parse_exposure)]
    pub(crate) exposure: Option<f64>,
    /// Light from all around in mode path, a picture in Radiance format (.hdr) over longitude and
    /// latitude; by default a sky, and a sun where the scene has no lights.
    #[arg(long, value_name = "FILE")]
    pub(crate) env: Option<PathBuf>,
    /// Upper end of the heat map of mode steps; by default according to each picture.
    #[arg(long, value_name = "STEPS", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) scale: Option<u32>,
    /// Threads; 0 for one per processor, or more where the file does not fit in memory. The picture
    /// does not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = parse_threads)]
    pub(crate) threads: usize,
    /// Read the whole file and check it, instead of mapping it. A mapped file must be as bthc wrote
    /// it, and nobody may change it meanwhile.
    #[arg(long)]
    pub(crate) read: bool,
    /// Folder of the cache; by default BTH_CACHE_DIR, else `bth` in the user's folder for caches.
    #[arg(long, value_name = "FOLDER")]
    pub(crate) cache_dir: Option<PathBuf>,
    /// Also print what each frame took, memory, what was read from storage, and how many objects
    /// were touched.
    #[arg(long)]
    pub(crate) stats: bool,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print a completion script for this shell and end.
    #[arg(long, value_name = "SHELL", exclusive = true)]
    pub(crate) completions: Option<clap_complete::Shell>,
    /// Print the manual page (roff) and end.
    #[arg(long, exclusive = true)]
    pub(crate) man: bool,
}

/// What is shown, in the order of the keys in the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Mode {
    /// The materials of the file under two lights; what has none is clay.
    Shaded,
    /// Normals as colours.
    Normals,
    /// Ambient occlusion.
    Ao,
    /// Heat map of the traversal steps of camera rays.
    Steps,
    /// Path tracing of the file's materials with the scene's lights, a sky and a sun.
    Path,
    /// Each instance in a different colour.
    Instances,
    /// As shaded, everything of matte clay.
    Clay,
}

/// How noise is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Denoise {
    /// With Open Image Denoise where it is installed, else with the built-in filter.
    Auto,
    /// With the built-in filter, whose pictures are the same on all machines.
    On,
    /// With Open Image Denoise, which has to be installed.
    Oidn,
    /// Not.
    Off,
}

/// The camera that the options name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum View {
    /// Eye and target.
    Points([f64; 6]),
    /// A camera of the scene.
    Named(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Axis {
    Y,
    Z,
}

impl Args {
    /// The compiled file or source, which clap requires.
    pub(crate) fn file(&self) -> Result<&Path, Failure> {
        self.file.as_deref().ok_or_else(|| Failure::Usage("a file is needed".to_owned()))
    }

    /// The axis that points up.
    pub(crate) fn up(&self) -> Axis {
        self.up.unwrap_or(Axis::Y)
    }

    /// Times that light is reflected in mode path.
    pub(crate) fn bounces(&self) -> u32 {
        self.bounces.unwrap_or(4)
    }

    /// The same options with another number of samples per pixel.
    pub(crate) fn with_samples(&self, spp: u32) -> Self {
        Self { spp, ..self.clone() }
    }

    /// Returns true if the pictures go to standard output.
    pub(crate) fn takes_stdout(&self) -> bool {
        self.output.as_deref() == Some(Path::new("-"))
    }

    /// Where pictures go, which clap requires unless they go to a window.
    pub(crate) fn output(&self) -> Result<&Path, Failure> {
        self.output.as_deref().ok_or_else(|| Failure::Usage("an output is needed".to_owned()))
    }
}

impl Mode {
    /// Returns true if it shows how materials look.
    pub(crate) fn shows_materials(self) -> bool {
        matches!(self, Mode::Shaded | Mode::Path)
    }

    /// Returns the name on the command line.
    pub(crate) fn name(self) -> String {
        format!("{self:?}").to_ascii_lowercase()
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
    Ok((parse_up_to(parts.0, "pixels", 16384)?, parse_up_to(parts.1, "pixels", 16384)?))
}

fn parse_tiles(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X']).ok_or("expected COLUMNSxROWS, such as 4x2")?;
    Ok((parse_up_to(parts.0, "columns", 64)?, parse_up_to(parts.1, "rows", 64)?))
}

fn parse_up_to(text: &str, what: &str, most: u32) -> Result<u32, String> {
    let number = text.parse().ok().filter(|n| (1..=most).contains(n));
    number.ok_or_else(|| format!("expected a number of {what} from 1 to {most}, found {text:?}"))
}

/// Six numbers, or else a name. A list of fewer or more numbers is an error, since it is hardly the
/// name of a camera.
fn parse_camera(text: &str) -> Result<View, String> {
    let parts: Vec<&str> = text.split(',').collect();
    let numbers: Vec<f64> = parts.iter().map_while(|s| s.trim().parse().ok()).collect();
    if parts.len() == 1 || numbers.len() < parts.len() {
        return Ok(View::Named(text.to_owned()));
    }
    let camera = <[f64; 6]>::try_from(numbers).map_err(|numbers| {
        format!("expected six numbers or the name of a camera, found {} numbers", numbers.len())
    })?;
    if camera.iter().any(|x| !x.is_finite()) {
        return Err("expected finite numbers".to_owned());
    }
    if camera[..3] == camera[3..] {
        return Err("the eye and the target are the same point".to_owned());
    }
    Ok(View::Points(camera))
}

fn parse_frames(text: &str) -> Result<(i32, i32), String> {
    let number = |s: &str| s.trim().parse::<i32>().map_err(|_| format!("expected a frame, found {s:?}"));
    let (first, last) = match text.split_once("..") {
        Some((a, b)) => (number(a)?, number(b)?),
        None => (number(text)?, number(text)?),
    };
    if last < first {
        return Err(format!("expected a last frame from {first} on, found {last}"));
    }
    Ok((first, last))
}

fn parse_shard(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    parts
        .filter(|(i, n)| 1 <= *i && i <= n)
        .ok_or_else(|| format!("expected I/N with I from 1 to N, such as 2/8, found {text:?}"))
}

fn parse_finite(text: &str) -> Result<f64, String> {
    text.parse::<f64>()
        .ok()
        .filter(|n| n.is_finite())
        .ok_or_else(|| format!("expected a finite number, found {text:?}"))
}

fn parse_crease(text: &str) -> Result<f64, String> {
    let degrees = parse_finite(text).ok().filter(|degrees| (0.0..=180.0).contains(degrees));
    degrees.ok_or_else(|| format!("expected degrees from 0 to 180, found {text:?}"))
}

fn parse_exposure(text: &str) -> Result<f64, String> {
    let stops = parse_finite(text).ok().filter(|stops| stops.abs() <= 30.0);
    stops.ok_or_else(|| format!("expected stops from -30 to 30, found {text:?}"))
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
