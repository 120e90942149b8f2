//! glTF and GLB, in the order of the data.
//!
//! `container` splits a GLB, `file` opens its JSON (`schema`), `buffer` gives the bytes of views
//! (`meshopt` decompresses them), `accessor` their rows, `primitive` triangles (`draco`
//! decompresses them, `uv_set` chooses texture coordinates), `rigid_parts` which of them a joint
//! moves alone, `placed_mesh` which meshes there are and where, and `flatten` a model. `materials`
//! reads how they look, `cutout` which materials make holes. [`scene`] makes a manifest instead.
//! `fbx` and `threemf` make documents of other formats (`made`).

mod accessor;
mod alpha_image;
mod buffer;
mod container;
pub(crate) mod cutout;
mod deformation;
mod draco;
pub(crate) mod extensions;
pub(crate) mod fbx;
pub(crate) mod file;
pub(crate) mod flatten;
// What other formats need.
#[cfg_attr(not(all(feature = "fbx", feature = "3mf")), allow(dead_code))]
pub(crate) mod made;
mod material;
pub(crate) mod materials;
mod meshopt;
mod placed_mesh;
mod primitive;
mod rest_pose;
mod rigid_parts;
pub mod scene;
mod schema;
mod source_files;
mod texture_reader;
pub(crate) mod threemf;
mod transform;
mod uri;
mod uv_set;

pub use placed_mesh::GltfPart;
pub use scene::Chosen;
pub(crate) use source_files::files;
