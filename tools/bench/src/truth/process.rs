//! Engines that are programs. They read commands line by line, and numbers from files.
//!
//! `PROGRAM ENGINE` prints `ok VERSION` once it is ready. `load FOLDER` builds the structure of
//! `positions` (f64, three each) and `triangles` (u32, three each), and reads the queries:
//! `origins` and `directions` (f64, three each), `own` (u32, two each: the triangles of the ends)
//! and `query`: `nearest`, `inside` or `visible`. `run` answers them into `t` (f64) and `id` (u32)
//! of the folder. Each prints `ok SECONDS` of processor time, or `no REASON`. A miss has an
//! infinite t and the id 2^32 - 1. Yes is the id 1, no is 0.

use super::engines::{Asked, Running};
use super::judge::EngineAnswer;
use super::sets::{Place, Query, Set};
use anyhow::{Context, Result, bail, ensure};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use tempfile::TempDir;
use zerocopy::{FromBytes, IntoBytes};

/// A program that runs.
pub(super) struct Process {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    folder: TempDir,
    count: usize,
    /// What it says of itself.
    pub(super) version: String,
}

/// The folder that `tools/bench/truth/setup` fills, or that TRUTH_ENGINES names.
fn engines() -> Result<PathBuf> {
    let named = std::env::var_os("TRUTH_ENGINES").map(PathBuf::from);
    let folder = named.or_else(|| crate::rivals::installed("truth"));
    folder.filter(|f| f.is_dir()).context("not installed (run tools/bench/truth/setup, or set TRUTH_ENGINES)")
}

impl Process {
    /// Starts a program of the folder of engines.
    pub(super) fn start(program: &str, engine: &str) -> Result<Process> {
        let (folder, scripts) = (engines()?, concat!(env!("CARGO_MANIFEST_DIR"), "/truth"));
        let mut command = match program {
            "python" => Command::new(folder.join("venv/bin/python")),
            "node" => Command::new("node"),
            _ => Command::new(folder.join(program)),
        };
        match program {
            "python" => command.arg(format!("{scripts}/engines.py")),
            // Modules are found next to the script.
            "node" => command.arg(folder.join("engines.mjs")),
            _ => &mut command,
        };
        // One thread each.
        for variable in ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "TBB_NUM_THREADS"] {
            command.env(variable, "1");
        }
        command.arg(engine).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().context("not installed (run tools/bench/truth/setup)")?;
        let (input, output) = (child.stdin.take().context("stdin")?, child.stdout.take().context("stdout")?);
        let (folder, count, version) = (tempfile::tempdir()?, 0, String::new());
        let mut process = Process { child, input, output: BufReader::new(output), folder, count, version };
        process.version = process.reply()?;
        Ok(process)
    }

    fn reply(&mut self) -> Result<String> {
        let mut line = String::new();
        self.output.read_line(&mut line)?;
        match line.trim().split_once(' ') {
            Some(("ok", rest)) => Ok(rest.to_owned()),
            Some(("no", why)) => bail!("{why}"),
            _ if line.is_empty() => bail!("the program ended"),
            _ => bail!("unexpected reply {line:?}"),
        }
    }

    fn ask(&mut self, command: &str) -> Result<f64> {
        writeln!(self.input, "{command}")?;
        Ok(self.reply()?.parse()?)
    }

    fn read<T: FromBytes>(&self, name: &str) -> Result<Vec<T>> {
        let bytes = std::fs::read(self.folder.path().join(name))?;
        let numbers = bytes.chunks_exact(size_of::<T>()).filter_map(|b| T::read_from_bytes(b).ok()).collect();
        Ok(numbers)
    }
}

impl Running for Process {
    fn load(&mut self, set: &Set, asked: &[Asked]) -> Result<()> {
        let write = |name: &str, bytes: &[u8]| std::fs::write(self.folder.path().join(name), bytes);
        write("positions", set.positions.as_bytes())?;
        write("triangles", set.triangles.as_bytes())?;
        let points = |point: fn(&Asked) -> glam::DVec3| -> Vec<[f64; 3]> {
            asked.iter().map(|ray| point(ray).to_array()).collect()
        };
        write("origins", points(|ray| ray.origin).as_bytes())?;
        write("directions", points(|ray| ray.direction).as_bytes())?;
        let of = |place: &Option<Place>| place.map_or(u32::MAX, |p| p.start.primitive.triangle);
        let questions = asked.iter().map(|asked| &set.questions[asked.row]);
        let own: Vec<[u32; 2]> = questions.map(|q| [of(&q.from), of(&q.to)]).collect();
        write("own", own.as_bytes())?;
        let query = match set.query {
            Query::Nearest => "nearest",
            Query::Inside => "inside",
            Query::Visible => "visible",
        };
        write("query", query.as_bytes())?;
        self.count = asked.len();
        let folder = self.folder.path().display().to_string();
        self.ask(&format!("load {folder}")).map(drop)
    }

    fn run(&mut self) -> Result<(f64, Vec<EngineAnswer>)> {
        let seconds = self.ask("run")?;
        let (t, id) = (self.read::<f64>("t")?, self.read::<u32>("id")?);
        ensure!(t.len() == self.count && id.len() == self.count, "{} answers", id.len());
        Ok((seconds, t.into_iter().zip(id).map(|(t, id)| EngineAnswer { t, id }).collect()))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
