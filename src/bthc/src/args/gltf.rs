//! Options of scenes from glTF, FBX and 3MF.

use super::common::{GLTF, positive};
use clap::Args as Group;

/// What of a glTF, FBX or 3MF file becomes a scene.
#[derive(Clone, Debug, Group)]
pub(crate) struct Gltf {
    /// Scene by name or number; by default the file's own choice.
    #[arg(long, help_heading = GLTF, value_name = "SCENE")]
    pub(crate) scene: Option<String>,
    /// Animation by name or number, `all` or `none`; by default the first. With `all`, of two that
    /// move the same thing the first is taken.
    #[arg(long, help_heading = GLTF, value_name = "ANIMATION")]
    pub(crate) animation: Option<String>,
    /// Frames per second; 24 by default.
    #[arg(long, help_heading = GLTF, value_parser = positive)]
    pub(crate) rate: Option<f64>,
    /// Leave meshes with skins and morph targets at rest; by default they deform where an animation
    /// moves them.
    #[arg(long, help_heading = GLTF)]
    pub(crate) at_rest: bool,
    /// Make instances of the parts of skinned meshes that one joint moves rigidly: updates of the
    /// time only place them, but rays that have to enter several instances are slower. See
    /// docs/scenes.md.
    #[arg(long, help_heading = GLTF, conflicts_with = "at_rest")]
    pub(crate) rigid_parts: bool,
    /// Refuse what would be ignored: animations of other things than nodes and morph weights.
    #[arg(long, help_heading = GLTF)]
    pub(crate) strict: bool,
}

impl Gltf {
    /// The first of these options that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let options = [
            ("--scene", self.scene.is_some()),
            ("--animation", self.animation.is_some()),
            ("--rate", self.rate.is_some()),
            ("--at-rest", self.at_rest),
            ("--rigid-parts", self.rigid_parts),
            ("--strict", self.strict),
        ];
        options.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }

    /// The options of the import.
    pub(crate) fn options(&self) -> bth_import::gltf::scene::ImportOptions {
        use bth_import::gltf::Chosen;
        let animation = match self.animation.as_deref() {
            None => Chosen::First,
            Some("all") => Chosen::All,
            Some("none") => Chosen::None,
            Some(name) => Chosen::One(name.to_owned()),
        };
        bth_import::gltf::scene::ImportOptions {
            scene: self.scene.clone(),
            animation,
            rate: self.rate.unwrap_or(24.0),
            deform: !self.at_rest,
            rigid_parts: self.rigid_parts,
            strict: self.strict,
        }
    }
}
