//! Commits: from the geometries of a scene to what rays are traced through.

use crate::abi::*;
use crate::committed::{Committed, Filters, MAX_MASKS, MAX_TABLE, Rest};
use crate::device::{Callback, lock};
use crate::error::{Failure, Result, operation, unsupported};
use crate::handles::Shared;
use crate::mesh::{Build, Mesh, Sources};
use crate::scene::Scene;
use crate::statistics::{Kind, Who, count, counted};
use crate::world::{Place, World, add_places};
use bth_compile::{Monitor, bvh::Quality};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

impl Shared<Scene> {
    /// Commits the scene. Threads that commit the same scene wait for the first.
    ///
    /// # Errors
    /// If a geometry was not committed, nobody answers what it needs, the build fails, or the
    /// program cancels it. The former commit then stays.
    pub(crate) fn commit(&self) -> Result<()> {
        let _one_at_a_time = lock(&self.commit);
        let enabled = self.enabled();
        if let Some((id, _)) = enabled.iter().find(|(_, geometry)| !geometry.is_committed()) {
            return operation(format!("geometry not committed: {id}"));
        }
        let (mut sources, mut places, mut rest) = (Sources::new(), Vec::new(), BTreeMap::new());
        for (id, geometry) in &enabled {
            let moves = geometry.state().time_steps > 1;
            let shows_rest = geometry.is_instance()
                && geometry.state().scenes.iter().flatten().any(|scene| !scene.twin().0.is_null());
            if !geometry.is_known() || moves || shows_rest {
                if geometry.device.fallback.is_none() {
                    if !geometry.has_items() {
                        continue;
                    }
                    return unsupported(&format!("geometry {id}, which moves or is of another kind,"));
                }
                rest.insert(*id, geometry.twin(moves));
                count(Kind::Geometries, Who::Fallback, 1);
            }
            if geometry.is_known() && !moves {
                match geometry.is_instance() {
                    true => add_places(*id, geometry, &mut places),
                    false => sources.push((*id, geometry.clone())),
                }
                count(Kind::Geometries, Who::Bth, 1);
            }
        }
        let has_rest = !rest.is_empty();
        let rest = match has_rest {
            true => counted(Kind::Commits, Who::Fallback, 1, || self.show_rest(rest)),
            false => self.show_rest(rest),
        };
        let mut committed = counted(Kind::Commits, Who::Bth, 1, || self.build(&sources, places, Rest(rest)))?;
        for (id, geometry) in enabled.into_iter().take_while(|(id, _)| *id < MAX_TABLE) {
            committed.geometries.resize(id as usize + 1, None);
            committed.geometries[id as usize] = Some(geometry);
        }
        if !self.device.memory(committed.bytes() as isize, false) {
            let message = "the memory monitor refused".to_owned();
            return Err(Failure { code: ErrorCode::OutOfMemory, message });
        }
        self.put(Some(Box::new(committed)));
        Ok(())
    }

    fn build(&self, sources: &Sources, instances: Vec<Place>, rest: Rest) -> Result<Committed> {
        let monitor = Progress::new(*lock(&self.progress));
        monitor.check()?;
        let allows_argument_filter = self.has_flag(SCENE_FILTER_IN_ARGUMENTS);
        let known = self
            .mesh()
            .filter(|mesh| mesh.is_of(sources) && mesh.allows_argument_filter == allows_argument_filter);
        let own = match known {
            Some(mesh) => mesh,
            None => {
                let (quality, device) = (self.effort(), &*self.device);
                let build = Build { quality, allows_argument_filter, device, monitor: &monitor };
                let make = || Mesh::build(sources, &build);
                // A single hand-over to a thread of a pool: each parallel loop would need its own.
                let (mesh, was_cached) = match &self.device.pool {
                    Some(pool) => pool.install(make)?,
                    None => rayon::scope(|_| make())?,
                };
                if was_cached {
                    count(Kind::CachedCommits, Who::Bth, 1);
                }
                Arc::new(mesh)
            }
        };
        monitor.finish()?;
        let mut still_bounds = own.bounds();
        instances.iter().for_each(|place| still_bounds.join(&placed_bounds(place)));
        let mut bounds = still_bounds;
        bounds.join(&self.twin_bounds());
        let (mut filters, mut masks) = (Filters::default(), Vec::new());
        let meshes = instances.iter().map(|place| &place.mesh);
        let mut seen: Vec<*const Mesh> = Vec::new();
        for mesh in std::iter::once(&own).chain(meshes) {
            if seen.contains(&Arc::as_ptr(mesh)) {
                continue;
            }
            // Instances of few meshes most often follow each other.
            seen.truncate(64);
            seen.push(Arc::as_ptr(mesh));
            filters.allows_argument |= mesh.allows_argument_filter;
            for part in mesh.parts() {
                let geometry = &part.geometry;
                filters.intersect |= !geometry.intersect_filter.get().is_null();
                filters.occluded |= !geometry.occluded_filter.get().is_null();
                filters.takes_argument |= geometry.takes_argument_filter.load(Relaxed);
                masks.push(part.mask);
            }
            masks.sort_unstable();
            masks.dedup();
        }
        masks.extend(instances.iter().map(|place| place.mask));
        masks.sort_unstable();
        masks.dedup();
        Ok(Committed {
            world: World::build(&own, instances)?,
            own,
            rest,
            is_robust: self.has_flag(SCENE_ROBUST),
            filters,
            masks: (masks.len() <= MAX_MASKS).then_some(masks),
            bounds,
            still_bounds,
            geometries: Vec::new(),
        })
    }

    /// How much a build of this scene may take: little where it will soon be built again.
    fn effort(&self) -> Quality {
        let (quality, is_dynamic) = (self.quality.load(Relaxed), self.has_flag(SCENE_DYNAMIC));
        let has_cache = self.device.cache.is_some();
        match quality {
            QUALITY_LOW | QUALITY_REFIT => Quality::Fast,
            _ if is_dynamic => Quality::Fast,
            QUALITY_HIGH => Quality::Balanced,
            _ if has_cache => Quality::Balanced,
            _ => Quality::Fast,
        }
    }
}

/// The box of an instance: of the corners of its mesh's box, rounded outwards.
fn placed_bounds(place: &Place) -> Bounds {
    let (inner, m) = (place.mesh.bounds(), place.to_world.map(f64::from));
    let mut bounds = Bounds::EMPTY;
    if inner.lower[0] > inner.upper[0] {
        return bounds;
    }
    for corner in 0..8 {
        let at = |k: usize| f64::from(if corner >> k & 1 == 0 { inner.lower[k] } else { inner.upper[k] });
        let exact: [f64; 3] = std::array::from_fn(|row| {
            let row = 4 * row;
            m[row] * at(0) + m[row + 1] * at(1) + m[row + 2] * at(2) + m[row + 3]
        });
        bounds.add(exact.map(|x| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 }));
        bounds.add(exact.map(|x| if f64::from(x as f32) < x { (x as f32).next_up() } else { x as f32 }));
    }
    bounds
}

/// Tells the program how far a commit is, and hears whether it is to go on.
struct Progress {
    function: Option<Callback<ProgressFunction>>,
    total: AtomicU64,
    done: AtomicU64,
    cancelled: AtomicBool,
}

impl Progress {
    fn new(function: Option<Callback<ProgressFunction>>) -> Progress {
        Progress {
            function,
            total: AtomicU64::new(0),
            done: AtomicU64::new(0),
            cancelled: AtomicBool::new(false),
        }
    }

    /// Tells a share from 0 to 1.
    #[allow(unsafe_code)]
    fn tell(&self, share: f64) {
        if let Some(Callback { function, user }) = self.function {
            // SAFETY: the program gave the function and its pointer for this.
            let goes_on = unsafe { function(user, share) };
            self.cancelled.fetch_or(!goes_on, Relaxed);
        }
    }

    fn check(&self) -> Result<()> {
        self.tell(0.0);
        self.outcome()
    }

    fn finish(&self) -> Result<()> {
        self.tell(1.0);
        self.outcome()
    }

    fn outcome(&self) -> Result<()> {
        let message = "the progress monitor ended the commit".to_owned();
        let cancelled = Failure { code: ErrorCode::Cancelled, message };
        if self.cancelled.load(Relaxed) { Err(cancelled) } else { Ok(()) }
    }
}

impl Monitor for Progress {
    fn stage(&self, _name: &'static str, total: Option<u64>) {
        self.total.store(total.unwrap_or(0), Relaxed);
        self.done.store(0, Relaxed);
    }

    fn advance(&self, units: u64) {
        let (done, total) = (self.done.fetch_add(units, Relaxed) + units, self.total.load(Relaxed));
        if total > 0 {
            self.tell((done as f64 / total as f64).min(1.0));
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Relaxed)
    }
}
