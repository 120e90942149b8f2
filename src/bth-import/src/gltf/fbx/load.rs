//! Opens an FBX file within the memory that is left, and tells its errors.

use ufbx::{
    AllocatorOpts, CoordinateAxes, CoordinateAxis, ErrorType, FileFormat, GeometryTransformHandling,
    IndexErrorHandling, InheritModeHandling, LoadOpts, MirrorAxis, Progress, ProgressCb, ProgressResult,
    SceneRoot,
};

use crate::error::{Error, Result};
use crate::source::{INDEX, INDEX_HINT, MALFORMED, Source, TRUNCATED, TRUNCATED_HINT, UNSUPPORTED};

pub(super) const EXPORT: &str = "export the model again, as binary FBX 7.4 or as glTF";
/// The axes of glTF: x to the right, y up, and the viewer at positive z.
const AXES: CoordinateAxes = CoordinateAxes {
    right: CoordinateAxis::PositiveX,
    up: CoordinateAxis::PositiveY,
    front: CoordinateAxis::PositiveZ,
};

/// Opens a file within the memory that is left.
pub(super) fn load(source: &Source<'_>) -> Result<SceneRoot> {
    let progress = |_: &Progress| match source.monitor.check() {
        Ok(()) => ProgressResult::Continue,
        Err(_) => ProgressResult::Cancel,
    };
    let options = LoadOpts {
        temp_allocator: memory(),
        result_allocator: memory(),
        index_error_handling: IndexErrorHandling::AbortLoading,
        clean_skin_weights: true,
        use_blender_pbr_material: true,
        progress_cb: ProgressCb::Ref(&progress),
        geometry_transform_handling: GeometryTransformHandling::HelperNodes,
        inherit_mode_handling: InheritModeHandling::HelperNodes,
        handedness_conversion_axis: MirrorAxis::Z,
        target_axes: AXES,
        target_unit_meters: 1.0,
        target_camera_axes: AXES,
        target_light_axes: AXES,
        file_format: FileFormat::Fbx,
        ..LoadOpts::default()
    };
    let scene = ufbx::load_memory(source.data, options).map_err(|e| error(source, &e))?;
    if scene.metadata.ascii && depth(source.data) > 0 {
        let message = "expected as many closing braces as opening ones, found the end of the file";
        return Err(source.error_at_byte(TRUNCATED, source.data.len(), message, TRUNCATED_HINT));
    }
    Ok(scene)
}

/// How many braces of a text are open at its end. The library takes them for closed.
fn depth(text: &[u8]) -> i64 {
    let (mut depth, mut quoted, mut comment) = (0, false, false);
    for byte in text {
        match byte {
            b'\n' => comment = false,
            _ if comment => {}
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b';' => comment = true,
            b'{' => depth += 1,
            b'}' => depth -= 1,
            _ => {}
        }
    }
    depth
}

/// Limits of memory: what is left now.
pub(super) fn memory() -> AllocatorOpts {
    let memory_limit = usize::try_from(bth_format::memory::available()).unwrap_or(usize::MAX);
    AllocatorOpts { memory_limit, ..AllocatorOpts::default() }
}

/// The error of the library as ours.
pub(super) fn error(source: &Source<'_>, e: &ufbx::Error) -> Error {
    let info = e.info();
    let (about, of) = if info.is_empty() { ("", "") } else { (": ", info) };
    let message = format!("expected a whole FBX file, found: {}{about}{of}", e.description);
    let (code, hint) = match e.type_ {
        ErrorType::Cancelled => return Error::Cancelled,
        ErrorType::OutOfMemory | ErrorType::MemoryLimit | ErrorType::AllocationLimit => {
            let message = format!("{}: reading it takes more memory than is left", source.path.display());
            return Error::Limit { code: "BTH-L034", message };
        }
        ErrorType::TruncatedFile | ErrorType::EmptyFile => (TRUNCATED, TRUNCATED_HINT),
        ErrorType::UnsupportedVersion => (UNSUPPORTED, EXPORT),
        ErrorType::BadIndex => (INDEX, INDEX_HINT),
        _ => (MALFORMED, EXPORT),
    };
    source.error(code, message, hint)
}
