//! Decompresses buffer views (EXT_meshopt_compression and KHR_meshopt_compression) by the crate `meshopt`.
//!
//! The decoder is safe for untrusted streams but trusts the sizes it is called with, and its result is allocated before it
//! looks at the stream. So sizes are checked first against the extension's rules and against the smallest stream that can
//! hold as many elements: a decoded view has at most 1024 times the bytes of its stream.

use crate::gltf::schema::MeshoptCompression;

/// Whether this build has the decoder (cargo feature `meshopt`, which needs a C++ compiler).
pub(super) const AVAILABLE: bool = cfg!(feature = "meshopt");

/// What a stream encodes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    /// Rows of vertex attributes.
    Attributes,
    /// Indices of a triangle list.
    Triangles,
    /// Any other indices.
    Indices,
}

/// What is applied to decoded attributes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// The bytes of a compressed view.
///
/// # Errors
/// What was expected and what was found, when the properties or the stream do not follow the extension.
pub(super) fn decode(stream: &[u8], compression: &MeshoptCompression) -> Result<Vec<u8>, String> {
    let (mode, filter) = (mode(compression)?, filter(compression)?);
    let stride = checked_stride(compression, mode, filter)?;
    let count = compression.count;
    let smallest = match mode {
        Mode::Attributes => smallest_attributes(stream, count, stride as u64),
        // A header, one byte for each triangle and a table of 16 bytes.
        Mode::Triangles => 1 + count / 3 + 16,
        // A header, one byte for each index and four bytes after them.
        Mode::Indices => count.saturating_add(5),
    };
    if (stream.len() as u64) < smallest {
        let found = stream.len();
        return Err(format!("expected a stream of {smallest} bytes or more for {count} rows, found {found}"));
    }
    let decoded = decoder::decode(stream, mode, filter, [count as usize, stride]);
    decoded.map_err(|message| format!("expected a stream of meshoptimizer, found: {message}"))
}

fn mode(compression: &MeshoptCompression) -> Result<Mode, String> {
    match compression.mode.as_str() {
        "ATTRIBUTES" => Ok(Mode::Attributes),
        "TRIANGLES" if compression.count.is_multiple_of(3) => Ok(Mode::Triangles),
        "TRIANGLES" => {
            Err(format!("expected a count of indices that 3 divides, found {}", compression.count))
        }
        "INDICES" => Ok(Mode::Indices),
        other => Err(format!("expected the mode ATTRIBUTES, TRIANGLES or INDICES, found {other}")),
    }
}

fn filter(compression: &MeshoptCompression) -> Result<Filter, String> {
    match compression.filter.as_deref() {
        None | Some("NONE") => Ok(Filter::None),
        Some("OCTAHEDRAL") => Ok(Filter::Octahedral),
        Some("QUATERNION") => Ok(Filter::Quaternion),
        Some("EXPONENTIAL") => Ok(Filter::Exponential),
        Some("COLOR") => Ok(Filter::Color),
        Some(other) => Err(format!(
            "expected a filter NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR, found {other}"
        )),
    }
}

/// The bytes of an element, which the mode and the filter restrict.
fn checked_stride(compression: &MeshoptCompression, mode: Mode, filter: Filter) -> Result<usize, String> {
    let stride = compression.byte_stride;
    let (allowed, rule) = match (mode, filter) {
        (Mode::Triangles | Mode::Indices, Filter::None) => (matches!(stride, 2 | 4), "2 or 4"),
        (Mode::Triangles | Mode::Indices, _) => {
            return Err(format!("expected no filter for indices, found {filter:?}"));
        }
        (Mode::Attributes, Filter::None | Filter::Exponential) => {
            (stride.is_multiple_of(4) && (4..=256).contains(&stride), "a multiple of 4 up to 256")
        }
        (Mode::Attributes, Filter::Octahedral | Filter::Color) => (matches!(stride, 4 | 8), "4 or 8"),
        (Mode::Attributes, Filter::Quaternion) => (stride == 8, "8"),
    };
    if allowed {
        Ok(stride as usize)
    } else {
        Err(format!("expected a byteStride of {rule}, found {stride}"))
    }
}

/// Bytes of the smallest stream of `count` attribute rows, by the version in its header: a header, for each block of rows
/// at least the control bits of its byte columns, and the tail with the first row.
fn smallest_attributes(stream: &[u8], count: u64, stride: u64) -> u64 {
    let version = stream.first().map_or(0, |header| header & 0x0f);
    let block = (8192 / stride & !15).min(256);
    let of_block = |rows: u64| match version {
        _ if rows == 0 => 0,
        // Two bits for each group of 16 rows of a byte column, in whole bytes.
        0 => stride * rows.div_ceil(16).div_ceil(4),
        // Two bits for each byte column.
        _ => stride / 4,
    };
    let tail = if version == 0 { stride.max(32) } else { (stride + stride / 4).max(24) };
    (count / block).saturating_mul(of_block(block)).saturating_add(of_block(count % block) + 1 + tail)
}

#[cfg(feature = "meshopt")]
mod decoder {
    use super::{Filter, Mode};
    use ::meshopt as codec;

    /// A row of `N` bytes, which the crate wants to have a default.
    #[derive(Clone)]
    struct Row<const N: usize>([u8; N]);

    impl<const N: usize> Default for Row<N> {
        fn default() -> Self {
            Row([0; N])
        }
    }

    /// The bytes of a stream whose sizes have been checked.
    pub(super) fn decode(
        stream: &[u8],
        mode: Mode,
        filter: Filter,
        [count, stride]: [usize; 2],
    ) -> Result<Vec<u8>, String> {
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
}

#[cfg(not(feature = "meshopt"))]
mod decoder {
    use super::{Filter, Mode};

    /// A build without the decoder reports compressed views before it comes here.
    pub(super) fn decode(_: &[u8], _: Mode, _: Filter, _: [usize; 2]) -> Result<Vec<u8>, String> {
        Err("a stream, which this build does not decode".to_owned())
    }
}

#[cfg(all(test, feature = "meshopt"))]
mod tests {
    use super::*;
    use ::meshopt as codec;
    use bth_random::Rng;

    fn compression(mode: &str, filter: &str, stride: u64, count: u64) -> MeshoptCompression {
        MeshoptCompression {
            buffer: 0,
            byte_offset: 0,
            byte_length: 0,
            byte_stride: stride,
            count,
            mode: mode.to_owned(),
            filter: (!filter.is_empty()).then(|| filter.to_owned()),
        }
    }

    fn decoded(stream: &[u8], mode: &str, filter: &str, stride: u64, count: u64) -> Result<Vec<u8>, String> {
        decode(stream, &compression(mode, filter, stride, count))
    }

    /// Rows of smooth and of random bytes.
    fn rows<const N: usize>(count: usize) -> Vec<[u8; N]> {
        let mut random = Rng::new(N as u64);
        let byte =
            |row: usize, k: usize, noise: u64| if k % 3 == 0 { noise as u8 } else { (row / (k + 1)) as u8 };
        (0..count).map(|row| std::array::from_fn(|k| byte(row, k, random.below(256)))).collect()
    }

    fn check_stride<const N: usize>() {
        for count in [0, 1, 15, 16, 17, 255, 256, 257, 2000] {
            let rows = rows::<N>(count);
            for version in [0, 1] {
                let stream = codec::encode_vertex_buffer_level(&rows, 2, Some(version)).unwrap();
                let found = decoded(&stream, "ATTRIBUTES", "NONE", N as u64, count as u64);
                assert_eq!(found.as_deref(), Ok(rows.as_flattened()), "{count} rows, version {version}");
            }
        }
    }

    #[test]
    fn attributes_of_every_kind_of_stride_and_version_are_decoded() {
        check_stride::<4>();
        check_stride::<8>();
        check_stride::<12>();
        check_stride::<36>();
        check_stride::<128>();
        check_stride::<256>();
    }

    #[test]
    fn the_smallest_streams_pass_the_bound() {
        for count in [0usize, 1, 16, 64, 256, 257, 100_000] {
            for version in [0, 1] {
                let rows = vec![[0u8; 16]; count];
                let stream = codec::encode_vertex_buffer_level(&rows, 3, Some(version)).unwrap();
                let found = decoded(&stream, "ATTRIBUTES", "", 16, count as u64);
                assert_eq!(found.as_deref(), Ok(rows.as_flattened()));
            }
        }
    }

    #[test]
    fn indices_of_both_sizes_are_decoded() {
        let indices: Vec<u32> = (0..300).flat_map(|i| [i, i + 1, i + 2]).collect();
        let triangles = codec::encode_index_buffer(&indices, 302).unwrap();
        let sequence = codec::encode_index_sequence(&indices, 302).unwrap();
        for (mode, stream) in [("TRIANGLES", triangles), ("INDICES", sequence)] {
            let wide = decoded(&stream, mode, "", 4, 900).unwrap();
            let narrow = decoded(&stream, mode, "", 2, 900).unwrap();
            let words = wide.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
            let halves = narrow.as_chunks::<2>().0.iter().map(|half| u32::from(u16::from_le_bytes(*half)));
            assert!(words.clone().eq(halves));
            // A triangle may begin with another of its corners.
            let smallest_first = |t: [u32; 3]| {
                let first = (0..3).min_by_key(|k| t[*k]).unwrap_or_default();
                [0, 1, 2].map(|k| t[(first + k) % 3])
            };
            let found: Vec<u32> = words.collect();
            let found = found.as_chunks::<3>().0.iter().copied().map(smallest_first);
            assert!(found.eq(indices.as_chunks::<3>().0.iter().copied()), "{mode}");
        }
    }

    #[test]
    fn filters_give_the_values_that_were_encoded() {
        let mut random = Rng::new(3);
        let mut number = || random.below(2_000_001) as f32 / 1e6 - 1.0;
        let vectors: Vec<[f32; 4]> = (0..500)
            .map(|_| {
                let v = [number(), number(), number(), number()];
                let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
                v.map(|x| x / length)
            })
            .collect();
        let octahedral: Vec<[f32; 4]> = vectors
            .iter()
            .map(|[x, y, z, _]| {
                let length = (x * x + y * y + z * z).sqrt();
                [x / length, y / length, z / length, 1.0]
            })
            .collect();
        let near = |found: &[f32], expected: &[f32], steps: f32| {
            found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 2.0 / steps)
        };

        let stream = codec::encode_vertex_buffer(&codec::encode_filter_oct::<i8>(&octahedral, 8)).unwrap();
        let bytes = decoded(&stream, "ATTRIBUTES", "OCTAHEDRAL", 4, 500).unwrap();
        let found: Vec<f32> = bytes.iter().map(|x| f32::from(*x as i8) / 127.0).collect();
        assert!(near(&found, octahedral.as_flattened(), 127.0));

        let stream = codec::encode_vertex_buffer(&codec::encode_filter_oct::<i16>(&octahedral, 16)).unwrap();
        let bytes = decoded(&stream, "ATTRIBUTES", "OCTAHEDRAL", 8, 500).unwrap();
        let halves = |bytes: &[u8]| -> Vec<f32> {
            bytes
                .as_chunks::<2>()
                .0
                .iter()
                .map(|half| f32::from(i16::from_le_bytes(*half)) / 32767.0)
                .collect()
        };
        assert!(near(&halves(&bytes), octahedral.as_flattened(), 32767.0));

        let stream = codec::encode_vertex_buffer(&codec::encode_filter_quat(&vectors, 16)).unwrap();
        let found = halves(&decoded(&stream, "ATTRIBUTES", "QUATERNION", 8, 500).unwrap());
        for (found, expected) in found.as_chunks::<4>().0.iter().zip(&vectors) {
            // A quaternion and its negative are the same rotation.
            assert!(near(found, expected, 8192.0) || near(&found.map(|x| -x), expected, 8192.0));
        }

        let mode = codec::EncodeExpMode::Separate;
        let stream = codec::encode_vertex_buffer(&codec::encode_filter_exp(&vectors, 24, mode)).unwrap();
        let bytes = decoded(&stream, "ATTRIBUTES", "EXPONENTIAL", 16, 500).unwrap();
        let found: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
        assert!(near(&found, vectors.as_flattened(), 4_000_000.0));

        let colors: Vec<[f32; 4]> = vectors.iter().map(|v| v.map(f32::abs)).collect();
        let stream = codec::encode_vertex_buffer(&codec::encode_filter_color::<u8>(&colors, 8)).unwrap();
        let bytes = decoded(&stream, "ATTRIBUTES", "COLOR", 4, 500).unwrap();
        let found: Vec<f32> = bytes.iter().map(|x| f32::from(*x) / 255.0).collect();
        assert!(near(&found, colors.as_flattened(), 64.0));
    }

    #[test]
    fn refuses_counts_that_the_stream_cannot_hold_before_it_allocates() {
        let rows = rows::<8>(1000);
        let stream = codec::encode_vertex_buffer(&rows).unwrap();
        for (mode, stride) in [("ATTRIBUTES", 8), ("ATTRIBUTES", 256), ("TRIANGLES", 4), ("INDICES", 2)] {
            for count in [3_000_000, 3 << 30, u64::MAX] {
                let error = decoded(&stream, mode, "", stride, count).unwrap_err();
                assert!(
                    error.contains("expected a stream of") && error.contains("or more"),
                    "{mode}: {error}"
                );
            }
        }
    }

    #[test]
    fn refuses_every_cut_of_a_stream() {
        let stream = codec::encode_vertex_buffer(&rows::<12>(300)).unwrap();
        for end in 0..stream.len() {
            assert!(decoded(&stream[..end], "ATTRIBUTES", "", 12, 300).is_err(), "cut at {end}");
        }
        let indices: Vec<u32> = (0..99).collect();
        let stream = codec::encode_index_sequence(&indices, 99).unwrap();
        for end in 0..stream.len() {
            assert!(decoded(&stream[..end], "INDICES", "", 4, 99).is_err(), "cut at {end}");
        }
    }
}
