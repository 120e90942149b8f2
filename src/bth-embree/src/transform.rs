//! Transforms of instances: matrices in three layouts, and decompositions with a quaternion.

use crate::abi::*;

/// A transform as the program gave it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Transform {
    /// Rows of four.
    Matrix([f32; 12]),
    /// `RTCQuaternionDecomposition`.
    Quaternion([f32; 16]),
}

impl Transform {
    pub(crate) const IDENTITY: Transform =
        Transform::Matrix([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);

    /// Reads the numbers of a format; `numbers` gives each by its index. `None` for a format of
    /// another kind.
    pub(crate) fn read(format: u32, numbers: impl Fn(usize) -> f32) -> Option<Transform> {
        let rows = |column: usize| {
            std::array::from_fn(|i| {
                let (row, k) = (i / 4, i % 4);
                numbers(k * column + row)
            })
        };
        Some(match format {
            FORMAT_3X4_ROWS => Transform::Matrix(std::array::from_fn(numbers)),
            FORMAT_3X4_COLUMNS => Transform::Matrix(rows(3)),
            FORMAT_4X4_COLUMNS => Transform::Matrix(rows(4)),
            FORMAT_QUATERNION => Transform::Quaternion(std::array::from_fn(numbers)),
            _ => return None,
        })
    }

    /// Rows of four, rounded to f32 once: T R S for a decomposition, in the order of the
    /// documentation of `RTCQuaternionDecomposition`.
    pub(crate) fn rows(&self) -> [f32; 12] {
        let numbers = match self {
            Transform::Matrix(rows) => return *rows,
            Transform::Quaternion(numbers) => numbers.map(f64::from),
        };
        let [sx, sy, sz, xy, xz, yz, hx, hy, hz, r, i, j, k, tx, ty, tz] = numbers;
        let length = (r * r + i * i + j * j + k * k).sqrt();
        let [r, i, j, k] = [r, i, j, k].map(|x| x / length);
        let rotation = [
            [r * r + i * i - j * j - k * k, 2.0 * (i * j - r * k), 2.0 * (i * k + r * j)],
            [2.0 * (i * j + r * k), r * r - i * i + j * j - k * k, 2.0 * (j * k - r * i)],
            [2.0 * (i * k - r * j), 2.0 * (j * k + r * i), r * r - i * i - j * j + k * k],
        ];
        let scale = [[sx, xy, xz, hx], [0.0, sy, yz, hy], [0.0, 0.0, sz, hz]];
        let translation = [tx, ty, tz];
        std::array::from_fn(|at| {
            let (row, column) = (at / 4, at % 4);
            let product: f64 = (0..3).map(|m| rotation[row][m] * scale[m][column]).sum();
            (product + if column == 3 { translation[row] } else { 0.0 }) as f32
        })
    }

    /// The numbers of a format that is a matrix; `None` for another one.
    pub(crate) fn write(rows: &[f32; 12], format: u32) -> Option<Vec<f32>> {
        let columns = |count: usize| {
            let number = |i: usize| match (i % count, i / count) {
                (3, column) => f32::from(column == 3),
                (row, column) => rows[4 * row + column],
            };
            (0..4 * count).map(number).collect()
        };
        match format {
            FORMAT_3X4_ROWS => Some(rows.to_vec()),
            FORMAT_3X4_COLUMNS => Some(columns(3)),
            FORMAT_4X4_COLUMNS => Some(columns(4)),
            _ => None,
        }
    }
}

/// Number of floats of a format of transforms.
pub(crate) fn float_count(format: u32) -> Option<usize> {
    match format {
        FORMAT_3X4_ROWS | FORMAT_3X4_COLUMNS => Some(12),
        FORMAT_4X4_COLUMNS | FORMAT_QUATERNION => Some(16),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_hold_the_same_matrix() {
        let rows: [f32; 12] = std::array::from_fn(|i| i as f32 + 1.0);
        for format in [FORMAT_3X4_ROWS, FORMAT_3X4_COLUMNS, FORMAT_4X4_COLUMNS] {
            let written = Transform::write(&rows, format).unwrap();
            assert_eq!(Some(written.len()), float_count(format));
            assert_eq!(Transform::read(format, |i| written[i]), Some(Transform::Matrix(rows)));
        }
        assert_eq!(Transform::write(&rows, FORMAT_4X4_COLUMNS).unwrap()[12..], [4.0, 8.0, 12.0, 1.0]);
    }

    #[test]
    fn a_decomposition_turns_after_it_scales() {
        // Scales x by 2, turns by 90 degrees about z, moves by (5, 0, 0).
        let half = 0.5f32.sqrt();
        let numbers = [2.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, half, 0.0, 0.0, half, 5.0, 0.0, 0.0];
        let rows = Transform::Quaternion(numbers).rows();
        let expected = [0.0, -1.0, 0.0, 5.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        for (found, expected) in rows.iter().zip(expected) {
            assert!((found - expected).abs() <= 2.0 * f32::EPSILON, "{rows:?}");
        }
    }
}
