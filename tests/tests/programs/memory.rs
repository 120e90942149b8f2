//! Compilation and viewing with little memory: scenes are written without being held, and what does
//! not fit is refused before the work.

use crate::support::{Run, bthc, command, folder, run_with};
use bth_compile::write::FileBuilder;
use bth_format::layout::kind;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// A program that may take this many KiB of addresses.
fn limited(kib: u64, program: &str, folder: &Path, args: &[&str]) -> Run {
    let unlimited = command(program, folder, args);
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit -v {kib} && exec \"$0\" \"$@\"")]);
    shell.arg(unlimited.get_program()).args(unlimited.get_args()).current_dir(folder);
    shell.env("BTH_NO_CACHE", "1");
    run_with(shell)
}

/// A heap of triangles that share no corners.
fn heap(triangles: u32) -> String {
    let mut text = String::new();
    for i in 0..triangles {
        let [x, y, z] = [i % 97, i / 97 % 89, i / 8633].map(|n| n * 4);
        let _ = write!(text, "v {x} {y} {z}\nv {} {y} {z}\nv {x} {} {z}\nf -3 -2 -1\n", x + 3, y + 2);
    }
    text
}

/// The same file with another name of its group, so that its object is another.
fn renamed(file: &bth_format::File, name: &str) -> Vec<u8> {
    let mut builder = FileBuilder::new();
    for section in file.sections() {
        let bytes = if section.entry.kind == kind::LABELS { name.as_bytes() } else { section.bytes };
        builder.section(section.entry.kind, section.entry.object, section.entry.stride, bytes).unwrap();
    }
    builder.finish()
}

#[test]
fn a_scene_larger_than_the_memory_is_written_and_shown_only_where_there_is_memory() {
    let folder = folder(&[("heap.obj", &format!("g 0000\n{}", heap(100_000)))]);
    bthc(folder.path(), &["compile", "heap.obj", "--quality", "fast", "--names"]).expect(0);
    let size = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().len();
    let heap = bth_format::File::read(folder.path().join("heap.bth")).unwrap();
    let mut manifest = "version = 1\n".to_owned();
    let count = (400 << 20) / size("heap.bth");
    for i in 0..count {
        std::fs::write(folder.path().join(format!("{i}.bth")), renamed(&heap, &format!("{i:04}"))).unwrap();
        let _ = write!(
            manifest,
            "[[objects]]\nname = \"{i}\"\nfile = \"{i}.bth\"\nobject = 0\n\
             [[nodes]]\nname = \"{i}\"\nobject = \"{i}\"\ntranslation = [{}, 0, 0]\n",
            i * 500
        );
    }
    std::fs::write(folder.path().join("s.manifest"), manifest).unwrap();
    let args = ["compile", "s.manifest", "--threads", "2", "--json"];
    let told = limited(350 << 10, "bthc", folder.path(), &args).expect(0).job();
    assert_eq!(told["scene"]["objects"].as_array().unwrap().len() as u64, count);
    assert!(size("s.bth") > 350 << 20);
    bthc(folder.path(), &["verify", "s.bth"]).expect(0);

    for args in [&["s.bth", "-o", "s.png"][..], &["s.bth", "-o", "s.png", "--read"]] {
        let run = limited(350 << 10, "bth-play", folder.path(), args).expect(5);
        assert!(run.stderr.contains("BTH-O001") && run.stderr.contains("ulimit -v"), "{run:?}");
    }
}

#[test]
fn models_larger_than_the_memory_are_refused_by_their_headers() {
    let folder = folder(&[]);
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 2000000\nproperty float x\nproperty float y\n\
        property float z\nelement face 4000000\nproperty list uchar int vertex_indices\nend_header\n";
    let bytes = header.len() as u64 + 2_000_000 * 12 + 4_000_000 * 13;
    std::fs::write(folder.path().join("large.ply"), header).unwrap();
    let file = std::fs::File::options().write(true).open(folder.path().join("large.ply")).unwrap();
    file.set_len(bytes).unwrap();
    let run =
        limited(700 << 10, "bthc", folder.path(), &["compile", "large.ply", "--threads", "2"]).expect(5);
    assert!(run.stderr.contains("BTH-L034: large.ply: 4000000 triangles take about 629 MiB"), "{run:?}");
    assert!(run.stderr.contains("--quality fast") && !folder.path().join("large.bth").exists(), "{run:?}");
}
