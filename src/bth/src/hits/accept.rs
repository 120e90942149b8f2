//! What a ray is allowed to hit.

use crate::rays::{Hit, Ray};
use std::fmt::{self, Debug, Formatter};

/// The sides of triangles that are ignored. The front of a triangle is the side from which its
/// vertices appear counter-clockwise in the space of its object. A ray that travels against the
/// normal of that side hits the front. The side is decided exactly.
///
/// A transform that mirrors an instance does not exchange front and back: the outside of a closed
/// surface stays its front. This is the rule of glTF (the determinant of a node's transform decides
/// about the winding) and of Embree (culling takes place in the space of the instanced geometry).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Cull {
    /// Both sides can be hit.
    #[default]
    None,
    /// Hits on the back are ignored.
    Back,
    /// Hits on the front are ignored.
    Front,
}

impl Cull {
    /// Returns true if a hit remains, given the scalar product of the ray's direction and
    /// (b-a)×(c-a), which is never 0 and whose sign is exact.
    pub(super) fn keeps(self, determinant: f64) -> bool {
        match self {
            Cull::None => true,
            Cull::Back => determinant < 0.0,
            Cull::Front => determinant > 0.0,
        }
    }
}

/// Returns true if a hit counts.
pub type Filter<'a> = dyn Fn(&Ray, &Hit) -> bool + Sync + 'a;

/// What a ray is allowed to hit: conditions on the instance and the triangle. By default
/// everything.
///
/// ```
/// use bth::rays::{Hit, Ray};
/// use bth::{Accept, Cull};
///
/// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
/// let scene = bth::from_bytes(CUBE)?;
/// let ray = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
/// // Both sides count by default. From above, the bottom of the cube shows its back.
/// let filter = |_: &Ray, hit: &Hit| hit.t > 1.0;
/// let accept = Accept { filter: Some(&filter), ..Accept::default() };
/// assert_eq!(scene.nearest_accepted(&ray, &accept).map(|hit| hit.t), Some(2.0));
/// let accept = Accept { cull: Cull::Back, ..accept };
/// assert_eq!(scene.nearest_accepted(&ray, &accept), None);
/// # Ok::<(), bth::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct Accept<'a> {
    /// Instances and groups of triangles whose mask has no bit in common with this one are not hit.
    /// Their masks have all bits set unless
    /// [`Scene::set_instance_mask`](crate::Scene::set_instance_mask) or
    /// [`Scene::set_group_mask`](crate::Scene::set_group_mask) was called. With a mask of 0 nothing
    /// is hit.
    pub mask: u32,
    /// The sides of triangles that are ignored.
    pub cull: Cull,
    /// If set, it is called with the ray and with a hit in the ray's range that passes the other
    /// conditions. It returns true if the hit counts. The hit has the t, u and v, the instance and
    /// the triangle with which it is reported. Calls come in any order and on any thread. There are
    /// none for transparent parts of triangles (see [`Scene::opacity`](crate::Scene::opacity)) and
    /// for hits that cannot change the result, such as hits behind the nearest so far. No hit is
    /// passed twice. The result of a query does not depend on the order if the filter depends only
    /// on its arguments.
    pub filter: Option<&'a Filter<'a>>,
}

impl Default for Accept<'_> {
    fn default() -> Self {
        Accept { mask: u32::MAX, cull: Cull::None, filter: None }
    }
}

impl Debug for Accept<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Accept { mask, cull, filter } = self;
        f.debug_struct("Accept")
            .field("mask", &format_args!("{mask:#010x}"))
            .field("cull", cull)
            .field("filter", &filter.is_some())
            .finish()
    }
}
