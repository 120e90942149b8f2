//! Groups and materials of an object, and their names.

use super::view::ObjectView;
use crate::layout::NONE;
use crate::names::name;

impl<'a> ObjectView<'a> {
    /// Number of groups of the object's triangles: 1 where the file keeps none, when all triangles
    /// are of group 0.
    pub fn group_count(&self) -> u32 {
        (self.groups.len() as u32).max(1)
    }

    /// The group of a triangle, by binary search in the runs; 0 where the file keeps no groups. For
    /// an id that is not below the number of triangles it is the group of the last triangle.
    #[inline]
    pub fn group_of(&self, triangle: u32) -> u32 {
        let behind = self.group_runs.partition_point(|run| run.first <= triangle);
        behind.checked_sub(1).map_or(0, |run| self.group_runs[run].group)
    }

    /// The name of a group; empty where it has none or the file does not keep it.
    pub fn group_name(&self, group: u32) -> &'a str {
        let row = self.groups.get(group as usize);
        row.and_then(|g| name(self.labels, g.name, g.name_length)).unwrap_or_default()
    }

    /// The material of a group; `None` where it has none or the file does not keep it.
    pub fn material_of(&self, group: u32) -> Option<u32> {
        self.groups.get(group as usize).map(|g| g.material).filter(|material| *material != NONE)
    }

    /// The name of a material; empty where it has none or the file does not keep it.
    pub fn material_name(&self, material: u32) -> &'a str {
        let row = self.materials.get(material as usize);
        row.and_then(|m| name(self.labels, m.name, m.name_length)).unwrap_or_default()
    }

    /// Number of triangles of each group. Costs O(runs).
    pub fn triangles_of_groups(&self) -> Vec<u64> {
        let mut counts = vec![0; self.group_count() as usize];
        let all = u64::from(self.header.triangles);
        if self.group_runs.is_empty() {
            counts[0] = all;
        }
        for (row, run) in self.group_runs.iter().enumerate() {
            let end = self.group_runs.get(row + 1).map_or(all, |next| u64::from(next.first));
            if let Some(count) = counts.get_mut(run.group as usize) {
                *count += end.saturating_sub(u64::from(run.first));
            }
        }
        counts
    }
}
