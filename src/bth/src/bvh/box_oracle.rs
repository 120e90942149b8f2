//! The slow and obvious box test of tests: the slabs of one box in f64.

use crate::rays::Ray;

/// Returns true if a ray hits a box that is enlarged by `more` on all sides. No ray hits an empty
/// box.
pub(crate) fn meets(ray: &Ray, lower: [f32; 3], upper: [f32; 3], more: f64) -> bool {
    if lower[0] > upper[0] {
        return false;
    }
    let (mut enter, mut leave) = (f64::from(ray.tmin), f64::from(ray.tmax));
    for k in 0..3 {
        let (o, d) = (f64::from(ray.origin[k]), f64::from(ray.direction[k]));
        let [a, b] = [f64::from(lower[k]) - more, f64::from(upper[k]) + more].map(|x| (x - o) / d);
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    enter <= leave
}
