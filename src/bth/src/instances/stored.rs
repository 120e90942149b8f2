//! Trees that the file holds: over the rows of groups that do not move, and of the world if it does
//! not. Opening a mapped file reads neither the trees nor the rows. What a ray needs of a row is
//! computed when the first ray comes to its neighbourhood.

use super::group_row::{GroupRow, object_of_group};
use super::placement::Placement;
use crate::nodes::affine::Affine;
use crate::nodes::hierarchy::NodeHierarchy;
use bth_format::SceneView;
use bth_format::file::File;
use bth_format::layout::{FEATURE_FIRST_TREES, Instance, Tree};
use std::sync::OnceLock;

/// Rows that are computed together.
const CHUNK: usize = 64;

/// The rows that the trees of a file hold: the first ones of INSTANCES.
#[derive(Debug)]
pub(crate) struct StoredRows {
    file: File,
    /// Nodes that do not move.
    hierarchy: NodeHierarchy,
    /// Number of rows, and of the nodes of their groups: the first ones of NODES.
    rows: u32,
    nodes: u32,
    /// Number of groups in trees.
    groups: u32,
    /// True if nothing moves.
    holds_world: bool,
    /// The rows of groups.
    of_groups: LazyRows<GroupRow>,
    /// The placements of a world without groups.
    placements: LazyRows<Option<Placement>>,
}

impl StoredRows {
    /// The rows of a file's trees; `None` if it has no trees. Nothing in the file has been checked.
    pub(super) fn of(file: &File) -> Option<StoredRows> {
        let view = file.scene()?;
        let last = view.trees.last()?;
        let rows =
            last.first_row.checked_add(last.rows).filter(|rows| *rows as usize <= view.instances.len())?;
        let first_only = file.header().required_features & FEATURE_FIRST_TREES != 0;
        let holds_world = !first_only && rows as usize == view.instances.len();
        let groups = (view.trees.len() - usize::from(holds_world)) as u32;
        let has_groups = groups > 0;
        Some(StoredRows {
            file: file.clone(),
            hierarchy: NodeHierarchy::at_rest(),
            rows,
            nodes: last.end_node.min(view.nodes.len() as u32),
            groups,
            holds_world,
            of_groups: LazyRows::new(if has_groups { rows } else { 0 }),
            placements: LazyRows::new(if has_groups { 0 } else { rows }),
        })
    }

    fn view(&self) -> SceneView<'_> {
        self.file.scene().expect("a file with trees")
    }

    /// The file.
    pub(super) fn file(&self) -> &File {
        &self.file
    }

    /// Number of rows that the trees hold. All before it are such rows.
    pub(super) fn rows(&self) -> u32 {
        self.rows
    }

    /// Number of nodes above these rows. All before it are such nodes.
    pub(super) fn nodes(&self) -> u32 {
        self.nodes
    }

    /// The trees: of the first groups, and of the world if it is stored, too.
    pub(super) fn trees(&self) -> &[Tree] {
        self.view().trees
    }

    /// Number of groups in trees. All before it are such groups.
    pub(super) fn groups(&self) -> u32 {
        self.groups
    }

    /// Returns true if nothing moves.
    pub(super) fn holds_world(&self) -> bool {
        self.holds_world
    }

    /// The rows of the file.
    pub(super) fn instances(&self) -> &[Instance] {
        self.file.instances()
    }

    /// Number of visible rows.
    pub(super) fn visible(&self) -> usize {
        self.trees().iter().map(|tree| tree.visible as usize).sum()
    }

    /// A row of a group.
    pub(super) fn row(&self, row: u32) -> &GroupRow {
        self.of_groups.get(row, |rows| {
            let view = self.view();
            rows.map(move |row| {
                let of = &view.instances[row as usize];
                GroupRow::stored(
                    self.to_outer(&view, of),
                    self.shown(&view, of),
                    of.first,
                    self.is_visible(&view, of),
                )
            })
        })
    }

    /// The placement of an instance of a world without groups; `None` if it is not visible.
    pub(super) fn placement(&self, row: u32) -> Option<&Placement> {
        let made = self.placements.get(row, |rows| {
            let view = self.view();
            rows.map(move |row| {
                let of = &view.instances[row as usize];
                let (inverse, accuracy) = self.to_outer(&view, of).inverse()?;
                let placement = Placement::without_box(inverse, accuracy, of.object);
                Some(placement).filter(|_| self.is_visible(&view, of))
            })
        });
        made.as_ref()
    }

    /// What a row shows, as [`GroupRow`] has it.
    pub(super) fn shown(&self, view: &SceneView<'_>, of: &Instance) -> u32 {
        let group_of = |node: u32| view.trees.partition_point(|tree| tree.end_node <= node) as u32;
        of.group().map_or(of.object, |node| object_of_group(group_of(node).min(self.groups)))
    }

    fn to_outer(&self, view: &SceneView<'_>, of: &Instance) -> Affine {
        self.hierarchy.to_world(view, of.node)
    }

    fn is_visible(&self, view: &SceneView<'_>, of: &Instance) -> bool {
        !self.hierarchy.hidden_of(view, of.node)
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.of_groups.bytes() + self.placements.bytes()
    }
}

/// Rows that are computed when they are needed, some neighbours at a time.
#[derive(Debug)]
struct LazyRows<T> {
    chunks: Box<[OnceLock<Box<[T]>>]>,
    len: u32,
}

impl<T> LazyRows<T> {
    fn new(len: u32) -> LazyRows<T> {
        LazyRows { chunks: (0..len as usize).step_by(CHUNK).map(|_| OnceLock::new()).collect(), len }
    }

    /// A row; `make` computes a range of rows.
    #[inline]
    fn get<I: Iterator<Item = T>>(&self, row: u32, make: impl FnOnce(std::ops::Range<u32>) -> I) -> &T {
        let chunk = self.chunks[row as usize / CHUNK].get_or_init(|| {
            let first = row / CHUNK as u32 * CHUNK as u32;
            make(first..self.len.min(first + CHUNK as u32)).collect()
        });
        &chunk[row as usize % CHUNK]
    }

    fn bytes(&self) -> usize {
        let made = self.chunks.iter().filter_map(OnceLock::get);
        size_of_val(&*self.chunks) + made.map(|chunk| size_of_val(&**chunk)).sum::<usize>()
    }
}
