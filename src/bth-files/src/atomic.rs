//! Files that are whole or absent.
//!
//! On Linux the bytes go to a file without a name (`O_TMPFILE`), so a killed program leaves
//! nothing. The finished file gets a hidden name and is renamed over the target at once. Where
//! nameless files are not supported, the bytes go to a hidden file in the target's folder; it is
//! removed on failure. A file left by a killed program is removed by the next write to the same
//! target, which finds it unlocked.

use crate::Digest;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{BufWriter, Error as IoError, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// End of the names of unfinished files.
pub const SUFFIX: &str = ".bth-part";
/// Longest name of a target that its hidden names contain, in bytes. Most file systems take 255
/// bytes, and a hidden name is longer than the target's.
const LONGEST: usize = 200;

/// Writes a file that is whole or absent, replacing one of that name; it is on the disk on return.
///
/// # Errors
/// Errors of the system and of `write`; the target is then as it was.
pub fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let name =
        path.file_name().ok_or_else(|| IoError::new(ErrorKind::InvalidInput, "not the name of a file"))?;
    // Renaming over a device or a folder would not do what is meant.
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        return Err(IoError::new(ErrorKind::InvalidInput, "the target exists and is not a regular file"));
    }
    // Renaming over a link such as /dev/stdout would take it away from all programs.
    if std::fs::read_link(path).is_ok_and(|to| to.starts_with("/proc")) {
        return Err(IoError::new(
            ErrorKind::InvalidInput,
            "the target leads to a file that a program has open",
        ));
    }
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let prefix = prefix_of(name);
    remove_stale(folder, &prefix);

    let (mut file, named) = create(folder, &prefix, 0o666)?;
    let mut out = BufWriter::with_capacity(1 << 20, &mut file);
    write(&mut out)?;
    out.flush()?;
    drop(out);
    file.sync_all()?;
    let named = match named {
        Some(named) => named,
        None => link(&file, folder, &prefix)?,
    };
    // From here to the rename the file has its hidden name; the guard removes it when that fails.
    std::fs::rename(&named.0, path)?;
    std::mem::forget(named);
    // The rename is durable once the folder is; some systems cannot open folders.
    if let Ok(folder) = File::open(folder) {
        folder.sync_all()?;
    }
    Ok(())
}

/// Writes a read-only file that is whole or absent, unless there is one of that name already;
/// whether it was written. It is not flushed to disk and may be lost when the machine stops, so
/// readers must check it. Whoever may write to the folder may read it.
///
/// # Errors
/// Errors of the system.
pub fn write_once(path: &Path, bytes: &[u8]) -> std::io::Result<bool> {
    write_once_by(path, &|out| out.write_all(bytes))
}

/// As [`write_once`], with what `write` writes.
///
/// # Errors
/// Errors of the system and of `write`.
pub fn write_once_by(
    path: &Path,
    write: &dyn Fn(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<bool> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
        return Err(IoError::new(ErrorKind::InvalidInput, "not the name of a file"));
    };
    let (mut file, named) = create(folder, &prefix_of(name), 0o444)?;
    let mut out = BufWriter::with_capacity(1 << 20, &mut file);
    write(&mut out)?;
    out.flush()?;
    drop(out);
    share(&file, folder, 0o4);
    let linked = match &named {
        None => link_to(&file, path),
        Some(named) => match std::fs::hard_link(&named.0, path) {
            Err(e) if e.kind() == ErrorKind::Unsupported => std::fs::rename(&named.0, path),
            linked => linked,
        },
    };
    match linked {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(e) => Err(e),
    }
}

/// A file without a name in a folder, to write to and to read from. It is gone when it is closed.
///
/// # Errors
/// Errors of the system.
pub fn nameless(folder: &Path) -> std::io::Result<File> {
    create(folder, &prefix_of(OsStr::new("bth")), 0o600).map(|(file, _)| file)
}

/// Makes the folders of a path that are missing below `root`. Whoever may write to a folder may
/// write to those that are made in it.
///
/// # Errors
/// Errors of the system.
pub fn create_folders(root: &Path, path: &Path) -> std::io::Result<()> {
    match std::fs::create_dir(path) {
        Ok(()) => {}
        Err(e) if e.kind() == ErrorKind::AlreadyExists && path.is_dir() => return Ok(()),
        Err(e) if e.kind() == ErrorKind::NotFound && path != root => {
            let parent = path.parent().ok_or(e)?;
            create_folders(root, parent)?;
            return create_folders(root, path);
        }
        Err(e) => return Err(e),
    }
    if let (true, Some(parent)) = (path != root, path.parent())
        && let Ok(made) = File::open(path)
    {
        share(&made, parent, 0o7);
    }
    Ok(())
}

/// Gives these permissions to the group and to others where they may write to the folder, whatever
/// the umask: the folder says with whom its content is shared. Folders inherit that they let nobody
/// remove what is another user's.
#[cfg(unix)]
fn share(file: &File, folder: &Path, permissions: u32) {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let (Ok(of_folder), Ok(of_file)) = (std::fs::metadata(folder), file.metadata()) else { return };
    let mut mode = of_file.mode() & 0o7777;
    for class in [3, 0] {
        if of_folder.mode() >> class & 0o2 != 0 {
            mode |= permissions << class;
            mode |= if of_file.is_dir() { of_folder.mode() & 0o1000 } else { 0 };
        }
    }
    // Where the system refuses, others cannot use the file and make their own.
    let _ = file.set_permissions(std::fs::Permissions::from_mode(mode));
}

#[cfg(not(unix))]
fn share(_: &File, _: &Path, _: u32) {}

/// A hidden name that is removed unless it has been renamed.
struct Named(PathBuf);

impl Drop for Named {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Beginning of the hidden names of a target: its name, or the hash of a long one.
fn prefix_of(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    match name.len() > LONGEST {
        true => prefix.push(Digest::of(name.as_encoded_bytes()).hex()),
        false => prefix.push(name),
    }
    prefix.push(".");
    prefix
}

/// A locked file to write to, and its name if it needs one.
fn create(folder: &Path, prefix: &OsString, mode: u32) -> std::io::Result<(File, Option<Named>)> {
    let mut options = std::fs::OpenOptions::new();
    options.read(true).write(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::fs::OpenOptionsExt;
        let nameless = options.clone().custom_flags(libc::O_TMPFILE).open(folder);
        if let Ok(file) = nameless
            // Without /proc it could not get a name.
            && std::fs::metadata(name_in_proc(&file)).is_ok()
        {
            // A file system without locks takes it all the same: nobody can tell there that the
            // hidden name, which it has for an instant, is unlocked.
            let _ = file.try_lock();
            return Ok((file, None));
        }
    }
    unused_name(folder, prefix, |path| {
        let file = options.clone().create_new(true).open(path)?;
        // A file system without locks only loses the removal of what killed programs left.
        let _ = file.try_lock();
        Ok((file, Some(Named(path.to_owned()))))
    })
}

/// Gives a nameless file a hidden name.
fn link(file: &File, folder: &Path, prefix: &OsString) -> std::io::Result<Named> {
    unused_name(folder, prefix, |path| link_to(file, path).map(|()| Named(path.to_owned())))
}

/// Gives a nameless file a name.
#[cfg(target_os = "linux")]
fn link_to(file: &File, path: &Path) -> std::io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    Ok(linkat(CWD, name_in_proc(file).as_str(), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// Where /proc shows an open file.
#[cfg(target_os = "linux")]
fn name_in_proc(file: &File) -> String {
    use std::os::fd::AsRawFd;
    format!("/proc/self/fd/{}", file.as_raw_fd())
}

#[cfg(not(target_os = "linux"))]
fn link_to(_: &File, _: &Path) -> std::io::Result<()> {
    Err(IoError::new(ErrorKind::Unsupported, "nameless files"))
}

/// Tries hidden names until `make` finds one that does not exist.
fn unused_name<T>(
    folder: &Path,
    prefix: &OsString,
    make: impl Fn(&Path) -> std::io::Result<T>,
) -> std::io::Result<T> {
    for attempt in 0..1000 {
        let mut name = prefix.clone();
        name.push(format!("{}-{attempt}{SUFFIX}", std::process::id()));
        match make(&folder.join(name)) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            done => return done,
        }
    }
    Err(IoError::new(ErrorKind::AlreadyExists, "no unused name for the unfinished file"))
}

/// Removes unfinished files of this target that are not locked: the programs that wrote them have
/// ended.
fn remove_stale(folder: &Path, prefix: &OsString) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let (name, prefix) = (name.as_encoded_bytes(), prefix.as_encoded_bytes());
        if name.starts_with(prefix) && name.ends_with(SUFFIX.as_bytes()) {
            let path = entry.path();
            let free = File::open(&path).is_ok_and(|f| f.try_lock().is_ok());
            if free {
                let _ = std::fs::remove_file(path);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    }

    fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
        replace(path, |out| out.write_all(bytes))
    }

    #[test]
    fn written_file_is_whole_and_replaces_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bth");
        write(&path, b"first").unwrap();
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(names(folder.path()), ["a.bth"]);
    }

    #[test]
    fn failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bth");
        write(&path, b"old").unwrap();
        let failed = replace(&path, |out| {
            out.write_all(&[1; 3 << 20])?;
            Err(IoError::other("no more"))
        });
        assert!(failed.unwrap_err().to_string().contains("no more"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.bth"]);
    }

    /// Runs this test again in a process that is killed while it writes.
    #[test]
    fn killed_writer_leaves_the_old_file_and_nothing_else() {
        const VARIABLE: &str = "BTH_TEST_KILLED_WRITER";
        if let Some(path) = std::env::var_os(VARIABLE) {
            let path = PathBuf::from(path);
            let endless = replace(&path, |out| {
                out.write_all(&[1; 3 << 20])?;
                std::fs::write(path.with_extension("started"), b"")?;
                loop {
                    std::thread::sleep(std::time::Duration::from_millis(10));
                }
            });
            return endless.unwrap();
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bth");
        write(&path, b"old").unwrap();
        let test = "atomic::tests::killed_writer_leaves_the_old_file_and_nothing_else";
        let mut writer = std::process::Command::new(std::env::current_exe().unwrap());
        let mut writer = writer.args(["--exact", test]).env(VARIABLE, &path).spawn().unwrap();
        while !path.with_extension("started").exists() {
            assert!(writer.try_wait().unwrap().is_none(), "the writer ended by itself");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        writer.kill().unwrap();
        writer.wait().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        let nameless = create(folder.path(), &OsString::from(".b."), 0o666).unwrap().1.is_none();
        if nameless {
            assert_eq!(names(folder.path()), ["a.bth", "a.started"]);
        }
        write(&path, b"new").unwrap();
        assert_eq!(names(folder.path()), ["a.bth", "a.started"]);
    }

    #[test]
    fn leftovers_of_killed_programs_are_removed_but_not_locked_ones() {
        let folder = tempfile::tempdir().unwrap();
        let stale = folder.path().join(".a.bth.1-0.bth-part");
        let live = folder.path().join(".a.bth.2-0.bth-part");
        let other = folder.path().join(".b.bth.1-0.bth-part");
        for path in [&stale, &live, &other] {
            std::fs::write(path, b"half").unwrap();
        }
        let lock = File::open(&live).unwrap();
        lock.lock().unwrap();
        write(&folder.path().join("a.bth"), b"whole").unwrap();
        assert!(!stale.exists() && live.exists() && other.exists());
    }

    #[test]
    fn hidden_name_is_used_where_nameless_files_are_not_supported() {
        let folder = tempfile::tempdir().unwrap();
        let prefix = OsString::from(".a.bth.");
        let (_, named) = unused_name(folder.path(), &prefix, |path| {
            let file = std::fs::OpenOptions::new().write(true).create_new(true).open(path)?;
            Ok((file, Named(path.to_owned())))
        })
        .unwrap();
        assert!(named.0.exists());
        let path = named.0.clone();
        drop(named);
        assert!(!path.exists());
    }

    #[test]
    fn written_once_means_read_only_and_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        assert!(write_once(&path, b"first").unwrap());
        assert!(!write_once(&path, b"second").unwrap());
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert!(std::fs::metadata(&path).unwrap().permissions().readonly());
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[test]
    fn names_may_be_as_long_as_the_file_system_takes() {
        let folder = tempfile::tempdir().unwrap();
        let name = "n".repeat(251) + ".bth";
        write(&folder.path().join(&name), b"first").unwrap();
        write(&folder.path().join(&name), b"second").unwrap();
        assert!(write_once(&folder.path().join("o".repeat(255)), b"once").unwrap());
        assert_eq!(names(folder.path()), [name.as_str(), "o".repeat(255).as_str()]);
        // What a killed program left of a long name is found, too.
        let mut stale = prefix_of(OsStr::new(&name));
        stale.push(format!("1-0{SUFFIX}"));
        std::fs::write(folder.path().join(&stale), b"half").unwrap();
        write(&folder.path().join(&name), b"third").unwrap();
        assert!(!folder.path().join(&stale).exists());
    }

    #[cfg(unix)]
    #[test]
    fn whoever_may_write_to_a_folder_may_use_what_is_in_it() {
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o7777;
        let set = |path: &Path, mode| {
            std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
        };
        for (of_folder, folders, file) in [
            (0o755, 0, 0),
            (0o700, 0, 0),
            (0o775, 0o070, 0o040),
            (0o777, 0o077, 0o044),
            (0o1777, 0o1077, 0o044),
        ] {
            let temporary = tempfile::tempdir().unwrap();
            let root = temporary.path();
            set(root, of_folder);
            let below = root.join("a").join("b");
            create_folders(root, &below).unwrap();
            create_folders(root, &below).unwrap();
            write_once(&below.join("c"), b"once").unwrap();
            for folder in [below.as_path(), &root.join("a")] {
                assert_eq!(mode(folder) & folders, folders, "{of_folder:o}");
            }
            // What the umask leaves to others anyway is not looked at.
            assert_eq!(mode(&below.join("c")) & file, file, "{of_folder:o}");
            assert_eq!(mode(&below.join("c")) & 0o222, 0);
            assert_eq!(mode(root), of_folder);
        }
        assert!(create_folders(Path::new("/nowhere/a"), Path::new("/nowhere/a/b")).is_err());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn links_to_open_files_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (out, link) = (folder.path().join("out"), folder.path().join("stdout"));
        let file = File::create(&out).unwrap();
        std::os::unix::fs::symlink(name_in_proc(&file), &link).unwrap();
        assert!(write(&link, b"x").is_err());
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(names(folder.path()), ["out", "stdout"]);
    }

    #[test]
    fn folders_and_devices_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        assert!(write(folder.path(), b"x").is_err());
        assert!(write(&folder.path().join("missing").join("a.bth"), b"x").is_err());
        #[cfg(unix)]
        assert!(write(Path::new("/dev/null"), b"x").is_err());
    }
}
