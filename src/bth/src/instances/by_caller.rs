//! Instances that the caller of a scene builder places: all changes of a commit at once, or none of
//! them.

use super::group_row::is_object;
use super::groups::{Groups, RowPlace};
use super::placement::{PlacementError, Unplaceable};
use super::world::{CallerInstances, InstanceRow, NewInstance, PlaceResult, TransformSource, World};
use crate::objects::Objects;
use crate::parallel::Tasks;
use crate::simd::{Isa, Kernel, Simd};
use crate::update::Update;

/// How changed instances are placed.
const TASKS: Tasks = Tasks { rows: 256, min_rows: 2048 };

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
        self.place_all(objects, changed, new, &mut placed);
        let failed = placed.iter().zip(changed).find_map(|(placed, &instance)| {
            placed.as_ref().err().map(|&error| Unplaceable { instance, error })
        });
        let result = match failed {
            Some(failed) => Err(failed),
            None => self.store(objects, count, changed, new, &mut placed),
        };
        if let TransformSource::Caller(caller) = &mut self.source {
            caller.placed = placed;
        }
        result
    }

    /// Computes the placements of changed instances.
    pub(super) fn place_all(
        &self,
        objects: &Objects,
        changed: &[u32],
        new: &(impl Fn(u32) -> NewInstance + Sync),
        placed: &mut Vec<PlaceResult>,
    ) {
        placed.clear();
        placed.resize(changed.len(), Ok(None));
        // Its loops are of four f64, so AVX-512 would not make it faster, and registers of 128 bits
        // hardly.
        let isa = Isa::chosen().min(Isa::Avx2);
        TASKS.for_each(placed, |first, placed| {
            isa.run(PlaceKernel { world: self, objects, changed: &changed[first..], new, placed });
        });
    }

    /// Stores the placements of changed instances. No placement may be an error.
    ///
    /// # Errors
    /// The first row of a group that cannot be placed. Nothing is changed then.
    fn store(
        &mut self,
        objects: &Objects,
        count: usize,
        changed: &[u32],
        new: &impl Fn(u32) -> NewInstance,
        placed: &mut [PlaceResult],
    ) -> Result<Update, Unplaceable> {
        let TransformSource::Caller(caller) = &mut self.source else { return Ok(Update::default()) };
        let (has_groups, former_count) = (caller.groups > 0, caller.rows.len());
        caller.rows.resize(count, NewInstance::VACANT);
        self.placements.resize(count, None);
        let mut same_visible = true;
        let mut former = Vec::new();
        let mut same_rows = former_count == count && self.groups().is_some();
        for (placed, &instance) in placed.iter_mut().zip(changed) {
            let TransformSource::Caller(caller) = &mut self.source else { break };
            let Ok(placed) = placed else { continue };
            std::mem::swap(placed, &mut self.placements[instance as usize]);
            same_visible &= placed.is_some() == self.placements[instance as usize].is_some();
            let row = std::mem::replace(&mut caller.rows[instance as usize], new(instance));
            if has_groups {
                let NewInstance { row: now, .. } = caller.rows[instance as usize];
                same_rows &= (row.row.object, row.row.within) == (now.object, now.within);
                former.push(row);
            }
        }
        if has_groups {
            let updated = match same_rows {
                true => self.stage_rows(objects, changed.iter().copied()),
                false => self.group_rows(objects),
            };
            same_visible = match updated {
                Ok(same) => same_rows && same,
                Err(failed) => {
                    let TransformSource::Caller(caller) = &mut self.source else { return Err(failed) };
                    for ((placed, row), &instance) in placed.iter().zip(former).zip(changed) {
                        self.placements[instance as usize] = placed.unwrap_or(None);
                        caller.rows[instance as usize] = row;
                    }
                    caller.rows.truncate(former_count);
                    self.placements.truncate(former_count);
                    // They have been placed before, so placing them again succeeds.
                    let _ = self.group_rows(objects);
                    self.build_top();
                    return Err(failed);
                }
            };
        }
        let mut update = Update { placed: changed.len(), visible: self.visible(), ..Update::default() };
        if changed.is_empty() {
            update.cost_ratio = self.top.cost_ratio();
            return Ok(update);
        }
        self.update_top(same_visible, &mut update);
        Ok(update)
    }

    /// Adds a group; returns its number. The next change may have rows in it.
    pub(crate) fn add_group(&mut self) -> u32 {
        let TransformSource::Caller(caller) = &mut self.source else { return 0 };
        caller.groups += 1;
        caller.groups - 1
    }

    /// Number of groups that were added.
    pub(crate) fn group_count(&self) -> u32 {
        match &self.source {
            TransformSource::Caller(caller) => caller.groups,
            TransformSource::File(_) => 0,
        }
    }

    /// Makes the groups from all rows.
    fn group_rows(&mut self, objects: &Objects) -> Result<bool, Unplaceable> {
        let TransformSource::Caller(CallerInstances { rows, groups, .. }) = &self.source else {
            return Ok(true);
        };
        let places =
            rows.iter().map(|NewInstance { row, .. }| RowPlace { object: row.object, within: row.within });
        let groups = Groups::new(places, *groups);
        let count = rows.len() as u32;
        let too_many = Unplaceable { instance: count.saturating_sub(1), error: PlacementError::TooMany };
        self.set_groups(groups.ok_or(too_many)?);
        self.stage_rows(objects, 0..count)
    }

    /// Stages rows of groups as they are to be, and places the groups.
    fn stage_rows(
        &mut self,
        objects: &Objects,
        changed: impl Iterator<Item = u32>,
    ) -> Result<bool, Unplaceable> {
        for row in changed {
            let TransformSource::Caller(CallerInstances { rows, .. }) = &self.source else { break };
            let NewInstance { row: InstanceRow { to_world, .. }, visible } = rows[row as usize];
            if let Some(groups) = self.groups_mut() {
                groups.stage(row, &to_world, visible);
            }
        }
        self.update_groups(objects, std::iter::empty())
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
            *placed = match visible && is_object(row.object) {
                true => self.world.place(self.objects, row.object, &row.to_world, S::INLINES_PARTS),
                false => Ok(None),
            };
        }
    }
}
