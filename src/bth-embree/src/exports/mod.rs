//! The functions of the interface. Each turns handles and pointers into what the modules of this
//! crate work with, and errors into reports to the device.

pub mod device;
pub mod forwarded;
pub mod geometry;
pub mod rays;
pub mod scene;

use crate::abi::{ErrorCode, Handle};
use crate::device::{Device, report_without_device};
use crate::error::{Failure, Result};
use crate::geometry::Geometry;
use crate::handles::{Shared, Tagged, borrow};
use crate::scene::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Objects that belong to a device, which is told of errors.
pub(crate) trait Reports {
    fn report(&self, failure: &Failure);
}

impl Reports for Device {
    fn report(&self, failure: &Failure) {
        Device::report(self, failure);
    }
}

impl Reports for Scene {
    fn report(&self, failure: &Failure) {
        self.device.report(failure);
    }
}

impl Reports for Geometry {
    fn report(&self, failure: &Failure) {
        self.device.report(failure);
    }
}

impl Reports for crate::buffer::Buffer {
    fn report(&self, failure: &Failure) {
        self.device.report(failure);
    }
}

/// Does the work of a function with the object of its first handle. An error or a panic, which
/// would be a defect, is reported, and the result is the default.
///
/// # Safety
/// The contract of [`borrow`] for the handle.
#[allow(unsafe_code)]
pub(crate) unsafe fn call<K: Tagged + Reports, T: Default>(
    handle: Handle,
    work: impl FnOnce(&Arc<Shared<K>>) -> Result<T>,
) -> T {
    // SAFETY: the contract is the same.
    let object = match unsafe { borrow::<K>(handle) } {
        Ok(object) => object,
        Err(failure) => {
            report_without_device(&failure);
            return T::default();
        }
    };
    catch_unwind(AssertUnwindSafe(|| work(&object))).unwrap_or_else(|_| defect()).unwrap_or_else(|failure| {
        object.report(&failure);
        T::default()
    })
}

/// The error of a call that panicked.
pub(crate) fn defect<T>() -> Result<T> {
    Err(Failure { code: ErrorCode::Unknown, message: "internal error".to_owned() })
}

/// Defines functions of the interface whose first argument is a handle of an object of ours.
macro_rules! exports {
    ($($(#[$doc:meta])* fn $name:ident($object:ident: $kind:ty $(, $argument:ident: $type:ty)*) $(-> $result:ty)? $body:block)+) => { $(
        $(#[$doc])*
        ///
        /// # Safety
        /// Handles are null or live, and pointers are as the documentation of Embree 4 asks.
        #[unsafe(no_mangle)]
        #[allow(non_snake_case)]
        pub unsafe extern "C" fn $name($object: $crate::abi::Handle $(, $argument: $type)*) $(-> $result)? {
            let work = |$object: &std::sync::Arc<$crate::handles::Shared<$kind>>| $body;
            // SAFETY: the contract is the same.
            unsafe { $crate::exports::call::<$kind, _>($object, work) }
        }
    )+ };
}
pub(crate) use exports;
