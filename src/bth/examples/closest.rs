//! Closest points of many points, with the time they take: `closest SCENE.bth POINTS.f32
//! [RESULTS.f32]`. Points are x, y and z as little-endian f32; results are the distances.

#![allow(clippy::print_stdout)]

use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [scene, points, results @ ..] = &std::env::args().skip(1).collect::<Vec<_>>()[..] else {
        return Err("usage: closest SCENE.bth POINTS.f32 [RESULTS.f32]".into());
    };
    let scene = bth::open(scene)?;
    let number = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let points: Vec<[f32; 3]> = std::fs::read(points)?
        .chunks_exact(12)
        .map(|bytes| [number(bytes), number(&bytes[4..]), number(&bytes[8..])])
        .collect();
    let mut closest = vec![None; points.len()];
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        scene.closest_batch(&points, f32::INFINITY, &mut closest);
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!("{} points in {best:.3} s, {:.0} ns each", points.len(), best / points.len() as f64 * 1e9);
    if let [results] = results {
        let distances = closest.iter().flat_map(|c| c.map_or(f32::NAN, |c| c.distance).to_le_bytes());
        std::fs::write(results, distances.collect::<Vec<u8>>())?;
    }
    Ok(())
}
