//! Transforms of glTF nodes in f64 (glTF 2.0 specification, §3.5.3).

/// An affine transform, from a node's space to its parent's or to the world.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Transform {
    /// Rows of the linear part.
    linear: [[f64; 3]; 3],
    translation: [f64; 3],
}

impl Transform {
    /// Changes nothing.
    pub(super) const IDENTITY: Transform =
        Transform { linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// From a column-major 4x4 matrix, whose last row counts as (0, 0, 0, 1).
    pub(super) fn from_columns(m: [f64; 16]) -> Transform {
        Transform {
            linear: [0, 1, 2].map(|row| [m[row], m[row + 4], m[row + 8]]),
            translation: [m[12], m[13], m[14]],
        }
    }

    /// Scales, then rotates by a unit quaternion (x, y, z, w), then moves.
    pub(super) fn from_parts(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> Transform {
        let [x, y, z, w] = rotation;
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Transform { linear: rotation.map(|row| [0, 1, 2].map(|k| row[k] * scale[k])), translation }
    }

    /// `inner` first, then `self`.
    pub(super) fn times(&self, inner: &Transform) -> Transform {
        let column = |k: usize| [0, 1, 2].map(|row| inner.linear[row][k]);
        Transform {
            linear: self.linear.map(|row| [0, 1, 2].map(|k| dot(row, column(k)))),
            translation: self.apply(inner.translation),
        }
    }

    fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| dot(self.linear[k], p) + self.translation[k])
    }

    /// A position, rounded to f32 once.
    #[inline]
    pub(super) fn point(&self, p: [f32; 3]) -> [f32; 3] {
        self.apply(p.map(f64::from)).map(|x| x as f32)
    }

    /// Row k of the cofactor matrix: the determinant times the inverse transpose.
    fn cofactors(&self) -> [[f64; 3]; 3] {
        let [a, b, c] = self.linear;
        [cross(b, c), cross(c, a), cross(a, b)]
    }

    fn determinant(&self) -> f64 {
        dot(self.linear[0], self.cofactors()[0])
    }

    /// Whether the transform exchanges left and right.
    pub(super) fn is_mirrored(&self) -> bool {
        self.determinant() < 0.0
    }

    /// A normal by the inverse transpose, of unit length again; unchanged without a linear part.
    pub(super) fn normal(&self, n: [f32; 3]) -> [f32; 3] {
        if self.linear == Transform::IDENTITY.linear {
            return n;
        }
        let sign = if self.is_mirrored() { -1.0 } else { 1.0 };
        let turned = self.cofactors().map(|row| sign * dot(row, n.map(f64::from)));
        let length = dot(turned, turned).sqrt();
        if length > 0.0 { turned.map(|x| (x / length) as f32) } else { [0.0; 3] }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_apply_scale_then_rotation_then_translation() {
        let half = 0.5f64.sqrt();
        let turn = Transform::from_parts([10.0, 0.0, 0.0], [0.0, 0.0, half, half], [2.0, 3.0, 4.0]);
        let p = turn.point([1.0, 1.0, 1.0]);
        for (found, expected) in p.into_iter().zip([7.0, 2.0, 4.0f32]) {
            assert!((found - expected).abs() <= 4.0 * f32::EPSILON * 10.0, "{p:?}");
        }
    }

    #[test]
    fn products_apply_the_inner_transform_first() {
        let scale = Transform::from_parts([0.0; 3], [0.0, 0.0, 0.0, 1.0], [2.0; 3]);
        let shift = Transform::from_parts([1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0], [1.0; 3]);
        assert_eq!(scale.times(&shift).point([1.0; 3]), [4.0, 6.0, 8.0]);
        assert_eq!(shift.times(&scale).point([1.0; 3]), [3.0, 4.0, 5.0]);
        let columns = [2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.0, 2.0, 3.0, 1.0];
        assert_eq!(Transform::from_columns(columns), shift.times(&scale));
    }

    #[test]
    fn normals_stay_perpendicular_and_on_their_side_when_mirrored_and_sheared() {
        let mut columns = [0.0; 16];
        columns[..12].copy_from_slice(&[-2.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.5, 3.0, 0.0]);
        let t = Transform::from_columns(columns);
        assert!(t.is_mirrored());
        let n = t.normal([0.0, 0.0, 1.0]).map(f64::from);
        let origin = t.apply([0.0; 3]);
        let along = |p| {
            let q: [f64; 3] = t.apply(p);
            dot(n, [0, 1, 2].map(|k| q[k] - origin[k]))
        };
        assert!(along([1.0, 0.0, 0.0]).abs() < 4.0 * f64::from(f32::EPSILON));
        assert!(along([0.0, 1.0, 0.0]).abs() < 4.0 * f64::from(f32::EPSILON));
        assert!(along([0.0, 0.0, 1.0]) > 0.0);
    }
}
