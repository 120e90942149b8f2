//! Vertices on a grid, for coordinates of fewer bits.

use crate::coordinates::{self, CoordinateOptions, OnGrid};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::stage::Stage;
use bth_import::Mesh;
use std::path::Path;

/// Moves the vertices to a grid, if the options have one.
pub(super) struct PlaceOnGrid<'a> {
    pub(super) source: &'a Path,
    pub(super) mesh: Mesh,
    pub(super) options: &'a CoordinateOptions,
}

impl Stage for PlaceOnGrid<'_> {
    type Output = (Mesh, Option<OnGrid>);
    const NAME: &'static str = "coordinates";
    const VERSION: &'static str = "1";

    fn run(self, _: &dyn Monitor) -> Result<Self::Output> {
        let mut mesh = self.mesh;
        let on_grid = coordinates::place(self.source, &mut mesh, self.options)?;
        Ok((mesh, on_grid))
    }
}
