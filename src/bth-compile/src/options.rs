//! The options of a compilation: the options of all stages.

use crate::{bvh, coordinates, costs, free, tets};
use bth_import as mesh;
use serde::Serialize;

/// What to build.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Structure {
    /// A BVH. Nodes are tetrahedralized where that saves time according to the cost model.
    #[default]
    Bth,
    /// A BVH only.
    Bvh,
    /// One tetrahedralization of the whole model.
    Tets,
}

/// The options of all stages.
#[derive(Clone, Debug)]
pub struct CompileOptions {
    /// What to build.
    pub structure: Structure,
    /// Shading attributes to keep.
    pub attributes: mesh::Keep,
    /// How polygons of more than three corners become triangles.
    pub polygons: mesh::Polygons,
    /// In which numbers positions are kept. Positions in f64 exclude `coordinates` other than f32,
    /// `deformable`, `Structure::Tets`, free directions that are always kept, and known rays: with
    /// these `auto` means f32. Objects that keep f64 are a BVH with the geometry of the source and
    /// without free directions.
    pub positions: mesh::Positions,
    /// Materials whose alpha makes holes.
    pub alpha: mesh::AlphaMode,
    /// True to keep groups of triangles, materials, and the names of these and of objects.
    pub names: bool,
    /// True to keep how materials look, with textures and vertex colours. Includes all
    /// attributes and the groups of triangles.
    pub materials: bool,
    /// True to skip images and material libraries that are missing, broken or too large, each with
    /// a warning.
    pub lenient_materials: bool,
    /// Coordinates that triangle leaves store.
    pub coordinates: coordinates::CoordinateOptions,
    /// Builder of the binary BVH.
    pub bvh: bvh::BvhOptions,
    /// Directions in which rays from a triangle hit nothing.
    pub free: free::FreeOptions,
    /// Selection of the nodes to tetrahedralize.
    pub costs: costs::CostOptions,
    /// Tetrahedralization.
    pub tets: tets::TetOptions,
    /// True to store the positions and triangles of the source.
    pub geometry: bool,
    /// True to keep what new positions at run time need (`bth::Scene::set_positions`). All vertices
    /// of the source are kept in its order, and triangles of zero area are not dropped. Excludes
    /// `coordinates` other than f32, files without the geometry, and `Structure::Tets`.
    /// `Structure::Bth` then gives a BVH.
    pub deformable: bool,
    /// How objects whose vertices move by themselves are compiled.
    pub motion: MotionOptions,
    /// Objects of more triangles are built in parts of at most this number, where no other option
    /// needs all triangles at once.
    pub part_triangles: u64,
    /// Limit on the estimated bytes of memory of the objects of a scene that are compiled at the
    /// same time; a single object may exceed it. The result does not depend on it.
    pub objects_memory: u64,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            structure: Structure::default(),
            attributes: mesh::Keep::default(),
            polygons: mesh::Polygons::default(),
            positions: mesh::Positions::default(),
            names: false,
            materials: false,
            lenient_materials: false,
            alpha: mesh::AlphaMode::default(),
            coordinates: coordinates::CoordinateOptions::default(),
            bvh: bvh::BvhOptions::default(),
            free: free::FreeOptions::default(),
            costs: costs::CostOptions::default(),
            tets: tets::TetOptions::default(),
            geometry: true,
            deformable: false,
            motion: MotionOptions::default(),
            part_triangles: mesh::TRIANGLES_AT_ONCE,
            objects_memory: u64::MAX,
        }
    }
}

impl CompileOptions {
    /// A BVH that takes a third of the default's time to build. Its rays are slower.
    pub fn fast() -> Self {
        let bvh = bvh::BvhOptions { quality: bvh::Quality::Fast, ..bvh::BvhOptions::default() };
        Self { structure: Structure::Bvh, bvh, ..Self::default() }
    }

    /// What to read of models.
    pub fn wanted(&self) -> mesh::Wanted {
        let attributes = if self.materials { mesh::Keep::All } else { self.attributes };
        mesh::Wanted {
            attributes,
            groups: self.names || self.materials,
            materials: self.materials,
            unreadable: self.looks().unreadable,
            polygons: self.polygons,
            positions: match (self.positions, self.excludes_f64()) {
                (mesh::Positions::Auto, Some(_)) => mesh::Positions::F32,
                (positions, _) => positions,
            },
            vertices: self.deformable,
        }
    }

    /// The options of an object whose vertices move by themselves: a BVH over coordinates that stay
    /// as they are, which keeps the source's positions and triangles.
    pub fn of_deforming(&self) -> Self {
        Self {
            structure: Structure::Bvh,
            deformable: true,
            positions: mesh::Positions::F32,
            coordinates: coordinates::CoordinateOptions::default(),
            geometry: true,
            free: free::FreeOptions::default(),
            costs: costs::CostOptions { rays: None, ..self.costs.clone() },
            ..self.clone()
        }
    }

    /// The options of an object whose positions are kept in f64.
    pub(crate) fn of_exact(&self) -> Self {
        Self { structure: Structure::Bvh, geometry: true, free: free::FreeOptions::default(), ..self.clone() }
    }

    /// What positions in f64 cannot be combined with.
    fn excludes_f64(&self) -> Option<&'static str> {
        if self.deformable {
            Some("new positions at run time")
        } else if self.coordinates != coordinates::CoordinateOptions::default() {
            Some("coordinates of fewer bits")
        } else if self.structure == Structure::Tets {
            Some("a tetrahedralization")
        } else if self.free.keep.always() {
            Some("free directions")
        } else if self.costs.rays.is_some() {
            Some("known rays")
        } else {
            None
        }
    }

    /// What of the looks of models is read, for which files besides the models are needed.
    pub fn looks(&self) -> mesh::Looks {
        let unreadable = match self.lenient_materials {
            true => mesh::Unreadable::LeftOut,
            false => mesh::Unreadable::Refused,
        };
        mesh::Looks { alpha: self.alpha, materials: self.materials, unreadable, polygons: self.polygons }
    }

    /// What is built: a BVH for deformable objects.
    pub(crate) fn built_structure(&self) -> Structure {
        if self.deformable { Structure::Bvh } else { self.structure }
    }

    /// Checks that the options do not exclude each other.
    ///
    /// # Errors
    /// `BTH-L033`.
    pub(crate) fn check(&self) -> bth_import::Result<()> {
        if let (mesh::Positions::F64, Some(other)) = (self.positions, self.excludes_f64()) {
            let message = format!("an object can keep positions in f64 or be compiled for {other}, not both");
            return Err(bth_import::Error::Limit { code: "BTH-L033", message });
        }
        let excluded = if !self.deformable {
            return Ok(());
        } else if self.coordinates != coordinates::CoordinateOptions::default() {
            "coordinates of fewer bits"
        } else if !self.geometry {
            "leaving out the geometry of the source"
        } else if self.structure == Structure::Tets {
            "a tetrahedralization"
        } else if self.free.keep.always() {
            "free directions"
        } else if self.costs.rays.is_some() {
            "known rays"
        } else {
            return Ok(());
        };
        let message = format!("an object can be deformable or be compiled with {excluded}, not both");
        Err(bth_import::Error::Limit { code: "BTH-L033", message })
    }
}

/// How objects whose vertices move by themselves are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MotionOptions {
    /// Poses over which the cost of a tree is summed, 1 to [`MAX_POSES`](crate::bvh::MAX_POSES). 1
    /// builds the tree for the first pose.
    pub poses: u32,
}

impl Default for MotionOptions {
    fn default() -> Self {
        Self { poses: 8 }
    }
}
