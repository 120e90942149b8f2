//! Options with a few named values, and their conversion to the types of the compiler.

use bth_import::Keep;
use clap::ValueEnum;

/// Defines options whose values have the names of a type's in the compiler.
macro_rules! choices {
    ($($(#[$about:meta])* $name:ident = $of_compiler:ty { $($(#[$doc:meta])* $value:ident),+ })+) => { $(
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
        pub(crate) enum $name {
            $($(#[$doc])* $value),+
        }

        impl From<$name> for $of_compiler {
            fn from(choice: $name) -> Self {
                match choice {
                    $($name::$value => Self::$value),+
                }
            }
        }
    )+ };
}

choices! {
    Structure = bth_compile::pipeline::Structure {
        /// A BVH with some nodes tetrahedralized, where that pays.
        Bth,
        /// A BVH only.
        Bvh,
        /// One tetrahedralization of the whole model; fails if its triangles cross.
        Tets
    }
    Quality = bth_compile::bvh::Quality { Fast, Balanced, Best }
    /// Which materials make holes.
    Alpha = bth_import::AlphaMode {
        /// None: every triangle is opaque.
        None,
        /// Those of alpha mode MASK.
        Mask,
        /// Also materials of alpha mode BLEND, with a cutoff of 0.5.
        Blend
    }
    Attributes = Keep {
        /// Positions only.
        None,
        /// Shading normals.
        Normals,
        /// Shading normals and texture coordinates.
        All
    }
    Polygons = bth_import::Polygons {
        /// Fans from the first corner.
        Fans,
        /// Fans where these cover nothing twice, else ears that are clipped one after the other,
        /// exactly.
        Ears
    }
    /// Numbers in which positions are kept.
    PositionNumbers = bth_import::Positions {
        /// f64 where f32 would move a vertex by more than 2^-24 of the object's size, else f32.
        Auto,
        /// f32. What that moves and drops is reported.
        F32,
        /// f64, unless all numbers of the source are f32.
        F64
    }
    /// Where free directions and distances are kept.
    Free = bth_compile::free::KeepFree {
        /// Nowhere.
        None,
        /// Directions and distances where enough directions are free, else distances where they
        /// save enough.
        Auto,
        /// Distances alone.
        Distances,
        /// Directions and distances.
        All
    }
}

/// Bits of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Coordinates {
    /// As in the source.
    F32,
    /// 21 bits.
    #[value(name = "21")]
    B21,
    /// 16 bits.
    #[value(name = "16")]
    B16,
}
