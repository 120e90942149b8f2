//! Scene manifests: the objects, hierarchy, cameras, lights and animation of a scene, as TOML that
//! a person can write.
//!
//! `format-spec/scene-manifest.md` specifies every key. [`read()`] is strict: unknown keys, wrong
//! types, cycles, missing names and paths that leave the manifest's folder are errors with line and
//! column. [`Manifest::to_toml`] writes what [`read()`] reads back to an equal value.
#![warn(missing_docs)]

pub mod error;
mod groups;
mod joint_set;
pub mod limits;
mod model;
mod names;
mod node_tables;
mod nodes;
mod read;
mod read_deformers;
mod read_material;
mod read_path;
mod read_sequence;
mod read_tracks;
mod read_transform;
mod segments;
mod table;
mod write;

pub use error::{Error, Result};
pub use groups::NodeGroups;
pub use joint_set::JointSet;
pub use model::*;
pub use nodes::{Node, Nodes, Transform};
pub use read::{parse, read};

/// The keys that are allowed in each table, by the name of the table in the specification.
pub const KEYS: &[(&str, &[&str])] = &[
    ("scene", read::SCENE_KEYS),
    ("frames", read::FRAMES_KEYS),
    ("object", read_sequence::OBJECT_KEYS),
    ("material", read_material::MATERIAL_KEYS),
    ("node", node_tables::NODE_KEYS),
    ("camera", read::CAMERA_KEYS),
    ("light", read::LIGHT_KEYS),
    ("skin", read_deformers::SKIN_KEYS),
    ("deformer", read_deformers::DEFORMER_KEYS),
    ("track", read_tracks::TRACK_KEYS),
    ("turn", read_transform::TURN_KEYS),
    ("look", read_transform::LOOK_KEYS),
];
