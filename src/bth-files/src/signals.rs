//! Signals that end a program unless it says otherwise. For programs, not for libraries: what a
//! signal does holds for the whole process.
#![allow(unsafe_code)]

/// Installs handlers of the signals that end a program. A hangup that the program was told to
/// ignore (`nohup`) stays ignored.
pub fn install<T>(handlers: impl FnOnce() -> T) -> T {
    #[cfg(unix)]
    let is_ignored = is_ignored(libc::SIGHUP);
    let installed = handlers();
    #[cfg(unix)]
    if is_ignored {
        ignore(libc::SIGHUP);
    }
    installed
}

/// Makes writes beyond the limit on the size of files (`ulimit -f`) fail with an error. Without
/// this they end the program by SIGXFSZ.
pub fn survive_file_size_limit() {
    #[cfg(unix)]
    ignore(libc::SIGXFSZ);
}

/// Returns true if this process ignores a signal.
#[cfg(unix)]
pub fn is_ignored(signal: i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::uninit();
    // SAFETY: With a null action the system changes nothing and writes the present one to `action`,
    // which has room for it. It is read only where the call succeeded, and so has written all of
    // it.
    unsafe {
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr()) == 0
            && action.assume_init().sa_sigaction == libc::SIG_IGN
    }
}

#[cfg(unix)]
fn ignore(signal: i32) {
    // Fails only for numbers that are no signals, and for those that cannot be ignored. SAFETY:
    // SIG_IGN is no function that could be called in a bad moment, and the call accesses no memory
    // of this process.
    unsafe { libc::signal(signal, libc::SIG_IGN) };
}
