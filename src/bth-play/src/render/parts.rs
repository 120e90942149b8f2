//! Pictures that are rendered in tiles, perhaps by many machines: each tile is a file next to the
//! picture until all are there.

use super::frame::{FrameRenderer, FrameReport};
use super::region::Region;
use crate::args::{Args, Denoise, Mode};
use crate::failure::Failure;
use crate::output::{Picture, Sink};
use bth::Scene;
use std::path::{Path, PathBuf};

/// The tiles of all pictures of a sequence.
pub(super) struct Tiles {
    grid: (u32, u32),
    /// By their numbers, which count from 1.
    regions: Vec<Region>,
}

impl Tiles {
    /// The tiles that the options ask for, if they do.
    ///
    /// # Errors
    /// Wrong usage, if pictures of this kind cannot be put together from tiles.
    pub(super) fn new(args: &Args, sink: &Sink, output: &Path) -> Result<Option<Tiles>, Failure> {
        let Some(grid) = args.tiles else { return Ok(None) };
        if sink.tile_path(0, grid, 1).is_none() {
            let message = format!("--tiles needs pictures (.png), found {}", output.display());
            return Err(Failure::Usage(message));
        }
        if args.mode == Mode::Steps {
            let message = "--tiles is not for --mode steps, whose colours depend on the whole picture";
            return Err(Failure::Usage(message.to_owned()));
        }
        if args.denoise == Denoise::Oidn {
            let message =
                "--tiles is not for --denoise oidn, which looks at whole pictures (hint: --denoise on)";
            return Err(Failure::Usage(message.to_owned()));
        }
        Ok(Some(Tiles { grid, regions: Region::grid(args.size, grid) }))
    }

    /// The numbers of all tiles.
    pub(super) fn numbers(&self) -> impl Iterator<Item = u32> + use<> {
        1..=self.regions.len() as u32
    }

    /// The part of the picture that a tile is.
    pub(super) fn region(&self, tile: u32) -> &Region {
        &self.regions[tile as usize - 1]
    }

    /// The file of a tile.
    fn path(&self, sink: &Sink, frame: i32, tile: u32) -> PathBuf {
        sink.tile_path(frame, self.grid, tile).expect("pictures, as `new` has checked")
    }

    /// The tile that is there already, if it is whole.
    pub(super) fn read(&self, sink: &Sink, frame: i32, tile: u32) -> Option<Picture> {
        Picture::read(&self.path(sink, frame, tile), self.region(tile).size())
    }

    /// Renders a tile and writes its file. An empty tile has none.
    pub(super) fn render_file(
        &self,
        renderer: &FrameRenderer<'_>,
        scene: &mut Scene,
        sink: &Sink,
        (frame, tile): (i32, u32),
    ) -> Result<FrameReport, Failure> {
        let (picture, report) = renderer.render(scene, frame, self.region(tile))?;
        if !picture.pixels.is_empty() {
            picture.write_in_folder(&self.path(sink, frame, tile))?;
        }
        Ok(FrameReport { tile: Some(tile), ..report })
    }

    /// Puts the picture of a frame together. Tiles that are missing are rendered, or with `force`
    /// all of them. Returns a report for each, and how many were there.
    pub(super) fn assemble(
        &self,
        renderer: &FrameRenderer<'_>,
        scene: &mut Scene,
        sink: &Sink,
        frame: i32,
    ) -> Result<(Picture, Vec<FrameReport>, usize), Failure> {
        let (width, height) = renderer.args.size;
        let empty = vec![[0; 3]; width as usize * height as usize];
        let (mut whole, mut reports, mut there) = (Picture { width, height, pixels: empty }, Vec::new(), 0);
        for tile in self.numbers() {
            let region = self.region(tile);
            let found = if renderer.args.force { None } else { self.read(sink, frame, tile) };
            let picture = match found {
                Some(picture) => {
                    there += 1;
                    picture
                }
                None => {
                    let (picture, report) = renderer.render(scene, frame, region)?;
                    reports.push(FrameReport { tile: Some(tile), ..report });
                    picture
                }
            };
            whole.put((region.x.start, region.y.start), &picture);
        }
        Ok((whole, reports, there))
    }

    /// Removes the files of tiles, after the picture of their frame was written.
    pub(super) fn remove(&self, sink: &Sink, frame: i32) -> Result<(), Failure> {
        for path in self.numbers().map(|tile| self.path(sink, frame, tile)) {
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Failure::file(&path, &format!("cannot remove: {error}")));
                }
                _ => {}
            }
        }
        Ok(())
    }
}
