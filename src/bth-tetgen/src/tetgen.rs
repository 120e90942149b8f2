//! TetGen through `shim.cpp`.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_int, c_void};

use bth_tetgen_protocol::{Failure, Job, Tetrahedra};

/// TetGen's version, as its header names it.
pub(crate) const VERSION: &str = env!("BTH_TETGEN_VERSION");

/// `bth_result` of the shim.
#[repr(C)]
struct Output {
    owner: *mut c_void,
    points: *const [f64; 3],
    point_count: usize,
    tets: *const [c_int; 4],
    tet_count: usize,
    text: [c_char; 160],
}

unsafe extern "C" {
    fn bth_tetgen_run(
        switches: *const c_char,
        points: *const f64,
        point_count: usize,
        triangles: *const u32,
        triangle_count: usize,
        quads: *const u32,
        quad_count: usize,
        result: *mut Output,
    ) -> c_int;
    fn bth_tetgen_free(result: *mut Output);
}

/// Frees TetGen's lists on every path.
struct Owned(Output);

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: `bth_tetgen_run` initialized the structure; `owner` is null or TetGen's object,
        // which nothing else frees.
        unsafe { bth_tetgen_free(&mut self.0) };
    }
}

/// Tetrahedralizes; facets name points that exist (the protocol checks that).
///
/// # Errors
/// Why TetGen failed, and its text. A crash within TetGen ends the process instead.
pub(crate) fn tetrahedralize(job: &Job) -> Result<Tetrahedra, (Failure, String)> {
    let switches = CString::new(job.switches.as_str())
        .map_err(|_| (Failure::Request, "NUL within the switches".into()))?;
    if switches.as_bytes().len() > 250 {
        return Err((Failure::Request, "switches of more than 250 characters".into()));
    }
    let mut owned = Owned(Output {
        owner: std::ptr::null_mut(),
        points: std::ptr::null(),
        point_count: 0,
        tets: std::ptr::null(),
        tet_count: 0,
        text: [0; 160],
    });
    // SAFETY: every pointer is valid for the count passed with it for the whole call, the switches
    // end with NUL, the result is writable and has the shim's layout; the shim catches every
    // exception.
    let code = unsafe {
        bth_tetgen_run(
            switches.as_ptr(),
            job.points.as_ptr().cast(),
            job.points.len(),
            job.triangles.as_ptr().cast(),
            job.triangles.len(),
            job.quads.as_ptr().cast(),
            job.quads.len(),
            &mut owned.0,
        )
    };
    let output = &owned.0;
    if code != 0 {
        // SAFETY: the shim zeroes the array and writes at most all but its last byte.
        let text = unsafe { CStr::from_ptr(output.text.as_ptr()) }.to_string_lossy().into_owned();
        let failure = match code {
            1 => Failure::Memory,
            2 => Failure::Internal,
            3 => Failure::Intersection,
            4 | 5 => Failure::TooSmall,
            10 => Failure::Input,
            _ => Failure::Other,
        };
        return Err((failure, format!("{text} (code {code})")));
    }
    // SAFETY: on success both lists are TetGen's own arrays of these lengths, alive until `owned`
    // drops.
    let (points, tets) = unsafe {
        (
            std::slice::from_raw_parts(output.points, output.point_count),
            std::slice::from_raw_parts(output.tets, output.tet_count),
        )
    };
    let inside = |i: c_int| usize::try_from(i).is_ok_and(|i| i < points.len());
    if !tets.as_flattened().iter().all(|&i| inside(i)) {
        return Err((Failure::Internal, "a tetrahedron names a point that is not there".into()));
    }
    Ok(Tetrahedra { points: points.to_vec(), tets: tets.iter().map(|t| t.map(|i| i as u32)).collect() })
}

#[cfg(test)]
mod tests {
    #[test]
    fn files_that_tetgen_would_write_go_nowhere() {
        let path = std::env::temp_dir().join(format!("bth-tetgen-{}", std::process::id()));
        let name = std::ffi::CString::new(path.as_os_str().as_encoded_bytes()).unwrap();
        // SAFETY: both strings end with NUL and the file is not used after it was closed.
        let written = unsafe {
            let file = libc::fopen(name.as_ptr(), c"w".as_ptr());
            assert!(!file.is_null());
            assert!(libc::fputs(c"text".as_ptr(), file) >= 0);
            libc::fclose(file) == 0
        };
        assert!(written && !path.exists());
    }
}
