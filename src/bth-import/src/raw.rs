//! The mesh that a format's reader makes: the source's own rows, not welded.

use crate::concave::ConcavePolygons;
use crate::deformation::RawDeformation;
use crate::error::{Error, Place, Result};
use crate::groups::GroupRecorder;
use crate::materials::MaterialRecorder;
use crate::mesh::Polygons;
use crate::monitor::Monitor;
use crate::polygon::fan;
use bth_format::layout::NONE;
use bth_format::limits::MAX_TRIANGLES;

/// The three kinds of rows of a [`Raw`] mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RowKind {
    /// A row of `positions`.
    Position,
    /// A row of `normals`.
    Normal,
    /// A row of `uvs`.
    Uv,
}

/// Finds the place of a row in the source. It may read the source again, so it is for error
/// messages only.
pub(super) type Locate<'a> = Box<dyn Fn(RowKind, usize) -> Place + 'a>;

/// Reads the positions of a source again, in f64.
pub(super) type ReadAgain<'a> = Box<dyn Fn() -> Vec<[f64; 3]> + 'a>;

/// A mesh with the rows of its source. Its reader has checked that all indices are in range.
pub(super) struct Raw<'a> {
    /// Name of the format.
    pub(super) format: &'static str,
    /// All positions, finite or not.
    pub(super) positions: Vec<[f32; 3]>,
    /// Rows of `positions` of all faces after triangulation.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Normals, if there are some and the caller keeps them.
    pub(super) normals: Vec<[f32; 3]>,
    /// Per triangle rows of `normals` or [`NONE`]; empty without normals.
    pub(super) normal_rows: Vec<[u32; 3]>,
    /// Texture coordinates, if there are some and the caller keeps them.
    pub(super) uvs: Vec<[f32; 2]>,
    /// Per triangle rows of `uvs` or [`NONE`]; empty without texture coordinates.
    pub(super) uv_rows: Vec<[u32; 3]>,
    /// Faces of more than three corners.
    pub(super) polygons: u64,
    /// Those of them whose fans are not the polygon.
    pub(super) concave: ConcavePolygons,
    /// Points, lines and faces of fewer than three corners.
    pub(super) skipped: u64,
    /// Groups of triangles, if the caller wants them and the source has some.
    pub(super) groups: GroupRecorder,
    /// How materials look, and vertex colours, if the caller wants them.
    pub(super) materials: MaterialRecorder,
    /// What moves the vertices, if the caller wants it.
    pub(super) deformation: Option<RawDeformation>,
    /// The positions with all digits of the source; `None` if its numbers are f32.
    pub(super) exact: Option<ReadAgain<'a>>,
    /// Finds places for error messages.
    pub(super) locate: Locate<'a>,
}

impl<'a> Raw<'a> {
    /// A mesh without faces.
    pub(super) fn new(format: &'static str, locate: Locate<'a>) -> Self {
        Raw {
            format,
            positions: Vec::new(),
            triangles: Vec::new(),
            normals: Vec::new(),
            normal_rows: Vec::new(),
            uvs: Vec::new(),
            uv_rows: Vec::new(),
            polygons: 0,
            concave: ConcavePolygons::default(),
            skipped: 0,
            groups: GroupRecorder::default(),
            materials: MaterialRecorder::default(),
            deformation: None,
            exact: None,
            locate,
        }
    }

    /// Appends a face as a fan around its first corner, or counts it as skipped.
    #[inline]
    pub(super) fn push_face(&mut self, face: &[u32]) -> Result<()> {
        self.count_face(face.len());
        self.concave.note(&self.positions, face, self.triangles.len());
        fan(&mut self.triangles, face);
        check_triangles(self.triangles.len() as u64)
    }

    /// Finds which polygons are concave, and splits them as wanted, once all faces and positions
    /// are read.
    ///
    /// # Errors
    /// Cancellation.
    pub(super) fn finish_polygons(&mut self, polygons: Polygons, monitor: &dyn Monitor) -> Result<()> {
        self.concave.find(&self.positions, &self.triangles, polygons, monitor)?;
        for triangles in [&mut self.triangles, &mut self.normal_rows, &mut self.uv_rows] {
            self.concave.replace(triangles);
        }
        Ok(())
    }

    /// Does again what [`Self::finish_polygons`] did, by the positions in f64.
    ///
    /// # Errors
    /// Cancellation.
    pub(super) fn finish_polygons_again(
        &mut self,
        exact: &[[f64; 3]],
        polygons: Polygons,
        monitor: &dyn Monitor,
    ) -> Result<()> {
        for triangles in [&mut self.triangles, &mut self.normal_rows, &mut self.uv_rows] {
            self.concave.restore(triangles);
        }
        self.concave.find(exact, &self.triangles, polygons, monitor)?;
        for triangles in [&mut self.triangles, &mut self.normal_rows, &mut self.uv_rows] {
            self.concave.replace(triangles);
        }
        Ok(())
    }

    /// Forgets the rows of attributes that the source does not have.
    pub(super) fn drop_unused_rows(&mut self) {
        if self.normals.is_empty() {
            self.normal_rows.clear();
        }
        if self.uvs.is_empty() {
            self.uv_rows.clear();
        }
    }

    /// Counts faces of more than three corners as polygons and of fewer as skipped.
    #[inline]
    pub(super) fn count_face(&mut self, corners: usize) {
        self.polygons += u64::from(corners > 3);
        self.skipped += u64::from(corners < 3);
    }
}

/// Refuses more triangles than a compiled file can hold (`BTH-L001`).
#[inline]
pub(super) fn check_triangles(count: u64) -> Result<()> {
    if count <= u64::from(MAX_TRIANGLES) {
        return Ok(());
    }
    Err(Error::Limit {
        code: "BTH-L001",
        message: format!("a model may have up to {MAX_TRIANGLES} triangles; this one has {count} or more"),
    })
}

/// Refuses more rows than 32-bit indices can address (`BTH-L002`).
pub(super) fn check_rows(count: u64) -> Result<()> {
    if count < u64::from(NONE) {
        return Ok(());
    }
    Err(Error::Limit {
        code: "BTH-L002",
        message: format!("a model may have up to {} vertices; this one has {count} or more", NONE - 1),
    })
}

/// Triangles of a strip as OpenGL and glTF order them, every second one with its last two corners
/// exchanged. Triangles that repeat a corner are kept, so that a triangle's id is its position in
/// the strip.
pub(super) fn strip(indices: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    indices
        .windows(3)
        .enumerate()
        .map(|(k, w)| if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
}
