//! Rays that enter an object together, in its space.

use super::affine::{ObjectRay, RayLanes};
use super::round::Round;
use crate::query::sink::Visit;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Rays that go through an object together, in the order of their visits.
#[derive(Default)]
pub(super) struct ObjectRays {
    pub(super) rays: Vec<Ray>,
    /// What t is to be multiplied with to be that of the world.
    pub(super) t_scale: Vec<f32>,
    /// The triangle that each starts on.
    from: Vec<u32>,
}

impl ObjectRays {
    /// Takes the rays of visits into the space of the object; they end at the t that `tmax` gives.
    pub(super) fn fill(
        &mut self,
        round: &Round<'_>,
        object: &ObjectView<'_>,
        visits: &[Visit],
        tmax: impl Fn(usize) -> f32,
    ) {
        self.rays.clear();
        self.t_scale.clear();
        self.from.clear();
        // Only in tetrahedra are they of use.
        if round.from.is_some() && !object.tet_leaves.is_empty() {
            self.from.extend(visits.iter().map(|visit| round.hint(visit.ray as usize, visit.instance)));
        }
        Isa::chosen().run(EnterKernel { batch: self, round, visits, tmax });
    }

    /// The triangles that rays start on, if they were asked for and there are some.
    pub(super) fn hints(&self) -> Option<&[u32]> {
        self.from.iter().any(|from| *from != NONE).then_some(&self.from)
    }
}

/// Takes rays into the space of an object, sixteen of an instance at a time: visits are sorted by those.
struct EnterKernel<'a, T> {
    batch: &'a mut ObjectRays,
    round: &'a Round<'a>,
    visits: &'a [Visit],
    tmax: T,
}

impl<T: Fn(usize) -> f32> Kernel for EnterKernel<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let EnterKernel { batch: ObjectRays { rays, t_scale, .. }, round, visits, tmax } = self;
        rays.resize(visits.len(), NO_RAY);
        t_scale.resize(visits.len(), 1.0);
        let mut lanes = RayLanes::NONE;
        let mut start = 0;
        while start < visits.len() {
            let instance = visits[start].instance;
            let (mut at, mut last) = ([0; LANES], [0.0; LANES]);
            let mut count = 0;
            while count < LANES && start + count < visits.len() && visits[start + count].instance == instance
            {
                let ray = visits[start + count].ray;
                (at[count], last[count]) = (ray, tmax(ray as usize));
                count += 1;
            }
            let wanted = s.mask(((1u64 << count) - 1) as u32);
            let mut rows = [s.splat(0.0); LANES];
            let words = s.rows8(wanted, Ray::rows(round.rays), s.load_u(&at));
            for k in 0..3 {
                s.store(s.floats(words[k]), &mut lanes.origin[k]);
                s.store(s.floats(words[4 + k]), &mut lanes.direction[k]);
            }
            round.world.placed_at(instance).inverse.transform(&mut lanes);
            for k in 0..3 {
                rows[k] = s.load(&lanes.origin[k]);
                rows[4 + k] = s.load(&lanes.direction[k]);
            }
            (rows[3], rows[7]) = (s.floats(words[3]), s.load(&last));
            let rows = s.transpose(rows);
            let mut row = [0.0; LANES];
            for lane in 0..count {
                s.store(rows[lane % LANES], &mut row);
                let [ox, oy, oz, tmin, dx, dy, dz, tmax, ..] = row;
                rays[start + lane] = Ray { origin: [ox, oy, oz], tmin, direction: [dx, dy, dz], tmax };
            }
            for lane in 0..count {
                if lanes.plain[lane % LANES] == 0 {
                    let visit = visits[start + lane];
                    let ObjectRay { ray, t_scale: scale } = round.object_ray(visit, last[lane % LANES]);
                    (rays[start + lane], t_scale[start + lane]) = (ray, scale);
                }
            }
            start += count;
        }
    }
}

const NO_RAY: Ray = Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 };
