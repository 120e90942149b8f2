//! New positions of the objects of a [`Scene`].

use super::Scene;
use crate::clock;
use crate::deform::Deforming;
use crate::update::Update;
use bth_format::Error;

impl Scene {
    /// Number of vertices that [`Self::set_positions`] expects; `None` if the object was not compiled with `--deformable`.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn vertex_count(&self, object: u32) -> Option<usize> {
        let view = self.view(object);
        view.is_deformable().then_some(view.positions.len())
    }

    /// Gives an object new positions: one for each vertex of its source, in the source's order, in the space of the object. That
    /// order is the one of the vertices of a PLY or OFF file and of the `v` lines of an OBJ file, that of the corners of an STL file's
    /// triangles, that of the arrays for triangles from memory, and for glTF that of the vertices of one primitive after the other.
    ///
    /// The boxes of the object's nodes are computed again, by the threads of the current pool with the feature `rayon`, in memory
    /// of the scene's own; the file is not touched, and other scenes with the same file are not either. All queries of this scene
    /// then answer for the new positions, as exactly as before. Triangles of zero area are not hit and are no part of the
    /// surface, as in a file that is compiled with these positions. The tree remains that of the pose that was compiled:
    /// [`Update::deformed_cost_ratio`] tells how much worse it is for the new one.
    ///
    /// # Errors
    /// `BTH-O003` if there is no such object, `BTH-S006` if it was not compiled with `--deformable`, `BTH-S007` if the number of
    /// positions is wrong or one is not finite, `BTH-S002` if the world box of an instance would not be finite, `BTH-O001` if there is
    /// not enough memory. The scene is then unchanged.
    pub fn set_positions(&mut self, object: u32, positions: &[[f32; 3]]) -> Result<Update, Error> {
        self.refit_object(object, |deforming| deforming.stage(positions))
    }

    /// As [`Self::set_positions`], with positions on the straight lines between those at two times: at `share` of the way from the
    /// first to the second, from 0 to 1. For motion blur, where positions are known when the shutter opens and when it closes: set the
    /// object to as many shares as there are times at which the picture is sampled.
    ///
    /// A coordinate is (1 − `share`) · a + `share` · b in `f64`, rounded once to `f32`: exactly a or b at the ends, and never beyond
    /// them, so that the boxes of both ends together contain all that is between. Rays are traced as exactly as against any other positions.
    ///
    /// # Errors
    /// As [`Self::set_positions`], for both ends, and `BTH-S007` if `share` is not from 0 to 1. The scene is then unchanged.
    pub fn set_positions_between(
        &mut self,
        object: u32,
        ends: [&[[f32; 3]]; 2],
        share: f64,
    ) -> Result<Update, Error> {
        self.refit_object(object, |deforming| deforming.stage_between(ends, share))
    }

    /// Stages positions of an object, refits it, and places its instances again; after an error the scene is unchanged.
    fn refit_object(
        &mut self,
        object: u32,
        stage: impl FnOnce(&mut Deforming) -> Result<(), Error>,
    ) -> Result<Update, Error> {
        let start = clock::now();
        stage(self.objects_mut().deforming(object)?)?;
        self.refit_staged(object, start)
    }

    fn refit_staged(&mut self, object: u32, start: Option<std::time::Instant>) -> Result<Update, Error> {
        let deforming = self.objects_mut().deforming(object)?;
        deforming.refit_staged();
        let (refit, deformed_cost_ratio) = (clock::elapsed(start), deforming.cost_ratio());
        let (objects, world) = self.objects_and_world_mut();
        let placed = match world {
            Some(world) => world.place_again(objects, &[object]),
            None => Ok(Update { visible: objects.count() as usize, ..Update::default() }),
        };
        match placed {
            Ok(update) => Ok(Update { deformed: 1, deformed_cost_ratio, refit, ..update }),
            Err(failed) => {
                self.objects_mut().deforming(object)?.undo();
                let (code, expected, found) = failed.error.words();
                let found = format!("{found}: instance {}", failed.instance);
                Err(Error::of_call(code, expected, found))
            }
        }
    }
}
