//! Entry nodes: where coherent rays begin below the root.
//!
//! Rays of neighbouring pixels pass the same nodes near the root. A shaft around them ([`Shaft`])
//! finds the children that any of them may enter, and below these the children of children, as long
//! as there are no more than a node has slots. These boxes make an entry node. Each ray is tested
//! against it instead of the root. It holds several of the entry points of Reshetov, Soupikov and
//! Hurley, "Multi-Level Ray Tracing Algorithm", SIGGRAPH 2005.

use crate::coherence::shaft::Shaft;
use crate::coherence::{Span, is_same_octant};
use crate::rays::Ray;
use crate::simd::{Part, Simd};
use bth_format::layout::{NONE, WIDTH, WideNode};
use bth_format::limits::MAX_DEPTH;
use bth_format::object::{NodeBase, ObjectBounds};

/// Number of consecutive rays that have an entry node in common.
pub(crate) const ENTRY_RAYS: usize = 64;

/// The next [`ENTRY_RAYS`] rays of an order, from `taken` on, if they are the rays of the batch
/// from
/// `first` on, and may be coherent.
#[inline(always)]
pub(crate) fn entry_run<'r>(
    rays: &'r [Ray],
    order: Option<&[u32]>,
    taken: usize,
    first: usize,
) -> Option<&'r [Ray]> {
    let run = rays.get(first..first + ENTRY_RAYS)?;
    (is_same_octant(&run[0], &run[ENTRY_RAYS - 1]) && is_run(order, taken, first)).then_some(run)
}

/// Returns true if the next [`ENTRY_RAYS`] rays of an order, from `taken` on, exist and are the
/// rays of the batch from `first` on.
#[inline(never)]
fn is_run(order: Option<&[u32]>, taken: usize, first: usize) -> bool {
    order.is_none_or(|order| {
        let run = order.get(taken..taken + ENTRY_RAYS);
        run.is_some_and(|run| run.iter().zip(first..).all(|(&ray, next)| ray as usize == next))
    })
}

/// Boxes with their child codes, at most [`WIDTH`] between two operations, and room for the
/// children of one more node.
struct Boxes {
    /// For each axis the lower bounds, then the upper ones, like [`WideNode::bounds`].
    bounds: [[f32; 2 * WIDTH]; 6],
    child: [u32; 2 * WIDTH],
    /// True for the box of a leaf, and for the box of a node if the slots left cannot hold its
    /// children.
    is_final: [bool; 2 * WIDTH],
    count: usize,
}

impl Boxes {
    /// The box of the root alone, whose bounds are not needed, because it is opened at once.
    #[inline(always)]
    fn of(root: u32) -> Boxes {
        let mut boxes = Boxes {
            bounds: [[0.0; 2 * WIDTH]; 6],
            child: [NONE; 2 * WIDTH],
            is_final: [false; 2 * WIDTH],
            count: 1,
        };
        boxes.child[0] = root;
        boxes
    }

    /// Appends the children of a node whose bit is set.
    #[inline(always)]
    fn append<S: Simd>(&mut self, s: S, node: &WideNode, bits: u32) {
        let at = self.count.min(WIDTH);
        for (rows, row) in self.bounds.iter_mut().zip(node.bounds.as_flattened()) {
            s.compress_f(bits, s.load(row), rows[at..].first_chunk_mut().expect("room for a node"));
        }
        self.is_final[at..][..WIDTH].fill(false);
        let codes = self.child[at..].first_chunk_mut().expect("room for a node");
        self.count = at + s.compress(bits, s.load_u(&node.child), codes);
    }

    /// Removes a box, whose place the last one takes.
    #[inline(always)]
    fn remove(&mut self, at: usize) {
        self.count -= 1;
        for rows in &mut self.bounds {
            rows[at] = rows[self.count];
        }
        self.child[at] = self.child[self.count];
        self.is_final[at] = self.is_final[self.count];
    }

    /// Writes the boxes as a node.
    #[inline(always)]
    fn write<S: Simd>(&self, s: S, node: &mut WideNode) {
        let used = s.mask((1 << self.count) - 1);
        for (i, row) in node.bounds.as_flattened_mut().iter_mut().enumerate() {
            let boxes = s.load(self.bounds[i].first_chunk().expect("a row"));
            let unused = if i % 2 == 0 { f32::MAX } else { f32::MIN };
            s.store(s.select(used, boxes, s.splat(unused)), row);
        }
        let codes = s.load_u(self.child.first_chunk().expect("a row"));
        s.store_u(s.select_u(used, codes, s.splat_u(NONE)), &mut node.child);
    }
}

/// The search for the entry node of rays, as a part of kernels. Its output is true if they have
/// one: if they are coherent, and the root is a wide node.
pub(crate) struct FindEntryNode<'a> {
    pub(crate) node_base: NodeBase<'a>,
    /// Child code of the root.
    pub(crate) root: u32,
    /// Bounds of the object.
    pub(crate) bounds: &'a ObjectBounds,
    pub(crate) rays: &'a [Ray],
    /// Receives the entry node.
    pub(crate) node: &'a mut WideNode,
}

impl<S: Simd> Part<S> for FindEntryNode<'_> {
    type Output = bool;
    #[inline(always)]
    fn run(self, s: S) -> bool {
        let FindEntryNode { node_base, root, bounds, rays, node } = self;
        let Some((shaft, limit)) = Shaft::of(s, bounds, &Span::of(s, rays)) else { return false };
        let mut boxes = Boxes::of(root);
        // In each round the boxes of a level are opened where there is room. An unchecked file may
        // have more levels.
        for _ in 0..MAX_DEPTH {
            let mut is_opened = false;
            // From the last to the first, so that a box that moves to a free place has had its
            // turn.
            for at in (0..boxes.count).rev() {
                if boxes.is_final[at] {
                    continue;
                }
                let Some(inner) = node_base.wide_node(boxes.child[at]) else {
                    boxes.is_final[at] = true;
                    continue;
                };
                let bits = shaft.children(s, inner, limit).0;
                if boxes.count - 1 + bits.count_ones() as usize > WIDTH {
                    boxes.is_final[at] = true;
                    continue;
                }
                boxes.append(s, inner, bits);
                boxes.remove(at);
                is_opened = true;
            }
            if !is_opened {
                break;
            }
        }
        if boxes.child[0] == root {
            return false;
        }
        boxes.write(s, node);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::box_oracle;
    use crate::bvh::height_field::HeightField;
    use crate::bvh::interleaved::Interleaved;
    use crate::bvh::stack::Stacks;
    use crate::query::sink::{Answers, Sink};
    use crate::query::with_batch_goal;
    use crate::rays::Hit;
    use crate::simd::{Isa, Kernel, Simd};
    use bth_format::layout::Child;
    use bth_format::object::ObjectView;
    use bth_random::Rng;

    impl Kernel for FindEntryNode<'_> {
        type Output = bool;
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> bool {
            Part::run(self, s)
        }
    }

    /// Traces rays by the pool alone; false if it is not compiled for the instruction set.
    fn through_pool(
        isa: Isa,
        object: &ObjectView<'_>,
        (rays, order): (&[Ray], Option<&[u32]>),
        stacks: &mut Stacks,
        answers: Answers<'_>,
    ) -> bool {
        if isa == Isa::Scalar || !isa.is_available() {
            return false;
        }
        let either = answers.goal();
        let sink = &mut Sink::new(object.triangle_ids, answers, 0);
        with_batch_goal!(isa, either, goal => {
            isa.run(Interleaved { object, rays, order, stacks, sink, goal, entry_nodes: true });
        });
        true
    }

    /// A run of rays from near a point above the surface to a small part of it.
    fn run(surface: &HeightField, scale: f32, rng: &mut Rng) -> Vec<Ray> {
        let target = surface.points[rng.below(surface.points.len() as u64) as usize];
        let mut unit = || rng.below(1 << 20) as f32 / (1 << 19) as f32 - 1.0;
        let eye = [20.0 * unit(), 20.0 * unit(), 40.0];
        let spread = 3.0 * unit().abs();
        (0..ENTRY_RAYS)
            .map(|_| {
                let origin = [0, 1, 2].map(|k| target[k] + (eye[k] + 0.1 * unit()) * scale);
                let direction = [0, 1, 2].map(|k| target[k] + spread * unit() * scale - origin[k]);
                Ray { origin, tmin: 0.0, direction, tmax: f32::INFINITY }
            })
            .collect()
    }

    /// The leaves below a child code that a ray reaches through the boxes of nodes, in f64.
    fn leaves(object: &ObjectView<'_>, ray: &Ray, code: u32, out: &mut Vec<u32>) {
        let Some(node) = object.node_base().wide_node(code) else { return out.push(code) };
        for slot in 0..WIDTH {
            if node.child[slot] != NONE && meets(ray, node, slot) {
                leaves(object, ray, node.child[slot], out);
            }
        }
    }

    fn meets(ray: &Ray, node: &WideNode, slot: usize) -> bool {
        let [lower, upper] = [0, 1].map(|end| [0, 1, 2].map(|k| node.bounds[k][end][slot]));
        box_oracle::meets(ray, lower, upper, 0.0)
    }

    /// All boxes of the tree with their child codes, by their bits.
    fn boxes(object: &ObjectView<'_>, code: u32, out: &mut Vec<([u32; 6], u32)>) {
        let Some(node) = object.node_base().wide_node(code) else { return };
        for slot in (0..WIDTH).filter(|&slot| node.child[slot] != NONE) {
            out.push((box_bits(node, slot), node.child[slot]));
            boxes(object, node.child[slot], out);
        }
    }

    fn box_bits(node: &WideNode, slot: usize) -> [u32; 6] {
        [0, 1, 2, 3, 4, 5].map(|i| node.bounds[i / 2][i % 2][slot].to_bits())
    }

    #[test]
    fn every_leaf_that_a_ray_meets_lies_below_a_box_of_the_entry_node_that_it_meets() {
        let surface = HeightField::new(1.0, 0.0);
        let object = surface.view();
        let mut all = vec![];
        boxes(&object, object.header.root, &mut all);
        let mut rng = Rng::new(4);
        let (mut found, mut below_root, mut met) = (0, 0, 0);
        for round in 0..if cfg!(miri) { 2 } else { 300 } {
            let rays = run(&surface, 1.0, &mut rng);
            for isa in Isa::ALL {
                let mut node = WideNode { bounds: [[[0.0; WIDTH]; 2]; 3], child: [0; WIDTH] };
                let (node_base, bounds) = (object.node_base(), &object.bounds);
                let root = object.header.root;
                if !isa.run(FindEntryNode { node_base, root, bounds, rays: &rays, node: &mut node }) {
                    continue;
                }
                found += 1;
                let used = node.child.iter().take_while(|&&code| code != NONE).count();
                for slot in 0..WIDTH {
                    if slot < used {
                        assert!(all.contains(&(box_bits(&node, slot), node.child[slot])), "{isa}, {round}");
                        below_root += usize::from(Child::LEAF_BIT & node.child[slot] != 0);
                    } else {
                        let empty = [f32::MAX, f32::MIN].map(f32::to_bits);
                        assert_eq!(box_bits(&node, slot), [0, 1, 2, 3, 4, 5].map(|i| empty[i % 2]));
                        assert_eq!(node.child[slot], NONE);
                    }
                }
                for ray in &rays {
                    let (mut expected, mut reached) = (vec![], vec![]);
                    leaves(&object, ray, root, &mut expected);
                    for slot in (0..used).filter(|&slot| meets(ray, &node, slot)) {
                        leaves(&object, ray, node.child[slot], &mut reached);
                    }
                    assert!(expected.iter().all(|leaf| reached.contains(leaf)), "{isa}, {round}: {ray:?}");
                    met += expected.len();
                }
            }
        }
        assert!(found > 3 && below_root > 10 && met > 100, "{found}, {below_root}, {met}");
    }

    #[test]
    fn coherent_rays_through_the_pool_have_the_same_bits_as_single_rays() {
        for (scale, away) in [(1.0, 0.0), (1e-9, 0.0), (1e9, 0.0), (0.001, 1e6)] {
            let surface = HeightField::new(scale, away);
            let object = surface.view();
            let mut rng = Rng::new(6);
            let mut rays: Vec<Ray> =
                (0..if cfg!(miri) { 2 } else { 24 }).flat_map(|_| run(&surface, scale, &mut rng)).collect();
            // A run that ends before it is complete, one that other rays interrupt, and rays that
            // cannot be prepared.
            rays.truncate(rays.len() - 9);
            (rays[70].direction, rays[3].origin[0]) = ([-1.0, 1.0, 1.0].map(|x| x * scale), f32::NAN);
            let order: Vec<u32> = (0..rays.len() as u32).filter(|i| i % 97 != 5).collect();
            // Rays of one run in the middle of another.
            let mut swapped: Vec<u32> = (0..rays.len() as u32).collect();
            for run in 0..rays.len() / (2 * ENTRY_RAYS) {
                swapped.swap(2 * run * ENTRY_RAYS + 20, (2 * run + 1) * ENTRY_RAYS + 30);
            }
            for order in [None, Some(&order[..]), Some(&swapped[..])] {
                for isa in Isa::ALL {
                    let mut hits = vec![Hit::MISS; rays.len()];
                    let mut found = vec![false; rays.len()];
                    let (mut stacks, object) = (Stacks::default(), &object);
                    let answers = Answers::Nearest(&mut hits);
                    if !through_pool(isa, object, (&rays, order), &mut stacks, answers) {
                        continue;
                    }
                    let answers = Answers::Any(&mut found);
                    assert!(through_pool(isa, object, (&rays, order), &mut stacks, answers));
                    let traced = |i: usize| order.is_none_or(|order| order.contains(&(i as u32)));
                    for (i, ray) in rays.iter().enumerate().filter(|&(i, _)| traced(i)) {
                        let hit = crate::object::nearest(object, ray, 0);
                        let is_hit = crate::object::any(object, ray);
                        assert_eq!(format!("{:?}", hits[i]), format!("{hit:?}"), "{isa}, {scale}: {ray:?}");
                        assert_eq!(found[i], is_hit, "{isa}, {scale}: {ray:?}");
                    }
                    assert!(found.iter().filter(|&&found| found).count() * 2 > rays.len());
                }
            }
        }
    }
}
