//! Reads files and prints their BLAKE3 hashes: the minimum work of a compilation whose result is in
//! the cache.
#![allow(clippy::print_stdout)]

fn main() -> std::io::Result<()> {
    for path in std::env::args_os().skip(1) {
        let (digest, bytes) = bth_files::Digest::of_reader(std::fs::File::open(&path)?)?;
        println!("{}  {bytes}  {}", digest.hex(), path.display());
    }
    Ok(())
}
