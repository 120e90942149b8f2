//! The nodes of a manifest, in few bytes each: a scene may have many millions.

use std::fmt;

/// A node of the hierarchy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node<'a> {
    /// Unique among nodes.
    pub name: &'a str,
    /// Parent in the hierarchy; `None` for the world.
    pub parent: Option<usize>,
    /// From its own space to its parent's, before tracks.
    pub transform: Transform,
    /// The object if the node is an instance.
    pub object: Option<usize>,
    /// A node without parent if this one, which has no object, is an instance of the group of that
    /// node and all below it. They then show nowhere else.
    pub group: Option<usize>,
    /// True if the node and its descendants are visible, before tracks.
    pub visible: bool,
}

/// From a node's space to its parent's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Scales, then rotates, then translates. All numbers are finite.
    Parts {
        /// Units of the parent.
        translation: [f64; 3],
        /// Quaternion x, y, z, w; not zero, normalized when used.
        rotation: [f64; 4],
        /// Factor of each axis; an instance with a factor of zero is invisible.
        scale: [f64; 3],
    },
    /// Rows of a matrix that is applied to columns (x, y, z, 1). All finite. Cannot be animated.
    Matrix([[f64; 4]; 3]),
}

impl Default for Transform {
    fn default() -> Self {
        let (translation, rotation, scale) = IDENTITY;
        Transform::Parts { translation, rotation, scale }
    }
}

/// Nodes by number.
#[derive(Clone, Default, PartialEq)]
pub struct Nodes {
    rows: Vec<Row>,
    /// All names, one behind the other.
    names: String,
    /// The numbers of all transforms, without translations, rotations and scales that are the
    /// identity.
    numbers: Vec<f64>,
}

#[derive(Clone, Copy, PartialEq)]
struct Row {
    /// The end of its name.
    name: u64,
    /// The end of its numbers in the bits of [`END`], and flags above.
    numbers: u64,
    parent: u32,
    /// Number of the object or the node that it shows.
    shows: u32,
}

/// Translation, rotation and scale of the identity.
const IDENTITY: ([f64; 3], [f64; 4], [f64; 3]) = ([0.0; 3], [0.0, 0.0, 0.0, 1.0], [1.0; 3]);
const NONE: u32 = u32::MAX;
const END: u64 = (1 << 48) - 1;
const VISIBLE: u64 = 1 << 48;
const OBJECT: u64 = 1 << 49;
const GROUP: u64 = 1 << 50;
const MATRIX: u64 = 1 << 51;
/// The flags of translation, rotation and scale.
const PARTS: [u64; 3] = [1 << 52, 1 << 53, 1 << 54];

impl Nodes {
    /// No nodes, with memory for the rows of `count`.
    pub fn with_capacity(count: usize) -> Self {
        Self { rows: Vec::with_capacity(count), ..Self::default() }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns true if there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// All nodes in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Node<'_>> {
        (0..self.len()).map(|number| self.get(number))
    }

    /// A node.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn get(&self, number: usize) -> Node<'_> {
        let row = &self.rows[number];
        let before = number.checked_sub(1).map(|before| &self.rows[before]);
        let first = before.map_or(0, |row| (row.numbers & END) as usize);
        let mut numbers = &self.numbers[first..(row.numbers & END) as usize];
        let mut take = |part: &mut [f64]| {
            let (taken, left) = numbers.split_at(part.len());
            part.copy_from_slice(taken);
            numbers = left;
        };
        let transform = if row.numbers & MATRIX != 0 {
            let mut rows = [[0.0; 4]; 3];
            take(rows.as_flattened_mut());
            Transform::Matrix(rows)
        } else {
            let (mut translation, mut rotation, mut scale) = IDENTITY;
            let parts: [&mut [f64]; 3] = [&mut translation, &mut rotation, &mut scale];
            parts
                .into_iter()
                .zip(PARTS)
                .filter(|(_, flag)| row.numbers & flag != 0)
                .for_each(|(part, _)| take(part));
            Transform::Parts { translation, rotation, scale }
        };
        Node {
            name: self.name(number),
            parent: self.parent(number),
            transform,
            object: self.object(number),
            group: (row.numbers & GROUP != 0).then_some(row.shows as usize),
            visible: row.numbers & VISIBLE != 0,
        }
    }

    /// The name of a node.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn name(&self, number: usize) -> &str {
        let first = number.checked_sub(1).map_or(0, |before| self.rows[before].name as usize);
        &self.names[first..self.rows[number].name as usize]
    }

    /// The parent of a node.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn parent(&self, number: usize) -> Option<usize> {
        let parent = self.rows[number].parent;
        (parent != NONE).then_some(parent as usize)
    }

    /// The object that a node shows.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn object(&self, number: usize) -> Option<usize> {
        let row = &self.rows[number];
        (row.numbers & OBJECT != 0).then_some(row.shows as usize)
    }

    /// Adds a node and returns its number.
    ///
    /// # Panics
    /// If a number exceeds 2^32 - 2.
    pub fn push(&mut self, node: Node<'_>) -> usize {
        self.names.push_str(node.name);
        let mut flags = if node.visible { VISIBLE } else { 0 };
        match &node.transform {
            Transform::Matrix(rows) => {
                flags |= MATRIX;
                self.numbers.extend(rows.as_flattened());
            }
            Transform::Parts { translation, rotation, scale } => {
                let parts: [(&[f64], &[f64]); 3] =
                    [(translation, &IDENTITY.0), (rotation, &IDENTITY.1), (scale, &IDENTITY.2)];
                for ((part, identity), flag) in parts.into_iter().zip(PARTS) {
                    // Compared by bits, so that a negative zero is kept.
                    if !part.iter().map(|x| x.to_bits()).eq(identity.iter().map(|x| x.to_bits())) {
                        flags |= flag;
                        self.numbers.extend(part);
                    }
                }
            }
        }
        self.rows.push(Row {
            name: self.names.len() as u64,
            numbers: self.numbers.len() as u64 | flags,
            parent: node.parent.map_or(NONE, short),
            shows: NONE,
        });
        self.set_shown(self.len() - 1, node.object, node.group);
        self.len() - 1
    }

    /// Changes the object and the group that a node shows.
    ///
    /// # Panics
    /// If there is no such node, it shows both, or a number exceeds 2^32 - 2.
    pub fn set_shown(&mut self, number: usize, object: Option<usize>, group: Option<usize>) {
        let row = &mut self.rows[number];
        let (flag, shows) = match (object, group) {
            (None, None) => (0, NONE),
            (Some(object), None) => (OBJECT, short(object)),
            (None, Some(group)) => (GROUP, short(group)),
            (Some(_), Some(_)) => panic!("expected a node with an object or a group, found both"),
        };
        row.numbers = row.numbers & !(OBJECT | GROUP) | flag;
        row.shows = shows;
    }
}

impl fmt::Debug for Nodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

fn short(number: usize) -> u32 {
    u32::try_from(number).ok().filter(|number| *number != NONE).expect("a number below 2^32 - 1")
}
