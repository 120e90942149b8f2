//! Decides by the results so far if packets are worthwhile.

use bth_format::Identity;

/// Exponential back-off of a kind of packets: after a packet that was not worthwhile some groups of
/// rays are not tried as packets, and twice as many after the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketBackoff {
    /// Number of groups of rays still to be skipped.
    skip: u32,
    /// Number of groups that are skipped after the next packet that is not worthwhile.
    back: u32,
}

impl Default for PacketBackoff {
    fn default() -> Self {
        PacketBackoff::new()
    }
}

impl PacketBackoff {
    /// Largest number of skipped groups.
    const MAX_SKIP: u32 = 64;

    pub(crate) fn new() -> PacketBackoff {
        PacketBackoff { skip: 0, back: 4 }
    }

    /// Returns true if the next group of rays may be tried as a packet.
    #[inline(always)]
    pub(crate) fn may_try(&mut self) -> bool {
        let open = self.skip == 0;
        self.skip = self.skip.saturating_sub(1);
        open
    }

    /// Records whether a packet was worthwhile.
    #[inline(always)]
    pub(crate) fn record(&mut self, worthwhile: bool) {
        if worthwhile {
            self.back = (self.back / 2).max(1);
        } else {
            self.skip = self.back;
            self.back = (self.back * 2).min(Self::MAX_SKIP);
        }
    }
}

/// The back-offs of packets of coherent and of short rays.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KindBackoffs {
    pub(crate) coherent: PacketBackoff,
    pub(crate) short: PacketBackoff,
}

/// The back-offs of a thread, kept from one batch to the next: batches of a few hundred rays would
/// otherwise try packets again each time. They belong to one object; each goal of queries has one.
#[derive(Debug, Default)]
pub(crate) struct Backoffs {
    object: Option<Identity>,
    nearest: KindBackoffs,
    any: KindBackoffs,
}

impl Backoffs {
    /// The back-offs for rays through an object; new ones if the last batch went through another
    /// object.
    #[inline(always)]
    pub(crate) fn of(&mut self, object: Identity, is_any: bool) -> &mut KindBackoffs {
        if self.object != Some(object) {
            *self = Backoffs { object: Some(object), ..Backoffs::default() };
        }
        if is_any { &mut self.any } else { &mut self.nearest }
    }
}
