//! Every mode, filter, version and kind of stride against the encoder, and what is refused.

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
    let byte = |row: usize, k: usize, noise: u64| {
        if k.is_multiple_of(3) { noise as u8 } else { (row / (k + 1)) as u8 }
    };
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
        bytes.as_chunks::<2>().0.iter().map(|half| f32::from(i16::from_le_bytes(*half)) / 32767.0).collect()
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
            assert!(error.contains("expected a stream of") && error.contains("or more"), "{mode}: {error}");
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
