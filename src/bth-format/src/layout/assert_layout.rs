//! Constant assertions on the size and the field offsets of every on-disk structure.

/// Fails to compile where a structure is not of the given size or a field does not start at the
/// given byte: `Type size { field offset, ... }`.
macro_rules! assert_layout {
    ($($type:ident $size:literal { $($field:ident $at:literal),* })*) => { $(const _: () = {
        assert!(size_of::<$type>() == $size);
        $(assert!(std::mem::offset_of!($type, $field) == $at);)*
    };)* };
}
pub(super) use assert_layout;
