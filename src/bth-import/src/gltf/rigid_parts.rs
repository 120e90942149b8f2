//! The parts of a skinned mesh that one joint moves rigidly: whole connected components, so that no
//! two parts share an edge.

use std::collections::{BTreeMap, HashMap};

use bth_scene::JointSet;

use crate::deformation::{Influences, RawDeformation};
use crate::disjoint_sets::DisjointSets;
use crate::error::Result;
use crate::gltf::file::GltfFile;
use crate::gltf::primitive::PrimitiveReader;
use crate::mesh::Keep;

/// The joint of a component that several joints or a morph target move.
const SOFT: u32 = u32::MAX;

/// The joint that alone moves the component of each triangle of a mesh.
pub(super) struct RigidParts {
    /// By primitive and triangle; [`SOFT`] for components that do not move rigidly.
    joints: Vec<Vec<u32>>,
}

/// Which triangles of a mesh are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum KeptTriangles {
    /// All.
    #[default]
    All,
    /// The rigid part of a joint.
    Part(u32),
    /// All but the rigid parts of some joints.
    Without(JointSet),
}

/// The triangles of a mesh that are read.
pub(super) struct Selection {
    kept: KeptTriangles,
    /// `None` where all are kept.
    parts: Option<RigidParts>,
}

impl KeptTriangles {
    /// All triangles but the rigid parts of joints.
    pub(super) fn without(joints: JointSet) -> KeptTriangles {
        if joints.is_empty() { KeptTriangles::All } else { KeptTriangles::Without(joints) }
    }

    /// The triangles of a mesh that are kept.
    ///
    /// # Errors
    /// The same as [`RigidParts::of`].
    pub(super) fn of_mesh(self, file: &GltfFile<'_>, mesh: usize) -> Result<Selection> {
        let parts = match self {
            KeptTriangles::All => None,
            _ => Some(RigidParts::of(file, mesh)?),
        };
        Ok(Selection { kept: self, parts })
    }

    fn keeps(self, joint: u32) -> bool {
        match self {
            KeptTriangles::All => true,
            KeptTriangles::Part(part) => joint == part,
            KeptTriangles::Without(joints) => !joints.contains(joint),
        }
    }
}

impl Selection {
    /// Removes what is not kept from the triangles of a primitive.
    pub(super) fn retain(&self, primitive: usize, triangles: &mut Vec<[u32; 3]>) {
        let Some(joints) = self.parts.as_ref().and_then(|parts| parts.joints.get(primitive)) else { return };
        let mut joints = joints.iter();
        triangles.retain(|_| joints.next().is_some_and(|joint| self.kept.keeps(*joint)));
    }
}

/// The triangles of the primitives of a mesh, and the joints of their vertices.
#[derive(Default)]
struct Vertices {
    /// By primitive, in rows of `joints`.
    triangles: Vec<Vec<[u32; 3]>>,
    /// For each row the joint that alone moves it, or [`SOFT`].
    joints: Vec<u32>,
    /// For each row the number of its position: equal ones have the same.
    places: Vec<u32>,
    numbers: HashMap<[u32; 3], u32>,
}

impl Vertices {
    /// Adds the vertices and triangles of a primitive, which may have none that are read.
    fn add(&mut self, reader: &PrimitiveReader<'_, '_>) -> Result<()> {
        self.triangles.push(Vec::new());
        let Some(kept) = reader.kept(Keep::None)? else { return Ok(()) };
        if reader.points_or_lines(&kept)?.is_some() {
            return Ok(());
        }
        let first = self.joints.len() as u32;
        let triangles = reader.read(&kept, first as usize)?;
        let mut moved = RawDeformation::default();
        reader.deformation(&triangles, [0, 0], &mut moved)?;
        let own = self.joints.len()..self.joints.len() + triangles.positions.len();
        if moved.sets > 0 {
            self.joints.extend(moved.influences.iter().map(only_joint));
        }
        self.joints.resize(own.end, SOFT);
        let joints = &mut self.joints[own];
        for morph in &moved.positions {
            morph.rows.iter().for_each(|row| joints[*row as usize] = SOFT);
        }
        for deltas in reader.target_normals(&triangles)? {
            let turned = joints.iter_mut().zip(deltas).filter(|(_, delta)| *delta != [0.0; 3]);
            turned.for_each(|(joint, _)| *joint = SOFT);
        }
        for position in &triangles.positions {
            let next = self.numbers.len() as u32;
            // Both zeros are one place.
            let key = position.map(|x| (x + 0.0).to_bits());
            self.places.push(*self.numbers.entry(key).or_insert(next));
        }
        if let Some(own) = self.triangles.last_mut() {
            own.extend(triangles.corners.iter().map(|triangle| triangle.map(|row| first + row)));
        }
        Ok(())
    }
}

/// The joint that alone moves a vertex, or [`SOFT`].
fn only_joint(influences: &Influences) -> u32 {
    let mut used = influences.joints.iter().zip(&influences.weights).filter(|(_, weight)| **weight != 0.0);
    let Some((&joint, _)) = used.next() else { return SOFT };
    if used.all(|(other, _)| *other == joint) { u32::from(joint) } else { SOFT }
}

impl RigidParts {
    /// The parts of a mesh.
    ///
    /// # Errors
    /// As for the import of the mesh.
    pub(super) fn of(file: &GltfFile<'_>, mesh: usize) -> Result<RigidParts> {
        let mut vertices = Vertices::default();
        for reader in PrimitiveReader::of_mesh(file, mesh) {
            file.source.monitor.check()?;
            vertices.add(&reader)?;
        }
        let Vertices { triangles, joints, places, numbers } = vertices;
        let mut sets = DisjointSets::new(numbers.len());
        let place = |triangle: &[u32; 3]| triangle.map(|row| places[row as usize]);
        for triangle in triangles.iter().flatten() {
            sets.join(place(triangle));
        }
        // For the root of each component its joint; `None` before its first triangle.
        let mut of_component: Vec<Option<u32>> = vec![None; numbers.len()];
        for triangle in triangles.iter().flatten() {
            let component = &mut of_component[sets.root(place(triangle)[0]) as usize];
            for joint in triangle.map(|row| joints[row as usize]) {
                *component = Some(if component.is_none_or(|other| other == joint) { joint } else { SOFT });
            }
        }
        let mut joint = |triangle: &[u32; 3]| of_component[sets.root(place(triangle)[0]) as usize];
        let mut of_primitive = |triangles: &Vec<[u32; 3]>| -> Vec<u32> {
            triangles.iter().map(|triangle| joint(triangle).unwrap_or(SOFT)).collect()
        };
        Ok(RigidParts { joints: triangles.iter().map(&mut of_primitive).collect() })
    }

    /// Numbers of triangles: of the parts of joints below [`JointSet::LIMIT`], and all others.
    pub(super) fn counts(&self) -> (BTreeMap<u32, u64>, u64) {
        let (mut parts, mut others) = (BTreeMap::new(), 0);
        for joint in self.joints.iter().flatten() {
            match *joint < JointSet::LIMIT {
                true => *parts.entry(*joint).or_default() += 1,
                false => others += 1,
            }
        }
        (parts, others)
    }
}
