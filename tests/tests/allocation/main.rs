//! How much is allocated: by files that declare wrong sizes, and by rays.
#![cfg(target_os = "linux")]

mod inputs;
mod measure;
mod tracing;
