//! What the caller of a scene builder wants, as a plain list, and the answers to rays by loops over
//! it.

use super::*;
use crate::instances::exact_loop::{add_hits, in_order};
use crate::instances::{PartBoxes, Placement};
use crate::nodes::Affine;
use bth_format::layout::NONE;

/// An instance that the caller wants.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExpectedInstance {
    pub(super) object: u32,
    pub(super) transform: [f64; 12],
    pub(super) visible: bool,
    /// The subscene, and the number of the instance in its file.
    pub(super) subscene: Option<(u32, u32)>,
}

/// A subscene that the caller wants.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExpectedSubscene {
    /// The index of its file in [`FILES`].
    pub(super) file: usize,
    pub(super) transform: [f64; 12],
    pub(super) seconds: f64,
    pub(super) visible: bool,
}

/// All that the caller wants, by id.
#[derive(Clone, Debug, Default)]
pub(super) struct Expected {
    pub(super) instances: Vec<Option<ExpectedInstance>>,
    pub(super) subscenes: Vec<Option<ExpectedSubscene>>,
}

impl Expected {
    pub(super) fn set(&mut self, id: u32, instance: Option<ExpectedInstance>) {
        let id = id as usize;
        self.instances.resize(self.instances.len().max(id + 1), None);
        self.instances[id] = instance;
    }

    pub(super) fn set_subscene(&mut self, id: u32, subscene: Option<ExpectedSubscene>) {
        let id = id as usize;
        self.subscenes.resize(self.subscenes.len().max(id + 1), None);
        self.subscenes[id] = subscene;
    }

    /// The ids of all instances for which a condition holds.
    pub(super) fn ids(&self, condition: impl Fn(&ExpectedInstance) -> bool) -> Vec<u32> {
        let instances = self.instances.iter().enumerate();
        instances.filter(|(_, i)| i.as_ref().is_some_and(&condition)).map(|(id, _)| id as u32).collect()
    }

    /// The transform of an instance and whether it is visible. The nodes of a subscene are taken
    /// from its file, opened alone.
    pub(super) fn transform(&self, instance: &ExpectedInstance) -> (Affine, bool) {
        let own = Affine::from_rows(&instance.transform);
        let Some((id, row)) = instance.subscene else { return (own, instance.visible) };
        let subscene = self.subscenes[id as usize].expect("a subscene of an instance");
        let outer = Affine::from_rows(&subscene.transform);
        let mut file = crate::from_bytes(FILES[subscene.file]).unwrap();
        file.set_seconds(subscene.seconds).unwrap();
        let visible = instance.visible && subscene.visible;
        if file.description().is_none() {
            return (outer, visible);
        }
        let view = file.instance(row);
        let (_, shown) = file.node(view.node);
        let [a, b, c] = view.to_world;
        let linear = [a, b, c].map(|row| [row[0], row[1], row[2]]);
        let inner = Affine { linear, translation: [a[3], b[3], c[3]] };
        let product = if outer == Affine::IDENTITY { inner } else { outer.times(&inner) };
        (product, visible && shown)
    }

    /// The placement of an instance; `None` if it is not visible.
    pub(super) fn placement(&self, scene: &Scene, id: u32) -> Option<Result<Placement, ()>> {
        let instance = self.instances[id as usize].as_ref()?;
        let view = scene.object(instance.object);
        let (world, visible) = self.transform(instance);
        if !visible || view.header.root == NONE {
            return None;
        }
        let parts = PartBoxes::of_root_children(&view);
        Some(Placement::new(&world, instance.object, view.header, &parts).map_err(drop))
    }

    /// The ids of instances that cannot be placed.
    pub(super) fn unplaceable(&self, scene: &Scene) -> Vec<u32> {
        let ids = 0..self.instances.len() as u32;
        ids.filter(|id| matches!(self.placement(scene, *id), Some(Err(())))).collect()
    }

    /// All hits of each ray, in order.
    pub(super) fn all_hits(&self, scene: &Scene, rays: &[Ray]) -> Vec<Vec<Hit>> {
        let mut found = vec![Vec::new(); rays.len()];
        for id in 0..self.instances.len() as u32 {
            let Some(Ok(placement)) = self.placement(scene, id) else { continue };
            let object = scene.object(placement.object());
            let world = scene.world().expect("instances");
            for (ray, found) in rays.iter().zip(&mut found) {
                add_hits(&object, (world, scene.objects()), id, ray, found);
            }
        }
        found.into_iter().map(in_order).collect()
    }

    /// The same scene, built at once.
    pub(super) fn afresh(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        FILES.iter().for_each(|bytes| _ = builder.add(&crate::from_bytes(bytes).unwrap()));
        for (id, instance) in self.instances.iter().enumerate() {
            let (object, transform, visible) = match instance {
                Some(i) => (i.object, i.transform, i.visible),
                None => (0, IDENTITY, false),
            };
            assert_eq!(builder.instance(object, &transform).unwrap(), id as u32);
            builder.set_visible(id as u32, visible).unwrap();
        }
        builder.commit().unwrap();
        builder
    }
}
