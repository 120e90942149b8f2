//! Transforms: translation, rotation and scale, matrices, and rotations given as axis and angle or
//! as a point to look at.

use crate::error::{Result, code};
use crate::nodes::Transform;
use crate::table::{Table, Value};

/// Keys of a rotation about an axis.
pub(crate) const TURN_KEYS: &[&str] = &["axis", "degrees"];
/// Keys of a `look`.
pub(crate) const LOOK_KEYS: &[&str] = &["from", "to", "up"];

/// The transform of a node.
pub(crate) fn transform(node: &Table<'_>) -> Result<Transform> {
    for parts in ["translation", "rotation", "scale", "look"] {
        node.exclude("matrix", parts)?;
    }
    for parts in ["translation", "rotation"] {
        node.exclude("look", parts)?;
    }
    if let Some(value) = node.get("matrix") {
        return Ok(Transform::Matrix(value.matrix()?));
    }
    let Transform::Parts { mut translation, mut rotation, mut scale } = Transform::default() else {
        unreachable!("the default has parts")
    };
    if let Some(value) = node.get("look") {
        (translation, rotation) = look(&value)?;
    }
    if let Some(value) = node.get("translation") {
        translation = value.numbers()?;
    }
    if let Some(value) = node.get("rotation") {
        rotation = self::rotation(&value)?;
    }
    if let Some(value) = node.get("scale") {
        scale = value.numbers()?;
    }
    Ok(Transform::Parts { translation, rotation, scale })
}

/// A quaternion, or `{ axis = [x, y, z], degrees = d }`.
pub(crate) fn rotation(value: &Value<'_>) -> Result<[f64; 4]> {
    if !value.is_table() {
        let quaternion: [f64; 4] = value.numbers()?;
        if unit(quaternion).is_none() {
            return Err(value.not_allowed("a quaternion that is not zero", format!("{quaternion:?}")));
        }
        return Ok(quaternion);
    }
    let turn = value.table(TURN_KEYS)?;
    let axis_value = turn.need("axis")?;
    let axis: [f64; 3] = axis_value.numbers()?;
    let half = turn.need("degrees")?.number()?.to_radians() / 2.0;
    let [x, y, z] = unit(axis)
        .ok_or_else(|| axis_value.not_allowed("an axis that is not zero", format!("{axis:?}")))?
        .map(|k| k * half.sin());
    Ok([x, y, z, half.cos()])
}

/// `{ from = [..], to = [..], up = [..] }`: the translation and rotation of a node at `from` whose
/// negative z axis points to `to`.
fn look(value: &Value<'_>) -> Result<([f64; 3], [f64; 4])> {
    let table = value.table(LOOK_KEYS)?;
    let from: [f64; 3] = table.need("from")?.numbers()?;
    let to: [f64; 3] = table.need("to")?.numbers()?;
    let up: [f64; 3] = table.get("up").map_or(Ok([0.0, 1.0, 0.0]), |v| v.numbers())?;
    let axes = || {
        let back = unit([0, 1, 2].map(|k| from[k] - to[k]))?;
        let right = unit(cross(up, back))?;
        Some([right, cross(back, right), back])
    };
    let Some(axes) = axes() else {
        return Err(table.error(
            code::VALUE,
            "`from`, `to` and `up` do not determine a direction of view",
            "choose `to` apart from `from`, and `up` not along the line between them",
        ));
    };
    Ok((from, quaternion(axes)))
}

/// The vector normalized; `None` for zero and for vectors that are not finite.
fn unit<const N: usize>(v: [f64; N]) -> Option<[f64; N]> {
    let greatest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let scaled = v.map(|x| x / greatest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    (greatest > 0.0 && length.is_finite()).then(|| scaled.map(|x| x / length))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The rotation that takes x, y and z to these unit axes (Shepperd, "Quaternion from rotation
/// matrix", 1978).
fn quaternion([x, y, z]: [[f64; 3]; 3]) -> [f64; 4] {
    let squares = [
        1.0 + x[0] - y[1] - z[2],
        1.0 - x[0] + y[1] - z[2],
        1.0 - x[0] - y[1] + z[2],
        1.0 + x[0] + y[1] + z[2],
    ];
    let greatest = (0..4).max_by(|a, b| squares[*a].total_cmp(&squares[*b])).unwrap_or(3);
    let (plus, minus) = ([y[2] + z[1], z[0] + x[2], x[1] + y[0]], [y[2] - z[1], z[0] - x[2], x[1] - y[0]]);
    let raw = match greatest {
        0 => [squares[0], plus[2], plus[1], minus[0]],
        1 => [plus[2], squares[1], plus[0], minus[1]],
        2 => [plus[1], plus[0], squares[2], minus[2]],
        _ => [minus[0], minus[1], minus[2], squares[3]],
    };
    unit(raw).unwrap_or([0.0, 0.0, 0.0, 1.0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of the matrix of a unit quaternion.
    fn axes([x, y, z, w]: [f64; 4]) -> [[f64; 3]; 3] {
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
            [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)],
            [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    #[test]
    fn quaternions_rotate_the_axes_to_those_they_are_made_from() {
        for i in 0..200u32 {
            let part = |k: u32| f64::from((i * 7919 + k * 104_729) % 1000) / 500.0 - 1.0;
            let Some(q) = unit([part(1), part(2), part(3), part(4)]) else { continue };
            let found = axes(quaternion(axes(q)));
            for (a, b) in found.as_flattened().iter().zip(axes(q).as_flattened()) {
                assert!((a - b).abs() < 1e-12, "{q:?}");
            }
        }
    }
}
