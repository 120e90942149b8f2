//! The catalogue: the models that can be made, by name.

use crate::{Model, blob, gyroid, hairball, hall, knot, soup};

/// A model that can be made by name.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Name, as on the command line.
    pub name: &'static str,
    /// Faces by default.
    pub faces: u32,
    /// What it is.
    pub about: &'static str,
    /// Makes it with about this number of faces.
    pub make: fn(u32) -> Model,
}

/// The max number of faces of `--faces`: some hundred times what tests and benchmarks use.
pub const MAX_FACES: u32 = 50_000_000;

/// All models.
pub const ENTRIES: [Entry; 7] = [
    Entry {
        name: "torus-knot",
        faces: 2_880,
        about: "a trefoil tube: closed, no self-intersection",
        make: knot::torus_knot,
    },
    Entry {
        name: "torus-knots-in-a-box",
        faces: 77_772,
        about: "27 trefoils in a box: closed parts that do not touch",
        make: knot::torus_knots_in_a_box,
    },
    Entry {
        name: "hairball",
        faces: 120_000,
        about: "open thin tubes that cross each other",
        make: hairball::hairball,
    },
    Entry {
        name: "gyroid",
        faces: 100_000,
        about: "an organic closed surface full of holes, no self-intersection",
        make: gyroid::gyroid,
    },
    Entry {
        name: "hall",
        faces: 20_000,
        about: "architecture: closed parts that touch without being welded, long thin triangles",
        make: hall::hall,
    },
    Entry { name: "soup", faces: 10_000, about: "random triangles that cut each other", make: soup::soup },
    Entry {
        name: "blob",
        faces: 20_000,
        about: "a bumpy sphere: closed, no self-intersection",
        make: blob::blob,
    },
];

/// The entry of that name; `_` counts as `-`.
pub fn find(name: &str) -> Option<&'static Entry> {
    let name = name.replace('_', "-");
    ENTRIES.iter().find(|e| e.name == name)
}
