//! Writes a tree whose leaves are holes in rectangles, for the picture in docs/models.md.
//!
//!     cargo run --release -p bth-tests --example leaves -- leaves.glb
fn main() -> std::io::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "leaves.glb".to_owned());
    std::fs::write(path, bth_tests::leaves::tree(700, 5))
}
