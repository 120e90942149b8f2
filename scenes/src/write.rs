//! Writers: OBJ, binary little-endian PLY and binary STL.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::Model;

/// Why a model was not written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The extension names no format that can be written.
    #[error("{}: expected a name that ends with .obj, .ply or .stl", .0.display())]
    Extension(PathBuf),
    /// The file or its folder cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The message of the system.
        source: std::io::Error,
    },
}

/// Text of a Wavefront OBJ file; each number is the shortest that reads back as the same `f32`.
pub fn obj(model: &Model) -> String {
    let mut text = String::new();
    for [x, y, z] in &model.positions {
        writeln!(text, "v {x} {y} {z}").expect("writing to a string");
    }
    for [a, b, c] in model.triangles.iter().map(|t| t.map(|v| v + 1)) {
        writeln!(text, "f {a} {b} {c}").expect("writing to a string");
    }
    text
}

/// Bytes of a binary little-endian PLY file.
pub fn ply(model: &Model) -> Vec<u8> {
    let faces = format!("face {}\nproperty list uchar uint", model.triangles.len());
    let mut bytes = vertices(model, &faces);
    for t in &model.triangles {
        bytes.push(3);
        bytes.extend(t.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// Bytes of a binary little-endian PLY file of strips: less than half the size, if each triangle
/// shares an edge with the one before.
pub fn ply_of_strips(model: &Model) -> Vec<u8> {
    let mut strips: Vec<i32> = Vec::new();
    let mut rest = &model.triangles[..];
    while !rest.is_empty() {
        // One triangle alone may turn those behind it into a long strip.
        let (mut strip, next) = (longest_strip(rest), longest_strip(&rest[1..]));
        if next.len() > strip.len() {
            strip.truncate(3);
        }
        rest = &rest[strip.len() - 2..];
        strips.extend(&strip);
        strips.extend([-1].iter().filter(|_| !rest.is_empty()));
    }
    let mut bytes = vertices(model, "tristrips 1\nproperty list uint int");
    bytes.extend((strips.len() as u32).to_le_bytes());
    bytes.extend(strips.iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// The longest strip of triangles from the first one on.
fn longest_strip(triangles: &[[u32; 3]]) -> Vec<i32> {
    let from = |first: usize| {
        let mut strip = Vec::new();
        for t in triangles.iter().map(|t| t.map(|v| v as i32)) {
            let &[.., a, b] = &strip[..] else {
                strip.extend([0, 1, 2].map(|k| t[(first + k) % 3]));
                continue;
            };
            // Every second triangle of a strip is turned.
            let edge = if strip.len() % 2 == 1 { [b, a] } else { [a, b] };
            let Some(k) = (0..3).find(|&k| [t[k], t[(k + 1) % 3]] == edge) else { break };
            strip.push(t[(k + 2) % 3]);
        }
        strip
    };
    (0..3).map(from).max_by_key(Vec::len).unwrap_or_default()
}

/// The head of a PLY file with this element of corners, and the vertices.
fn vertices(model: &Model, corners: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement {corners} vertex_indices\nend_header\n",
        model.positions.len()
    )
    .into_bytes();
    bytes.extend(model.positions.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// Bytes of a binary STL file. The normal of a triangle without area is zero.
pub fn stl(model: &Model) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((model.triangles.len() as u32).to_le_bytes());
    for index in 0..model.triangles.len() {
        let corners = model.corners(index);
        let [a, b, c] = model.triangles[index].map(|row| model.position(row));
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        let unit = normal.to_array().map(|x| if length > 0.0 { (x / length) as f32 } else { 0.0 });
        bytes.extend(unit.iter().chain(corners.iter().flatten()).flat_map(|x| x.to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

/// Writes a model in the format that the extension names: `.obj`, `.ply`, `.strips.ply` or `.stl`.
/// The file is whole or as it was.
///
/// # Errors
/// Fails on another extension, or when the file cannot be written.
pub fn file(model: &Model, path: &Path) -> Result<(), Error> {
    let bytes = match path.extension().and_then(|e| e.to_str()) {
        Some("obj") => obj(model).into_bytes(),
        Some("ply") if path.as_os_str().as_encoded_bytes().ends_with(b".strips.ply") => ply_of_strips(model),
        Some("ply") => ply(model),
        Some("stl") => stl(model),
        _ => return Err(Error::Extension(path.into())),
    };
    bth_files::replace(path, |out| out.write_all(&bytes))
        .map_err(|source| Error::Write { path: path.into(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_replaced_and_not_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let [path, link] = ["model.ply", "former.ply"].map(|name| folder.path().join(name));
        file(&crate::blob::blob(80), &path).unwrap();
        let former = std::fs::read(&path).unwrap();
        std::fs::hard_link(&path, &link).unwrap();
        file(&crate::blob::blob(320), &path).unwrap();
        assert_eq!(std::fs::read(&link).unwrap(), former);
        assert_ne!(std::fs::read(&path).unwrap(), former);
    }
}
