//! What queries have in common: arrays of what is asked, and arrays for the answers.

use crate::{ERROR_INTERNAL, OK, code_of, fail, null_argument};
use runtime::{Error, Scene};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Number of answers that are converted together.
pub(crate) const CHUNK: usize = 1024;

/// The arguments of a query.
///
/// `scene` is null or open. `asked` and `answers` are each null or point to `count` elements. All
/// bit patterns are valid for their types. The elements of `answers` are valid for writes and do
/// not overlap the others. Nobody else uses any of them during the call.
pub(crate) struct Arguments<Q, A> {
    pub(crate) scene: *const Scene,
    pub(crate) asked: *const Q,
    pub(crate) answers: *mut A,
    pub(crate) count: usize,
}

impl<Q, A: Copy> Arguments<Q, A> {
    /// The arguments as a scene and slices. `Err` is the result of the query if nothing is asked or
    /// a pointer is null.
    ///
    /// # Safety
    /// The arguments are as in [`Arguments`] for as long as the result lives.
    unsafe fn slices<'a>(self) -> Result<(&'a Scene, &'a [Q], &'a mut [A]), i32> {
        let Arguments { scene, asked, answers, count } = self;
        if count == 0 {
            return Err(OK);
        }
        if scene.is_null() || asked.is_null() || answers.is_null() {
            return Err(null_argument());
        }
        // SAFETY: the pointers are not null, so by contract `scene` is an open scene and the others
        // point to `count` elements, and the elements of `answers` are valid for writes and overlap
        // nothing.
        unsafe {
            let answers = std::slice::from_raw_parts_mut(answers, count);
            Ok((&*scene, std::slice::from_raw_parts(asked, count), answers))
        }
    }

    /// Stores the answers of a query; returns its code. After a panic they are all `none`.
    ///
    /// # Safety
    /// The arguments are as in [`Arguments`].
    #[inline(always)]
    pub(crate) unsafe fn store(self, none: A, query: impl FnOnce(&Scene, &[Q], &mut [A])) -> i32 {
        // SAFETY: the contract is the same.
        match unsafe { self.slices() } {
            Ok((scene, asked, answers)) => guarded(|| query(scene, asked, answers)).unwrap_or_else(|code| {
                answers.fill(none);
                code
            }),
            Err(code) => code,
        }
    }

    /// Stores the answers of a query that have another type in C; returns its code. After a panic
    /// the answers of a chunk are all `none`.
    ///
    /// # Safety
    /// The arguments are as in [`Arguments`].
    pub(crate) unsafe fn store_as<T: Copy>(
        self,
        none: T,
        mut query: impl FnMut(&Scene, &[Q], &mut [T]),
        in_c: impl Fn(T) -> A,
    ) -> i32 {
        // SAFETY: the contract is the same.
        let (scene, asked, answers) = match unsafe { self.slices() } {
            Ok(slices) => slices,
            Err(code) => return code,
        };
        let (mut buffer, mut code) = ([none; CHUNK], OK);
        for (asked, answers) in asked.chunks(CHUNK).zip(answers.chunks_mut(CHUNK)) {
            let found = &mut buffer[..asked.len()];
            if let Err(failed) = guarded(|| query(scene, asked, found)) {
                code = failed;
                found.fill(none);
            }
            answers.iter_mut().zip(found).for_each(|(answer, found)| *answer = in_c(*found));
        }
        code
    }
}

/// Defines functions of C that answer a query: of a scene, what is asked, further parameters, where
/// the answers go, and the number of what is asked.
macro_rules! queries {
    ($($(#[$doc:meta])* fn $name:ident($asked:ty $(, $more:ident: $type:ty)*) -> $answer:ty = |$arguments:ident| $call:expr;)+) => { $(
        $(#[$doc])*
        ///
        /// # Safety
        /// The arguments are as in `Arguments`. Other pointers, and those in structs, are null or
        /// valid as `bth.h` says.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            scene: *const runtime::Scene,
            asked: *const $asked,
            $($more: $type,)*
            answers: *mut $answer,
            count: usize,
        ) -> i32 {
            let $arguments = crate::query::Arguments { scene, asked, answers, count };
            // SAFETY: the contract is the same.
            unsafe { $call }
        }
    )+ };
}
pub(crate) use queries;

/// Runs a query. A panic must not unwind into C: it would be a defect of the library, and becomes a
/// code.
#[inline(always)]
pub(crate) fn guarded(query: impl FnOnce()) -> Result<i32, i32> {
    catch_unwind(AssertUnwindSafe(query)).map_or_else(|_| Err(defect()), |()| Ok(OK))
}

/// Calls a function that may fail. Its error or panic becomes a code. `name` is the name of the C
/// function, for error messages.
pub(crate) fn attempt<T>(name: &str, call: impl FnOnce() -> Result<T, Error>) -> Result<T, i32> {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(fail(code_of(&error), format!("{name}: {error}"))),
        Err(_) => Err(fail(ERROR_INTERNAL, format!("{name}: internal error"))),
    }
}

/// The result of a query that panicked.
#[cold]
pub(crate) fn defect() -> i32 {
    fail(ERROR_INTERNAL, "internal error of a query".into())
}
