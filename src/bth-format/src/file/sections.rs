//! What belongs to objects and to the whole file beside what is traced: materials, movements, names and the scene, and the
//! checks of their indices.

use super::File;
use crate::check;
use crate::deformation_view::DeformationView;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::materials_view::{ImagesView, MaterialsView};
use crate::names;
use crate::scene_view::SceneView;
use crate::sequence_view::SequenceView;

impl File {
    /// What moves the vertices of an object, whose **indices are not checked**; empty where nothing does or there is no such
    /// object.
    pub fn deformation(&self, object: u32) -> DeformationView<'_> {
        DeformationView {
            rows: self.slice(object, kind::DEFORMATION),
            joints: self.slice(object, kind::JOINTS),
            weights: self.slice(object, kind::JOINT_WEIGHTS),
            morphs: self.slice(object, kind::MORPHS),
            morph_rows: self.slice(object, kind::MORPH_ROWS),
            deltas: self.slice(object, kind::MORPH_DELTAS),
        }
    }

    /// The materials and vertex colours of an object, whose **indices are not checked**; empty where the file keeps none or
    /// there is no such object.
    pub fn materials(&self, object: u32) -> MaterialsView<'_> {
        MaterialsView {
            parameters: self.slice(object, kind::MATERIAL_PARAMETERS),
            textures: self.slice(object, kind::TEXTURES),
            color_corners: self.slice(object, kind::COLOR_CORNERS),
            colors: self.slice(object, kind::COLORS),
            second_corners: self.slice(object, kind::SECOND_CORNERS),
            second_uvs: self.slice(object, kind::SECOND_UVS),
        }
    }

    /// How the vertices of an object move by themselves, whose **indices are not checked**; empty where they do not or there is no
    /// such object.
    pub fn sequence(&self, object: u32) -> SequenceView<'_> {
        SequenceView {
            times: self.slice(object, kind::SEQUENCE_TIMES),
            positions: self.slice(object, kind::SEQUENCE_POSITIONS),
        }
    }

    /// The images of all textures, whose **indices are not checked**.
    pub fn images(&self) -> ImagesView<'_> {
        ImagesView { images: self.slice(NONE, kind::IMAGES), bytes: self.slice(NONE, kind::IMAGE_BYTES) }
    }

    /// Checks the images and that textures have one. Costs O(textures and images).
    ///
    /// # Errors
    /// `BTH-F162`.
    pub fn check_images(&self) -> Result<()> {
        let images = self.images();
        check::images(&images).map_err(|e| self.locate(e, NONE))?;
        (0..self.object_count()).try_for_each(|object| {
            check::image_names(&self.materials(object), &images).map_err(|e| self.locate(e, object))
        })
    }

    /// The name of an object; empty where the file keeps none or there is no such object.
    pub fn object_name(&self, object: u32) -> &str {
        let rows: &[ObjectName] = self.slice(NONE, kind::OBJECT_NAMES);
        let row = rows.get(object as usize);
        row.and_then(|n| names::name(self.slice(NONE, kind::OBJECT_LABELS), n.name, n.name_length))
            .unwrap_or_default()
    }

    /// Checks the names of objects. Costs O(their bytes).
    ///
    /// # Errors
    /// `BTH-F148`.
    pub fn check_object_names(&self) -> Result<()> {
        let rows: &[ObjectName] = self.slice(NONE, kind::OBJECT_NAMES);
        let text: &[u8] = self.slice(NONE, kind::OBJECT_LABELS);
        let error = |offset: usize, expected: String, found: String| {
            let error =
                Error::within_file(Code::ObjectName, kind::OBJECT_NAMES, offset as u64, expected, found);
            Err(self.locate(error, NONE))
        };
        if !rows.is_empty() && rows.len() != self.object_count() as usize {
            return error(0, format!("{} rows or none", self.object_count()), format!("{}", rows.len()));
        }
        let text = names::checked(text);
        match rows.iter().position(|n| !names::is_name(text, n.name, n.name_length)) {
            None => Ok(()),
            Some(row) => {
                let expected = String::from("a name of at most 4096 bytes within OBJECT_LABELS");
                error(size_of::<ObjectName>() * row, expected, format!("{:?}", rows[row]))
            }
        }
    }

    /// The scene sections, whose **indices are not checked**; `None` when the file has none of them.
    pub fn scene(&self) -> Option<SceneView<'_>> {
        (kind::SCENE..=kind::MORPH_WEIGHTS).find(|kind| self.section(NONE, *kind).is_some())?;
        Some(SceneView {
            scene: self.slice(NONE, kind::SCENE),
            nodes: self.slice(NONE, kind::NODES),
            instances: self.slice(NONE, kind::INSTANCES),
            tracks: self.slice(NONE, kind::TRACKS),
            times: self.slice(NONE, kind::TIMES),
            values: self.slice(NONE, kind::VALUES),
            cameras: self.slice(NONE, kind::CAMERAS),
            lights: self.slice(NONE, kind::LIGHTS),
            names: self.slice(NONE, kind::NAMES),
            deformers: self.slice(NONE, kind::DEFORMERS),
            skins: self.slice(NONE, kind::SKINS),
            skin_joints: self.slice(NONE, kind::SKIN_JOINTS),
            morph_weights: self.slice(NONE, kind::MORPH_WEIGHTS),
        })
    }

    /// The scene sections, after checking every index in them; `None` when the file has none of them. Costs O(bytes of these
    /// sections).
    ///
    /// # Errors
    /// The first violation of `BTH-F150` to `BTH-F159` and `BTH-F180` to `BTH-F186`.
    pub fn check_scene(&self) -> Result<Option<SceneView<'_>>> {
        let Some(view) = self.scene() else { return Ok(None) };
        let deformation = |object| {
            let has = |kind: u32| self.section(object, kind).is_some_and(|s| s.entry.count != 0);
            let can_move = has(kind::LEAF_VERTICES) || self.object_header(object).root == NONE;
            let row = self.deformation(object).rows.first().copied();
            (row, can_move && !has(kind::SEQUENCE_TIMES))
        };
        check::scene(&view, self.object_count(), &deformation).map_err(|e| self.locate(e, NONE))?;
        Ok(Some(view))
    }
}
