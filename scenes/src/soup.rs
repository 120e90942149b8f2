//! Random triangles that share no vertices and cut each other.

use crate::Model;
use crate::math::{Random, add, scale};

/// `faces` random triangles in a cube of side 2; sizes shrink with the number so that each
/// cuts a few others.
pub fn soup(faces: u32) -> Model {
    let mut random = Random::new(3);
    let mut model = Model::default();
    // Cube roots of different systems differ in the last place, so count up to it.
    let cells = (1..).find(|k: &u32| k.pow(3) >= faces).expect("faces are below 1625^3");
    let size = 1.5 / f64::from(cells);
    for _ in 0..faces {
        let centre = [random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(-1.0, 1.0)];
        let stretch = random.range(0.5, 2.0);
        let t = [(); 3].map(|()| model.push(add(centre, scale(random.in_ball(), size * stretch))));
        model.triangles.push(t);
    }
    model
}
