//! Options with a few named values, and their conversion to the types of the compiler.

use bth_import::Keep;
use clap::ValueEnum;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Structure {
    /// A BVH with some nodes tetrahedralized, where that pays.
    Bth,
    /// A BVH only.
    Bvh,
    /// One tetrahedralization of the whole model; fails if its triangles cross.
    Tets,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    Fast,
    Balanced,
    Best,
}

/// Which materials make holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Alpha {
    /// None: every triangle is opaque.
    None,
    /// Those of alpha mode MASK.
    Mask,
    /// Also materials of alpha mode BLEND, with a cutoff of 0.5.
    Blend,
}

impl From<Alpha> for bth_import::AlphaMode {
    fn from(alpha: Alpha) -> Self {
        match alpha {
            Alpha::None => Self::None,
            Alpha::Mask => Self::Mask,
            Alpha::Blend => Self::Blend,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Attributes {
    /// PositionNumbers only.
    None,
    /// Shading normals.
    Normals,
    /// Shading normals and texture coordinates.
    All,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Polygons {
    /// Fans from the first corner.
    Fans,
    /// Fans where these cover nothing twice, else ears that are clipped one after the other,
    /// exactly.
    Ears,
}

impl From<Polygons> for bth_import::Polygons {
    fn from(polygons: Polygons) -> Self {
        match polygons {
            Polygons::Fans => Self::Fans,
            Polygons::Ears => Self::Ears,
        }
    }
}

/// Numbers in which positions are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PositionNumbers {
    /// f64 where f32 would move a vertex by more than 2^-24 of the object's size, else f32.
    Auto,
    /// f32. What that moves and drops is reported.
    F32,
    /// f64, unless all numbers of the source are f32.
    F64,
}

impl From<PositionNumbers> for bth_import::Positions {
    fn from(positions: PositionNumbers) -> Self {
        match positions {
            PositionNumbers::Auto => Self::Auto,
            PositionNumbers::F32 => Self::F32,
            PositionNumbers::F64 => Self::F64,
        }
    }
}

impl From<Attributes> for Keep {
    fn from(attributes: Attributes) -> Self {
        match attributes {
            Attributes::None => Keep::None,
            Attributes::Normals => Keep::Normals,
            Attributes::All => Keep::All,
        }
    }
}

impl From<Quality> for bth_compile::bvh::Quality {
    fn from(quality: Quality) -> Self {
        match quality {
            Quality::Fast => Self::Fast,
            Quality::Balanced => Self::Balanced,
            Quality::Best => Self::Best,
        }
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

impl From<Structure> for bth_compile::pipeline::Structure {
    fn from(structure: Structure) -> Self {
        match structure {
            Structure::Bth => Self::Bth,
            Structure::Bvh => Self::Bvh,
            Structure::Tets => Self::Tets,
        }
    }
}

/// Where free directions and distances are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Free {
    /// Nowhere.
    None,
    /// Directions and distances where enough directions are free, else distances where they save
    /// enough.
    Auto,
    /// Distances alone.
    Distances,
    /// Directions and distances.
    All,
}

impl From<Free> for bth_compile::free::KeepFree {
    fn from(free: Free) -> Self {
        match free {
            Free::None => Self::None,
            Free::Auto => Self::Auto,
            Free::Distances => Self::Distances,
            Free::All => Self::All,
        }
    }
}
