//! Instances that the caller of a scene builder places: all changes of a commit at once, or none of
//! them.

use super::world::{InstanceRow, PlaceResult, TransformSource, Unplaceable, World};
use crate::nodes::affine::Affine;
use crate::objects::Objects;
use crate::parallel::Tasks;
use crate::simd::{Isa, Kernel, Simd};
use crate::update::Update;
use bth_format::layout::NONE;

/// How changed instances are placed.
const TASKS: Tasks = Tasks { rows: 256, min_rows: 2048 };

/// An instance as it is to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewInstance {
    pub(crate) row: InstanceRow,
    pub(crate) visible: bool,
}

impl World {
    /// Changes the instances in `changed`, whose indices are below `count`, to what `new` returns
    /// for them, and builds or refits the top level. `count` is the new number of instances, not
    /// below the former one. Each new instance is in `changed`.
    ///
    /// # Errors
    /// The first of `changed` that cannot be placed. No instance is changed then.
    pub(crate) fn change(
        &mut self,
        objects: &Objects,
        count: usize,
        changed: &[u32],
        new: &(impl Fn(u32) -> NewInstance + Sync),
    ) -> Result<Update, Unplaceable> {
        let mut placed = match &mut self.source {
            TransformSource::Caller(caller) => std::mem::take(&mut caller.placed),
            TransformSource::File(_) => Vec::new(),
        };
        placed.resize(changed.len(), Ok(None));
        // Its loops are of four f64, so AVX-512 would not make it faster, and registers of 128 bits
        // hardly.
        let (isa, world) = (Isa::chosen().min(Isa::Avx2), &*self);
        TASKS.for_each(&mut placed, |first, placed| {
            isa.run(PlaceKernel { world, objects, changed: &changed[first..], new, placed });
        });
        let failed = placed.iter().zip(changed).find_map(|(placed, &instance)| {
            placed.as_ref().err().map(|&error| Unplaceable { instance, error })
        });
        let result = match failed {
            Some(failed) => Err(failed),
            None => Ok(self.store(count, changed, new, &placed)),
        };
        if let TransformSource::Caller(caller) = &mut self.source {
            caller.placed = placed;
        }
        result
    }

    /// Stores the placements of changed instances. No placement may be an error.
    fn store(
        &mut self,
        count: usize,
        changed: &[u32],
        new: &impl Fn(u32) -> NewInstance,
        placed: &[PlaceResult],
    ) -> Update {
        let TransformSource::Caller(caller) = &mut self.source else { return Update::default() };
        let vacant = InstanceRow { object: NONE, node: NONE, to_world: Affine::IDENTITY };
        caller.rows.resize(count, vacant);
        self.placements.resize(count, None);
        let mut same_visible = true;
        for (placed, &instance) in placed.iter().zip(changed) {
            let placement = placed.unwrap_or(None);
            let former = std::mem::replace(&mut self.placements[instance as usize], placement);
            caller.rows[instance as usize] = new(instance).row;
            same_visible &= former.is_some() == placement.is_some();
        }
        let mut update = Update { placed: changed.len(), visible: self.visible(), ..Update::default() };
        if changed.is_empty() {
            update.cost_ratio = self.top.cost_ratio();
            return update;
        }
        self.update_top(same_visible, &mut update);
        update
    }
}

/// Kernel that computes the placements of changed instances.
struct PlaceKernel<'a, N> {
    world: &'a World,
    objects: &'a Objects,
    changed: &'a [u32],
    new: &'a N,
    placed: &'a mut [PlaceResult],
}

impl<N: Fn(u32) -> NewInstance> Kernel for PlaceKernel<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        // The loops of a placement are vectorized with the registers of the instruction set.
        for (&instance, placed) in self.changed.iter().zip(self.placed) {
            let NewInstance { row, visible } = (self.new)(instance);
            *placed = match visible && row.object != NONE {
                true => self.world.place(self.objects, row.object, &row.to_world, S::INLINES_PARTS),
                false => Ok(None),
            };
        }
    }
}
