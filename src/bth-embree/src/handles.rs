//! Handles: objects with a count of references, as programs hold them.
#![allow(unsafe_code)] // Programs pass pointers.

use crate::abi::Handle;
use crate::error::{Result, argument};
use std::mem::ManuallyDrop;
use std::ops::Deref;
use std::sync::Arc;

/// The first word of each object of a kind. Objects of another library begin with a pointer, which
/// is never one of these odd numbers.
pub(crate) trait Tagged {
    const TAG: u64;
}

/// An object that programs hold handles of.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Shared<T> {
    tag: u64,
    value: T,
}

impl<T> Deref for Shared<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

/// A handle that a program borrows to a call: its count stays as it is.
pub(crate) struct Borrowed<T>(ManuallyDrop<Arc<Shared<T>>>);

impl<T> Deref for Borrowed<T> {
    type Target = Arc<Shared<T>>;
    fn deref(&self) -> &Arc<Shared<T>> {
        &self.0
    }
}

impl<T: Tagged> Shared<T> {
    /// An object with one reference.
    pub(crate) fn new(value: T) -> Arc<Shared<T>> {
        Arc::new(Shared { tag: T::TAG, value })
    }
}

/// Gives a program a handle that counts as one reference.
pub(crate) fn give<T>(object: Arc<Shared<T>>) -> Handle {
    Arc::into_raw(object).cast_mut().cast()
}

/// The address by which programs know an object, without a reference.
pub(crate) fn address<T>(object: &Arc<Shared<T>>) -> Handle {
    Arc::as_ptr(object).cast_mut().cast()
}

/// Returns true if a handle is one of ours, of a kind.
///
/// # Safety
/// It is null or points to an object of ours, or of a library whose objects begin with a word.
#[inline(always)]
pub(crate) unsafe fn is_ours<T: Tagged>(handle: Handle) -> bool {
    // SAFETY: it is not null, so by contract a word can be read.
    !handle.is_null() && unsafe { handle.cast::<u64>().read() } == T::TAG
}

/// The object of a handle for the fast path of rays, which check nothing else.
///
/// # Safety
/// It is a handle that was given out and not released, of this kind.
#[inline(always)]
pub(crate) unsafe fn object<'a, T>(handle: Handle) -> &'a Shared<T> {
    // SAFETY: by contract it comes from `give`, so it points to the object, which lives.
    unsafe { &*handle.cast::<Shared<T>>() }
}

/// The object of a handle.
///
/// # Errors
/// If the handle is null or of another kind.
///
/// # Safety
/// As for [`is_ours`]; it is not released during the call.
pub(crate) unsafe fn borrow<T: Tagged>(handle: Handle) -> Result<Borrowed<T>> {
    // SAFETY: the contract is the same.
    if !unsafe { is_ours::<T>(handle) } {
        return argument("invalid argument: expected a handle of this library, found null or another");
    }
    // SAFETY: it has the tag, so it comes from `give`. The count is not changed, since the `Arc` is
    // never dropped.
    Ok(Borrowed(ManuallyDrop::new(unsafe { Arc::from_raw(handle.cast::<Shared<T>>()) })))
}

/// Adds a reference.
///
/// # Safety
/// The contract of [`borrow`].
pub(crate) unsafe fn retain<T: Tagged>(handle: Handle) -> Result<()> {
    // SAFETY: the contract is the same.
    let object = unsafe { borrow::<T>(handle)? };
    std::mem::forget(Arc::clone(&object));
    Ok(())
}

/// Removes a reference.
///
/// # Safety
/// The contract of [`borrow`]; the caller owns a reference.
pub(crate) unsafe fn release<T: Tagged>(handle: Handle) -> Result<()> {
    // SAFETY: the contract is the same.
    let object = unsafe { borrow::<T>(handle)? };
    drop(ManuallyDrop::into_inner(object.0));
    Ok(())
}
