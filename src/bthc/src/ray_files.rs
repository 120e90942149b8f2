//! `.rays`, `.hits` and `.tris` files: a tag of four bytes, u32 1, a u64 count, then the
//! elements. Little-endian.

use crate::failure::Failure;
use bth::rays::{Hit, PrimitiveRef, Ray};
use std::fs::File;
use std::io::Read;
use std::path::Path;

const HEADER: usize = 16;
/// The hint for a file of another kind.
const OTHER_KIND: &str =
    "name a file of that kind; the section on ray files in docs/reference.md describes them";

/// Reads a `.rays` file: `ox oy oz tmin dx dy dz tmax` as f32.
pub(crate) fn read_rays(path: &Path) -> Result<Vec<Ray>, Failure> {
    let data = read(path, b"RAYS", 32)?;
    let (rays, _) = data[HEADER..].as_chunks::<32>();
    Ok(rays
        .iter()
        .map(|bytes| {
            let f = |i: usize| {
                f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
            };
            Ray { origin: [f(0), f(1), f(2)], tmin: f(3), direction: [f(4), f(5), f(6)], tmax: f(7) }
        })
        .collect())
}

/// The bytes of a `.hits` file: f32 t (infinite for none), u, v, u32 triangle.
pub(crate) fn hits(hits: &[Hit]) -> Vec<u8> {
    let mut bytes = header(b"HITS", hits.len(), 16);
    for hit in hits {
        for value in [hit.t, hit.u, hit.v] {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        bytes.extend_from_slice(&hit.primitive.triangle.to_le_bytes());
    }
    bytes
}

/// The answer of an any-hit query as a hit: triangle 0 or none.
pub(crate) fn answer(any: bool) -> Hit {
    let hit = Hit { t: 0.0, u: 0.0, v: 0.0, primitive: PrimitiveRef { instance: 0, triangle: 0 } };
    if any { hit } else { Hit::MISS }
}

/// The bytes of a `.tris` file: 9 f32 per triangle.
pub(crate) fn triangles(mesh: &bth_import::Mesh) -> Vec<u8> {
    let mut bytes = header(b"TRIS", mesh.triangles.len(), 36);
    for triangle in 0..mesh.triangles.len() as u32 {
        for value in mesh.corners(triangle).into_iter().flatten() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

fn header(tag: &[u8; 4], count: usize, stride: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + count * stride);
    bytes.extend_from_slice(tag);
    bytes.extend_from_slice(&1u32.to_le_bytes());
    bytes.extend_from_slice(&(count as u64).to_le_bytes());
    bytes
}

fn read(path: &Path, tag: &[u8; 4], stride: u64) -> Result<Vec<u8>, Failure> {
    let failed = |e: std::io::Error| Failure::file("BTH-O090", path, &e);
    let mut file = File::open(path).map_err(failed)?;
    let mut data = Vec::new();
    file.by_ref().take(HEADER as u64).read_to_end(&mut data).map_err(failed)?;
    let name = String::from_utf8_lossy(tag);
    let Some(start) = data.first_chunk::<HEADER>() else {
        let message = format!("expected a {name} file, found {} bytes", data.len());
        return Err(Failure::ray_file(path, 0, message, OTHER_KIND));
    };
    let [tag_found @ .., _, _, _, _, _, _, _, _, _, _, _, _] = start;
    let version = u32::from_le_bytes([start[4], start[5], start[6], start[7]]);
    if tag_found != tag || version != 1 {
        let message = format!(
            "expected the tag {name} and version 1, found {:?} and {version}",
            tag_found.escape_ascii().to_string()
        );
        return Err(Failure::ray_file(path, 0, message, OTHER_KIND));
    }
    let mut count = [0; 8];
    count.copy_from_slice(&start[8..]);
    let expected = u64::from_le_bytes(count).checked_mul(stride).and_then(|n| n.checked_add(HEADER as u64));
    // One byte more shows that there are more; devices and pipes may have no end.
    let most = expected.map_or(0, |n| n - HEADER as u64 + 1);
    file.take(most).read_to_end(&mut data).map_err(failed)?;
    match expected {
        Some(n) if n == data.len() as u64 => Ok(data),
        Some(n) if n < data.len() as u64 => {
            let message = format!("expected {n} bytes by the count, found more");
            Err(Failure::ray_file(path, 8, message, "the count does not belong to the elements"))
        }
        _ => {
            let expected = expected.map_or("more than can be stored".to_owned(), |n| n.to_string());
            let message = format!("expected {expected} bytes by the count, found {}", data.len());
            Err(Failure::ray_file(path, 8, message, "the file seems to be truncated"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, bytes: &[u8]) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("bthc-ray-files-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        path
    }

    #[test]
    fn rays_are_read_as_written() {
        let mut bytes = header(b"RAYS", 1, 32);
        (1..=8).for_each(|i| bytes.extend_from_slice(&(i as f32).to_le_bytes()));
        let path = written("good.rays", &bytes);
        let rays = read_rays(&path).unwrap();
        std::fs::remove_file(path).unwrap();
        assert_eq!(rays, [Ray { origin: [1.0, 2.0, 3.0], tmin: 4.0, direction: [5.0, 6.0, 7.0], tmax: 8.0 }]);
    }

    #[test]
    fn rejects_truncated_mistagged_and_overflowing_ray_files() {
        let mut huge = header(b"RAYS", 0, 32);
        huge[8..].fill(0xff);
        let truncated = header(b"RAYS", 1, 32);
        let mistagged = header(b"HITS", 0, 32);
        for (name, bytes) in [("a", &huge), ("b", &truncated), ("c", &mistagged), ("d", &vec![1, 2, 3])] {
            let path = written(name, bytes);
            let result = read_rays(&path);
            std::fs::remove_file(path).unwrap();
            assert!(result.is_err(), "{name}");
        }
    }
}
