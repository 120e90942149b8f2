//! Decides if a triangle overlaps a box, by cutting the triangle to the box exactly.

use crate::number::Coordinate;
use num_rational::BigRational;
use num_traits::Zero;

type Polygon = Vec<[BigRational; 3]>;

fn exact<T: Coordinate>(x: T) -> BigRational {
    BigRational::from_float(x.into()).expect("a finite number")
}

/// The part of a convex polygon in the half space where `sign * (p[axis] - plane)` is not negative
/// (Sutherland and Hodgman, "Reentrant Polygon Clipping", CACM 1974).
fn cut(polygon: &Polygon, axis: usize, plane: &BigRational, sign: i32) -> Polygon {
    let height = |p: &[BigRational; 3]| (&p[axis] - plane) * BigRational::from_integer(sign.into());
    let mut kept = Polygon::new();
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        let (from, to) = (height(p), height(q));
        if from >= BigRational::zero() {
            kept.push(p.clone());
        }
        if (from < BigRational::zero()) != (to < BigRational::zero()) {
            let t = &from / (&from - &to);
            kept.push([0, 1, 2].map(|k| &p[k] + (&q[k] - &p[k]) * &t));
        }
    }
    kept
}

/// Returns true if a closed triangle and a closed box of finite coordinates have a point in common.
pub fn overlaps_box<T: Coordinate>(lower: [T; 3], upper: [T; 3], corners: [[T; 3]; 3]) -> bool {
    let mut polygon: Polygon = corners.iter().map(|p| p.map(exact)).collect();
    for k in 0..3 {
        polygon = cut(&polygon, k, &exact(lower[k]), 1);
        polygon = cut(&polygon, k, &exact(upper[k]), -1);
    }
    !polygon.is_empty()
}

#[cfg(test)]
mod tests {
    use super::overlaps_box;

    #[test]
    fn a_triangle_that_touches_or_crosses_a_box_overlaps_it() {
        let unit = |corners| overlaps_box([0.0; 3], [1.0; 3], corners);
        assert!(unit([[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]));
        assert!(unit([[3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]]), "in a corner of the box");
        assert!(!unit([[3.1, 0.0, 0.0], [0.0, 3.1, 0.0], [0.0, 0.0, 3.1]]));
        assert!(unit([[1.0, 0.5, 0.5], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]), "by a corner");
        assert!(unit([[-1.0, -1.0, 0.5], [4.0, -1.0, 0.5], [-1.0, 4.0, 0.5]]), "around the box");
        assert!(!unit([[1.5, 1.5, 0.5], [2.5, 0.5, 0.5], [2.5, 2.5, 0.5]]));
    }
}
