//! BTH-F212 and BTH-F213: the stored trees over the rows of groups and of the world. Boxes are
//! compared with half of the room that the specification demands, so that roundings do not matter.

use crate::error::{Code, Error, Result};
use crate::file::File;
use crate::groups::Groups;
use crate::layout::*;
use crate::limits::{MAX_DEPTH, MAX_STORED_LEVELS};
use crate::view::SceneView;
use zerocopy::{FromBytes, IntoBytes};

/// Half of what points are off, relative to their coordinates and to a ray's origin.
const HALF_ROOM: f64 = 1.0 / (1u64 << 22) as f64;
/// The origins of rays for which boxes have room: how far they are, relative to the extent.
const REACH: f64 = 4.0;
/// What roundings of bounds may take away.
const ROUNDED: f64 = 1.0 - 1.0 / (1u64 << 40) as f64;

/// Checks the stored trees of a file whose scene sections and objects have been checked.
///
/// # Errors
/// `BTH-F212`, `BTH-F213`.
pub(super) fn check(file: &File) -> Result<()> {
    let Some(view) = file.scene() else { return Ok(()) };
    let mut check = Check { file, view, groups: Groups::of(&view), shown: Vec::new() };
    check.ranges()?;
    for number in 0..view.trees.len() {
        check.tree(number)?;
    }
    Ok(())
}

/// What is known of what a row may show.
#[derive(Clone)]
struct Shown {
    /// The box of an object, or those in the root of a group's tree.
    boxes: Vec<[[f64; 3]; 2]>,
    magnitude: f64,
    condition: f64,
}

impl Shown {
    /// The largest absolute coordinate of the boxes.
    fn greatest(&self) -> f64 {
        self.boxes.iter().flatten().map(|end| greatest(*end)).fold(0.0, f64::max)
    }
}

struct Check<'a> {
    file: &'a File,
    view: SceneView<'a>,
    groups: Option<Groups>,
    /// The groups whose trees have been checked; `None` where nothing is visible.
    shown: Vec<Option<Shown>>,
}

/// A row of a group: its transform, and the box and bounds of its image.
struct Row {
    lower: [f64; 3],
    upper: [f64; 3],
    /// The condition number of the transform.
    condition: f64,
    shown: Shown,
    norm: f64,
    far: f64,
}

impl Check<'_> {
    fn world(&self) -> usize {
        self.groups.as_ref().map_or(0, Groups::world) as usize
    }

    fn group_of(&self, node: u32) -> usize {
        self.groups.as_ref().map_or(0, |groups| groups.of_node(node)) as usize
    }

    /// The ranges of the trees' rows, and that nothing in them moves.
    fn ranges(&self) -> Result<()> {
        let SceneView { trees, instances, nodes, tree_lines, tracks, deformers, .. } = self.view;
        let counts = instances.iter().fold(vec![0u32; self.world() + 1], |mut counts, instance| {
            counts[self.group_of(instance.node)] += 1;
            counts
        });
        let written_out =
            self.groups.as_ref().and_then(|groups| groups.written_out(instances, |_, _| {}).ok());
        let (mut row, mut node, mut line) = (0u64, 0usize, 0u64);
        for (number, tree) in trees.iter().enumerate() {
            let behind =
                nodes[node..].iter().zip(node as u32..).take_while(|(_, n)| self.group_of(*n) == number);
            node += behind.count();
            let count = counts.get(number).copied();
            let all = written_out
                .as_ref()
                .map_or(Some(instances.len() as u32), |all| all.get(number).map(|group| group.instances));
            let is_right = u64::from(tree.first_row) == row
                && Some(tree.rows) == count
                && Some(tree.instances) == all
                && tree.end_node as usize == node
                && u64::from(tree.first_line) == line
                && (tree.lines as usize).is_multiple_of(NODE_LINES)
                && tree.reserved == [0; 2];
            if !is_right {
                return wrong(number, "the ranges and counts of the group", format!("{tree:?}"));
            }
            row += u64::from(tree.rows);
            line += u64::from(tree.lines);
        }
        let all_groups = trees.len() == self.world() && (row as usize) < instances.len();
        let is_whole = trees.is_empty() || trees.len() == self.world() + 1 || all_groups;
        let is_first = self.file.header().required_features & FEATURE_FIRST_TREES != 0;
        if is_whole == is_first || trees.len() > self.world() + 1 || line != tree_lines.len() as u64 {
            return wrong(
                0,
                "a tree for each group or, with the feature, each of the first, and lines of these trees",
                format!("{} trees", trees.len()),
            );
        }
        let moves = tracks.iter().any(|track| (track.node as usize) < node)
            || !deformers.is_empty()
            || (0..self.file.object_count()).any(|object| {
                [kind::SEQUENCE_TIMES, kind::EXACT_POSITIONS].into_iter().any(|kind| {
                    self.file.section(object, kind).is_some_and(|section| section.entry.count > 0)
                })
            });
        if !trees.is_empty() && moves {
            let expected = "trees over what does not move, of objects in f32";
            return wrong(0, expected, "others".to_owned());
        }
        Ok(())
    }

    /// A tree, whose ranges are right. The trees before have been checked.
    fn tree(&mut self, number: usize) -> Result<()> {
        let tree = &self.view.trees[number];
        let lines = &self.view.tree_lines[tree.first_line as usize..][..tree.lines as usize];
        let mut seen = vec![false; tree.rows as usize];
        let (mut visible, mut next, mut depth, mut boxes) = (0, vec![(0u32, 1u32, None)], 0, Vec::new());
        if lines.is_empty() {
            next.clear();
        }
        let mut reached = vec![false; lines.len() / NODE_LINES];
        while let Some((code, level, within)) = next.pop() {
            depth = depth.max(level);
            let at = code as usize;
            let is_node = at.is_multiple_of(NODE_LINES) && at < lines.len() && level as usize <= MAX_DEPTH;
            if !is_node || std::mem::replace(&mut reached[at / NODE_LINES], true) {
                return wrong(number, "nodes that are reached once", format!("child code {code:#x}"));
            }
            let bytes = lines[at..at + NODE_LINES].as_bytes();
            let node = WideNode::ref_from_bytes(bytes).ok().expect("a node is as long as its lines");
            let used = node.child.iter().take_while(|code| **code != NONE).count();
            let is_empty = |slot: usize| {
                node.child[slot] == NONE
                    && (0..3)
                        .all(|k| (node.bounds[k][0][slot], node.bounds[k][1][slot]) == (f32::MAX, f32::MIN))
            };
            if used == 0 || !(used..WIDTH).all(is_empty) {
                return wrong(
                    number,
                    "used slots first, and empty boxes behind",
                    format!("node at line {at}"),
                );
            }
            for (slot, &child) in node.child[..used].iter().enumerate() {
                let bounds = [0, 1].map(|end| [0, 1, 2].map(|k| f64::from(node.bounds[k][end][slot])));
                boxes.extend((code == 0).then_some(bounds));
                if within.is_some_and(|within| !contains(within, bounds)) {
                    return outside(number, format!("slot {slot} of the node at line {at}"));
                }
                if child & Child::LEAF_BIT == 0 {
                    if child <= code {
                        return wrong(number, "nodes behind those that lead to them", format!("{child:#x}"));
                    }
                    next.push((child, level + 1, Some(bounds)));
                    continue;
                }
                let row = child & !Child::LEAF_BIT;
                let first = row.checked_sub(tree.first_row).filter(|i| *i < tree.rows);
                let Some(i) = first.filter(|i| !std::mem::replace(&mut seen[*i as usize], true)) else {
                    return wrong(number, "rows of the group, each once", format!("row {row}"));
                };
                let Some(placed) = self.row(number, &self.view.instances[(tree.first_row + i) as usize])?
                else {
                    return wrong(number, "rows that are visible", format!("row {row}"));
                };
                visible += 1;
                if !placed.fits(tree, number == self.world(), bounds) {
                    return outside(number, format!("row {row}"));
                }
            }
        }
        if visible != tree.visible || depth != tree.depth || reached.contains(&false) {
            let found = format!("{visible} visible rows, {depth} levels");
            return wrong(number, "the counts of the tree, and nodes that are all reached", found);
        }
        for (row, _) in (tree.first_row..).zip(&seen).filter(|(_, seen)| !**seen) {
            if self.row(number, &self.view.instances[row as usize])?.is_some() {
                return wrong(number, "all visible rows", format!("row {row} in no slot"));
            }
        }
        let of_tree = Shown { boxes, magnitude: tree.magnitude, condition: tree.condition };
        self.shown.push((!lines.is_empty()).then_some(of_tree));
        Ok(())
    }

    /// A row; `None` if it is not visible.
    fn row(&self, number: usize, instance: &Instance) -> Result<Option<Row>> {
        let shown = match instance.group() {
            Some(node) => self.shown.get(self.group_of(node)).cloned().flatten(),
            None => {
                let object = self.file.object_header(instance.object);
                let boxes = vec![[object.lower, object.upper].map(|end| end.map(f64::from))];
                if object.root == NONE {
                    return wrong(number, "objects that can be hit", format!("object {}", instance.object));
                }
                let shown = Shown { boxes, magnitude: 0.0, condition: 1.0 };
                Some(Shown { magnitude: shown.greatest(), ..shown })
            }
        };
        let (mut matrix, mut node, mut levels) = (None, instance.node, 0);
        while node != NONE {
            let row = &self.view.nodes[node as usize];
            levels += 1;
            if levels > MAX_STORED_LEVELS {
                return wrong(number, "at most 64 nodes on a path", "more".to_owned());
            }
            let local = local(row);
            if row.flags & NODE_HIDDEN != 0 || hides(row) {
                return Ok(None);
            }
            matrix = Some(matrix.map_or(local, |inner| product(&local, &inner)));
            node = row.parent;
        }
        let (Some(matrix), Some(shown)) = (matrix, shown) else { return Ok(None) };
        Ok(Some(Row::new(&matrix, shown)))
    }
}

impl Row {
    fn new(m: &[[f64; 4]; 3], shown: Shown) -> Row {
        let (mut lower, mut upper) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let (mut norm, mut far) = (0.0f64, 0.0f64);
        for k in 0..3 {
            for bounds in &shown.boxes {
                let ends = [0, 1, 2].map(|j| [m[k][j] * bounds[0][j], m[k][j] * bounds[1][j]]);
                lower[k] = lower[k].min(ends.iter().fold(m[k][3], |sum, ends| sum + ends[0].min(ends[1])));
                upper[k] = upper[k].max(ends.iter().fold(m[k][3], |sum, ends| sum + ends[0].max(ends[1])));
            }
            norm = norm.max(m[k][..3].iter().map(|x| x.abs()).sum());
            far = far.max(m[k][3].abs());
        }
        // The rows of the adjugate, the inverse times the determinant.
        let minor = |i: usize, j: usize| {
            let [a, b, c, d] = [(i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3];
            m[a][c] * m[b][d] - m[a][d] * m[b][c]
        };
        let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
        let inverse = (0..3).map(|j| (0..3).map(|i| minor(i, j).abs()).sum()).fold(0.0, f64::max);
        Row { lower, upper, condition: norm * inverse / determinant.abs(), shown, norm, far }
    }

    /// Returns true if a box in a tree contains the row with the room that rays need, and the
    /// bounds of the tree hold.
    fn fits(&self, tree: &Tree, is_world: bool, bounds: [[f64; 3]; 2]) -> bool {
        let room = HALF_ROOM * (self.condition * self.far + self.norm * self.shown.greatest());
        let extent = f64::from(tree.extent);
        let ends = [self.lower.map(|x| x - room), self.upper.map(|x| x + room)];
        let reach = HALF_ROOM * self.condition * REACH * extent;
        let of_group = tree.magnitude >= (self.norm * self.shown.magnitude + self.far) * ROUNDED
            && tree.condition >= self.condition * self.shown.condition * ROUNDED;
        contains(bounds, [ends[0].map(|x| x - reach), ends[1].map(|x| x + reach)])
            && extent >= greatest(ends[0]).max(greatest(ends[1]))
            && f64::from(tree.origin_slack) >= HALF_ROOM * self.condition
            && (is_world || of_group)
    }
}

/// The transform of a node to the space of its parent.
fn local(node: &Node) -> [[f64; 4]; 3] {
    let t = &node.transform;
    if node.flags & NODE_MATRIX != 0 {
        return [0, 4, 8].map(|k| [t[k], t[k + 1], t[k + 2], t[k + 3]]);
    }
    let length = t[3..7].iter().fold(0.0f64, |sum, x| sum.hypot(*x));
    let [x, y, z, w] = [t[3], t[4], t[5], t[6]].map(|q| q / length);
    let rotation = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ];
    [0, 1, 2].map(|k| {
        let [a, b, c] = rotation[k];
        [a * t[7], b * t[8], c * t[9], t[k]]
    })
}

/// Returns true if the scale of a node hides it.
fn hides(node: &Node) -> bool {
    let t = &node.transform;
    match node.flags & NODE_MATRIX {
        0 => t[7..10].contains(&0.0),
        _ => (0..3).all(|k| t[4 * k..4 * k + 3].iter().all(|x| *x == 0.0)),
    }
}

/// The transform that applies `inner` first.
fn product(outer: &[[f64; 4]; 3], inner: &[[f64; 4]; 3]) -> [[f64; 4]; 3] {
    outer.map(|row| {
        let column = |j: usize| row[0] * inner[0][j] + row[1] * inner[1][j] + row[2] * inner[2][j];
        [column(0), column(1), column(2), column(3) + row[3]]
    })
}

fn contains(outer: [[f64; 3]; 2], inner: [[f64; 3]; 2]) -> bool {
    (0..3).all(|k| outer[0][k] <= inner[0][k] && inner[1][k] <= outer[1][k])
}

fn greatest(v: [f64; 3]) -> f64 {
    v.iter().fold(0.0, |most, x| most.max(x.abs()))
}

fn wrong<T>(tree: usize, expected: &'static str, found: String) -> Result<T> {
    let at = (tree * size_of::<Tree>()) as u64;
    Err(Error::within_file(Code::Trees, kind::TREES, at, expected, format!("{found} in tree {tree}")))
}

fn outside<T>(tree: usize, what: String) -> Result<T> {
    let (at, expected) = ((tree * size_of::<Tree>()) as u64, "boxes and bounds with the room that rays need");
    Err(Error::within_file(Code::TreeBoxes, kind::TREES, at, expected, format!("{what} of tree {tree}")))
}
