//! Geometries: what a program sets, until a scene is committed.

use crate::abi::*;
use crate::buffer::{Buffer, View};
use crate::device::{Device, lock};
use crate::error::{Result, argument, operation, unsupported};
use crate::handles::{Shared, Tagged};
use crate::transform::Transform;
use crate::twin::TwinGeometry;
use std::any::Any;
use std::ffi::c_void;
use std::fmt::Debug;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard};

/// The kinds of geometry that only another library answers: subdivision, curves, points, user
/// geometry.
const KINDS: [u32; 20] = [8, 15, 16, 17, 24, 25, 26, 32, 33, 34, 40, 41, 42, 50, 51, 52, 58, 59, 60, 120];

/// A function of the program that is read with every hit; 0 if there is no function.
#[derive(Debug, Default)]
pub(crate) struct Function(AtomicUsize);

impl Function {
    pub(crate) fn set(&self, function: *const c_void) {
        self.0.store(function as usize, Relaxed);
    }

    /// Its address, or null.
    #[inline(always)]
    pub(crate) fn get(&self) -> *const c_void {
        self.0.load(Relaxed) as *const c_void
    }
}

/// A geometry.
#[derive(Debug)]
pub(crate) struct Geometry {
    pub(crate) device: Arc<Shared<Device>>,
    /// `RTC_GEOMETRY_TYPE_*`.
    pub(crate) kind: u32,
    pub(crate) enabled: AtomicBool,
    pub(crate) mask: AtomicU32,
    pub(crate) user: AtomicPtr<c_void>,
    pub(crate) intersect_filter: Function,
    pub(crate) occluded_filter: Function,
    pub(crate) point_query: Function,
    pub(crate) takes_argument_filter: AtomicBool,
    state: Mutex<State>,
}

/// What changes before commits.
#[derive(Debug)]
pub(crate) struct State {
    pub(crate) time_steps: u32,
    pub(crate) time_range: [f32; 2],
    views: Vec<(u32, u32, View)>,
    pub(crate) attributes: u32,
    /// Of an instance, by time step.
    pub(crate) transforms: Vec<Transform>,
    /// Of an instance one, of an array of instances any number.
    pub(crate) scenes: Vec<Option<Arc<dyn Instanced>>>,
    pub(crate) quality: u32,
    /// False after a change, until the geometry is committed.
    committed: bool,
    /// Number of commits: another one means that something may have changed.
    pub(crate) version: u64,
    /// What the other library has of it.
    pub(crate) twin: Option<TwinGeometry>,
}

/// A scene as instances of it see it.
pub(crate) trait Instanced: Debug + Send + Sync {
    /// The triangles of its last commit, a `Mesh`.
    fn triangles(&self) -> Option<Arc<dyn Any + Send + Sync>>;

    /// The scene of the other library with what bth does not hold, and the number of its commits;
    /// null if there is nothing.
    fn twin(&self) -> (Handle, u64);

    /// The scene of the other library with everything, as it is now, and the number of its commits;
    /// null without a library.
    fn whole_twin(&self) -> (Handle, u64);
}

impl Tagged for Geometry {
    const TAG: u64 = 0x6274_6867_656F_6D01;
}

impl Geometry {
    /// A geometry of a kind.
    ///
    /// # Errors
    /// If there is no such kind, or the other library does not hold it.
    pub(crate) fn new(device: &Arc<Shared<Device>>, kind: u32) -> Result<Geometry> {
        let geometry = Geometry {
            device: device.clone(),
            kind,
            enabled: AtomicBool::new(true),
            mask: AtomicU32::new(1),
            user: AtomicPtr::default(),
            intersect_filter: Function::default(),
            occluded_filter: Function::default(),
            point_query: Function::default(),
            takes_argument_filter: AtomicBool::new(false),
            state: Mutex::new(State {
                time_steps: 1,
                time_range: [0.0, 1.0],
                views: Vec::new(),
                attributes: 0,
                transforms: vec![Transform::IDENTITY],
                scenes: Vec::new(),
                quality: QUALITY_MEDIUM,
                committed: false,
                version: 0,
                twin: None,
            }),
        };
        if !geometry.is_known() && !KINDS.contains(&kind) {
            return argument(format!("invalid geometry type {kind}"));
        }
        // Without another library, the geometry is refused when a scene commits it with items.
        if let (false, Some(fallback)) = (geometry.is_known(), &device.fallback) {
            let Some(twin) = TwinGeometry::new(fallback, kind) else {
                return unsupported(&format!("geometry of type {kind}"));
            };
            geometry.state().twin = Some(twin);
        }
        Ok(geometry)
    }

    /// Returns true if bth answers geometry of this kind, as long as it does not move.
    pub(crate) fn is_known(&self) -> bool {
        matches!(self.kind, TRIANGLE | QUAD | GRID) || self.is_instance()
    }

    pub(crate) fn is_instance(&self) -> bool {
        matches!(self.kind, INSTANCE | INSTANCE_ARRAY)
    }

    /// Returns true if a buffer has items.
    pub(crate) fn has_items(&self) -> bool {
        self.state().views.iter().any(|(.., view)| view.count > 0)
    }

    pub(crate) fn is_enabled(&self) -> bool {
        self.enabled.load(Relaxed)
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }

    /// The state, to be changed: the geometry has to be committed again.
    pub(crate) fn change(&self) -> MutexGuard<'_, State> {
        let mut state = self.state();
        state.committed = false;
        state
    }

    /// Checks and keeps a view of a buffer.
    pub(crate) fn set_buffer(
        &self,
        (kind, slot, format): (u32, u32, u32),
        buffer: &Arc<Shared<Buffer>>,
        place: [usize; 3],
    ) -> Result<View> {
        let view = View::new(buffer, format, place)?;
        let mut state = self.change();
        if self.is_known() {
            check_buffer(self.kind, &state, (kind, slot, format))?;
        }
        state.views.retain(|known| (known.0, known.1) != (kind, slot));
        state.views.push((kind, slot, view.clone()));
        Ok(view)
    }

    /// Checks a geometry, and takes it as committed.
    pub(crate) fn commit(&self) -> Result<()> {
        let mut state = self.state();
        let strides: Vec<usize> = (0..state.time_steps)
            .filter_map(|step| state.view(BUFFER_VERTEX, step).map(|view| view.stride))
            .collect();
        if strides.windows(2).any(|pair| pair[0] != pair[1]) {
            return operation("the vertex buffers of all time steps must have the same stride");
        }
        if self.kind == INSTANCE_ARRAY && state.scenes.is_empty() {
            return operation("an instance array needs a scene");
        }
        state.committed = true;
        state.version += 1;
        Ok(())
    }

    pub(crate) fn is_committed(&self) -> bool {
        self.state().committed
    }
}

impl State {
    /// The view of a buffer.
    pub(crate) fn view(&self, kind: u32, slot: u32) -> Option<&View> {
        self.views.iter().find(|known| (known.0, known.1) == (kind, slot)).map(|known| &known.2)
    }

    /// All views with their kind and slot.
    pub(crate) fn views(&self) -> &[(u32, u32, View)] {
        &self.views
    }
}

/// Checks that geometry of a kind has buffers of a kind, in a slot and a format.
fn check_buffer(geometry: u32, state: &State, (kind, slot, format): (u32, u32, u32)) -> Result<()> {
    let is_mesh = matches!(geometry, TRIANGLE | QUAD | GRID);
    let (slots, formats) = match kind {
        BUFFER_INDEX if geometry == TRIANGLE => (1, FORMAT_UINT3..=FORMAT_UINT3),
        BUFFER_INDEX if geometry == QUAD => (1, FORMAT_UINT4..=FORMAT_UINT4),
        BUFFER_INDEX if geometry == INSTANCE_ARRAY => (1, FORMAT_UINT..=FORMAT_UINT),
        BUFFER_GRID if geometry == GRID => (1, FORMAT_GRID..=FORMAT_GRID),
        BUFFER_VERTEX if is_mesh => (state.time_steps, FORMAT_FLOAT3..=FORMAT_FLOAT3),
        BUFFER_ATTRIBUTE if is_mesh => (state.attributes, FORMAT_FLOAT..=FORMAT_FLOAT16),
        BUFFER_TRANSFORM if geometry == INSTANCE_ARRAY => {
            let known = [FORMAT_3X4_ROWS, FORMAT_3X4_COLUMNS, FORMAT_4X4_COLUMNS, FORMAT_QUATERNION];
            if !known.contains(&format) {
                return operation("invalid transform buffer format");
            }
            (state.time_steps, format..=format)
        }
        _ => return argument("unknown buffer type"),
    };
    if !formats.contains(&format) {
        return operation(format!("invalid format {format:#x} of buffer {kind}"));
    }
    if slot >= slots {
        return argument(format!("invalid slot {slot} of buffer {kind}, expected one below {slots}"));
    }
    Ok(())
}
