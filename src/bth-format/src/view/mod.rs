//! Sections of an object or of the whole file as typed slices, zero-copy.

use zerocopy::{FromBytes, Immutable, KnownLayout};

/// Declares a view: for each field the rows of a section. Sections that the file lacks are empty.
macro_rules! section_view {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $row:ty = $kind:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default)]
        pub struct $name<'a> {
            $($(#[$field_doc])* pub $field: &'a [$row],)*
        }

        impl<'a> $name<'a> {
            /// The view of sections, whose bytes `bytes` returns by their kind.
            pub(crate) fn of(bytes: impl Fn(u32) -> Option<&'a [u8]>) -> Self {
                $name { $($field: crate::view::rows(bytes(crate::layout::kind::$kind)),)* }
            }
        }
    };
}

mod deformer;
mod materials;
mod scene;
mod sequence;

pub use deformer::{DeformationView, MorphDeltas};
pub use materials::{ImagesView, MaterialsView};
pub use scene::SceneView;
pub use sequence::{FramePosition, SequenceView};

/// The rows of a section, given its bytes; empty if the file lacks it.
pub(crate) fn rows<T: FromBytes + KnownLayout + Immutable>(bytes: Option<&[u8]>) -> &[T] {
    let Some(bytes) = bytes else { return &[] };
    <[T]>::ref_from_bytes(bytes).ok().expect("checking the table made length, stride and alignment fit")
}
