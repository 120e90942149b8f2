//! Sections that no traversal reads: materials, movements, names and the scene, and the checks of
//! their indices.

use super::File;
use crate::check;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::names;
use crate::view::{DeformationView, ImagesView, MaterialsView, SceneView, SequenceView};

impl File {
    /// What moves the vertices of an object, whose **indices are not checked**; empty where nothing
    /// does or there is no such object.
    pub fn deformation(&self, object: u32) -> DeformationView<'_> {
        DeformationView::of(|kind| self.section_bytes(object, kind))
    }

    /// The materials and vertex colours of an object, whose **indices are not checked**; empty
    /// where the file keeps none or there is no such object.
    pub fn materials(&self, object: u32) -> MaterialsView<'_> {
        MaterialsView::of(|kind| self.section_bytes(object, kind))
    }

    /// How the vertices of an object move by themselves, whose **indices are not checked**; empty
    /// where they do not or there is no such object.
    pub fn sequence(&self, object: u32) -> SequenceView<'_> {
        SequenceView::of(|kind| self.section_bytes(object, kind))
    }

    /// The images of all textures, whose **indices are not checked**.
    pub fn images(&self) -> ImagesView<'_> {
        ImagesView::of(|kind| self.section_bytes(NONE, kind))
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

    /// The scene sections, whose **indices are not checked**; `None` when the file has none of
    /// them.
    pub fn scene(&self) -> Option<SceneView<'_>> {
        (kind::SCENE..=kind::MORPH_WEIGHTS).find(|kind| self.section(NONE, *kind).is_some())?;
        Some(SceneView::of(|kind| self.section_bytes(NONE, kind)))
    }

    /// The scene sections, after checking every index in them; `None` when the file has none of
    /// them. Costs O(bytes of these sections).
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
