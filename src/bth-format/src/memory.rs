//! How much memory this process may still take.

use std::path::Path;

/// Bytes of memory that this process may still take: what the machine has, or less where a limit
/// on the process (`ulimit -v`) or on its group (cgroups) leaves less. `u64::MAX` where the system
/// does not tell.
pub fn available() -> u64 {
    available_by(Path::new("/proc"), Path::new("/sys/fs/cgroup"))
}

fn available_by(proc: &Path, cgroup: &Path) -> u64 {
    let text = |path: &str| std::fs::read_to_string(proc.join(path)).unwrap_or_default();
    let machine = text("meminfo");
    let free = field(&machine, "MemAvailable:").map(|kib| kib << 10);
    let swap = field(&machine, "SwapFree:").map_or(0, |kib| kib << 10);
    let taken = field(&text("self/status"), "VmSize:").map_or(0, |kib| kib << 10);
    let limit = field(&text("self/limits"), "Max address space");
    let groups = text("self/cgroup");
    let groups = groups.lines().filter_map(|line| of_group(line, cgroup));
    let all = free.map(|free| free + swap).into_iter().chain(groups);
    all.chain(limit.map(|limit| limit.saturating_sub(taken))).min().unwrap_or(u64::MAX)
}

/// The first number behind a name at the start of a line.
fn field(text: &str, name: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

/// What a line of `/proc/self/cgroup`, with all groups above, leaves to the process. Memory that
/// the groups hold for files can be taken from them.
fn of_group(line: &str, root: &Path) -> Option<u64> {
    let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
    let (root, [limit, usage], files) = match controllers {
        "" => (root.to_owned(), ["memory.max", "memory.current"], ["inactive_file", "active_file"]),
        _ if controllers.split(',').any(|name| name == "memory") => (
            root.join("memory"),
            ["memory.limit_in_bytes", "memory.usage_in_bytes"],
            ["total_inactive_file", "total_active_file"],
        ),
        _ => return None,
    };
    let folder = root.join(path.trim_start_matches('/'));
    let groups = folder.ancestors().take_while(|folder| folder.starts_with(&root));
    let left = groups.filter_map(|folder| {
        let text = |name: &str| std::fs::read_to_string(folder.join(name)).ok();
        let number = |name| text(name)?.trim().parse::<u64>().ok();
        let (limit, usage) = (number(limit)?, number(usage)?);
        let stat = text("memory.stat").unwrap_or_default();
        let files: u64 = files.iter().filter_map(|name| field(&stat, &format!("{name} "))).sum();
        Some(limit.saturating_sub(usage.saturating_sub(files)))
    });
    left.min()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIB: u64 = 1 << 20;

    #[test]
    fn the_least_of_machine_process_and_groups_counts() {
        let folder = tempfile::tempdir().unwrap();
        let (proc, cgroup) = (folder.path().join("proc"), folder.path().join("cgroup"));
        let write = |path: &Path, text: &str| {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let available = || available_by(&proc, &cgroup);
        assert_eq!(available(), u64::MAX);
        write(&proc.join("meminfo"), "MemFree: 1 kB\nMemAvailable:  4194304 kB\nSwapFree: 1024 kB\n");
        assert_eq!(available(), 4097 * MIB);
        write(&proc.join("self/status"), "VmPeak: 9 kB\nVmSize:  102400 kB\n");
        write(&proc.join("self/limits"), "Max address space         unlimited unlimited bytes\n");
        assert_eq!(available(), 4097 * MIB);
        write(&proc.join("self/limits"), "Max address space         1073741824 unlimited bytes\n");
        assert_eq!(available(), 924 * MIB);
        write(&proc.join("self/cgroup"), "1:cpu:/x\n0::/above/own\n");
        write(&cgroup.join("above/own/memory.max"), "max\n");
        write(&cgroup.join("above/memory.max"), &format!("{}\n", 300 * MIB));
        write(&cgroup.join("above/memory.current"), &format!("{}\n", 200 * MIB));
        write(&cgroup.join("above/memory.stat"), &format!("anon 1\ninactive_file {}\n", 50 * MIB));
        assert_eq!(available(), 150 * MIB);
        write(&proc.join("self/cgroup"), "4:memory:/own\n");
        write(&cgroup.join("memory/own/memory.limit_in_bytes"), &format!("{}\n", 100 * MIB));
        write(&cgroup.join("memory/own/memory.usage_in_bytes"), &format!("{}\n", 30 * MIB));
        assert_eq!(available(), 70 * MIB);
    }
}
