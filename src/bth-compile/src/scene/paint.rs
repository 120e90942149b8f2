//! The look that a manifest gives an object: the same for all of its triangles, instead of what its
//! source says.

use super::sections::ObjectSections;
use bth_format::layout::{
    GlossParameters, Group, GroupRun, Material as MaterialRow, MaterialParameters, kind,
};
use bth_import::{NO_GLOSS, PLAIN};
use bth_scene::Material;
use zerocopy::FromBytes;

/// A material, by the bits of its numbers in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Paint([u32; 8]);

impl From<&Material> for Paint {
    fn from(material: &Material) -> Self {
        let Material { color: [r, g, b], emission: [x, y, z], metallic, roughness } = *material;
        Self([r, g, b, x, y, z, metallic, roughness].map(|number| (number as f32).to_bits()))
    }
}

impl Paint {
    /// Its name in keys.
    pub(super) fn name(self) -> String {
        format!(" material {:x?}", self.0)
    }

    /// An object that looks like this. It keeps the names of its groups and holes by alpha.
    pub(super) fn on(self, object: &ObjectSections) -> ObjectSections {
        let [r, g, b, x, y, z, metallic, roughness] = self.0.map(f32::from_bits);
        let parameters = MaterialParameters { base_color: [r, g, b, 1.0], emissive: [x, y, z], ..PLAIN };
        let gloss = GlossParameters { metallic, roughness, ..NO_GLOSS };
        let kept = <[Group]>::ref_from_bytes(object.bytes(kind::GROUPS)).unwrap_or_default();
        let mut groups: Vec<Group> = kept.iter().map(|group| Group { material: 0, ..*group }).collect();
        let mut painted = object.clone();
        if groups.is_empty() {
            groups.push(Group { name: 0, name_length: 0, material: 0, reserved: 0 });
            if object.row.triangles > 0 {
                painted.replace(kind::GROUP_RUNS, &[GroupRun { first: 0, group: 0 }]);
            }
        }
        painted.replace(kind::GROUPS, &groups);
        painted.replace(kind::MATERIALS, &[MaterialRow { name: 0, name_length: 0, reserved: [0; 2] }]);
        painted.replace(kind::MATERIAL_PARAMETERS, &[parameters]);
        let glossy = std::slice::from_ref(&gloss);
        painted.replace(kind::GLOSS_PARAMETERS, if gloss == NO_GLOSS { &[] } else { glossy });
        for kind in
            [kind::TEXTURES, kind::COLOR_CORNERS, kind::COLORS, kind::SECOND_CORNERS, kind::SECOND_UVS]
        {
            painted.replace::<u8>(kind, &[]);
        }
        painted
    }
}
