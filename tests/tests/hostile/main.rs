//! Files that declare wrong sizes, and files that are truncated while they are in use.
#![cfg(target_os = "linux")]

mod allocation;
mod shrinking;
mod tracing_allocates;
