//! Names in a section of text.

use crate::limits::MAX_NAME;

/// The name of `length` bytes from `first` on; `None` when it does not lie within the text or is not UTF-8, which the checks rule
/// out (BTH-F144, BTH-F148, BTH-F153).
pub(crate) fn name(text: &[u8], first: u32, length: u32) -> Option<&str> {
    let end = (first as usize).checked_add(length as usize)?;
    std::str::from_utf8(text.get(first as usize..end)?).ok()
}

/// Whether the bytes from `first` on are a name of an allowed length.
pub(crate) fn is_name(text: &[u8], first: u32, length: u32) -> bool {
    length <= MAX_NAME && name(text, first, length).is_some()
}
