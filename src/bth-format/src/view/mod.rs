//! Sections of an object or of the whole file as typed slices, zero-copy.

/// Declares a view: for each field the rows of a section. Sections that the file lacks are empty.
macro_rules! section_view {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $row:ty = $kind:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default)]
        pub struct $name<'a> {
            $($(#[$field_doc])* pub $field: &'a [$row],)*
        }

        impl<'a> $name<'a> {
            /// The sections of an object; for [`NONE`](crate::layout::NONE) the sections of the
            /// whole file.
            pub(crate) fn of(file: &'a crate::File, object: u32) -> Self {
                $name { $($field: file.slice(object, crate::layout::kind::$kind),)* }
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
