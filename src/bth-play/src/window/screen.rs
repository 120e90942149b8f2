//! The pixels of the window: a picture, and the playback bar that shows and sets the frame.

use crate::failure::Failure;
use crate::output::Picture;
use std::num::NonZeroU32;
use std::rc::Rc;
use winit::window::Window;

/// Height of the playback bar, pixels.
const BAR: u32 = 5;
/// A drag scrubs if it begins within this distance of the bottom of the window, pixels.
pub(crate) const GRIP: f64 = 14.0;
/// Colours of the bar, as 0RGB: left and right of the current frame.
const PLAYED: u32 = 0x00e8_9a3c;
const REMAINING: u32 = 0x0040_4448;

/// A window and its pixels.
pub(crate) struct Screen {
    pub(crate) window: Rc<Window>,
    surface: softbuffer::Surface<Rc<Window>, Rc<Window>>,
}

impl Screen {
    /// The pixels of a window.
    ///
    /// # Errors
    /// If the display does not provide them.
    pub(crate) fn new(window: Window) -> Result<Self, Failure> {
        let window = Rc::new(window);
        let context = softbuffer::Context::new(window.clone()).map_err(failed)?;
        let surface = softbuffer::Surface::new(&context, window.clone()).map_err(failed)?;
        Ok(Self { window, surface })
    }

    /// Shows a picture, scaled to a size, with a bar that is filled to the fraction `bar` of its
    /// width.
    ///
    /// # Errors
    /// If the display fails.
    pub(crate) fn show(
        &mut self,
        picture: &Picture,
        (width, height): (u32, u32),
        bar: Option<f64>,
    ) -> Result<(), Failure> {
        let (Some(columns), Some(rows)) = (NonZeroU32::new(width), NonZeroU32::new(height)) else {
            return Ok(());
        };
        self.surface.resize(columns, rows).map_err(failed)?;
        let mut buffer = self.surface.buffer_mut().map_err(failed)?;
        draw(&mut buffer, picture, (width, height), bar);
        self.window.pre_present_notify();
        buffer.present().map_err(failed)
    }
}

fn failed(error: softbuffer::SoftBufferError) -> Failure {
    Failure::Window(format!("the picture cannot be shown: {error}"))
}

/// Pixels as 0RGB, rows from the top.
fn draw(pixels: &mut [u32], picture: &Picture, (width, height): (u32, u32), bar: Option<f64>) {
    for (y, row) in pixels.chunks_mut(width as usize).enumerate() {
        let from = y as u64 * u64::from(picture.height) / u64::from(height);
        let source = &picture.pixels[from as usize * picture.width as usize..][..picture.width as usize];
        for (x, pixel) in row.iter_mut().enumerate() {
            let [r, g, b] = source[(x as u64 * u64::from(picture.width) / u64::from(width)) as usize];
            *pixel = u32::from_be_bytes([0, r, g, b]);
        }
    }
    if let Some(part) = bar {
        let top = height.saturating_sub(BAR) as usize * width as usize;
        for (i, pixel) in pixels[top..].iter_mut().enumerate() {
            let x = (i % width as usize) as f64 / f64::from(width);
            *pixel = if x < part { PLAYED } else { REMAINING };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_pictures_fill_the_window_and_the_bar_its_fraction() {
        let picture = Picture { width: 2, height: 1, pixels: vec![[1, 2, 3], [255, 0, 9]] };
        let mut pixels = vec![7; 4 * 8];
        draw(&mut pixels, &picture, (4, 8), Some(0.25));
        assert_eq!(pixels[..4], [0x0001_0203, 0x0001_0203, 0x00ff_0009, 0x00ff_0009]);
        assert_eq!(pixels[8..12], pixels[..4]);
        assert_eq!(pixels[28..], [PLAYED, REMAINING, REMAINING, REMAINING]);
    }
}
