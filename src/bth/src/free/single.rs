//! The decision about one ray, in f64.

use super::corners_at;
use super::crossings::{DIRECTIONS, SLACK as SLACK_F32};
use crate::rays::Ray;
use bth_format::layout::{free_axes, free_bin};
use bth_format::object::ObjectView;

/// Unit of rounding.
const U: f64 = f64::EPSILON / 2.0;
const SLACK: f64 = SLACK_F32 as f64;

/// Where the range of a ray in object space can begin, because the ray leaves `triangle` in a direction of which that is known: no triangle
/// of the object is hit before. At least `tmin`, infinite in a free direction. The triangle may be anything, also none of the object.
#[inline(never)]
pub(super) fn begin(object: &ObjectView<'_>, ray: &Ray, triangle: u32) -> f32 {
    match known_begin(object, ray, triangle) {
        Some(begin) => ray.tmin.max(begin),
        None => ray.tmin,
    }
}

fn known_begin(object: &ObjectView<'_>, ray: &Ray, triangle: u32) -> Option<f32> {
    let known = object.known_free(triangle as usize)?;
    let corners = corners_at(object, *object.places.get(triangle as usize)?)?;
    let direction = ray.direction;
    let greatest = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
    if !(greatest > DIRECTIONS[0] && greatest < DIRECTIONS[1]) {
        return None;
    }
    // The file may lie about which triangles have axes; then nothing is known.
    let (bin, is_back) = free_bin(&free_axes(corners)?, direction.map(f64::from))?;
    let (crossing, leaves_to_back) = crossing(ray, corners)?;
    if is_back != leaves_to_back {
        return None;
    }
    if known.bins.is_free(bin) && known.bins.is_back() == is_back {
        return Some(f32::INFINITY);
    }
    let level = known.sectors[usize::from(is_back)].level_of_bin(bin);
    let within = f64::from(object.free_levels.first()?.within(level));
    let length = direction.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    let step = within / length;
    Some((crossing + step - (step - crossing) * SLACK) as f32)
}

/// Lower bound of the t at which the line of a ray crosses a triangle, if it certainly does before the ray's range begins, and
/// whether the ray leaves it to the back.
///
/// With the corners r relative to the origin, the signs of d·(r₁×r₂), d·(r₂×r₀) and d·(r₀×r₁) say on which sides of the edges the line
/// passes, and t is the quotient of r₀·(r₁×r₂) and their sum. The bounds of the errors follow from the number of roundings: 14 units
/// of the product of the sizes of a term for the former, 48 for the latter. Products of three f32 neither underflow nor
/// overflow in f64.
fn crossing(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<(f64, bool)> {
    let d = ray.direction.map(f64::from);
    let r = corners.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(ray.origin[k])));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let far = r.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let size = d[0].abs() + d[1].abs() + d[2].abs();
    let normal = cross(r[1], r[2]);
    let sides = [dot(d, normal), dot(d, cross(r[2], r[0])), dot(d, cross(r[0], r[1]))];
    let side_error = 20.0 * U * far * far * size;
    let sign = if sides[0] > 0.0 { 1.0 } else { -1.0 };
    // Comparisons are false for what is no number.
    if !sides.iter().all(|side| side * sign > side_error) {
        return None;
    }
    let volume = sign * dot(r[0], normal);
    let volume_error = 64.0 * U * far * far * far;
    let sum = sign * (sides[0] + sides[1] + sides[2]);
    let sum_error = 4.0 * side_error + 8.0 * U * sum;
    let tmin = f64::from(ray.tmin);
    let first = tmin - (tmin.abs() * (1.0 / f64::from(1 << 20)) + f64::from(f32::MIN_POSITIVE));
    if !(volume + volume_error < first * sum - first.abs() * sum_error && sum > sum_error) {
        return None;
    }
    Some(((volume - volume_error).min(0.0) / (sum - sum_error), sign < 0.0))
}
