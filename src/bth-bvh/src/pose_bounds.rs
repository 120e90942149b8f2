//! Bounds in several poses at once, for trees whose cost is summed over poses.

use super::bounds::Bounds;
use super::extent::Extent;
use super::poses::Poses;
use rayon::prelude::*;

/// Poses whose axes are orders in which triangles are sorted and binned. The axes of all poses find
/// little better splits, and take longer by the number of poses.
const ORDER_POSES: usize = 4;
/// Largest scaled coordinate.
const GREATEST: f64 = (1u64 << 40) as f64;

/// Bounds in up to `P` poses. Each pose is scaled so that the root's half area is 1 in it. The sum
/// of areas is then the sum of probabilities that a ray enters the node, as in T-SAH. Places
/// without a pose hold points, whose area is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseBounds<const P: usize> {
    /// Lower end per axis, then pose.
    lower: [[f32; P]; 3],
    /// Upper end per axis, then pose.
    upper: [[f32; P]; 3],
}

impl<const P: usize> Extent for PoseBounds<P> {
    type Orders<T: Clone + Send + Sync> = [T; 3 * ORDER_POSES];

    const EMPTY: Self = PoseBounds { lower: [[f32::INFINITY; P]; 3], upper: [[f32::NEG_INFINITY; P]; 3] };

    #[inline(always)]
    fn orders<T: Clone + Send + Sync>(value: impl FnMut(usize) -> T) -> [T; 3 * ORDER_POSES] {
        std::array::from_fn(value)
    }

    #[inline(always)]
    fn grow(&mut self, other: &Self) {
        for k in 0..3 {
            for p in 0..P {
                let (a, b) = (self.lower[k][p], other.lower[k][p]);
                self.lower[k][p] = if b < a { b } else { a };
                let (a, b) = (self.upper[k][p], other.upper[k][p]);
                self.upper[k][p] = if b > a { b } else { a };
            }
        }
    }

    #[inline(always)]
    fn half_area(&self) -> f64 {
        let mut areas = [0.0f32; P];
        for (p, area) in areas.iter_mut().enumerate() {
            let [x, y, z]: [f32; 3] = std::array::from_fn(|k| self.upper[k][p] - self.lower[k][p]);
            *area = x * y + y * z + z * x;
        }
        areas.iter().map(|area| f64::from(*area)).sum()
    }

    #[inline(always)]
    fn half_center(&self) -> [f32; 3 * ORDER_POSES] {
        std::array::from_fn(|order| {
            let (k, p) = (order % 3, order / 3);
            0.25 * self.lower[k][p] + 0.25 * self.upper[k][p]
        })
    }

    /// A box of zeros: the boxes of nodes come from the mesh and are written when the tree is
    /// complete.
    fn node_box(&self) -> Bounds {
        Bounds::new([0.0; 3], [0.0; 3])
    }
}

/// Turns corners into bounds in all poses.
pub(super) struct ScaledPoses<'a, const P: usize> {
    triangles: &'a [[u32; 3]],
    /// For each place its pose, or none.
    places: [Option<Scaled<'a>>; P],
}

/// A pose, and how it is scaled.
#[derive(Clone, Copy)]
struct Scaled<'a> {
    positions: &'a [[f32; 3]],
    origin: [f64; 3],
    /// 0 where the bounds of the whole mesh have no area, so that the pose does not count.
    scale: f64,
}

impl<'a, const P: usize> ScaledPoses<'a, P> {
    /// Scales the poses, 1 to `P` of them. `used` are the triangles of the tree.
    pub(super) fn new(triangles: &'a [[u32; 3]], poses: &Poses<'a>, used: &[u32]) -> Self {
        const { assert!(P >= ORDER_POSES) };
        let count = poses.len().min(P);
        // The first places are those whose axes are orders, so they hold poses that are spread over
        // all.
        let mut rows: Vec<usize> = (0..ORDER_POSES).map(|order| order * count / ORDER_POSES).collect();
        rows.dedup();
        rows.extend((0..count).filter(|row| !rows.contains(row)).collect::<Vec<_>>());
        let mut places = [None; P];
        for (place, row) in places.iter_mut().zip(rows) {
            *place = Some(Scaled::new(triangles, poses.positions(row), used));
        }
        ScaledPoses { triangles, places }
    }

    /// The bounds of a triangle.
    pub(super) fn bounds(&self, id: u32) -> PoseBounds<P> {
        let corners = self.triangles[id as usize];
        let mut bounds = PoseBounds { lower: [[0.0; P]; 3], upper: [[0.0; P]; 3] };
        for (p, place) in self.places.iter().enumerate() {
            let Some(pose) = place else { continue };
            let box_of = pose.bounds(corners);
            for k in 0..3 {
                bounds.lower[k][p] = box_of.lower()[k];
                bounds.upper[k][p] = box_of.upper()[k];
            }
        }
        bounds
    }
}

impl<'a> Scaled<'a> {
    fn new(triangles: &[[u32; 3]], positions: &'a [[f32; 3]], used: &[u32]) -> Self {
        let of = |id: &u32| Bounds::of_points(&triangles[*id as usize].map(|row| positions[row as usize]));
        let root = used.par_iter().map(of).reduce(|| Bounds::EMPTY, |a, b| a.union(&b));
        let area = root.half_area();
        // Of boxes that are extremely thin the area stays below 1, so that no scaled coordinate
        // overflows.
        let extent =
            (0..3).map(|k| f64::from(root.upper()[k]) - f64::from(root.lower()[k])).fold(0.0, f64::max);
        let scale = if area > 0.0 { (1.0 / area.sqrt()).min(GREATEST / extent) } else { 0.0 };
        Scaled { positions, origin: root.lower().map(f64::from), scale }
    }

    fn bounds(&self, corners: [u32; 3]) -> Bounds {
        let scaled = |row: u32| -> [f32; 3] {
            let p = self.positions[row as usize];
            std::array::from_fn(|k| ((f64::from(p[k]) - self.origin[k]) * self.scale) as f32)
        };
        Bounds::of_points(&corners.map(scaled))
    }
}
