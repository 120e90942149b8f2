//! Where the instances are in each round.

use bth_random::Rng;

/// How the instances move from one round to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    /// All move on, each on a circle of its own.
    Drift,
    /// Each goes where another was.
    Shuffle,
    /// One in a hundred moves on.
    Few,
}

impl Motion {
    pub(super) const ALL: [Motion; 3] = [Motion::Drift, Motion::Shuffle, Motion::Few];

    /// Its name in tables and reports.
    pub(super) fn name(self) -> &'static str {
        match self {
            Motion::Drift => "drift",
            Motion::Shuffle => "shuffle",
            Motion::Few => "few",
        }
    }
}

/// The instances that move in a round, and their new transforms: rows of four.
#[derive(Clone, Debug, Default)]
pub(super) struct Moves {
    pub(super) ids: Vec<u32>,
    pub(super) transforms: Vec<[f32; 12]>,
}

/// Instances on circles in a cube, which has room for eight times as many.
pub(super) struct Crowd {
    centers: Vec<[f32; 3]>,
    phases: Vec<f32>,
    rng: Rng,
}

impl Crowd {
    pub(super) fn new(count: u32) -> Crowd {
        let mut rng = Rng::new(1);
        let side = (count as f32).cbrt() * 2.0;
        let centers = (0..count).map(|_| [(); 3].map(|()| rng.unit_f32() * side)).collect();
        let phases = (0..count).map(|_| rng.unit_f32()).collect();
        Crowd { centers, phases, rng }
    }

    /// The transform of an instance: it turns while it moves.
    fn transform(&self, id: u32) -> [f32; 12] {
        let ([x, y, z], phase) = (self.centers[id as usize], self.phases[id as usize]);
        let (sin, cos) = (phase * std::f32::consts::TAU).sin_cos();
        [cos, 0.0, -sin, x + cos, 0.0, 1.0, 0.0, y, sin, 0.0, cos, z + sin]
    }

    /// All instances.
    pub(super) fn all(&self) -> Moves {
        let ids: Vec<u32> = (0..self.centers.len() as u32).collect();
        let transforms = ids.iter().map(|id| self.transform(*id)).collect();
        Moves { ids, transforms }
    }

    /// Moves the instances on.
    pub(super) fn advance(&mut self, motion: Motion) -> Moves {
        let count = self.centers.len();
        match motion {
            Motion::Drift => self.phases.iter_mut().for_each(|phase| *phase += 0.01),
            Motion::Shuffle => {
                (1..count).for_each(|i| self.centers.swap(i, self.rng.below(i as u64 + 1) as usize));
            }
            Motion::Few => {
                let first = self.rng.below(100) as usize;
                let ids: Vec<u32> = (first.min(count - 1)..count).step_by(100).map(|i| i as u32).collect();
                ids.iter().for_each(|id| self.phases[*id as usize] += 0.01);
                let transforms = ids.iter().map(|id| self.transform(*id)).collect();
                return Moves { ids, transforms };
            }
        }
        self.all()
    }
}
