//! The masks of instances and of groups of triangles, which decide what rays with a mask can hit.

/// A mask of 32 bits for each instance and for each group of triangles of an object. All bits are
/// set unless a mask was set; no memory is used for masks behind the last one that lacks a bit.
#[derive(Debug, Default)]
pub(crate) struct Masks {
    /// By instance; shorter than the number of instances where the rest has all bits set.
    instances: Vec<u32>,
    /// By object and group; shorter as above.
    groups: Vec<Vec<u32>>,
}

/// Stores a mask at an index, after masks with all bits set.
fn store(masks: &mut Vec<u32>, index: u32, mask: u32) {
    let index = index as usize;
    if masks.len() <= index {
        if mask == u32::MAX {
            return;
        }
        masks.resize(index + 1, u32::MAX);
    }
    masks[index] = mask;
    trim(masks, |mask| *mask == u32::MAX);
}

/// Removes defaults from the end.
fn trim<T>(masks: &mut Vec<T>, is_default: impl Fn(&T) -> bool) {
    let kept = masks.iter().rposition(|mask| !is_default(mask)).map_or(0, |last| last + 1);
    masks.truncate(kept);
}

/// The mask at an index.
fn read(masks: &[u32], index: u32) -> u32 {
    masks.get(index as usize).copied().unwrap_or(u32::MAX)
}

impl Masks {
    /// Returns true if all masks have all bits set.
    pub(crate) fn is_empty(&self) -> bool {
        self.instances.is_empty() && self.groups.is_empty()
    }

    /// Returns true if some group has a mask that lacks a bit.
    pub(crate) fn has_groups(&self) -> bool {
        !self.groups.is_empty()
    }

    pub(crate) fn of_instance(&self, instance: u32) -> u32 {
        read(&self.instances, instance)
    }

    pub(crate) fn set_instance(&mut self, instance: u32, mask: u32) {
        store(&mut self.instances, instance, mask);
    }

    /// The masks of an object's groups, for [`Self::of_group`]; `None` if all have all bits set.
    pub(crate) fn groups(&self, object: u32) -> Option<&[u32]> {
        self.groups.get(object as usize).map(Vec::as_slice).filter(|masks| !masks.is_empty())
    }

    /// The mask of a group, given the masks of the object's groups.
    pub(crate) fn of_group(groups: &[u32], group: u32) -> u32 {
        read(groups, group)
    }

    pub(crate) fn set_group(&mut self, object: u32, group: u32, mask: u32) {
        let object = object as usize;
        if self.groups.len() <= object {
            if mask == u32::MAX {
                return;
            }
            self.groups.resize_with(object + 1, Vec::new);
        }
        store(&mut self.groups[object], group, mask);
        trim(&mut self.groups, Vec::is_empty);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_that_are_set_back_leave_nothing() {
        let mut masks = Masks::default();
        masks.set_instance(7, u32::MAX);
        masks.set_group(7, 7, u32::MAX);
        assert!(masks.is_empty());
        masks.set_instance(3, 5);
        masks.set_instance(1, 0);
        masks.set_group(2, 4, 1);
        assert_eq!([0, 1, 2, 3, 9].map(|i| masks.of_instance(i)), [u32::MAX, 0, u32::MAX, 5, u32::MAX]);
        assert!(masks.groups(1).is_none());
        assert_eq!(masks.groups(2).map(|groups| Masks::of_group(groups, 4)), Some(1));
        masks.set_instance(3, u32::MAX);
        masks.set_group(2, 4, u32::MAX);
        assert!(!masks.is_empty());
        masks.set_instance(1, u32::MAX);
        assert!(masks.is_empty());
    }
}
