//! Errors of calls: each belongs to a device and to the thread that made the call.

use crate::abi::ErrorCode;

/// Why a call failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    pub(crate) code: ErrorCode,
    pub(crate) message: String,
}

pub(crate) type Result<T> = std::result::Result<T, Failure>;

/// An argument that cannot be used.
pub(crate) fn argument<T>(message: impl Into<String>) -> Result<T> {
    Err(Failure { code: ErrorCode::InvalidArgument, message: message.into() })
}

/// A call that is not allowed as things are.
pub(crate) fn operation<T>(message: impl Into<String>) -> Result<T> {
    Err(Failure { code: ErrorCode::InvalidOperation, message: message.into() })
}

/// What neither bth nor another library answers.
pub(crate) fn unsupported<T>(what: &str) -> Result<T> {
    let hint = "bth does not hold it, and no Embree 4 was found that does (see BTH_EMBREE_FALLBACK)";
    Err(Failure { code: ErrorCode::Unknown, message: format!("{what} is not supported: {hint}") })
}

impl From<bth_compile::Error> for Failure {
    fn from(error: bth_compile::Error) -> Failure {
        let code = match &error {
            bth_compile::Error::Cancelled => ErrorCode::Cancelled,
            bth_compile::Error::Limit { .. } => ErrorCode::OutOfMemory,
            _ => ErrorCode::Unknown,
        };
        Failure { code, message: error.to_string() }
    }
}

impl From<bth::Error> for Failure {
    fn from(error: bth::Error) -> Failure {
        Failure { code: ErrorCode::Unknown, message: error.to_string() }
    }
}
