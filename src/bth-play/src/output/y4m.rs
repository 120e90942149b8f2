//! YUV4MPEG2 streams: 8 bits, 4:4:4, BT.709, limited range.

use super::picture::Picture;
use std::io::{Result, Write};

/// Writes the stream header, then one frame after another.
pub(crate) struct Y4mEncoder<W> {
    out: W,
}

impl<W: Write> Y4mEncoder<W> {
    pub(super) fn new(mut out: W, (width, height): (u32, u32), rate: f64) -> Result<Self> {
        // Whole rates are written exactly, others to a thousandth.
        let (rate, over) =
            if rate.fract() == 0.0 { (rate, 1) } else { ((rate * 1000.0).round().max(1.0), 1000) };
        writeln!(out, "YUV4MPEG2 W{width} H{height} F{rate:.0}:{over} Ip A1:1 C444 XCOLORRANGE=LIMITED")?;
        Ok(Self { out })
    }

    pub(super) fn add(&mut self, picture: &Picture) -> Result<()> {
        self.out.write_all(b"FRAME\n")?;
        for plane in 0..3 {
            let bytes: Vec<u8> = picture.pixels.iter().map(|p| component(*p, plane)).collect();
            self.out.write_all(&bytes)?;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Result<W> {
        Ok(self.out)
    }
}

/// Y, Cb or Cr of a pixel (ITU-R BT.709).
pub(super) fn component(pixel: [u8; 3], plane: usize) -> u8 {
    let [r, g, b] = pixel.map(|c| f64::from(c) / 255.0);
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let value = match plane {
        0 => 16.0 + 219.0 * y,
        1 => 128.0 + 224.0 * (b - y) / 1.8556,
        _ => 128.0 + 224.0 * (r - y) / 1.5748,
    };
    value.round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_black_and_the_primaries_have_the_components_of_bt_709() {
        let yuv = |pixel| [0, 1, 2].map(|plane| component(pixel, plane));
        assert_eq!(yuv([255, 255, 255]), [235, 128, 128]);
        assert_eq!(yuv([0, 0, 0]), [16, 128, 128]);
        assert_eq!(yuv([255, 0, 0]), [63, 102, 240]);
        assert_eq!(yuv([0, 0, 255]), [32, 240, 118]);
    }
}
