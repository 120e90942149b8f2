//! Reads files and prints their BLAKE3: what a compilation that finds everything in the cache cannot do without.
#![allow(clippy::print_stdout)]

fn main() -> std::io::Result<()> {
    for path in std::env::args_os().skip(1) {
        let (digest, bytes) = bth_cache::Digest::of_reader(std::fs::File::open(&path)?)?;
        println!("{}  {bytes}  {}", digest.hex(), path.display());
    }
    Ok(())
}
