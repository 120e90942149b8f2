//! A shared cache in a real S3-compatible server. `tools/s3/run` starts one and sets its address;
//! without it there is nothing to test.
#![allow(clippy::print_stdout)]

use bth_cache::{Digest, Key, Remote, S3, Store};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const LARGE: u64 = 1 << 30;

/// A new store with the server as its shared cache. Without a server prints that, and returns
/// `None`.
fn store(folder: &tempfile::TempDir) -> Option<(Store, String)> {
    let Ok(url) = std::env::var("BTH_TEST_S3") else {
        println!("skipped: BTH_TEST_S3 names no bucket (tools/s3/run does)");
        return None;
    };
    let store =
        Store::open(folder.path(), LARGE).unwrap().with_remote(Box::new(S3::open(&url, || false).unwrap()));
    Some((store, url))
}

fn key(name: &str) -> Key {
    Key::new("test").with("name", name)
}

#[test]
fn what_one_machine_makes_another_finds() {
    let (here, there) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let Some((one, url)) = store(&here) else { return };
    let content: Vec<u8> = (0..3_000_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    assert_eq!(one.find(&key("a")), None);
    let record = one.put(&key("a"), &content, serde_json::json!({"nodes": 3})).unwrap();
    assert_eq!(one.take_notes(), [""; 0]);

    let (two, _) = store(&there).unwrap();
    assert_eq!(two.find(&key("a")), Some(record.clone()));
    assert!(two.read(&record).as_deref() == Some(&content[..]));
    assert_eq!(two.statistics().shared_hits, 1);
    // The local copy suffices without the server.
    let alone = Store::open(there.path(), LARGE).unwrap();
    assert!(alone.find(&key("a")).and_then(|r| alone.read(&r)).as_deref() == Some(&content[..]));

    // Damaged entries of the server are not copied.
    let s3 = S3::open(&url, || false).unwrap();
    let hex = record.blob.hex();
    s3.put(&format!("blobs/{}/{hex}", &hex[..2]), b"something else", true).unwrap();
    let third = tempfile::tempdir().unwrap();
    let (three, _) = store(&third).unwrap();
    assert_eq!(three.find(&key("a")).and_then(|r| three.read(&r)), None);
    assert!(three.take_notes()[0].contains("shared store"));
}

#[test]
fn a_server_that_cannot_be_reached_is_gone_on_without() {
    let folder = tempfile::tempdir().unwrap();
    if store(&folder).is_none() {
        return;
    }
    // The bucket does not exist, which must be handled like a server that cannot be reached.
    let gone = S3::open("s3://no-such-bucket/x", || false).unwrap();
    let local = tempfile::tempdir().unwrap();
    let store = Store::open(local.path(), LARGE).unwrap().with_remote(Box::new(gone));
    let start = Instant::now();
    let record = store.put(&key("b"), b"content", serde_json::Value::Null).unwrap();
    let notes = store.take_notes();
    assert!(notes.len() == 1 && notes[0].contains("going on without"), "{notes:?}");
    assert!(start.elapsed().as_secs() < 40);
    assert_eq!(store.read(&record).map(|bytes| Digest::of(&bytes)), Some(record.blob));
}

/// Runs itself again in a process whose server accepts connections and says nothing.
#[test]
fn a_server_that_hangs_is_not_waited_for_when_the_user_cancels() {
    const VARIABLE: &str = "BTH_TEST_HANGING_S3";
    static CANCELLED: AtomicBool = AtomicBool::new(false);
    if std::env::var_os(VARIABLE).is_some() {
        let local = tempfile::tempdir().unwrap();
        let s3 = S3::open("s3://bucket/x", || CANCELLED.load(Ordering::Relaxed)).unwrap();
        let store = Store::open(local.path(), LARGE).unwrap().with_remote(Box::new(s3));
        std::thread::spawn(|| {
            std::thread::sleep(Duration::from_millis(300));
            CANCELLED.store(true, Ordering::Relaxed);
        });
        let start = Instant::now();
        assert_eq!(store.find(&key("a")), None);
        assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
        return assert_eq!(store.take_notes(), [""; 0]);
    }
    let server = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let mut again = std::process::Command::new(std::env::current_exe().unwrap());
    again.args(["--exact", "a_server_that_hangs_is_not_waited_for_when_the_user_cancels"]).env(VARIABLE, "1");
    again.env("AWS_ENDPOINT_URL", format!("http://{}", server.local_addr().unwrap()));
    again.envs([("AWS_ALLOW_HTTP", "true"), ("AWS_REGION", "us-east-1")]);
    again.envs([("AWS_ACCESS_KEY_ID", "test"), ("AWS_SECRET_ACCESS_KEY", "test")]);
    let done = again.output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stdout));
}
