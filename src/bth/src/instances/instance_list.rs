//! What lists of instances have in common with keys of the stack.

/// The least key of a list. Negative depths, which rounding makes of zero, would not be sorted, and keys near zero would be denormal, since
/// their lowest bits are overwritten. It is still a lower bound for the comparison with a limit, to which [`key_limit`] adds as much.
pub(super) const LEAST_KEY: f32 = f32::MIN_POSITIVE;
