//! Day, commit and type of machine for reports and rows, which hold no host names and no paths.

use std::process::Command;

/// Processor, vector instructions that our kernels can use, cores and operating system.
pub(crate) fn describe() -> String {
    let isas = bth::Isa::ALL.iter().filter(|isa| isa.is_available()).map(ToString::to_string);
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
    let (isas, os) = (isas.collect::<Vec<_>>().join("/"), std::env::consts::OS);
    format!("{}, {isas}, {cores} logical cores, {os}", cpu())
}

/// The processor's name.
pub(crate) fn cpu() -> String {
    cpu_of_linux().unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

fn cpu_of_linux() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let field = |name: &str| {
        let line = text.lines().find(|l| l.split(':').next().is_some_and(|key| key.trim() == name))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    let name = field("model name")?;
    // Virtual machines hide the marketing name; family and model still tell the generation.
    match (field("cpu family"), field("model")) {
        (Some(family), Some(model)) => Some(format!("{name} (family {family}, model {model})")),
        _ => Some(name),
    }
}

/// The commit that is measured, with a note when files differ from it; `None` outside a repository.
pub(crate) fn commit() -> Option<String> {
    let git = |arguments: &[&str]| {
        let output =
            Command::new("git").arg("-C").arg(env!("CARGO_MANIFEST_DIR")).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|s| !s.is_empty());
    Some(if changed { format!("{commit} with changes") } else { commit })
}

/// Today, UTC, as `2026-11-21`.
pub(crate) fn today() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%d").to_string()
}
