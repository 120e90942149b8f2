//! Rays of a renderer: folders that `record_rays` writes, with a model and the rays of each query.
//! The sets are `nearest` and `any`: the rays that start on a triangle, as the renderer traced
//! them.

use super::RaySet;
use crate::model::{Model, position};
use anyhow::{Context, Result, ensure};
use bth::rays::{PrimitiveRef, Ray, Start};
use bth_format::layout::NONE;
use std::path::Path;

/// Names of the sets.
pub(crate) const NAMES: [&str; 2] = ["nearest", "any"];
/// The file of the model in a folder of recorded rays.
pub(crate) const MODEL: &str = "model.ply";

/// Reads the sets of a folder, of about `most` rays at most.
pub(crate) fn sets(folder: &Path, model: &Model, most: usize) -> Result<Vec<RaySet>> {
    let set = |name| {
        let (rays, from) = read(folder, name)?;
        let fits = |p: &PrimitiveRef| (p.triangle as usize) < model.triangles();
        ensure!(from.iter().all(fits), "{name}.from: a triangle that {MODEL} lacks");
        let starts = rays.iter().zip(from).map(|(ray, own)| start(ray, own, model)).collect();
        let set = RaySet { name, any: name == "any", coherent: false, rays, starts: Some(starts) };
        Ok(set.thinned(most))
    };
    NAMES.into_iter().map(set).collect()
}

/// The point of a triangle that is nearest to the origin of a ray which starts there.
fn start(ray: &Ray, primitive: PrimitiveRef, model: &Model) -> Start {
    let [a, b, c] = model.corners(primitive.triangle);
    let (e, f, p) = (b - a, c - a, position(ray.origin) - a);
    let normal = e.cross(f);
    let of = |weight: f64| weight.max(0.0) / normal.length_squared();
    let (u, v) = (of(p.cross(f).dot(normal)), of(e.cross(p).dot(normal)));
    let sum = (u + v).max(1.0);
    Start { primitive, u: (u / sum) as f32, v: (v / sum) as f32 }
}

/// The rays that start on triangles, and these triangles.
fn read(folder: &Path, name: &str) -> Result<(Vec<Ray>, Vec<PrimitiveRef>)> {
    let rays: Vec<Ray> = elements(&folder.join(format!("{name}.rays")), b"RAYS", |bytes: [[u8; 4]; 8]| {
        let [x, y, z, tmin, dx, dy, dz, tmax] = bytes.map(f32::from_le_bytes);
        Ray { origin: [x, y, z], tmin, direction: [dx, dy, dz], tmax }
    })?;
    let from: Vec<PrimitiveRef> = elements(
        &folder.join(format!("{name}.from")),
        b"FROM",
        |[id]: [[u8; 4]; 1]| match u32::from_le_bytes(id) {
            NONE => PrimitiveRef::NONE,
            triangle => PrimitiveRef { instance: 0, triangle },
        },
    )?;
    ensure!(rays.len() == from.len(), "{name}.from: expected one triangle for each of {} rays", rays.len());
    let known = rays.into_iter().zip(from).filter(|(_, from)| *from != PrimitiveRef::NONE);
    Ok(known.unzip())
}

/// The elements of a ray file of N words each (`docs/reference.md` describes them).
fn elements<const N: usize, T>(path: &Path, tag: &[u8; 4], element: fn([[u8; 4]; N]) -> T) -> Result<Vec<T>> {
    let data = std::fs::read(path).with_context(|| path.display().to_string())?;
    let count = (data.len() / 4).saturating_sub(4) / N;
    let mut header = [tag.as_slice(), &1u32.to_le_bytes()].concat();
    header.extend_from_slice(&(count as u64).to_le_bytes());
    let is_whole = data.starts_with(&header) && data.len() == header.len() + 4 * N * count;
    ensure!(is_whole, "{}: not a {} file, or truncated", path.display(), String::from_utf8_lossy(tag));
    let (words, _) = data[header.len()..].as_chunks::<4>();
    let (rows, _) = words.as_chunks::<N>();
    Ok(rows.iter().map(|row| element(*row)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &Path, tag: &[u8; 4], words: &[u32], row: usize) {
        let mut bytes = [tag.as_slice(), &1u32.to_le_bytes()].concat();
        bytes.extend_from_slice(&((words.len() / row) as u64).to_le_bytes());
        words.iter().for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        std::fs::write(path, bytes).unwrap();
    }

    #[test]
    fn rays_and_starts_are_read_and_truncated_files_refused() {
        let folder = tempfile::tempdir().unwrap();
        let words: Vec<u32> = (1..=16).map(|i| (i as f32).to_bits()).collect();
        file(&folder.path().join("any.rays"), b"RAYS", &words, 8);
        file(&folder.path().join("any.from"), b"FROM", &[7, NONE], 1);
        let ray = Ray { origin: [1.0, 2.0, 3.0], tmin: 4.0, direction: [5.0, 6.0, 7.0], tmax: 8.0 };
        let own = PrimitiveRef { instance: 0, triangle: 7 };
        assert_eq!(read(folder.path(), "any").unwrap(), (vec![ray], vec![own]));
        for wrong in [&words[..8], &words[..15]] {
            file(&folder.path().join("any.rays"), b"RAYS", wrong, 8);
            assert!(read(folder.path(), "any").is_err());
        }
    }
}
