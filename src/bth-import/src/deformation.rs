//! What moves the vertices of a mesh: joints with weights, and morph targets.
//!
//! A reader records it for the source's own rows ([`RawDeformation`]). Vertices are merged where
//! both their positions and what moves them are equal ([`RawDeformation::equal_vertices`]), and the
//! rest is brought into the form of the compiled file ([`Deformation`]).

use std::collections::HashMap;
use std::sync::atomic::AtomicU32;

use bth_format::layout::{self, MAX_INFLUENCE_SETS, Morph, NONE};

/// Joints of a vertex: at most this many.
pub(crate) const MOST_INFLUENCES: usize = 4 * MAX_INFLUENCE_SETS as usize;

/// A share of a sparse morph's rows from which a dense one is smaller: a sparse delta takes 16
/// bytes, a dense one 12.
const DENSE_FROM: (usize, usize) = (3, 4);

/// What moves the vertices of a mesh, as the deformation sections of a compiled file have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    /// Numbers of joints, of sets of influences and of targets.
    pub counts: layout::Deformation,
    /// Joints that move a position, for each as many rows as there are sets.
    pub joints: Vec<[u16; 4]>,
    /// Their weights, as in the source. A position without weights follows its first joint.
    pub weights: Vec<[f32; 4]>,
    /// What the targets add to positions, then, if there is any such, what they add to normals.
    pub morphs: Vec<Morph>,
    /// Rows of positions or of normals that sparse morphs change.
    pub morph_rows: Vec<u32>,
    /// What morphs add.
    pub deltas: Vec<[f32; 3]>,
}

/// The joints of a vertex and their weights; unused ones have a weight of zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Influences {
    pub(crate) joints: [u16; MOST_INFLUENCES],
    pub(crate) weights: [f32; MOST_INFLUENCES],
}

/// What a target adds to rows of a raw mesh: those that it changes, ascending.
#[derive(Clone, Debug, Default)]
pub(crate) struct RawMorph {
    pub(crate) rows: Vec<u32>,
    pub(crate) deltas: Vec<[f32; 3]>,
}

/// What moves the vertices of a raw mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct RawDeformation {
    /// Sets of four joints that the vertices have.
    pub(crate) sets: usize,
    /// One more than the largest joint.
    pub(crate) joint_count: u32,
    /// For each position, if there are sets.
    pub(crate) influences: Vec<Influences>,
    /// For each target what it adds to positions.
    pub(crate) positions: Vec<RawMorph>,
    /// For each target what it adds to normals.
    pub(crate) normals: Vec<RawMorph>,
}

impl RawMorph {
    /// Appends the deltas other than zero of rows that start at `first`.
    pub(crate) fn append(&mut self, first: usize, deltas: &[[f32; 3]]) {
        for (row, delta) in deltas.iter().enumerate().filter(|(_, delta)| **delta != [0.0; 3]) {
            self.rows.push((first + row) as u32);
            self.deltas.push(*delta);
        }
    }
}

impl RawDeformation {
    /// Numbers for the source's positions, equal where all that moves them is equal, bit for bit.
    fn classes(&self, positions: usize) -> Vec<u32> {
        let mut keys: Vec<Vec<u32>> = vec![Vec::new(); positions];
        for (key, influences) in keys.iter_mut().zip(&self.influences) {
            let (joints, weights) = (influences.joints.map(u32::from), influences.weights.map(f32::to_bits));
            let used = 4 * self.sets;
            key.extend_from_slice(&joints[..used]);
            key.extend_from_slice(&weights[..used]);
        }
        for (target, morph) in self.positions.iter().enumerate() {
            for (row, delta) in morph.rows.iter().zip(&morph.deltas) {
                keys[*row as usize].push(target as u32);
                keys[*row as usize].extend(delta.map(f32::to_bits));
            }
        }
        let mut numbers = HashMap::new();
        keys.into_iter()
            .map(|key| {
                let next = numbers.len() as u32;
                *numbers.entry(key).or_insert(next)
            })
            .collect()
    }

    /// Returns for each vertex the first row whose position and all that moves it are equal, bit
    /// for bit; -0 of a position equals +0.
    pub(crate) fn equal_vertices(&self, positions: &[[f32; 3]]) -> Vec<AtomicU32> {
        let mut first = HashMap::new();
        let rows = positions.iter().zip(self.classes(positions.len())).zip(0u32..);
        rows.map(|((position, class), row)| {
            let key = (position.map(|x| (x + 0.0).to_bits()), class);
            AtomicU32::new(*first.entry(key).or_insert(row))
        })
        .collect()
    }

    /// In the form of the compiled file, given for each of its positions and normals the row in the
    /// source.
    pub(crate) fn finish(&self, positions: &[u32], normals: &[u32]) -> Deformation {
        let sets = self.sets;
        let counts = layout::Deformation {
            joints: self.joint_count,
            influence_sets: sets as u32,
            targets: self.positions.len() as u32,
            reserved: 0,
        };
        let mut deformation = Deformation {
            counts,
            joints: Vec::with_capacity(positions.len() * sets),
            weights: Vec::with_capacity(positions.len() * sets),
            morphs: Vec::new(),
            morph_rows: Vec::new(),
            deltas: Vec::new(),
        };
        for source in positions.iter().filter(|_| sets > 0) {
            let influences = &self.influences[*source as usize];
            deformation.joints.extend_from_slice(&influences.joints.as_chunks::<4>().0[..sets]);
            deformation.weights.extend_from_slice(&influences.weights.as_chunks::<4>().0[..sets]);
        }
        for morph in &self.positions {
            deformation.add_morph(morph, positions);
        }
        if !normals.is_empty() && self.normals.iter().any(|morph| !morph.rows.is_empty()) {
            for morph in &self.normals {
                deformation.add_morph(morph, normals);
            }
        }
        deformation
    }
}

impl Deformation {
    /// Adds a morph of rows whose places in the source are given.
    fn add_morph(&mut self, morph: &RawMorph, sources: &[u32]) {
        let delta = |source: &u32| match morph.rows.binary_search(source) {
            Ok(at) => morph.deltas[at],
            Err(_) => [0.0; 3],
        };
        let (first_delta, first_row) = (self.deltas.len() as u32, self.morph_rows.len() as u32);
        let changed = sources.iter().filter(|source| delta(source) != [0.0; 3]).count();
        if changed * DENSE_FROM.1 > sources.len() * DENSE_FROM.0 {
            self.deltas.extend(sources.iter().map(delta));
            let deltas = sources.len() as u32;
            self.morphs.push(Morph { deltas, first_delta, first_row: NONE, reserved: 0 });
            return;
        }
        for (row, source) in sources.iter().enumerate() {
            let delta = delta(source);
            if delta != [0.0; 3] {
                self.morph_rows.push(row as u32);
                self.deltas.push(delta);
            }
        }
        self.morphs.push(Morph { deltas: changed as u32, first_delta, first_row, reserved: 0 });
    }
}
