//! The native module of the Python package `bth`. It holds what must be fast or needs the library;
//! shapes, defaults and documentation are in the Python modules above it (`python/bth`).
//!
//! | file | |
//! |---|---|
//! | `work` | runs chunks on threads without the interpreter's lock, and lets signals through |
//! | `numbers`, `rays`, `output` | arrays to rays, and hits to arrays, chunk by chunk |
//! | `scene`, `shared`, `state` | a scene that threads share, and that its file or Python places |
//! | `placing` | moving, adding, hiding and removing of its instances |
//! | `queries`, `many`, `points`, `overlaps` | its queries |
//! | `conditions` | what rays may hit, filters in Python included |
//! | `surface`, `parts` | what hits lead to: normals and the like, names and masks |
//! | `attributes` | texture coordinates |
//! | `options`, `compile`, `caching` | the compiler |
//! | `errors` | exceptions |

// Functions take what Python passes, and return tuples of arrays.
#![allow(clippy::too_many_arguments, clippy::type_complexity)]

mod attributes;
mod caching;
mod compile;
mod conditions;
mod errors;
mod many;
mod materials;
mod numbers;
mod options;
mod output;
mod overlaps;
mod parts;
mod placing;
mod points;
mod queries;
mod rays;
mod scene;
mod shared;
mod state;
mod surface;
mod work;

use pyo3::prelude::*;

/// Native parts of the package `bth`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    let error = py.get_type::<errors::Error>();
    error.setattr("code", "")?;
    module.add("Error", error)?;
    module.add_class::<scene::NativeScene>()?;
    module.add_class::<conditions::Candidate>()?;
    module.add_function(wrap_pyfunction!(scene::open, module)?)?;
    module.add_function(wrap_pyfunction!(scene::load, module)?)?;
    module.add_function(wrap_pyfunction!(queries::nearest, module)?)?;
    module.add_function(wrap_pyfunction!(queries::any, module)?)?;
    module.add_function(wrap_pyfunction!(queries::check_start, module)?)?;
    module.add_function(wrap_pyfunction!(compile::compile_path, module)?)?;
    module.add_function(wrap_pyfunction!(compile::source_files, module)?)?;
    module.add_function(wrap_pyfunction!(many::all_hits, module)?)?;
    module.add_function(wrap_pyfunction!(many::count, module)?)?;
    module.add_function(wrap_pyfunction!(many::crossings, module)?)?;
    module.add_function(wrap_pyfunction!(points::contains, module)?)?;
    module.add_function(wrap_pyfunction!(points::winding, module)?)?;
    module.add_function(wrap_pyfunction!(points::signed_distance, module)?)?;
    module.add_function(wrap_pyfunction!(points::closest, module)?)?;
    module.add_function(wrap_pyfunction!(compile::compile_mesh, module)?)?;
    module.add_function(wrap_pyfunction!(compile::compile_scene, module)?)?;
    module.add_function(wrap_pyfunction!(overlaps::overlaps, module)?)?;
    module.add_function(wrap_pyfunction!(overlaps::triangles_in, module)?)?;
    module.add_function(wrap_pyfunction!(surface::surface, module)?)?;
    module.add_function(wrap_pyfunction!(surface::triangle_positions, module)?)?;
    module.add_function(wrap_pyfunction!(materials::materials, module)?)?;
    module.add_function(wrap_pyfunction!(materials::textures, module)?)?;
    module.add_function(wrap_pyfunction!(parts::object_names, module)?)?;
    module.add_function(wrap_pyfunction!(parts::instance_names, module)?)?;
    module.add_function(wrap_pyfunction!(parts::groups, module)?)?;
    module.add_function(wrap_pyfunction!(parts::instance_masks, module)?)?;
    module.add_function(wrap_pyfunction!(parts::group_masks, module)?)?;
    module.add_function(wrap_pyfunction!(parts::set_instance_mask, module)?)?;
    module.add_function(wrap_pyfunction!(parts::set_group_masks, module)?)?;
    module.add_function(wrap_pyfunction!(parts::masks, module)?)?;
    module.add_function(wrap_pyfunction!(parts::set_masks, module)?)?;
    module.add_function(wrap_pyfunction!(placing::add_objects, module)?)?;
    module.add_function(wrap_pyfunction!(placing::added_files, module)?)?;
    module.add_function(wrap_pyfunction!(placing::set_transforms, module)?)?;
    module.add_function(wrap_pyfunction!(placing::add_instances, module)?)?;
    module.add_function(wrap_pyfunction!(placing::remove_instances, module)?)?;
    module.add_function(wrap_pyfunction!(placing::set_visible, module)?)?;
    module.add_function(wrap_pyfunction!(attributes::texture_coordinates, module)?)?;
    module.add_function(wrap_pyfunction!(work::processors, module)?)?;
    module.add_function(wrap_pyfunction!(isa, module)?)?;
    Ok(())
}

/// Name of the instruction set that queries use, such as `avx512`, `sse4` or `neon`. The
/// environment variable BTH_ISA names another.
#[pyfunction]
fn isa() -> String {
    bth::Isa::chosen().to_string()
}
