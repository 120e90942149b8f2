//! The compilation of what is in memory to a BVH of quality fast: the stages that it needs, one
//! after the other, without cache, clock or threads, and for meshes without importers. Programs
//! that call nothing else of this crate stay small, such as the WebAssembly modules of
//! `packages/js`.

use super::object::{Collapse, Compiled};
use super::provenance;
use super::traced::TracedMesh;
use crate::bvh;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::source::{MESH_NAME, SourceDigest, TriangleMesh};
use crate::stage::Stage;
use bth_files::Digest;
use bth_import::{ImageFile, Mesh, import_bytes, import_images_bytes, import_triangles};
use std::path::Path;

/// Compiles a mesh as [`compile`](super::compile) does with [`CompileOptions::fast`]: the same
/// bytes, but for meshes of more than 2²⁴ triangles, which are built at once here. `deformable`
/// keeps what new positions at run time need.
///
/// # Errors
/// The errors of [`compile`](super::compile).
pub fn compile_fast(mesh: TriangleMesh<'_>, deformable: bool, monitor: &dyn Monitor) -> Result<Compiled> {
    let mut options = CompileOptions { deformable, ..CompileOptions::fast() };
    options.bvh.keep_zero_area = deformable;
    let digest = SourceDigest::of_triangles(mesh);
    let TriangleMesh { positions, triangles } = mesh;
    let (mesh, report) =
        import_triangles(Path::new(MESH_NAME), positions, triangles, options.wanted(), monitor)?;
    assembled((mesh, &report.format), &digest.file, &[], &options, monitor)
}

/// Compiles the bytes of a model with materials: as [`compile`](super::compile) does with
/// [`fast_model`], to the same bytes. The extension of `name` decides about the format. Where the
/// system has no files, what the model refers to is skipped with a warning, or an error if it has
/// vertices.
///
/// # Errors
/// The errors of [`compile`](super::compile).
pub fn compile_model_fast(name: &Path, bytes: &[u8], monitor: &dyn Monitor) -> Result<Compiled> {
    let options = fast_model();
    let (mesh, report) = import_bytes(name, bytes, options.wanted(), monitor)?;
    let textures = mesh.materials.iter().flat_map(|materials| &materials.textures);
    let used: Vec<[u8; 16]> = textures.map(|texture| texture.image).collect();
    let mut images = match used.is_empty() {
        true => Vec::new(),
        false => import_images_bytes(name, bytes, options.looks(), monitor)?,
    };
    images.retain(|image| used.contains(&image.name));
    let digest = blake3::hash(bytes).into();
    assembled((mesh, &report.format), &digest, &images, &options, monitor)
}

/// The options of [`compile_model_fast`]: a BVH of quality fast, and materials.
pub fn fast_model() -> CompileOptions {
    CompileOptions { materials: true, lenient_materials: true, ..CompileOptions::fast() }
}

/// Builds the tree of a mesh and the file. Its textures refer to `images`.
fn assembled(
    (mesh, format): (Mesh, &str),
    digest: &Digest,
    images: &[ImageFile],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<Compiled> {
    let (tree, _) = bvh::build(&mesh, &options.bvh, monitor)?;
    let traced = TracedMesh { mesh, on_grid: None, tree, probabilities: None };
    let collapse = Collapse { traced, leaves: Vec::new(), free: None, motion: None, options };
    let (object, _) = collapse.run(monitor)?;
    let provenance = provenance::of_model(&digest.hex(), format, None, options)?;
    Ok(object.file(provenance, images, options)?.0.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::compile;
    use bth_import::{PositionRows, Silent};

    #[test]
    fn the_bytes_are_those_of_all_stages() {
        let mut random = bth_random::Rng::new(7);
        let wide: Vec<[f64; 3]> = (0..400).map(|_| [0.0; 3].map(|_: f64| random.unit_f64() + 1e6)).collect();
        let narrow: Vec<[f32; 3]> = wide.iter().map(|p| p.map(|x| (x - 1e6) as f32)).collect();
        let mut triangles: Vec<[u32; 3]> = (0..398).map(|i| [i, i + 1, i + 2]).collect();
        triangles.push([3, 3, 4]);
        for positions in [PositionRows::F32(&narrow), PositionRows::F64(&wide)] {
            for triangles in [&triangles[..], &[]] {
                for deformable in [false, true] {
                    let mesh = TriangleMesh { positions, triangles };
                    let options = CompileOptions { deformable, ..CompileOptions::fast() };
                    let (expected, _) = compile(mesh, &options, &Silent).unwrap();
                    assert_eq!(compile_fast(mesh, deformable, &Silent).unwrap(), expected);
                }
            }
        }
    }

    /// A square with a texture, in a data URI, and a material library that is not there.
    #[test]
    fn models_are_compiled_as_from_files() {
        let folder = tempfile::tempdir().unwrap();
        let corners = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAAAA";
        let pixel = concat!(
            "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5",
            "ErkJggg=="
        );
        let gltf = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"materials":[{{"pbrMetallicRoughness":
            {{"baseColorTexture":{{"index":0}},"roughnessFactor":0.5}}}}],"textures":[{{"source":0}}],
            "images":[{{"uri":"data:image/png;base64,{pixel}"}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6,"material":0}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}}],
            "bufferViews":[{{"buffer":0,"byteLength":48}}],
            "buffers":[{{"byteLength":48,"uri":"data:application/octet-stream;base64,{corners}"}}]}}"#
        );
        let obj = "mtllib absent.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\ng a\nusemtl b\nf 1 2 3\n";
        for (name, text, images) in [("a.gltf", gltf.as_str(), 1), ("a.obj", obj, 0)] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let (expected, _) = compile(&path, &fast_model(), &Silent).unwrap();
            let found = compile_model_fast(&path, text.as_bytes(), &Silent).unwrap();
            assert_eq!(found, expected, "{name}");
            let file = bth_format::File::from_bytes(&found.bytes).unwrap();
            assert_eq!(file.images().images.len(), images, "{name}");
        }
        let refused = compile_model_fast(Path::new("a.ply"), b"ply\n", &Silent).unwrap_err();
        assert!(refused.to_string().starts_with("a.ply:"), "{refused}");
    }
}
