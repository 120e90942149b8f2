//! The page of `shutter`.

use super::ShutterTimes;
use crate::markdown::{cells, count, table};

/// The tables of all frames.
pub(super) fn markdown(rows: &[ShutterTimes]) -> String {
    let head = cells(&[
        "scene",
        "triangles",
        "open, frames",
        "exact, ms",
        "between, ms",
        "rays, ms",
        "position error",
        "picture of 64 times",
        "of 64 between",
        "of an instant",
    ]);
    let first = |row: &ShutterTimes| [row.name.clone(), count(row.triangles as u64), row.open.to_string()];
    let frames = rows.iter().map(|row| {
        let times = [row.exact_ms, row.linear_ms, row.trace_ms].map(|ms| format!("{ms:.2}"));
        let errors = row.picture_errors.map(|error| format!("{error:.5}"));
        let position = [format!("{:.1e}", row.position_error)];
        first(row).into_iter().chain(times).chain(position).chain(errors).collect()
    });
    let frames = table(&head, &frames.collect::<Vec<Vec<String>>>());
    let head = cells(&[
        "scene",
        "triangles",
        "open, frames",
        "ns",
        "of each ray",
        "nodes",
        "",
        "triangles",
        "",
        "differ",
    ]);
    let per_ray = rows.iter().filter_map(|row| {
        let of = row.per_ray.as_ref()?;
        let numbers = [of.ns, of.nodes, of.triangles].concat().into_iter().map(|x| format!("{x:.2}"));
        Some(first(row).into_iter().chain(numbers).chain([format!("{:.1e}", of.differ)]).collect())
    });
    let per_ray = table(&head, &per_ray.collect::<Vec<Vec<String>>>());
    format!(
        "One thread's CPU clock. `exact`: setting the scene to 64 times within the shutter, positions computed for each; `between`: positions \
         between those at both ends, refitted for each time; `rays`: a camera ray of each pixel at each of the times. Errors of pictures are mean \
         differences, of pixels that are not empty, from pictures of 1,024 times; of positions the greatest, relative to the diagonal of the \
         scene.\n\n{frames}\n\nPlain functions in f32, rays with one of 64 times each: through trees refitted for each time, and through boxes and \
         corners interpolated for each ray.\n\n{per_ray}"
    )
}
