//! A made model with all attributes, and the geometry that its surfaces are checked with.

use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_import::Keep;
use bth_random::Rng;

/// A model of separate triangles with all that a file can keep.
pub(crate) struct Model {
    pub(crate) triangles: Vec<[[f32; 3]; 3]>,
    pub(crate) normals: Vec<[[f32; 3]; 3]>,
    pub(crate) uvs: Vec<[[f32; 2]; 3]>,
    /// Group and material of each triangle.
    pub(crate) parts: Vec<(String, String)>,
}

pub(crate) fn number(rng: &mut Rng, scale: f32) -> f32 {
    (rng.below(1 << 20) as f32 / (1u32 << 19) as f32 - 1.0) * scale
}

impl Model {
    /// Triangles of all sizes and shapes. Some have normals of zeros at some corners or at all.
    pub(crate) fn random(count: usize, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        let mut model = Self { triangles: vec![], normals: vec![], uvs: vec![], parts: vec![] };
        for i in 0..count {
            let centre = [0; 3].map(|_| number(&mut rng, 8.0));
            let size = [1.0, 0.01, 3.0][i % 3];
            model.triangles.push([0; 3].map(|_| centre.map(|c| c + number(&mut rng, size))));
            let zero = |corner: usize| i % 5 == 0 && corner < i % 4;
            let normal = |corner: usize| match zero(corner) {
                true => [0.0; 3],
                false => [0; 3].map(|_| number(&mut rng, 2.0)),
            };
            model.normals.push([0, 1, 2].map(normal));
            model.uvs.push([0; 3].map(|_| [number(&mut rng, 4.0), number(&mut rng, 4.0)]));
            model.parts.push((format!("part {}", i / 7 % 11), format!("material {}", i / 3 % 4)));
        }
        model
    }

    pub(crate) fn obj(&self) -> String {
        let mut text = String::new();
        for i in 0..self.triangles.len() {
            for k in 0..3 {
                let [x, y, z] = self.triangles[i][k];
                let [a, b, c] = self.normals[i][k];
                let [u, v] = self.uvs[i][k];
                text += &format!("v {x} {y} {z}\nvn {a} {b} {c}\nvt {u} {v}\n");
            }
            text +=
                &format!("g {}\nusemtl {}\nf -3/-3/-3 -2/-2/-2 -1/-1/-1\n", self.parts[i].0, self.parts[i].1);
        }
        text
    }
}

pub(crate) fn options() -> CompileOptions {
    let attributes = Keep::All;
    CompileOptions { structure: Structure::Bvh, attributes, names: true, ..CompileOptions::default() }
}

pub(crate) fn compiled(model: &Model, options: &CompileOptions) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    std::fs::write(&path, model.obj()).unwrap();
    let (compiled, _) = compile(&path, options, &Silent).unwrap();
    bth_format::verify::verify(&bth_format::File::from_bytes(&compiled.bytes).unwrap()).unwrap();
    compiled.bytes
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

pub(crate) fn wide(p: [f32; 3]) -> [f64; 3] {
    p.map(f64::from)
}

#[track_caller]
pub(crate) fn assert_close(a: [f64; 3], b: [f64; 3], error: f64) {
    let size = dot(b, b).sqrt();
    assert!((0..3).all(|k| (a[k] - b[k]).abs() <= error * size), "{a:?} is not {b:?}");
}

/// The rows of a transform as the manifest's matrix, and the model's points through it.
pub(crate) type Rows = [[f64; 4]; 3];

pub(crate) fn through(rows: &Rows, p: [f64; 3]) -> [f64; 3] {
    rows.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
}

pub(crate) const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
