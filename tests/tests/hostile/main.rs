//! Files that lie about their size, and files that shrink.
#![cfg(target_os = "linux")]

mod allocation;
mod shrinking;
