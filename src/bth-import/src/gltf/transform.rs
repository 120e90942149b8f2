//! Transforms of glTF nodes in f64 (glTF 2.0 specification, §3.5.3).

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use crate::gltf::schema::GltfNode;

/// Returns the transform from a node's space to its parent's. The last row of a matrix counts as
/// (0, 0, 0, 1). Without a matrix the node scales, then rotates by a quaternion (x, y, z, w), then
/// translates. The quaternion, which is not zero, is normalized as in scenes: the numbers of a file
/// are rounded, which would shear the mesh, and the error adds up in a long chain of joints.
pub(super) fn local(node: &GltfNode) -> DAffine3 {
    if let Some(columns) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(columns));
    }
    let (translation, rotation, scale) = node.parts();
    DAffine3::from_scale_rotation_translation(
        DVec3::from_array(scale),
        DQuat::from_array(rotation).normalize(),
        DVec3::from_array(translation),
    )
}

/// The rows of a transform, applied to columns (x, y, z, 1).
pub(super) fn rows(transform: &DAffine3) -> [[f64; 4]; 3] {
    let (linear, moved) = (transform.matrix3, transform.translation.to_array());
    [0, 1, 2].map(|k| {
        let [x, y, z] = linear.row(k).to_array();
        [x, y, z, moved[k]]
    })
}

/// A transformed position, computed in f64 and rounded to f32 once.
#[inline]
pub(super) fn point(transform: &DAffine3, p: [f32; 3]) -> [f32; 3] {
    exact_point(transform, p).map(|x| x as f32)
}

/// A transformed position, computed in f64.
#[inline]
pub(super) fn exact_point(transform: &DAffine3, p: [f32; 3]) -> [f64; 3] {
    transform.transform_point3(DVec3::from_array(p.map(f64::from))).to_array()
}

/// Returns the corners of a triangle, with the last two exchanged where it is mirrored.
pub(super) fn turned([a, b, c]: [u32; 3], mirrored: bool) -> [u32; 3] {
    if mirrored { [a, c, b] } else { [a, b, c] }
}

/// Returns true if the transform exchanges left and right.
pub(super) fn is_mirrored(transform: &DAffine3) -> bool {
    let linear = transform.matrix3;
    linear.row(0).dot(cofactors(linear).row(0)) < 0.0
}

/// Transforms a normal by the inverse transpose and normalizes it. It is unchanged where the linear
/// part is the identity, and zero where the transform leaves it no direction.
pub(super) fn normal(transform: &DAffine3, n: [f32; 3]) -> [f32; 3] {
    if transform.matrix3 == DMat3::IDENTITY {
        return n;
    }
    let transformed = direction_of_normal(transform, DVec3::from_array(n.map(f64::from)));
    let length = transformed.length();
    if length > 0.0 { (transformed / length).to_array().map(|x| x as f32) } else { [0.0; 3] }
}

/// Transforms a normal by the inverse transpose, to any length; zero where the transform leaves it
/// no direction.
pub(super) fn direction_of_normal(transform: &DAffine3, n: DVec3) -> DVec3 {
    let sign = if is_mirrored(transform) { -1.0 } else { 1.0 };
    let cofactors = cofactors(transform.matrix3);
    DVec3::from_array([0, 1, 2].map(|k| sign * cofactors.row(k).dot(n)))
}

/// Returns the cofactor matrix: the determinant times the inverse transpose, which exists for
/// singular matrices too.
fn cofactors(linear: DMat3) -> DMat3 {
    let [a, b, c] = [0, 1, 2].map(|k| linear.row(k));
    DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b)).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_apply_scale_then_rotation_then_translation() {
        let half = 0.5f64.sqrt();
        let turn = local(&GltfNode {
            translation: Some([10.0, 0.0, 0.0].into()),
            rotation: Some([0.0, 0.0, half, half].into()),
            scale: Some([2.0, 3.0, 4.0].into()),
            ..GltfNode::default()
        });
        let p = point(&turn, [1.0, 1.0, 1.0]);
        for (found, expected) in p.into_iter().zip([7.0, 2.0, 4.0f32]) {
            assert!((found - expected).abs() <= 4.0 * f32::EPSILON * 10.0, "{p:?}");
        }
    }

    #[test]
    fn products_apply_the_inner_transform_first() {
        let scale = local(&GltfNode { scale: Some([2.0; 3].into()), ..GltfNode::default() });
        let shift = local(&GltfNode { translation: Some([1.0, 2.0, 3.0].into()), ..GltfNode::default() });
        assert_eq!(point(&(scale * shift), [1.0; 3]), [4.0, 6.0, 8.0]);
        assert_eq!(point(&(shift * scale), [1.0; 3]), [3.0, 4.0, 5.0]);
        let columns = [2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.0, 2.0, 3.0, 1.0];
        assert_eq!(local(&GltfNode { matrix: Some(columns.into()), ..GltfNode::default() }), shift * scale);
    }

    #[test]
    fn normals_stay_perpendicular_and_on_their_side_when_mirrored_and_sheared() {
        let mut columns = [0.0; 16];
        columns[..12].copy_from_slice(&[-2.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.5, 3.0, 0.0]);
        let t = local(&GltfNode { matrix: Some(columns.into()), ..GltfNode::default() });
        assert!(is_mirrored(&t));
        let n = DVec3::from_array(normal(&t, [0.0, 0.0, 1.0]).map(f64::from));
        let along = |p: DVec3| n.dot(t.transform_vector3(p));
        assert!(along(DVec3::X).abs() < 4.0 * f64::from(f32::EPSILON));
        assert!(along(DVec3::Y).abs() < 4.0 * f64::from(f32::EPSILON));
        assert!(along(DVec3::Z) > 0.0);
    }
}
