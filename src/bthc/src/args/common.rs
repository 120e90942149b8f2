//! What several commands share: the exit codes in the help, and the number of threads.

/// Exit codes, as the help lists them.
pub(super) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  a check failed (verify, cache verify), or files differ (diff)
    2  wrong usage
    3  bad input: the model or the compiled file cannot be used
    4  a file could not be read or written
    5  the model exceeds a limit of the format
   70  internal error; please report it
  130  cancelled";

/// Parses a number of threads: at most 4096, 0 for one per processor.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= 4096 => Ok(n),
        _ => Err("expected a number from 0 to 4096".to_owned()),
    }
}
