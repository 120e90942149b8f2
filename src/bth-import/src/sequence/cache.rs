//! A model whose vertices are moved by a vertex cache.

use super::frames::finish;
use super::vertex_cache::VertexCache;
use super::{MISMATCH, Timing, check_times, mdd, pc2};
use crate::error::Result;
use crate::import::{Format, format, read_raw};
use crate::mesh::{Mesh, Report, Wanted};
use crate::monitor::Monitor;
use crate::source::{Source, UNSUPPORTED, read_file};
use std::path::Path;

/// Reads a PC2 or MDD file from its bytes; `name` is for messages. A PC2 file is known by its first bytes.
///
/// # Errors
/// `BTH-I00…` where the file does not follow its format, `BTH-I017` where times do not ascend or a rate is given for MDD;
/// cancellation.
pub fn read_vertex_cache(
    name: &Path,
    data: &[u8],
    timing: &Timing,
    monitor: &dyn Monitor,
) -> Result<VertexCache> {
    let source = Source::new(name, data, monitor);
    source.fetched()?;
    let cache = match data.starts_with(pc2::SIGNATURE) {
        true => pc2::read(&source, timing)?,
        false => mdd::read(&source, timing)?,
    };
    check_times(&source, &cache.times)?;
    if cache.times.is_empty() {
        return Err(source.error(
            MISMATCH,
            "expected at least one frame, found none",
            "export the cache again",
        ));
    }
    Ok(cache)
}

/// Reads a model and the vertex cache (PC2 or MDD) that moves its vertices, which are those of the model's file in their order. The
/// positions in the model's file have no effect.
///
/// # Errors
/// As [`import`](crate::import()) and [`read_vertex_cache`]; `BTH-I017` where the cache has another number of vertices, and
/// `BTH-I006` for a glTF model, whose vertices have no order that is known to programs that write vertex caches.
pub fn import_vertex_cache(
    model: &Path,
    cache: &Path,
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let (model_data, cache_data) = (read_file(model)?, read_file(cache)?);
    import_vertex_cache_bytes((model, &model_data), (cache, &cache_data), timing, wanted, monitor)
}

/// As [`import_vertex_cache`], from the names and the bytes of both files.
///
/// # Errors
/// As [`import_vertex_cache`].
pub fn import_vertex_cache_bytes(
    (model, model_data): (&Path, &[u8]),
    (cache, cache_data): (&Path, &[u8]),
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    monitor.stage("import", Some((model_data.len() + cache_data.len()) as u64));
    let source = Source::new(model, model_data, monitor);
    if format(&source)? == Format::Gltf {
        let message = "expected an OBJ, PLY, STL or OFF file as the model of a vertex cache, found glTF";
        return Err(source.error(
            UNSUPPORTED,
            message,
            "export the model in one of these formats, or bake the animation into glTF",
        ));
    }
    let raw = read_raw(&source, wanted)?;
    source.progress(model_data.len())?;
    let found = read_vertex_cache(cache, cache_data, timing, monitor)?;
    if found.points != raw.positions.len() {
        let message = format!(
            "expected the {} vertices of {}, found {}",
            raw.positions.len(),
            model.display(),
            found.points
        );
        let hint = "export model and cache together, without modifiers that change the number of vertices";
        return Err(Source::new(cache, cache_data, monitor).error(MISMATCH, message, hint));
    }
    let frames = found.positions.chunks(found.points.max(1)).map(<[_]>::to_vec).collect();
    let format = format!("{} and {}", raw.format, found.format);
    finish(raw, (found.times, frames), (format, &|_| cache.to_owned()), wanted, monitor)
}
