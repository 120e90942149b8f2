//! A set of joints of a mesh.

/// Numbers of joints below [`JointSet::LIMIT`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JointSet {
    /// Bit j % 64 of word j / 64 is set if joint j is in the set.
    words: [u64; 4],
}

impl JointSet {
    /// No joint of this number or a greater one is in a set.
    pub const LIMIT: u32 = 256;

    /// Returns true if no joint is in the set.
    pub fn is_empty(&self) -> bool {
        self.words == [0; 4]
    }

    /// Returns true if a joint is in the set.
    pub fn contains(&self, joint: u32) -> bool {
        joint < Self::LIMIT && self.words[joint as usize / 64] >> (joint % 64) & 1 == 1
    }

    /// The joints, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        (0..Self::LIMIT).filter(|joint| self.contains(*joint))
    }
}

impl FromIterator<u32> for JointSet {
    /// The set of those numbers that are below [`JointSet::LIMIT`].
    fn from_iter<T: IntoIterator<Item = u32>>(joints: T) -> JointSet {
        let mut set = JointSet::default();
        for joint in joints.into_iter().filter(|joint| *joint < Self::LIMIT) {
            set.words[joint as usize / 64] |= 1 << (joint % 64);
        }
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_has_the_joints_that_it_was_made_of() {
        let joints = [0, 1, 63, 64, 130, 255];
        let set: JointSet = joints.into_iter().chain([256, u32::MAX]).collect();
        assert!(set.iter().eq(joints) && !set.is_empty() && JointSet::default().is_empty());
        assert!((0..300).all(|joint| set.contains(joint) == joints.contains(&joint)));
        assert!(!set.contains(u32::MAX));
    }
}
