//! `bthc cache`: shows and maintains the cache.

use crate::args::cache::{Cache, CacheCommand};
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Table, bytes, count};
use bth_cache::{Digest, Inventory, Store};
use bth_compile::Monitor;
use serde_json::{Value, json};

pub(crate) fn run(args: &Cache) -> Result<(), Failure> {
    let Some(store) = args.location.existing_store()? else {
        let message = "there is no folder for the cache".to_owned();
        return Err(Failure::Usage { message, hint: "name one with --cache-dir or BTH_CACHE_DIR" });
    };
    let mut not_removed = 0;
    let (value, text) = match &args.command {
        CacheCommand::Stats => {
            let inventory = store.inventory();
            (json!(inventory), stats(&inventory))
        }
        CacheCommand::List { stage } => list(&store, stage.as_deref()),
        CacheCommand::Gc => {
            let evicted = store.evict(store.cap());
            not_removed = evicted.not_removed;
            let text = format!(
                "removed {} contents ({}), {} left by killed programs; {} left, {} in use\n",
                count(evicted.entries),
                bytes(evicted.bytes),
                count(evicted.leftovers),
                bytes(evicted.left_bytes),
                count(evicted.in_use)
            );
            (json!(evicted), text)
        }
        CacheCommand::Verify => return verify(&store, args.json),
        CacheCommand::Path { key } => path(&store, key.as_deref())?,
        CacheCommand::Clear => {
            let cleared = store.clear();
            not_removed = cleared.not_removed;
            let text =
                format!("removed {} contents; {} in use\n", count(cleared.removed), count(cleared.in_use));
            (json!(cleared), text)
        }
    };
    if args.json {
        output::json(&value)?;
    } else {
        output::text(&text)?;
    }
    if not_removed > 0 {
        output::error(&format!(
            "{} contents cannot be removed from {}; who may write to their folders can",
            count(not_removed),
            store.folder().display()
        ));
        return Err(Failure::Reported(4));
    }
    Ok(())
}

fn stats(inventory: &Inventory) -> String {
    let mut table = Table::default();
    let statistics = &inventory.statistics;
    table.row(["folder", &inventory.folder]);
    table.row(["size", &format!("{} of {}", bytes(inventory.bytes), bytes(inventory.cap))]);
    table.row(["contents", &count(inventory.contents)]);
    for (stage, records) in &inventory.records {
        table.row([&format!("entries of {stage}"), &count(*records)]);
    }
    for (stage, hits) in &statistics.hits {
        table.row([&format!("hits of {stage}"), &count(*hits)]);
    }
    for (stage, reasons) in &statistics.misses {
        for (reason, misses) in reasons {
            table.row([&format!("misses of {stage}, {reason}"), &count(*misses)]);
        }
    }
    table.count("hits of the shared cache", statistics.shared_hits);
    let written = [
        ("written", statistics.stored, statistics.stored_bytes),
        ("evicted", statistics.evictions, statistics.evicted_bytes),
    ];
    for (name, n, size) in written.into_iter().filter(|(_, n, _)| *n > 0) {
        table.row([name, &format!("{} ({})", count(n), bytes(size))]);
    }
    table.count("damaged", statistics.damaged);
    table.render()
}

fn list(store: &Store, stage: Option<&str>) -> (Value, String) {
    let entries: Vec<_> =
        store.list().into_iter().filter(|e| stage.is_none_or(|stage| e.stage == stage)).collect();
    let mut table = Table::default();
    for entry in &entries {
        let used = entry.idle_seconds.map_or("not kept".to_owned(), |s| format!("{} s ago", count(s)));
        table.row([&format!("{:<15} {}", entry.stage, entry.id.hex()), &bytes(entry.bytes), &used]);
    }
    (json!({ "entries": entries }), table.render())
}

fn verify(store: &Store, as_json: bool) -> Result<(), Failure> {
    let progress = Progress::new(as_json);
    progress.stage("verify", Some(store.inventory().bytes));
    let verdict = store.verify(&|bytes| {
        progress.advance(bytes);
        !progress.cancelled()
    });
    let cancelled = progress.cancelled();
    drop(progress);
    if cancelled {
        return Err(bth_compile::Error::Cancelled.into());
    }
    if as_json {
        output::json(&verdict)?;
    } else {
        let mut text: String =
            verdict.damaged.iter().map(|path| format!("damaged, removed: {path}\n")).collect();
        text.extend(verdict.not_removed.iter().map(|entry| format!("damaged: {entry}\n")));
        text.push_str(&format!(
            "{} records, {} contents, {}: {} damaged\n",
            count(verdict.records),
            count(verdict.contents),
            bytes(verdict.bytes),
            count((verdict.damaged.len() + verdict.not_removed.len()) as u64)
        ));
        output::text(&text)?;
    }
    if verdict.is_clean() { Ok(()) } else { Err(Failure::Check) }
}

fn path(store: &Store, key: Option<&str>) -> Result<(Value, String), Failure> {
    let Some(key) = key else {
        let folder = store.folder().display().to_string();
        return Ok((json!({ "folder": folder }), folder + "\n"));
    };
    let record = Digest::parse(key).and_then(|id| store.find_id(&id)).filter(|record| store.holds(record));
    let Some(record) = record else {
        let message = format!("the cache has no entry {key}");
        return Err(Failure::Usage { message, hint: "`bthc cache list` shows what it has" });
    };
    let path = store.path(&record).display().to_string();
    Ok((json!({ "path": path, "stage": record.key.stage() }), path + "\n"))
}
