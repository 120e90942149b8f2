//! A shared store in an S3-compatible object store.

use crate::Remote;
use object_store::aws::{AmazonS3, AmazonS3Builder};
use object_store::path::Path;
use object_store::{ClientOptions, ObjectStoreExt, RetryConfig};
use std::io::{Error, ErrorKind, Result};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::time::timeout;

/// Time limits of one try and of all tries together: a machine that is offline goes on without the
/// store soon.
const CONNECT: Duration = Duration::from_secs(5);
const TRIES: usize = 2;
const ALL_TRIES: Duration = Duration::from_secs(30);
/// Smallest bytes a second of a transfer: a slower server counts as one that does not answer.
const SLOWEST: u64 = 1 << 20;

/// Time between two looks at whether the user cancelled.
const CANCEL_INTERVAL: Duration = Duration::from_millis(100);

/// A bucket, or part of one.
#[derive(Debug)]
pub struct S3 {
    url: String,
    prefix: Path,
    bucket: AmazonS3,
    runtime: Runtime,
    cancelled: fn() -> bool,
}

impl S3 {
    /// Opens a place such as `s3://bucket/prefix`. The variables `AWS_ACCESS_KEY_ID`,
    /// `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT_URL` and `AWS_ALLOW_HTTP` say how to
    /// reach it. Sends nothing yet. Waits end as soon as `cancelled` returns true.
    ///
    /// # Errors
    /// When `url` is not such a place, or a variable is malformed.
    pub fn open(url: &str, cancelled: fn() -> bool) -> Result<Self> {
        let prefix = url.strip_prefix("s3://").and_then(|rest| rest.split_once('/')).map_or("", |(_, p)| p);
        // The client's own limit is one for a whole transfer of any size.
        let options = ClientOptions::new().with_connect_timeout(CONNECT).with_timeout_disabled();
        let options = options.with_allow_http(allow_http());
        let retry = RetryConfig { max_retries: TRIES, retry_timeout: ALL_TRIES, ..RetryConfig::default() };
        let bucket = AmazonS3Builder::from_env().with_url(url).with_retry(retry).with_client_options(options);
        Ok(Self {
            url: url.to_owned(),
            prefix: Path::parse(prefix).map_err(Error::other)?,
            bucket: bucket.build().map_err(Error::other)?,
            runtime: tokio::runtime::Builder::new_current_thread().enable_all().build()?,
            cancelled,
        })
    }

    /// What the server answers within a time limit.
    ///
    /// # Errors
    /// `TimedOut`, and `Interrupted` when the user cancelled.
    async fn within<T>(&self, limit: Duration, answer: impl Future<Output = T>) -> Result<T> {
        let mut answer = std::pin::pin!(answer);
        let start = Instant::now();
        loop {
            if (self.cancelled)() {
                return Err(Error::new(ErrorKind::Interrupted, "cancelled"));
            }
            let left = limit.saturating_sub(start.elapsed());
            match timeout(left.min(CANCEL_INTERVAL), answer.as_mut()).await {
                Ok(answer) => return Ok(answer),
                Err(elapsed) if left.is_zero() => return Err(elapsed.into()),
                Err(_) => {}
            }
        }
    }

    fn place(&self, name: &str) -> Path {
        name.split('/').fold(self.prefix.clone(), |path, part| path.join(part))
    }
}

impl Remote for S3 {
    fn get(&self, name: &str) -> Result<Option<Vec<u8>>> {
        self.runtime.block_on(async {
            let found = match self.within(ALL_TRIES, self.bucket.get(&self.place(name))).await? {
                Err(object_store::Error::NotFound { .. }) => return Ok(None),
                found => found.map_err(Error::other)?,
            };
            let size = found.meta.size;
            // The client allocates the size that the server claims, and aborts the program if
            // memory runs out.
            let has_memory =
                usize::try_from(size).is_ok_and(|n| Vec::<u8>::new().try_reserve_exact(n).is_ok());
            if !has_memory {
                return Err(Error::new(ErrorKind::OutOfMemory, format!("{name} has {size} bytes")));
            }
            let bytes = self.within(limit(size), found.bytes()).await?;
            bytes.map(|bytes| Some(bytes.into())).map_err(Error::other)
        })
    }

    fn put(&self, name: &str, bytes: &[u8], _over: bool) -> Result<()> {
        // What is there under the name of a content is that content: writing it again changes
        // nothing.
        let place = self.place(name);
        self.runtime.block_on(async {
            let put = self.bucket.put(&place, bytes.to_vec().into());
            self.within(limit(bytes.len() as u64), put).await?.map(|_| ()).map_err(Error::other)
        })
    }

    fn name(&self) -> String {
        self.url.clone()
    }
}

/// Longest time of a transfer.
fn limit(bytes: u64) -> Duration {
    ALL_TRIES + Duration::from_secs(bytes / SLOWEST)
}

/// Options of the client override the environment, so the variable is read here.
fn allow_http() -> bool {
    std::env::var("AWS_ALLOW_HTTP").is_ok_and(|value| value.eq_ignore_ascii_case("true") || value == "1")
}
