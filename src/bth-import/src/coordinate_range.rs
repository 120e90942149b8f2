//! Warnings of coordinates with which all rays take long, although their answers stay exact.

use crate::mesh::Mesh;
use crate::monitor::Monitor;
use bth_format::object::GREATEST_IN_F32;

/// Where no |coordinate| is greater, products of distances within a leaf are denormal in f32.
const LEAST: f32 = 1.0 / (1u64 << 50) as f32;
/// From this ratio of the mesh's size to its [`Bulk`], a vertex far out counts as a mistake: all
/// rays pass close to its triangles.
const FAR: f64 = (1u64 << 30) as f64;
/// Number of vertices by which the bulk is found.
const SAMPLES: usize = 4096;
/// Along each axis, one in this number of sampled coordinates may lie beyond either end of the
/// bulk.
const OUTSIDE: usize = 16;

/// The box in which most vertices lie.
struct Bulk {
    middle: [f64; 3],
    /// Its largest extent.
    size: f64,
}

impl Bulk {
    /// Returns the bulk of positions, at least one.
    fn of(positions: &[[f32; 3]]) -> Bulk {
        let step = positions.len().div_ceil(SAMPLES);
        let mut bulk = Bulk { middle: [0.0; 3], size: 0.0 };
        for k in 0..3 {
            let mut sample: Vec<f32> = positions.iter().step_by(step).map(|position| position[k]).collect();
            sample.sort_unstable_by(f32::total_cmp);
            let outside = sample.len().div_ceil(OUTSIDE).min((sample.len() - 1) / 2);
            let [least, greatest] = [sample[outside], sample[sample.len() - 1 - outside]].map(f64::from);
            bulk.middle[k] = 0.5 * least + 0.5 * greatest;
            bulk.size = bulk.size.max(greatest - least);
        }
        bulk
    }

    /// Returns true if a position is so far out that it is taken for a mistake.
    fn is_far(&self, position: &[f32; 3]) -> bool {
        (0..3).any(|k| (f64::from(position[k]) - self.middle[k]).abs() > FAR * self.size)
    }
}

/// Warns of vertices far out and otherwise of coordinates that are too large or too
/// small for f32.
pub(crate) fn warn(mesh: &Mesh, monitor: &dyn Monitor) {
    if mesh.positions.is_empty() {
        return;
    }
    let bulk = Bulk::of(&mesh.positions);
    if bulk.size > 0.0 {
        let count = mesh.positions.iter().filter(|position| bulk.is_far(position)).count();
        let is_far = |corners: &[u32; 3]| corners.iter().any(|v| bulk.is_far(&mesh.positions[*v as usize]));
        if let (true, Some(triangle)) = (count > 0, mesh.triangles.iter().position(is_far)) {
            let mut corners = mesh.triangles[triangle].into_iter().map(|v| v as usize);
            let row = corners.find(|row| bulk.is_far(&mesh.positions[*row])).unwrap_or_default();
            let first = match &mesh.exact {
                None => format!("{:?}", mesh.positions[row]),
                Some(exact) => format!("{:?}", exact.positions[row]),
            };
            let vertices = if count == 1 { "1 vertex lies".into() } else { format!("{count} vertices lie") };
            return monitor.warn(&format!(
                "{vertices} more than 2^30 times as far out as most of the mesh is large, the first at {first} \
                 in triangle {triangle}: rays take two to four times as long, from coordinates of 1.1e12 (2^40) on ten to thirty times, from 3e29 \
                 (2^98) on thousands of times. Remove what is there by mistake",
            ));
        }
    }
    let greatest = mesh.positions.as_flattened().iter().fold(0f32, |greatest, x| greatest.max(x.abs()));
    if greatest >= GREATEST_IN_F32 {
        monitor.warn(&format!(
            "coordinates reach {greatest:e}: from 1.1e12 (2^40) on rays take several times as long, from 3e29 (2^98) on thousands of times. \
             Answers are exact all the same; in a greater unit the model is faster",
        ));
    } else if 0.0 < greatest && greatest <= LEAST {
        monitor.warn(&format!(
            "coordinates do not exceed {greatest:e}: below 8.9e-16 (2^-50) rays take several times as long, below 1e-33 thousands of \
             times. Answers are exact all the same; in a smaller unit the model is faster",
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    struct Said(Mutex<Vec<String>>);

    impl Monitor for Said {
        fn warn(&self, message: &str) {
            self.0.lock().unwrap().push(message.to_owned());
        }
    }

    /// What is said of a square of 40 by 40 vertices, all coordinates times `scale`, and of more
    /// vertices.
    fn said(scale: f32, more: &[[f32; 3]]) -> Vec<String> {
        let mut positions: Vec<[f32; 3]> =
            (0..1600).map(|i| [(i % 40) as f32 * scale, (i / 40) as f32 * scale, scale]).collect();
        let mut triangles: Vec<[u32; 3]> = (0..1500).map(|i| [i, i + 1, i + 41]).collect();
        for position in more {
            triangles.push([0, 1, positions.len() as u32]);
            positions.push(*position);
        }
        let said = Said(Mutex::default());
        warn(&Mesh { positions, triangles, ..Mesh::default() }, &said);
        said.0.into_inner().unwrap()
    }

    #[test]
    fn ordinary_meshes_and_those_on_a_wide_plane_are_not_warned_of() {
        for scale in [1.0, 1e-12, 1e9, 3e-14, 2e10] {
            assert_eq!(said(scale, &[]), [""; 0], "{scale}");
            let plane = [[-1e8 * scale, 0.0, 0.0], [1e8 * scale, 0.0, 1e9 * scale]];
            assert_eq!(said(scale, &plane).len(), usize::from(1e9 * scale >= GREATEST_IN_F32), "{scale}");
        }
        let said = Said(Mutex::default());
        warn(&Mesh::default(), &said);
        warn(&Mesh { positions: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 2]], ..Mesh::default() }, &said);
        warn(&Mesh { positions: vec![[1.0; 3]], ..Mesh::default() }, &said);
        assert!(said.0.into_inner().unwrap().is_empty());
    }

    #[test]
    fn vertices_far_out_are_counted_and_the_first_is_named() {
        for scale in [1.0, 1e-30] {
            let said =
                said(scale, &[[5.0 * scale, 0.0, 0.0], [0.0, f32::MAX, 0.0], [-1e12 * scale, 0.0, 0.0]]);
            assert_eq!(said.len(), 1, "{said:?}");
            assert!(said[0].starts_with("2 vertices lie more than 2^30"), "{said:?}");
            assert!(said[0].contains("[0.0, 3.4028235e38, 0.0] in triangle 1501"), "{said:?}");
        }
    }

    #[test]
    fn units_that_are_too_small_or_too_great_for_f32_are_warned_of() {
        assert!(said(1e30, &[])[0].starts_with("coordinates reach 3.9e31"));
        assert!(said(1e-20, &[])[0].starts_with("coordinates do not exceed 3.9e-19"));
    }
}
