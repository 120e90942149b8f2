//! Options of the cache, and the commands that maintain it.

use super::common::{CACHE, EXIT_CODES};
use crate::failure::Failure;
use bth_cache::{DEFAULT_CAP, Store, parse_bytes};
use clap::{Args as Group, Subcommand};
use std::path::{Path, PathBuf};

/// Which folder is the cache, and how large it may be.
#[derive(Clone, Debug, Group)]
pub(crate) struct CacheLocation {
    /// Folder of the cache; by default BTH_CACHE_DIR, else `bth` in the user's folder for caches.
    #[arg(long, help_heading = CACHE, global = true, value_name = "FOLDER")]
    pub(crate) cache_dir: Option<PathBuf>,
    /// Bytes to keep, such as 20GiB; beyond it, what was used longest ago goes. By default
    /// BTH_CACHE_SIZE, else 20GiB.
    #[arg(long, help_heading = CACHE, global = true, value_name = "BYTES", value_parser = parse_bytes)]
    pub(crate) cache_size: Option<u64>,
}

/// Where results are kept, if at all.
#[derive(Clone, Debug, Group)]
pub(crate) struct Keeping {
    #[command(flatten)]
    pub(crate) location: CacheLocation,
    /// A folder that machines share, or with the feature s3 a place such as s3://bucket/prefix:
    /// what the cache lacks is looked for there, what is made is put there too. By default
    /// BTH_SHARED_CACHE.
    #[arg(long, help_heading = CACHE, value_name = "PLACE")]
    pub(crate) shared_cache: Option<String>,
    /// Neither look into the cache nor keep anything; so does setting BTH_NO_CACHE, unless
    /// --cache-dir is given.
    #[arg(long, help_heading = CACHE, conflicts_with_all = ["cache_dir", "shared_cache", "in_cache"])]
    pub(crate) no_cache: bool,
    /// Keep the compiled file in the cache only; --json says where, and which files were read. For
    /// programs that map it there.
    #[arg(long, help_heading = CACHE, conflicts_with_all = ["output", "depfile"])]
    pub(crate) in_cache: bool,
}

/// Look after the cache of compiled models.
#[derive(Debug, Group)]
#[command(after_help = EXIT_CODES)]
pub(crate) struct Cache {
    #[command(subcommand)]
    pub(crate) command: CacheCommand,
    #[command(flatten)]
    pub(crate) location: CacheLocation,
    /// Print one JSON object.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

#[derive(Clone, Debug, Subcommand)]
pub(crate) enum CacheCommand {
    /// Hits, misses and why, evictions, bytes.
    Stats,
    /// All entries, by stage and time of use.
    List {
        /// Only this stage.
        #[arg(long, value_parser = ["mesh", "bvh", "free-directions", "marks", "tets", "part", "object", "file", "scene"])]
        stage: Option<String>,
    },
    /// Remove what was used longest ago until the size is kept, and what killed processes left.
    Gc,
    /// Read all entries; remove and report those that are damaged (exit code 1).
    Verify,
    /// Print the folder, or the file of an entry.
    Path {
        /// Key of an entry, as `list` and `compile --json` give it.
        key: Option<String>,
    },
    /// Remove everything that is not in use.
    Clear,
}

impl CacheLocation {
    /// The store; `None` if no folder for it is known.
    ///
    /// # Errors
    /// `BTH-O063` when its folder cannot be used, `BTH-U001` for a wrong size.
    pub(crate) fn store(&self) -> Result<Option<Store>, Failure> {
        self.store_by(Store::open)
    }

    /// As [`CacheLocation::store`], but a folder that the command line names must be a store
    /// already, or empty.
    ///
    /// # Errors
    /// As [`CacheLocation::store`].
    pub(crate) fn existing_store(&self) -> Result<Option<Store>, Failure> {
        self.store_by(match self.cache_dir {
            Some(_) => Store::open_existing,
            None => Store::open,
        })
    }

    fn store_by(&self, open: fn(&Path, u64) -> std::io::Result<Store>) -> Result<Option<Store>, Failure> {
        let Some(folder) = self.cache_dir.clone().or_else(bth_cache::folder) else { return Ok(None) };
        let store = open(&folder, self.size()?);
        store.map(Some).map_err(|e| Failure::file("BTH-O063", &folder, &format!("cannot be the cache: {e}")))
    }

    fn size(&self) -> Result<u64, Failure> {
        let set = std::env::var("BTH_CACHE_SIZE").ok().filter(|text| !text.is_empty());
        match (self.cache_size, set) {
            (Some(size), _) => Ok(size),
            (None, Some(text)) => parse_bytes(&text).map_err(|message| Failure::Usage {
                message: format!("BTH_CACHE_SIZE: {message}"),
                hint: "correct or unset it",
            }),
            (None, None) => Ok(DEFAULT_CAP),
        }
    }
}

impl Keeping {
    /// The store, unless the options exclude it. A default folder that cannot be used is only a
    /// warning.
    ///
    /// # Errors
    /// As [`CacheLocation::store`] for a folder that the options name.
    pub(crate) fn store(&self, warn: &dyn Fn(&str)) -> Result<Option<Store>, Failure> {
        let set = |name: &str| std::env::var(name).ok().filter(|v| !v.is_empty());
        let asked = self.location.cache_dir.is_some() || self.in_cache;
        let is_off = std::env::var_os("BTH_NO_CACHE").is_some_and(|value| !value.is_empty());
        if self.no_cache || !asked && is_off {
            if self.shared_cache.is_some() {
                warn("--shared-cache has no effect, since BTH_NO_CACHE is set and there is no --cache-dir");
            }
            return Ok(None);
        }
        let store = match self.location.store() {
            Err(Failure::Compile(e)) if !asked => {
                warn(&format!("going on without the cache: {e}"));
                return Ok(None);
            }
            store => store?,
        };
        let shared = self.shared_cache.clone().or_else(|| set("BTH_SHARED_CACHE"));
        match (store, shared) {
            (Some(store), Some(shared)) => Ok(Some(store.with_remote(remote(&shared)?))),
            (None, Some(shared)) => {
                // Results go to the shared cache from the one of this machine.
                warn(&format!(
                    "going on without the shared cache {shared}: there is no folder for a cache of this machine; \
                     BTH_CACHE_DIR or --cache-dir names one"
                ));
                Ok(None)
            }
            (store, None) => Ok(store),
        }
    }
}

/// The shared cache of a name: a folder or an address.
fn remote(name: &str) -> Result<Box<dyn bth_cache::Remote>, Failure> {
    #[cfg(feature = "s3")]
    if name.starts_with("s3://") {
        let s3 = bth_cache::S3::open(name, crate::progress::is_cancelled).map_err(|e| Failure::Usage {
            message: format!("{name} cannot be a shared cache: {e}"),
            hint: "the variables AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION and AWS_ENDPOINT_URL say how to reach it",
        })?;
        return Ok(Box::new(s3));
    }
    if name.contains("://") {
        return Err(Failure::Usage {
            message: format!("this bthc knows no shared cache such as {name}"),
            hint: "name a folder, or build bthc with the feature s3",
        });
    }
    Ok(Box::new(bth_cache::Folder(name.into())))
}
