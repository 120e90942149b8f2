//! An object whose positions differ from its file: its memory, and the state of its refits.

use super::boxes::refit;
use super::cost::cost;
use super::plan::RefitPlan;
use crate::parallel::Tasks;
use bth_format::file::{DeformableObject, Normals};
use bth_format::object::ObjectView;
use bth_format::{Code, Error, File};

/// Positions, boxes and leaves of an object that differ from its file.
#[derive(Debug)]
pub(crate) struct OwnPositions {
    object: DeformableObject,
    plan: RefitPlan,
    /// Positions of the next refit, or of the refit before the last.
    staged: Vec<[f32; 3]>,
    /// The same for normals. New positions without normals have the normals of the triangles.
    staged_normals: Normals,
    /// Expected cost of the tree for the positions of the file.
    compiled_cost: f64,
    /// The same for the positions of the last refit.
    cost: f64,
}

/// How positions are checked and copied.
const TASKS: Tasks = Tasks { rows: 1 << 14, min_rows: 1 << 16 };

impl OwnPositions {
    /// An object with the positions of its file.
    ///
    /// # Errors
    /// `BTH-S006` if the object is not deformable, `BTH-O001` if there is not enough memory.
    pub(crate) fn new(file: &File, object: u32) -> Result<OwnPositions, Error> {
        let object = DeformableObject::new(file, object)?;
        let view = object.view();
        let plan = RefitPlan::new(view);
        let compiled_cost = cost(&view.lines[..plan.node_lines as usize]);
        let staged = view.positions.to_vec();
        let staged_normals = Some(Vec::new());
        let cost = compiled_cost;
        Ok(OwnPositions { object, plan, staged, staged_normals, compiled_cost, cost })
    }

    /// The sections of the object, with its own positions.
    #[inline(always)]
    pub(crate) fn view(&self) -> &ObjectView<'_> {
        self.object.view()
    }

    /// Stages given positions.
    ///
    /// # Errors
    /// `BTH-S007` if their number is another or one is not finite. What was staged before remains.
    pub(crate) fn stage(&mut self, positions: &[[f32; 3]]) -> Result<(), Error> {
        self.check(positions)?;
        copy_positions(positions, &mut self.staged);
        self.staged_normals = Some(Vec::new());
        Ok(())
    }

    /// Stages positions on the straight lines between given ones, at a share of the way from the
    /// first to the second.
    ///
    /// # Errors
    /// The errors of [`Self::stage`], and `BTH-S007` for a share that is not from 0 to 1.
    #[cold]
    pub(crate) fn stage_between(&mut self, ends: [&[[f32; 3]]; 2], share: f64) -> Result<(), Error> {
        if !(0.0..=1.0).contains(&share) {
            return Err(Error::of_call(Code::NewPositions, "a share from 0 to 1", format!("{share}")));
        }
        self.check(ends[1])?;
        self.stage(ends[0])?;
        move_towards(&mut self.staged, ends[1], share);
        Ok(())
    }

    /// Checks the number of positions that are given, and that all are finite.
    fn check(&self, positions: &[[f32; 3]]) -> Result<(), Error> {
        if positions.len() != self.staged.len() {
            let expected = format!("{} positions", self.staged.len());
            return Err(Error::of_call(Code::NewPositions, expected, format!("{}", positions.len())));
        }
        check_finite(positions)
    }

    /// Memory for new positions, which are staged when all of it has been filled and
    /// [`Self::check_staged`] has been called. The positions before the last refit, which it holds
    /// until then, are lost. Without [`Self::stage_normals_of_file`] they have the normals of the
    /// triangles.
    pub(crate) fn staged_mut(&mut self) -> &mut [[f32; 3]] {
        self.staged_normals = Some(Vec::new());
        &mut self.staged
    }

    /// Stages the normals of the file with the positions that are staged, for what turns them where
    /// it needs them.
    pub(crate) fn stage_normals_of_file(&mut self) {
        self.staged_normals = None;
    }

    /// Checks positions that were written to [`Self::staged_mut`], in which no zero is negative.
    ///
    /// # Errors
    /// `BTH-S007` if one is not finite.
    pub(crate) fn check_staged(&self) -> Result<(), Error> {
        check_finite(&self.staged)
    }

    /// Gives the object the positions that [`Self::stage`] has staged.
    pub(crate) fn refit_staged(&mut self) {
        let plan = &self.plan;
        let refitted = self.object.refit(&mut self.staged, &mut self.staged_normals, |mut parts| {
            let ends = refit(plan, &mut parts);
            (ends, cost(&parts.lines[..plan.node_lines as usize]))
        });
        self.cost = refitted.unwrap_or(self.cost);
    }

    /// Undoes the last refit; its positions are staged again.
    pub(crate) fn undo(&mut self) {
        self.refit_staged();
    }

    /// Expected cost of rays relative to that for the positions of the file. 1 where the tree is a
    /// single leaf.
    pub(crate) fn cost_ratio(&self) -> f64 {
        let ratio = self.cost / self.compiled_cost;
        if ratio.is_nan() { 1.0 } else { ratio }
    }
}

/// Checks that all positions are finite.
fn check_finite(positions: &[[f32; 3]]) -> Result<(), Error> {
    if TASKS.all(positions, all_finite) {
        return Ok(());
    }
    let row = positions.iter().position(|p| !p.iter().all(|x| x.is_finite())).unwrap_or_default();
    let found = format!("{:?} of vertex {row}", positions[row]);
    Err(Error::of_call(Code::NewPositions, "finite positions", found))
}

fn all_finite(positions: &[[f32; 3]]) -> bool {
    // The product with 0 is 0, or NaN for what is not finite: sums without branches, which compile
    // to vectors.
    let (whole, rest) = positions.as_flattened().as_chunks::<16>();
    let mut sums = [0.0f32; 16];
    for values in whole {
        for i in 0..16 {
            sums[i] += values[i] * 0.0;
        }
    }
    sums.iter().all(|sum| *sum == 0.0) && rest.iter().all(|x| x.is_finite())
}

/// Copies positions. As in compiled files, no zero is negative.
fn copy_positions(from: &[[f32; 3]], to: &mut [[f32; 3]]) {
    TASKS.for_each(to, |first, to| {
        for (to, from) in to.as_flattened_mut().iter_mut().zip(from[first..].as_flattened()) {
            *to = from + 0.0;
        }
    });
}

/// Moves positions by a share of the way to others.
///
/// A coordinate is (1 − share) · a + share · b in `f64`, rounded once to `f32`. Since a and b are
/// `f32`, it is exactly a and b at the ends and never beyond them.
fn move_towards(positions: &mut [[f32; 3]], to: &[[f32; 3]], share: f64) {
    TASKS.for_each(positions, |first, positions| {
        for (from, to) in positions.as_flattened_mut().iter_mut().zip(to[first..].as_flattened()) {
            *from = ((1.0 - share) * f64::from(*from) + share * f64::from(*to)) as f32 + 0.0;
        }
    });
}
