//! What the worker does to its own process before the first job.
#![allow(unsafe_code)]

use std::fs::File;
use std::io;
use std::os::fd::FromRawFd;

/// Where frames go. TetGen prints, so descriptor 1 itself is pointed at the null device.
///
/// # Errors
/// The system's.
pub(crate) fn frames_apart_from_prints() -> io::Result<File> {
    let null = std::fs::OpenOptions::new().write(true).open("/dev/null")?;
    // SAFETY: `dup` only reads the descriptor table; on success nothing else owns the new
    // descriptor.
    let frames = unsafe { libc::dup(1) };
    if frames < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: `frames` was just returned by `dup`, is open, and nothing else owns it.
    let frames = unsafe { File::from_raw_fd(frames) };
    let null_fd = std::os::fd::AsRawFd::as_raw_fd(&null);
    // SAFETY: both descriptors are open (`null` lives until the end of this function); Rust's
    // stdout refers to 1 by number and keeps working on whatever 1 is.
    if unsafe { libc::dup2(null_fd, 1) } < 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(frames)
}

/// Limits memory (bytes of address space), forbids core files and, given the parent's process
/// id, arranges to die with it.
///
/// # Errors
/// The system's, or when the parent is gone already.
pub(crate) fn confine(memory: Option<u64>, parent: Option<u64>) -> io::Result<()> {
    limit(libc::RLIMIT_CORE, 0)?;
    if let Some(bytes) = memory {
        limit(libc::RLIMIT_AS, bytes)?;
    }
    if let Some(parent) = parent {
        #[cfg(target_os = "linux")]
        // SAFETY: PR_SET_PDEATHSIG takes a signal number and accesses no memory of this process.
        if unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) } != 0 {
            return Err(io::Error::last_os_error());
        }
        // It may have died before the call above.
        if u64::from(std::os::unix::process::parent_id()) != parent {
            return Err(io::Error::other("the parent is gone"));
        }
    }
    Ok(())
}

#[cfg(target_os = "linux")]
type Resource = libc::__rlimit_resource_t;
#[cfg(not(target_os = "linux"))]
type Resource = libc::c_int;

fn limit(resource: Resource, value: u64) -> io::Result<()> {
    let mut now = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `now` is a valid rlimit that the call fills.
    if unsafe { libc::getrlimit(resource, &mut now) } != 0 {
        return Err(io::Error::last_os_error());
    }
    let value = (value as libc::rlim_t).min(now.rlim_max);
    let wanted = libc::rlimit { rlim_cur: value, rlim_max: value };
    // SAFETY: `wanted` is a valid rlimit that the call only reads.
    if unsafe { libc::setrlimit(resource, &wanted) } != 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(())
}
