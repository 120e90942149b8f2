//! Options of the tets stage.

use std::path::PathBuf;
use std::time::Duration;

use bth_tetgen_protocol::Fault;

/// Options of the tetrahedralization.
#[derive(Clone, Debug, PartialEq)]
pub struct TetOptions {
    /// The worker program. If absent it is searched for: `BTH_TETGEN`, then next to this program,
    /// then on the `PATH`.
    pub worker: Option<PathBuf>,
    /// Worker processes; 0 for one per thread of the pool that calls. The result is the same for
    /// any number.
    pub workers: usize,
    /// Vertices of the mesh that an octree cell may hold before it is split; a point goes into the
    /// centre of every empty cell. 16 suits scans, 64 rooms; 0 adds no points.
    pub free_space: u32,
    /// Distance of the box from the bounds of the triangles on every side, relative to the diagonal
    /// of the bounds; at least one unit in the last place.
    pub inflation: f32,
    /// Time for one attempt at a node, whatever its size.
    pub deadline: Duration,
    /// Additional time for one attempt for each triangle.
    pub deadline_per_triangle: Duration,
    /// Address space of a worker, bytes.
    pub memory: u64,
    /// Sizes of the cells that replace a node that fails, in triangles: the largest size below the
    /// node's, for cells that fail the next one.
    pub cells: Vec<u32>,
    /// Cells with fewer triangles than this stay in the BVH.
    pub minimum: u32,
    /// Plants a fault at a node, for tests.
    #[doc(hidden)]
    pub planted: Option<(u32, Fault)>,
}

impl Default for TetOptions {
    fn default() -> Self {
        Self {
            worker: None,
            workers: 0,
            free_space: 16,
            inflation: 1.0 / 128.0,
            deadline: Duration::from_secs(2),
            deadline_per_triangle: Duration::from_millis(1),
            memory: 4 << 30,
            cells: vec![16384, 4096],
            minimum: 1024,
            planted: None,
        }
    }
}
