//! Rays of a renderer: folders that `record_rays` writes, with a model and the rays of each query.
//!
//! | set | rays |
//! |---|---|
//! | `nearest`, `any` | as the renderer traced them |
//! | `nearest-past`, `any-past` | the same, but tmin is just past the triangle on which the ray starts |
//! | `nearest-beside`, `any-beside` | the same, but the start is a little off that triangle |

use super::{LIFT, RaySet};
use crate::model::{Model, position};
use anyhow::{Context, Result, ensure};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth::{Accept, Scene};
use bth_format::layout::NONE;
use glam::DVec3;
use std::path::Path;

/// Names of the sets, in order.
pub const NAMES: [&str; 6] = ["nearest", "nearest-past", "nearest-beside", "any", "any-past", "any-beside"];
/// The file of the model in a folder of recorded rays.
pub const MODEL: &str = "model.ply";

/// Reads the sets of a folder, whose model and its compiled scene are given, of about `most` rays at most.
///
/// # Errors
/// If a file cannot be read or its elements do not belong to the others or to the scene.
pub fn sets(folder: &Path, model: &Model, scene: &Scene, most: usize) -> Result<Vec<RaySet>> {
    let lift = LIFT * model.bounds().diagonal();
    let mut sets = Vec::new();
    for (any, names) in [(false, &NAMES[..3]), (true, &NAMES[3..])] {
        let set = read(folder, names[0], any)?;
        let fits = |p: &PrimitiveRef| *p == PrimitiveRef::NONE || (p.triangle as usize) < model.triangles();
        ensure!(set.from.iter().flatten().all(fits), "{}.from: a triangle that {MODEL} lacks", names[0]);
        let set = set.thinned(most);
        let other = |name, change: &dyn Fn(&Ray, PrimitiveRef) -> Ray| {
            let changed = |(ray, own): (&Ray, &PrimitiveRef)| match *own {
                PrimitiveRef::NONE => *ray,
                own => change(ray, own),
            };
            let rays = set.rays.iter().zip(set.from.iter().flatten()).map(changed).collect();
            RaySet { name, rays, ..set.clone() }
        };
        let past = other(names[1], &|ray, own| past_own(scene, ray, own));
        let beside = other(names[2], &|ray, own| lifted(ray, model.normal(own.triangle) * lift));
        sets.extend([set, past, beside]);
    }
    Ok(sets)
}

/// The ray, beginning just past its own triangle if it hits that.
fn past_own(scene: &Scene, ray: &Ray, own: PrimitiveRef) -> Ray {
    let is_own = |_: &Ray, hit: &Hit| hit.primitive == own;
    let accept = Accept { filter: Some(&is_own), ..Accept::default() };
    scene.nearest_accepted(ray, &accept).map_or(*ray, |hit| Ray { tmin: hit.t.next_up(), ..*ray })
}

/// The ray, moved along its own triangle's normal to the side that it travels to.
fn lifted(ray: &Ray, lift: DVec3) -> Ray {
    let side = lift.dot(position(ray.direction)).signum();
    Ray { origin: (position(ray.origin) + lift * side).as_vec3().to_array(), ..*ray }
}

fn read(folder: &Path, name: &'static str, any: bool) -> Result<RaySet> {
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
    Ok(RaySet { name, any, coherent: false, rays, from: Some(from) })
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
        let set = read(folder.path(), "any", true).unwrap();
        let second = Ray { origin: [9.0, 10.0, 11.0], tmin: 12.0, direction: [13.0, 14.0, 15.0], tmax: 16.0 };
        assert_eq!(set.rays[1], second);
        let own = PrimitiveRef { instance: 0, triangle: 7 };
        assert_eq!(set.from, Some(vec![own, PrimitiveRef::NONE]));
        for wrong in [&words[..8], &words[..15]] {
            file(&folder.path().join("any.rays"), b"RAYS", wrong, 8);
            assert!(read(folder.path(), "any", true).is_err());
        }
    }
}
