//! `bth-bench`: measures bth and other CPU ray tracers on identical rays.

fn main() -> std::process::ExitCode {
    bth_bench::run()
}
