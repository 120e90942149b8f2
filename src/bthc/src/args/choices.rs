//! Options with a few named values, and their conversion to the types of the compiler.

use bth_import::Keep;
use clap::ValueEnum;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Structure {
    /// A BVH, some nodes of which are tetrahedralized where that pays.
    Bth,
    /// A BVH only.
    Bvh,
    /// One tetrahedralization of the whole model; fails if its triangles cross.
    Tets,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Subtrees {
    /// Keep them: some 32 bytes a triangle more.
    Keep,
    /// Leave them out: all rays walk the tetrahedra.
    Prune,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    Fast,
    Balanced,
    Best,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Estimator {
    /// From the number of triangles.
    FaceCount,
    /// From the average depth of the BVH.
    AverageDepth,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Select {
    /// What saves most time of all rays.
    Best,
    /// The paper's rule: from the root down, the first nodes whose tetrahedra are cheaper for rays from outside.
    Paper,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OptimizeFor {
    /// Rays from outside only.
    Camera,
    /// Rays that start on known surfaces only.
    Secondary,
    /// Three rays from surfaces for one from outside.
    Balanced,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Probe {
    /// Steps of sampled rays, priced by the profile: the same on every machine.
    Steps,
    /// Nothing: all that was built stays.
    Off,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Record {
    /// 32 bytes, fastest.
    Link32,
    /// 32 bytes.
    Tet32,
    /// 20 bytes.
    Tet20,
    /// 16 bytes.
    Tet16,
}

/// Which materials make holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Alpha {
    /// None: every triangle is opaque.
    None,
    /// Those of alpha mode MASK.
    Mask,
    /// Also those of alpha mode BLEND, with a cutoff of 0.5.
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
    /// Positions only.
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
    /// Fans where these cover nothing twice, else ears that are clipped one after the other, exactly.
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

impl From<Attributes> for Keep {
    fn from(attributes: Attributes) -> Self {
        match attributes {
            Attributes::None => Keep::None,
            Attributes::Normals => Keep::Normals,
            Attributes::All => Keep::All,
        }
    }
}

impl From<Record> for bth_format::layout::RecordKind {
    fn from(record: Record) -> Self {
        match record {
            Record::Link32 => Self::Link32,
            Record::Tet32 => Self::Tet32,
            Record::Tet20 => Self::Tet20,
            Record::Tet16 => Self::Tet16,
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

impl From<Estimator> for bth_compile::costs::Estimator {
    fn from(estimator: Estimator) -> Self {
        match estimator {
            Estimator::FaceCount => Self::FaceCount,
            Estimator::AverageDepth => Self::AverageDepth,
        }
    }
}

impl From<Select> for bth_compile::costs::Select {
    fn from(select: Select) -> Self {
        match select {
            Select::Best => Self::Best,
            Select::Paper => Self::Paper,
        }
    }
}

impl From<OptimizeFor> for bth_compile::costs::OptimizeFor {
    fn from(rays: OptimizeFor) -> Self {
        match rays {
            OptimizeFor::Camera => Self::Camera,
            OptimizeFor::Secondary => Self::Secondary,
            OptimizeFor::Balanced => Self::Balanced,
        }
    }
}

impl From<Probe> for bth_compile::costs::Probe {
    fn from(probe: Probe) -> Self {
        match probe {
            Probe::Steps => Self::Steps,
            Probe::Off => Self::Off,
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
    /// Directions and distances where enough directions are free, else distances where they save enough.
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
