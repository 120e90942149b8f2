//! Instances that the caller of a scene builder places: all changes of a commit at once, or none of them.

use super::caller_instances::InstanceRow;
use super::placement::{PartBoxes, Placement, PlacementError};
use super::world::{TransformSource, World};
use crate::clock;
use crate::objects::Objects;
use crate::simd::{Isa, Kernel, Simd};
use crate::update::Update;
use bth_format::layout::NONE;

/// From this number of changed instances on, they are placed by several threads.
#[cfg(feature = "rayon")]
const MIN_PARALLEL: usize = 2048;
/// Number of instances that one task places.
#[cfg(feature = "rayon")]
const TASK: usize = 256;

/// The top level is built anew where its expected cost would exceed this multiple of that when it was built. See
/// `docs/decisions.md`.
pub(crate) const MAX_COST_RATIO: f64 = 1.5;

/// An instance as it is to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewInstance {
    pub(crate) row: InstanceRow,
    pub(crate) visible: bool,
}

/// An instance that cannot be placed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unplaceable {
    pub(crate) instance: u32,
    pub(crate) error: PlacementError,
}

impl World {
    /// Changes the instances in `changed`, whose indices are below `count`, to what `new` returns for them, and rebuilds or refits
    /// the top level. `count` is the new number of instances, not below the former one; each new instance is among the changed.
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
        self.place_all(objects, changed, new, &mut placed);
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

    /// Stores the placements of changed instances, none of which is an error.
    fn store(
        &mut self,
        count: usize,
        changed: &[u32],
        new: &impl Fn(u32) -> NewInstance,
        placed: &[Result<Option<Placement>, PlacementError>],
    ) -> Update {
        let TransformSource::Caller(caller) = &mut self.source else { return Update::default() };
        let vacant =
            InstanceRow { object: NONE, node: NONE, to_world: crate::nodes::affine::Affine::IDENTITY };
        caller.rows.resize(count, vacant);
        self.placements.resize(count, None);
        let mut same_visible = true;
        for (placed, &instance) in placed.iter().zip(changed) {
            let placement = placed.unwrap_or(None);
            let former = std::mem::replace(&mut self.placements[instance as usize], placement);
            caller.rows[instance as usize] = new(instance).row;
            same_visible &= former.is_some() == placement.is_some();
            caller.visible =
                caller.visible + usize::from(placement.is_some()) - usize::from(former.is_some());
        }
        let visible = caller.visible;
        let mut update = Update { placed: changed.len(), visible, ..Update::default() };
        if changed.is_empty() {
            update.cost_ratio = self.top.cost_ratio();
            return update;
        }
        self.update_top(same_visible, &mut update);
        update
    }

    /// Refits the top level if the same instances are visible and its cost permits, else builds it anew.
    pub(super) fn update_top(&mut self, same_visible: bool, update: &mut Update) {
        let start = clock::now();
        if same_visible {
            self.top.refit(&self.placements);
        }
        if !same_visible || self.top.cost_ratio() > MAX_COST_RATIO {
            self.build_top();
            update.rebuilt = true;
        }
        (update.cost_ratio, update.top_level) = (self.top.cost_ratio(), clock::elapsed(start));
    }

    /// Computes the placements of changed instances.
    fn place_all(
        &self,
        objects: &Objects,
        changed: &[u32],
        new: &(impl Fn(u32) -> NewInstance + Sync),
        placed: &mut [Result<Option<Placement>, PlacementError>],
    ) {
        #[cfg(feature = "rayon")]
        if changed.len() >= MIN_PARALLEL {
            use rayon::iter::{IndexedParallelIterator, ParallelIterator};
            use rayon::slice::{ParallelSlice, ParallelSliceMut};
            let tasks = changed.par_chunks(TASK).zip(placed.par_chunks_mut(TASK));
            return tasks.for_each(|(changed, placed)| self.place_some(objects, changed, new, placed));
        }
        self.place_some(objects, changed, new, placed);
    }

    fn place_some(
        &self,
        objects: &Objects,
        changed: &[u32],
        new: &impl Fn(u32) -> NewInstance,
        placed: &mut [Result<Option<Placement>, PlacementError>],
    ) {
        // Its loops are of four f64, so AVX-512 would not make it faster, and registers of 128 bits hardly.
        Isa::chosen().min(Isa::Avx2).run(PlaceKernel { world: self, objects, changed, new, placed });
    }

    /// The placement of an instance; `None` if it is not visible. `inlined`: it is compiled inside of a kernel.
    #[inline(always)]
    fn place(
        &self,
        objects: &Objects,
        new: &NewInstance,
        inlined: bool,
    ) -> Result<Option<Placement>, PlacementError> {
        let InstanceRow { object, to_world, .. } = &new.row;
        if !new.visible || *object == NONE {
            return Ok(None);
        }
        let TransformSource::Caller(caller) = &self.source else { return Ok(None) };
        let parts = &caller.parts[*object as usize];
        let view = objects.view(*object);
        if view.header.root == NONE {
            return Ok(None);
        }
        // As for the instances of files, the roots of mapped objects are not read before rays have reached them.
        let is_loaded = || self.is_traced(*object) || !objects.is_mapped(*object);
        let parts = match parts.get() {
            Some(parts) => parts,
            None if is_loaded() => parts.get_or_init(|| Box::new(PartBoxes::of_root_children(view))),
            None => &PartBoxes::whole(view.header),
        };
        let placement = if inlined {
            Placement::inlined(to_world, *object, view.header, parts)
        } else {
            Placement::new(to_world, *object, view.header, parts)
        };
        placement.map(Some)
    }
}

/// Kernel that computes the placements of changed instances.
struct PlaceKernel<'a, N> {
    world: &'a World,
    objects: &'a Objects,
    changed: &'a [u32],
    new: &'a N,
    placed: &'a mut [Result<Option<Placement>, PlacementError>],
}

impl<N: Fn(u32) -> NewInstance> Kernel for PlaceKernel<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        // The loops of a placement are vectorized with the registers of the instruction set.
        for (&instance, placed) in self.changed.iter().zip(self.placed) {
            *placed = self.world.place(self.objects, &(self.new)(instance), S::INLINES_PARTS);
        }
    }
}
