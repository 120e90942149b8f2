//! Positions in double that C compiles.

use crate::{program, run};
use bth_compile::Silent;
use bth_compile::memory::{PositionRows, TriangleMesh};
use bth_compile::pipeline::{CompileOptions, compile};
use bth_format::File;

#[test]
fn a_c_program_keeps_and_traces_positions_in_double_and_is_told_what_float_moves() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = program(folder.path(), "compile_double.c", &["bth", "bth_compile"]) else { return };
    let path = folder.path().join("far.bth");
    let output = run(&program, &[path.to_str().expect("UTF-8")], "");
    assert!(output.status.success(), "{output:?}");
    let [x, y] = [5.5e6, 4.2e5];
    let square = [[x, y, 0.0], [x + 2.0, y, 0.0], [x, y + 2.0, 0.0], [x + 2.0, y + 2.0, 0.0]];
    let positions = [&square[..], &[[x + 0.125, y + 1.0, 1.0], [x + 0.0625, y + 2.0, 2.0]]].concat();
    let mesh = TriangleMesh {
        positions: PositionRows::F64(&positions),
        triangles: &[[0, 1, 2], [1, 3, 2], [0, 4, 5]],
    };
    let (compiled, _) = compile(mesh, &CompileOptions::default(), &Silent).expect("it compiles");
    let found = std::fs::read(&path).expect("a file");
    assert!(found == compiled.bytes);
    let file = File::from_bytes(&found).expect("a file");
    let corners = [0, 4, 5].map(|row: usize| positions[row]);
    assert_eq!(file.object(0).expect("an object").exact.corners(2), Some(corners));
}
