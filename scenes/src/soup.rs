//! Random triangles that share no vertices and cut each other.

use crate::Model;
use bth_random::Rng;
use glam::DVec3;

/// `faces` random triangles in a cube of side 2; sizes shrink with the number so that each
/// cuts a few others.
pub fn soup(faces: u32) -> Model {
    let mut rng = Rng::new(3);
    let mut model = Model::default();
    // The library's cube root differs between systems in the last place, so the root is found by
    // counting.
    let cells = (1..).find(|k: &u32| k.pow(3) >= faces).expect("faces are below 1625^3");
    let size = 1.5 / f64::from(cells);
    for _ in 0..faces {
        let centre = DVec3::from_array([(); 3].map(|()| rng.between(-1.0, 1.0)));
        let stretch = rng.between(0.5, 2.0);
        let t =
            [(); 3].map(|()| model.push(centre + DVec3::from_array(rng.point_in_ball()) * (size * stretch)));
        model.triangles.push(t);
    }
    model
}
