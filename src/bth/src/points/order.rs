//! The order in which the points of a batch are searched: along a Morton curve, so that each point
//! is close to the one before. Its triangle then gives a good bound, and the nodes that it visited
//! are in the cache. The order never changes a result.

/// Number of points that are ordered together.
const CHUNK: usize = 1 << 20;
/// Fewer points are searched in the order in which they are given.
const MIN_ORDERED: usize = 32;
/// Bits of each coordinate on the curve.
const BITS: u32 = 10;

/// Spreads the ten lowest bits of a number, two zero bits after each.
fn spread(x: u64) -> u64 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// The points of a batch by their place on the curve through the box of all finite ones: `order`
/// receives the place in the high half and the index of the point in the low half of each number.
/// There are at most 2^32 points.
fn along_curve<T: Into<f64> + Copy>(points: &[[T; 3]], order: &mut Vec<u64>) {
    let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let wide = |point: &[T; 3]| point.map(T::into);
    for point in points.iter().map(wide).filter(|point| point.iter().all(|x: &f64| x.is_finite())) {
        for k in 0..3 {
            lower[k] = lower[k].min(point[k]);
            upper[k] = upper[k].max(point[k]);
        }
    }
    let cells = f64::from((1 << BITS) - 1);
    let scale = [0, 1, 2].map(|k| cells / (upper[k] - lower[k]));
    let place = |point: &[T; 3]| {
        let point = wide(point);
        (0..3).fold(0, |place, k| {
            // The conversion limits the number to the range of the type, and maps NaN to 0.
            let cell = ((point[k] - lower[k]) * scale[k]) as u16;
            place | spread(u64::from(cell.min((1 << BITS) - 1))) << k
        })
    };
    order.clear();
    order.extend(points.iter().enumerate().map(|(i, point)| place(point) << 32 | i as u64));
    order.sort_unstable();
}

/// Calls `visit` with the index of each point of a batch, in an order in which each is close to the
/// one before.
pub(super) fn in_order<T: Into<f64> + Copy>(points: &[[T; 3]], mut visit: impl FnMut(usize)) {
    let mut order = Vec::new();
    for (chunk, points) in points.chunks(CHUNK).enumerate() {
        let first = chunk * CHUNK;
        if points.len() < MIN_ORDERED {
            (first..first + points.len()).for_each(&mut visit);
            continue;
        }
        along_curve(points, &mut order);
        order.iter().for_each(|entry| visit(first + *entry as u32 as usize));
    }
}

#[cfg(test)]
mod tests {
    use super::along_curve;

    #[test]
    fn every_point_is_visited_once_and_the_cells_of_an_octant_together() {
        let points: Vec<[f32; 3]> =
            (0..64).map(|i| [i & 3, i >> 2 & 3, i >> 4].map(|x| x as f32)).chain([[f32::NAN; 3]]).collect();
        let mut order = vec![7];
        along_curve(&points, &mut order);
        let visited: Vec<usize> = order.iter().map(|entry| *entry as u32 as usize).collect();
        let mut sorted = visited.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..65));
        let finite: Vec<_> = visited.into_iter().filter(|i| *i < 64).collect();
        for octant in finite.chunks(8) {
            let of = |i: usize| points[i].map(|x| x >= 2.0);
            assert!(octant.iter().all(|i| of(*i) == of(octant[0])), "{octant:?}");
        }
    }

    #[test]
    fn points_without_an_extent_keep_their_order() {
        for point in [[1.0; 3], [f32::INFINITY; 3], [f32::MAX; 3]] {
            let mut order = Vec::new();
            along_curve(&[point; 5], &mut order);
            assert!(order.iter().map(|entry| *entry as u32).eq(0..5));
        }
    }
}
