//! The masks of instances and of groups of triangles, which decide what rays with a mask meet.

/// A mask of 32 bits for each instance and for each group of triangles of an object. All bits are set unless a mask was set; no
/// memory is used before.
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
        masks.resize(index + 1, u32::MAX);
    }
    masks[index] = mask;
}

/// The mask at an index.
fn read(masks: &[u32], index: u32) -> u32 {
    masks.get(index as usize).copied().unwrap_or(u32::MAX)
}

impl Masks {
    /// Whether no mask was ever set.
    pub(crate) fn is_empty(&self) -> bool {
        self.instances.is_empty() && self.groups.is_empty()
    }

    pub(crate) fn of_instance(&self, instance: u32) -> u32 {
        read(&self.instances, instance)
    }

    pub(crate) fn set_instance(&mut self, instance: u32, mask: u32) {
        store(&mut self.instances, instance, mask);
    }

    /// Sets all bits of the mask of an instance that was removed.
    pub(crate) fn reset_instance(&mut self, instance: u32) {
        if let Some(mask) = self.instances.get_mut(instance as usize) {
            *mask = u32::MAX;
        }
    }

    /// The masks of an object's groups, for [`Self::of_group`]; `None` if none was set.
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
            self.groups.resize_with(object + 1, Vec::new);
        }
        store(&mut self.groups[object], group, mask);
    }
}
