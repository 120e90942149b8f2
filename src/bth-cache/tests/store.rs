//! What the store guarantees: damage is detected, the size limit holds, entries in use are kept,
//! and a failing shared store does no harm.
#![allow(clippy::print_stdout)]

use bth_cache::{Digest, Folder, Key, Record, Store};
use serde_json::json;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

const LARGE: u64 = 1 << 30;

fn key(name: &str) -> Key {
    Key::new("test").with("name", name)
}

fn content(name: &str, bytes: usize) -> Vec<u8> {
    (0..bytes).map(|i| (i * 31 % 253) as u8 ^ name.as_bytes()[i % name.len()]).collect()
}

fn put(store: &Store, name: &str, bytes: usize) -> Record {
    store.put(&key(name), &content(name, bytes), json!({ "name": name })).unwrap()
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

/// Writes over an entry as a failing disk would.
fn overwrite(path: &Path, bytes: &[u8]) {
    std::fs::remove_file(path).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// Sets the time at which the store considers a content last used.
fn set_used(store: &Store, record: &Record, seconds_ago: u64) {
    let time = SystemTime::now() - Duration::from_secs(seconds_ago);
    File::open(store.path(record)).unwrap().set_modified(time).unwrap();
}

#[test]
fn what_is_put_is_found_again_with_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let record = put(&Store::open(folder.path(), LARGE).unwrap(), "a", 1000);
    let store = Store::open(folder.path(), LARGE).unwrap();
    assert_eq!(store.find(&key("a")).as_ref(), Some(&record));
    assert_eq!(store.read(&record), Some(content("a", 1000)));
    assert_eq!(record.report, json!({"name": "a"}));
    assert_eq!(store.find(&key("b")), None);
    assert!(std::fs::metadata(store.path(&record)).unwrap().permissions().readonly());
}

#[test]
fn every_flipped_byte_of_every_entry_is_noticed_removed_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let record = put(&store, "a", 300);
    let mut flipped = 0;
    for kind in ["v1/keys", "v1/blobs"] {
        let [path] = files(&folder.path().join(kind)).try_into().unwrap();
        let good = std::fs::read(&path).unwrap();
        let mut damaged: Vec<Vec<u8>> = (0..good.len())
            .map(|at| {
                let mut bytes = good.clone();
                bytes[at] ^= 1 << (at % 8);
                bytes
            })
            .collect();
        damaged.extend([good[..good.len() - 1].to_vec(), [&good[..], &[0]].concat(), Vec::new()]);
        for bytes in damaged {
            overwrite(&path, &bytes);
            let served = store.find(&key("a")).and_then(|record| store.read(&record));
            assert_eq!(served, None);
            assert!(!path.exists(), "it was removed");
            assert!(store.take_notes()[0].contains("damaged"));
            // Built again, it is as before.
            assert_eq!(put(&store, "a", 300), record);
            assert_eq!(store.find(&key("a")).and_then(|r| store.read(&r)), Some(content("a", 300)));
            flipped += 1;
        }
    }
    assert_eq!(store.statistics().damaged, flipped);
}

#[test]
fn damage_is_noticed_before_a_content_is_mapped_and_by_verification() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let records = ["a", "b", "c"].map(|name| put(&store, name, 5000));
    let damage = |record: &Record| {
        let mut bytes = std::fs::read(store.path(record)).unwrap();
        bytes[4321] ^= 4;
        overwrite(&store.path(record), &bytes);
    };
    damage(&records[0]);
    assert!(store.pin(&records[0]).is_none());
    assert!(store.pin(&records[1]).is_some());
    let read_as = |record: &Record| {
        let read = |path: &Path| std::fs::read(path).ok();
        store.read_as(record, read, |bytes| Some(bytes.to_vec()), |bytes| bytes.as_slice())
    };
    assert_eq!(read_as(&records[1]), Some(content("b", 5000)));
    damage(&records[1]);
    assert_eq!(read_as(&records[1]), None);
    assert!(!store.holds(&records[1]), "it is removed");
    damage(&records[2]);
    let leftover = folder.path().join("v1/blobs/.killed.1-0.bth-part");
    std::fs::write(&leftover, b"half").unwrap();
    let verdict = store.verify(&|_| true);
    assert_eq!((verdict.damaged.len(), verdict.leftovers), (1, 1));
    assert!(!leftover.exists() && !store.holds(&records[2]));
    assert!(store.verify(&|_| true).damaged.is_empty());
}

#[test]
fn a_content_that_is_put_takes_the_place_of_a_damaged_one() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let record = put(&store, "a", 500);
    // A record is lost, and its content changed without another length.
    let [path] = files(&folder.path().join("v1/keys")).try_into().unwrap();
    std::fs::remove_file(path).unwrap();
    overwrite(&store.path(&record), &content("b", 500));
    assert_eq!(put(&store, "a", 500), record);
    assert_eq!(std::fs::read(store.path(&record)).unwrap(), content("a", 500));
    assert!(store.take_notes()[0].contains("damaged"));
}

#[cfg(unix)]
#[test]
fn a_folder_in_the_place_of_an_entry_is_told_and_not_taken_for_one() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let record = put(&store, "a", 1000);
    let path = store.path(&record);
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    assert!(store.read(&record).is_none() && store.pin(&record).is_none() && !store.holds(&record));
    let error = store.put(&key("a"), &content("a", 1000), json!(null)).unwrap_err();
    assert!(error.to_string().contains("is in the way"), "{error}");
    let found = store.verify(&|_| true);
    assert_eq!(found.not_removed.len(), 1, "{found:?}");
    assert_eq!((store.evict(0).not_removed, store.clear().not_removed), (1, 1));
    assert!(path.is_dir(), "what is no entry is not removed");
}

#[test]
fn verification_tells_what_it_cannot_read_or_remove() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let records = ["a", "b"].map(|name| put(&store, name, 500));
    overwrite(&store.path(&records[0]), &content("b", 500));
    let mode = |path: &Path, mode: u32| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    };
    let kept = store.path(&records[0]).parent().unwrap().to_owned();
    mode(&kept, 0o555);
    mode(&store.path(&records[1]), 0);
    if std::fs::read(store.path(&records[1])).is_ok() {
        println!("skipped: rights do not count for this user");
        mode(&kept, 0o755);
        return;
    }
    let verdict = store.verify(&|_| true);
    assert!(verdict.damaged.is_empty() && !verdict.is_clean());
    let mut told = verdict.not_removed;
    told.sort_by_key(|text| text.contains("cannot be read"));
    assert!(told[0].contains("cannot be removed") && told[1].contains("cannot be read"), "{told:?}");
    mode(&kept, 0o755);
    assert_eq!(store.verify(&|_| true).damaged.len(), 1);
}

#[test]
fn what_was_used_longest_ago_goes_first_and_never_what_is_in_use() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let names = ["a", "b", "c", "d", "e"];
    let records = names.map(|name| put(&store, name, 10_000));
    for (i, record) in records.iter().enumerate() {
        set_used(&store, record, 1000 - 100 * i as u64);
    }
    // The oldest is mapped by another process, the second oldest is read.
    let other = Store::open(folder.path(), LARGE).unwrap();
    let pin = other.pin(&records[0]).unwrap();
    set_used(&store, &records[0], 1000);
    assert!(store.read(&records[1]).is_some());
    let evicted = store.evict(35_000);
    assert_eq!((evicted.entries, evicted.in_use), (2, 1));
    assert!(evicted.left_bytes <= 35_000);
    let left = records.each_ref().map(|record| store.holds(record));
    assert_eq!(left, [true, true, false, false, true]);
    assert_eq!(store.find(&key("c")), None, "the record goes with its content");
    drop(pin);
    assert_eq!(store.evict(0).entries, 3);
    let statistics = store.statistics();
    assert_eq!((statistics.evictions, statistics.evicted_bytes), (5, 50_000));
}

#[test]
fn the_size_is_kept_without_being_asked() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 50_000).unwrap();
    for i in 0..40 {
        put(&store, &format!("{i}"), 5_000);
    }
    let bytes: u64 = files(&folder.path().join("v1/blobs")).iter().map(|p| p.metadata().unwrap().len()).sum();
    assert!((30_000..=50_000).contains(&bytes), "{bytes}");
}

#[test]
fn names_without_contents_go_with_contents_of_their_age() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let record =
        store.put_name(&key("scene"), Digest::of(b"put together from others"), 24, json!(null)).unwrap();
    put(&store, "a", 1000);
    assert!(!store.holds(&record) && store.read(&record).is_none());
    store.evict(LARGE);
    assert!(store.find(&key("scene")).is_some(), "as long as there is room");
    store.evict(0);
    assert!(store.find(&key("scene")).is_none());
}

#[test]
fn a_miss_names_the_component_that_differs_from_the_last_time() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), LARGE).unwrap();
    let of = |quality: &str, source: &str| {
        Key::new("bvh").with("quality", quality).with("source", Digest::of(source.as_bytes()).hex())
    };
    assert_eq!(store.count_miss(&of("fast", "1"), "model.ply"), ["new"]);
    store.note_last(&of("fast", "1"), "model.ply");
    assert_eq!(store.count_miss(&of("best", "1"), "model.ply"), ["quality: fast -> best"]);
    assert_eq!(store.count_miss(&of("fast", "2"), "model.ply"), ["source"]);
    assert_eq!(store.count_miss(&of("fast", "1"), "model.ply"), ["evicted"]);
    assert_eq!(store.count_miss(&of("fast", "1"), "other.ply"), ["new"]);
    let misses = &store.statistics().misses["bvh"];
    let expected = [("evicted", 1), ("new", 2), ("quality", 1), ("source", 1)];
    assert!(misses.iter().map(|(name, n)| (name.as_str(), *n)).eq(expected), "{misses:?}");
    for path in files(folder.path()) {
        let text = std::fs::read(&path).unwrap();
        assert!(!String::from_utf8_lossy(&text).contains(".ply"), "no path is kept: {}", path.display());
    }
}

#[test]
fn a_shared_folder_is_read_through_with_a_local_copy() {
    let (shared, one, two) =
        (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let open = |local: &Path| {
        let remote = Box::new(Folder(shared.path().to_owned()));
        Store::open(local, LARGE).unwrap().with_remote(remote)
    };
    let record = put(&open(one.path()), "a", 2000);
    let store = open(two.path());
    assert_eq!(store.find(&key("a")).as_ref(), Some(&record));
    assert_eq!(store.read(&record), Some(content("a", 2000)));
    assert_eq!(store.statistics().shared_hits, 1);
    // The copy serves without the shared folder, and a pinned one is fetched as well.
    let alone = Store::open(two.path(), LARGE).unwrap();
    assert_eq!(alone.find(&key("a")).and_then(|r| alone.read(&r)), Some(content("a", 2000)));
    let three = tempfile::tempdir().unwrap();
    assert!(open(three.path()).pin(&record).is_some());

    // Damage there is not taken over.
    let [blob] = files(&shared.path().join("blobs")).try_into().unwrap();
    overwrite(&blob, &content("b", 2000));
    let four = tempfile::tempdir().unwrap();
    let store = open(four.path());
    assert_eq!(store.read(&record), None);
    assert!(store.take_notes()[0].contains("shared store"));
    assert!(files(&four.path().join("v1/blobs")).is_empty());

    // What is made in its place is put there, too, so that the next machine finds it.
    assert_eq!(put(&store, "a", 2000), record);
    assert_eq!(std::fs::read(&blob).unwrap(), content("a", 2000));
    let five = tempfile::tempdir().unwrap();
    assert_eq!(open(five.path()).read(&record), Some(content("a", 2000)));
}

#[test]
fn a_shared_folder_that_goes_away_is_gone_on_without() {
    let (shared, local) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let gone = shared.path().join("gone");
    let store = Store::open(local.path(), LARGE).unwrap().with_remote(Box::new(Folder(gone)));
    assert_eq!(store.find(&key("a")), None);
    let notes = store.take_notes();
    assert!(notes.len() == 1 && notes[0].contains("going on without"), "{notes:?}");
    let record = put(&store, "a", 100);
    assert_eq!(store.read(&record), Some(content("a", 100)));
    assert!(store.take_notes().is_empty(), "said once");
}
