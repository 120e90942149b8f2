//! Calls the decoders and filters of the crate `meshopt`, each by the type of its rows.

use ::meshopt as codec;

use crate::gltf::meshopt::check::{CheckedSizes, Filter, Mode};

/// A row of `N` bytes, which the crate wants to have a default.
#[derive(Clone)]
struct Row<const N: usize>([u8; N]);

impl<const N: usize> Default for Row<N> {
    fn default() -> Self {
        Row([0; N])
    }
}

/// The bytes of a stream whose sizes have been checked.
pub(super) fn decode(stream: &[u8], sizes: CheckedSizes) -> Result<Vec<u8>, String> {
    let CheckedSizes { mode, filter, count, stride } = sizes;
    let bytes = match (mode, filter, stride) {
        (Mode::Triangles, _, 2) => codec::decode_index_buffer::<u16>(stream, count).map(u16_bytes),
        (Mode::Triangles, ..) => codec::decode_index_buffer::<u32>(stream, count).map(u32_bytes),
        (Mode::Indices, _, 2) => codec::decode_index_sequence::<u16>(stream, count).map(u16_bytes),
        (Mode::Indices, ..) => codec::decode_index_sequence::<u32>(stream, count).map(u32_bytes),
        (Mode::Attributes, Filter::None, _) => rows(stream, count, stride),
        (Mode::Attributes, Filter::Exponential, _) => rows(stream, count, stride).map(exponential),
        (Mode::Attributes, Filter::Octahedral, 4) => {
            filtered::<[i8; 4], 4>(stream, count, codec::decode_filter_oct, |row| row.map(|x| x as u8))
        }
        (Mode::Attributes, Filter::Octahedral, _) => {
            filtered(stream, count, codec::decode_filter_oct::<i16>, i16_row)
        }
        (Mode::Attributes, Filter::Quaternion, _) => {
            filtered(stream, count, codec::decode_filter_quat, i16_row)
        }
        (Mode::Attributes, Filter::Color, 4) => {
            filtered::<[u8; 4], 4>(stream, count, codec::decode_filter_color, |row| row)
        }
        (Mode::Attributes, Filter::Color, _) => {
            filtered::<[u16; 4], 8>(stream, count, codec::decode_filter_color, |row| {
                i16_row(row.map(|x| x as i16))
            })
        }
    };
    bytes.map_err(|error| error.to_string())
}

fn u16_bytes(values: Vec<u16>) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn u32_bytes(values: Vec<u32>) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn i16_row(row: [i16; 4]) -> [u8; 8] {
    let mut bytes = [0; 8];
    for (pair, value) in bytes.chunks_exact_mut(2).zip(row) {
        pair.copy_from_slice(&value.to_le_bytes());
    }
    bytes
}

/// Applies the exponential filter, which treats each word alone.
fn exponential(bytes: Vec<u8>) -> Vec<u8> {
    let mut words: Vec<[u32; 1]> =
        bytes.as_chunks::<4>().0.iter().map(|word| [u32::from_le_bytes(*word)]).collect();
    codec::decode_filter_exp(&mut words);
    words.iter().flat_map(|[word]| word.to_le_bytes()).collect()
}

/// Decodes rows of type `T`, filters them in place and writes each as `N` bytes.
fn filtered<T: Clone + Default, const N: usize>(
    stream: &[u8],
    count: usize,
    filter: fn(&mut [T]),
    bytes: fn(T) -> [u8; N],
) -> codec::Result<Vec<u8>> {
    let mut rows = codec::decode_vertex_buffer::<T>(stream, count)?;
    filter(&mut rows);
    Ok(rows.into_iter().flat_map(bytes).collect())
}

fn fixed<const N: usize>(stream: &[u8], count: usize) -> codec::Result<Vec<u8>> {
    let rows = codec::decode_vertex_buffer::<Row<N>>(stream, count)?;
    Ok(rows.into_iter().flat_map(|row| row.0).collect())
}

/// Decodes rows of `stride` bytes, which the crate takes as the size of a type.
fn rows(stream: &[u8], count: usize, stride: usize) -> codec::Result<Vec<u8>> {
    macro_rules! by_stride {
        ($($words:literal)*) => {
            match stride / 4 {
                $($words => fixed::<{ $words * 4 }>(stream, count),)*
                _ => unreachable!("strides are checked to be at most 256"),
            }
        };
    }
    by_stride!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
        33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64)
}
