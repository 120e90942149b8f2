//! What several commands share: headings and exit codes in the help, and kinds of numbers.

use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::PathBuf;

/// Exit codes, as the help lists them.
pub(super) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  a check failed (verify, cache verify), or files differ (diff)
    2  wrong usage
    3  bad input: the model or the compiled file cannot be used
    4  a file could not be read or written
    5  a limit of the format or of the machine (memory, threads) is exceeded
   70  internal error; please report it
  130  cancelled, by Ctrl-C, SIGTERM or SIGHUP";

// The headings of the help. Each option names its own, since one that is set for a group of options
// would hold for what follows the group, too.
pub(super) const CACHE: &str = "Cache";
pub(super) const DEFORMING: &str = "Objects that deform";
pub(super) const GLTF: &str = "Scenes from glTF, FBX and 3MF";
pub(super) const JOBS: &str = "Many models and build systems";
pub(super) const KEPT: &str = "What the file keeps";
pub(super) const SMALLER: &str = "Smaller files";

/// Parses a number of threads: at most 4096, 0 for one per processor.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= 4096 => Ok(n),
        _ => Err("expected a number from 0 to 4096".to_owned()),
    }
}

/// Parses the path of a file that is written, which standard output cannot take the place of.
pub(super) fn output_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match path.as_os_str() == "-" {
        true => Err("expected the name of a file, not standard output; ./- is a file of that name"),
        false => Ok(path),
    })
}

/// Parses a finite positive number.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("expected a number above 0".into()),
    }
}
