//! The materials of an object and the images of a file as typed slices, zero-copy.

use crate::layout::{GlossParameters, Image, MaterialParameters, NONE, Texture};

section_view! {
    /// The materials and vertex colours of an object. Sections that the file lacks are empty.
    /// Specification: "Materials".
    MaterialsView {
        /// Per row of `MATERIALS` its parameters, or empty.
        parameters: MaterialParameters = MATERIAL_PARAMETERS,
        /// Per row of `MATERIALS` how glossy it is, or empty.
        gloss: GlossParameters = GLOSS_PARAMETERS,
        /// Textures that the parameters refer to.
        textures: Texture = TEXTURES,
        /// Per source triangle its rows of `colors`, or empty.
        color_corners: [u32; 3] = COLOR_CORNERS,
        /// Vertex colours: linear red, green, blue and alpha; 65,535 means 1.
        colors: [u16; 4] = COLORS,
        /// Per source triangle its rows of `second_uvs`, or empty.
        second_corners: [u32; 3] = SECOND_CORNERS,
        /// A second set of texture coordinates.
        second_uvs: [f32; 2] = SECOND_UVS,
    }
}

section_view! {
    /// The images of a file.
    ImagesView {
        /// Images, ascending by name.
        images: Image = IMAGES,
        /// The bytes of all of them.
        bytes: u8 = IMAGE_BYTES,
    }
}

impl MaterialsView<'_> {
    /// The interpolated vertex colour at barycentric coordinates (weights of the second and third
    /// corner) of a triangle; `None` where it has none.
    pub fn color_at(&self, triangle: u32, u: f32, v: f32) -> Option<[f32; 4]> {
        let color = interpolated(self.color_corners, self.colors, triangle, [u, v])?;
        Some(color.map(|x| (x / f64::from(u16::MAX)) as f32))
    }

    /// The interpolated texture coordinates of the second set at barycentric coordinates of a
    /// triangle; `None` where it has none.
    pub fn second_uv_at(&self, triangle: u32, u: f32, v: f32) -> Option<[f32; 2]> {
        let uv = interpolated(self.second_corners, self.second_uvs, triangle, [u, v])?;
        Some(uv.map(|x| x as f32))
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

/// The interpolation of rows at barycentric coordinates (weights of the second and third corner) of
/// a triangle, whose corners have separate rows; `None` for a triangle without rows.
fn interpolated<T: Copy + Into<f64>, const N: usize>(
    corners: &[[u32; 3]],
    rows: &[[T; N]],
    triangle: u32,
    [u, v]: [f32; 2],
) -> Option<[f64; N]> {
    let [a, b, c] = corners.get(triangle as usize)?.map(|row| rows.get(row as usize).copied());
    let (corners, weights) = ([a?, b?, c?], [1.0 - f64::from(u) - f64::from(v), u.into(), v.into()]);
    let at = |k: usize| corners.iter().zip(weights).map(|(row, w): (_, f64)| row[k].into() * w).sum();
    Some(std::array::from_fn(at))
}
