//! Devices: their configuration, their errors, and what they tell of themselves.
#![allow(unsafe_code)] // Calls functions of the program.

use crate::abi::{ErrorFunction, MemoryFunction};
use crate::error::Failure;
use crate::fallback::Fallback;
use crate::handles::Tagged;
use bth_cache::Store;
use std::ffi::{CString, c_char, c_void};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;

/// Version of the interface: 4.4.1.
const VERSION: [isize; 3] = [4, 4, 1];

/// Where commits keep what they built, and find it again.
const CACHE_VARIABLE: &str = "BTH_EMBREE_CACHE";

/// A function of the program with its pointer, which it may call from any thread.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Callback<F> {
    pub(crate) function: F,
    pub(crate) user: *mut c_void,
}

// SAFETY: the documentation demands that these functions can be called from any thread.
unsafe impl<F> Send for Callback<F> {}
// SAFETY: as above.
unsafe impl<F> Sync for Callback<F> {}

/// Locks, also after a panic of another thread: what is locked here is always whole.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The last error of a thread.
#[derive(Debug)]
struct ThreadError {
    thread: ThreadId,
    code: u32,
    message: CString,
}

/// The errors of threads, until they ask.
#[derive(Debug, Default)]
pub(crate) struct Errors(Mutex<Vec<ThreadError>>);

impl Errors {
    /// Keeps the first error since the thread has last asked.
    fn keep(&self, failure: &Failure) -> CString {
        let (thread, code) = (std::thread::current().id(), failure.code as u32);
        let message = CString::new(failure.message.replace('\0', "?")).unwrap_or_default();
        let mut all = lock(&self.0);
        match all.iter_mut().find(|error| error.thread == thread) {
            Some(error) if error.code != 0 => {}
            Some(error) => (error.code, error.message) = (code, message.clone()),
            None => all.push(ThreadError { thread, code, message: message.clone() }),
        }
        message
    }

    /// The code of the first error since the thread has last asked, or 0.
    pub(crate) fn take(&self) -> u32 {
        let mut all = lock(&self.0);
        let error = all.iter_mut().find(|error| error.thread == std::thread::current().id());
        error.map_or(0, |error| std::mem::take(&mut error.code))
    }

    /// The text of the error that the thread has last had. It is valid until its next one.
    pub(crate) fn message(&self) -> *const c_char {
        let all = lock(&self.0);
        let error = all.iter().find(|error| error.thread == std::thread::current().id());
        error.map_or(c"".as_ptr(), |error| error.message.as_ptr())
    }
}

/// Errors of calls that belong to no device.
pub(crate) static NO_DEVICE: Errors = Errors(Mutex::new(Vec::new()));

/// What the program asks for by the text of `rtcNewDevice`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Configuration {
    verbose: bool,
    threads: usize,
    /// Folder of the cache.
    cache: Option<PathBuf>,
}

impl Configuration {
    /// Reads `key=value` pairs. Keys that concern the insides of another library are ignored.
    fn read(text: &str) -> Configuration {
        let mut found = Configuration {
            cache: std::env::var_os(CACHE_VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from),
            ..Configuration::default()
        };
        for pair in text.split(',') {
            let Some((key, value)) = pair.split_once('=') else { continue };
            match (key.trim(), value.trim()) {
                ("verbose", value) => found.verbose = value.parse().is_ok_and(|level: u32| level > 0),
                ("threads", value) => found.threads = value.parse().unwrap_or(0),
                ("bth_cache", value) => found.cache = Some(PathBuf::from(value)),
                _ => {}
            }
        }
        found
    }
}

/// A device.
#[derive(Debug)]
pub(crate) struct Device {
    errors: Errors,
    verbose: bool,
    on_error: Mutex<Option<Callback<ErrorFunction>>>,
    on_memory: Mutex<Option<Callback<MemoryFunction>>>,
    /// The pool of a device with a given number of threads.
    pub(crate) pool: Option<rayon::ThreadPool>,
    pub(crate) cache: Option<Store>,
    /// Answers what bth does not hold.
    pub(crate) fallback: Option<Fallback>,
}

impl Tagged for Device {
    const TAG: u64 = 0x6274_6864_6576_6901;
}

impl Device {
    /// A device for the configuration that the program gives.
    ///
    /// # Errors
    /// If the cache or the other library that was named cannot be used.
    pub(crate) fn new(text: &str) -> Result<Device, Failure> {
        Ok(Device { fallback: Fallback::find(text)?, ..Device::without_fallback(text)? })
    }

    /// The same without another library.
    pub(crate) fn without_fallback(text: &str) -> Result<Device, Failure> {
        let configuration = Configuration::read(text);
        let store = |folder: &PathBuf| {
            Store::open(folder, bth_cache::DEFAULT_CAP).map_err(|error| Failure {
                code: crate::abi::ErrorCode::InvalidArgument,
                message: format!("{}: cannot be a cache: {error}", folder.display()),
            })
        };
        let cache = configuration.cache.as_ref().map(store).transpose()?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(configuration.threads);
        Ok(Device {
            errors: Errors::default(),
            verbose: configuration.verbose,
            on_error: Mutex::default(),
            on_memory: Mutex::default(),
            pool: if configuration.threads > 0 { pool.build().ok() } else { None },
            cache,
            fallback: None,
        })
    }

    pub(crate) fn errors(&self) -> &Errors {
        &self.errors
    }

    pub(crate) fn set_error_function(&self, function: Option<Callback<ErrorFunction>>) {
        *lock(&self.on_error) = function;
    }

    pub(crate) fn set_memory_function(&self, function: Option<Callback<MemoryFunction>>) {
        *lock(&self.on_memory) = function;
    }

    /// Keeps an error and tells the program.
    pub(crate) fn report(&self, failure: &Failure) {
        let message = self.errors.keep(failure);
        if self.verbose {
            crate::statistics::note(&format!("bth: {}", failure.message));
        }
        let function = *lock(&self.on_error);
        if let Some(Callback { function, user }) = function {
            // SAFETY: the program gave the function and its pointer for this; the text lives.
            unsafe { function(user, failure.code as u32, message.as_ptr()) };
        }
    }

    /// Tells the program of memory that is to be taken, or was given back. False if it refuses, and
    /// then does not count it.
    pub(crate) fn memory(&self, bytes: isize, after: bool) -> bool {
        let function = *lock(&self.on_memory);
        // SAFETY: the program gave the function and its pointer for this.
        function.is_none_or(|Callback { function, user }| unsafe { function(user, bytes, after) })
    }

    /// The value of a property, `RTC_DEVICE_PROPERTY_*`.
    pub(crate) fn property(&self, property: u32) -> isize {
        let [major, minor, patch] = VERSION;
        match property {
            0 => major * 10_000 + minor * 100 + patch,
            1 => major,
            2 => minor,
            3 => patch,
            // Packets of 4, 8 and 16 rays; masks; filters; triangles; quads.
            32..=34 | 64 | 66 | 96 | 97 => 1,
            // Rays that are not finite hit nothing here; the other library may think otherwise.
            67 => self.fallback.as_ref().map_or(1, |fallback| fallback.property(property)),
            // Subdivision, curves, user geometry, points.
            98..=101 => self.fallback.as_ref().map_or(0, |fallback| fallback.property(property)),
            // Joined commits and parallel commits; a device of the CPU.
            129 | 130 | 140 => 1,
            _ => 0,
        }
    }
}

/// Keeps an error of a call that has no device.
pub(crate) fn report_without_device(failure: &Failure) {
    NO_DEVICE.keep(failure);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::abi::ErrorCode;

    #[test]
    fn configurations_are_read() {
        let found =
            Configuration::read("threads=3,verbose=2,isa=avx2, bth_cache=/tmp/x ,tri_accel=bvh4.triangle4v");
        let expected = Configuration { verbose: true, threads: 3, cache: Some(PathBuf::from("/tmp/x")) };
        assert_eq!(found, expected);
        assert!(!Configuration::read("verbose=0,threads=").verbose);
    }

    #[test]
    fn a_thread_sees_its_first_error_once() {
        let errors = Errors::default();
        assert_eq!(errors.take(), 0);
        for code in [ErrorCode::InvalidOperation, ErrorCode::InvalidArgument] {
            errors.keep(&Failure { code, message: format!("{code:?}") });
        }
        std::thread::scope(|scope| {
            scope.spawn(|| assert_eq!(errors.take(), 0));
        });
        assert_eq!(errors.take(), ErrorCode::InvalidOperation as u32);
        assert_eq!(errors.take(), 0);
    }
}
