//! The materials of an object and the images of a file as typed slices, zero-copy.

use crate::layout::{Image, MaterialParameters, NONE, Texture};

/// The materials and vertex colours of an object. Sections that the file lacks are empty. Specification: "Materials".
#[derive(Clone, Copy, Debug, Default)]
pub struct MaterialsView<'a> {
    /// Per row of `MATERIALS` its parameters, or empty.
    pub parameters: &'a [MaterialParameters],
    /// Textures that the parameters refer to.
    pub textures: &'a [Texture],
    /// Per source triangle its rows of `colors`, or empty.
    pub color_corners: &'a [[u32; 3]],
    /// Vertex colours: linear red, green, blue and alpha; 65,535 stands for 1.
    pub colors: &'a [[u16; 4]],
}

/// The images of a file.
#[derive(Clone, Copy, Debug, Default)]
pub struct ImagesView<'a> {
    /// Images, ascending by name.
    pub images: &'a [Image],
    /// The bytes of all of them.
    pub bytes: &'a [u8],
}

impl MaterialsView<'_> {
    /// The interpolated vertex colour at barycentric coordinates (weights of the second and third corner) of a triangle; `None`
    /// where it has none.
    pub fn color_at(&self, triangle: u32, u: f32, v: f32) -> Option<[f32; 4]> {
        let rows = self.color_corners.get(triangle as usize)?;
        let [a, b, c] = rows.map(|row| self.colors.get(row as usize).copied());
        let (corners, weights) = ([a?, b?, c?], [1.0 - f64::from(u) - f64::from(v), u.into(), v.into()]);
        let sum = |k: usize| {
            corners.iter().zip(weights).map(|(color, w): (_, f64)| f64::from(color[k]) * w).sum::<f64>()
        };
        Some([0, 1, 2, 3].map(|k| (sum(k) / f64::from(u16::MAX)) as f32))
    }
}

impl<'a> ImagesView<'a> {
    /// The row of an image of this name.
    pub fn row_of(&self, name: [u8; 16]) -> Option<u32> {
        let row = self.images.binary_search_by(|image| image.name.cmp(&name)).ok()?;
        (row != NONE as usize).then_some(row as u32)
    }

    /// The bytes of an image; `None` when there is no such row.
    pub fn file(&self, row: u32) -> Option<&'a [u8]> {
        let image = self.images.get(row as usize)?;
        let (first, length) = (usize::try_from(image.first).ok()?, usize::try_from(image.length).ok()?);
        self.bytes.get(first..first.checked_add(length)?)
    }
}
