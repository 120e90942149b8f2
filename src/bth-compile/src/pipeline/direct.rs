//! The compilation of a mesh in memory to a BVH of quality fast: the stages that it needs, one
//! after the other, without cache, clock, threads or importers. Programs that call nothing else of
//! this crate stay small, such as the WebAssembly module of `packages/js`.

use super::object::{Collapse, Compiled};
use super::provenance;
use super::traced::TracedMesh;
use crate::bvh::{self, BvhOptions, Quality};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::source::{MESH_NAME, SourceDigest, TriangleMesh};
use crate::stage::Stage;
use bth_import::import_triangles;
use std::path::Path;

/// Compiles a mesh as [`compile`](super::compile) does with [`Structure::Bvh`], [`Quality::Fast`]
/// and without free directions: the same bytes. `deformable` keeps what new positions at run time
/// need.
///
/// # Errors
/// The errors of [`compile`](super::compile).
pub fn compile_fast(mesh: TriangleMesh<'_>, deformable: bool, monitor: &dyn Monitor) -> Result<Compiled> {
    let bvh = BvhOptions { quality: Quality::Fast, keep_zero_area: deformable };
    let options = CompileOptions { structure: Structure::Bvh, deformable, bvh, ..CompileOptions::default() };
    let digest = SourceDigest::of_triangles(mesh);
    let TriangleMesh { positions, triangles } = mesh;
    let (mesh, report) =
        import_triangles(Path::new(MESH_NAME), positions, triangles, options.wanted(), monitor)?;
    let (tree, _) = bvh::build(&mesh, &bvh, monitor)?;
    let traced = TracedMesh { mesh, on_grid: None, tree, probabilities: None };
    let collapse = Collapse { traced, leaves: Vec::new(), free: None, motion: None, options: &options };
    let (object, _) = collapse.run(monitor)?;
    let provenance = provenance::of_model(&digest.file.hex(), &report.format, None, &options)?;
    Ok(object.file(provenance, &[], &options)?.0.into())
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
                    let mut options =
                        CompileOptions { structure: Structure::Bvh, deformable, ..CompileOptions::default() };
                    options.bvh.quality = Quality::Fast;
                    let (expected, _) = compile(mesh, &options, &Silent).unwrap();
                    assert_eq!(compile_fast(mesh, deformable, &Silent).unwrap(), expected);
                }
            }
        }
    }
}
