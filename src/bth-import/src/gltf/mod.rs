//! glTF and GLB, in the order of the data: `container` splits a GLB, `document` reads its JSON into `schema`, `buffer`
//! gives the bytes of views (`meshopt` decompresses them), `accessor` their rows, `primitive` triangles (`draco`
//! decompresses them, `texture` chooses texture coordinates), `rigid_parts` what of them a joint moves alone, `placed_mesh` which
//! meshes there are and where, and `flatten` a model. `cutout` reads which materials make holes. [`scene`] makes a manifest instead.

pub(crate) mod accessor;
mod base_color;
pub(crate) mod buffer;
mod container;
pub(crate) mod cutout;
mod deformation;
pub(crate) mod document;
mod draco;
pub(crate) mod extensions;
pub(crate) mod flatten;
pub(crate) mod materials;
mod meshopt;
mod placed_mesh;
mod primitive;
mod rest_pose;
mod rigid_parts;
pub mod scene;
pub(crate) mod schema;
mod source_files;
mod texture;
mod texture_parts;
mod transform;
pub(crate) mod uri;

pub use placed_mesh::GltfPart;
pub use scene::options::Chosen;
pub use source_files::external_files;
