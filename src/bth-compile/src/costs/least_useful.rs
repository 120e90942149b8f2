//! What to leave out when too much is taken.

/// What a chosen node saves and what it takes of a limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weighed {
    /// Saving, in any unit.
    pub gain: f64,
    /// Bytes or seconds, more than zero.
    pub takes: f64,
}

/// The rows to leave out for `over` less to be taken: those of least gain for what they take, but none without which
/// the others are enough. Ascending; all of them when all take less than `over`.
pub fn least_useful(items: &[Weighed], over: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    let worth = |k: &usize| items[*k].gain / items[*k].takes;
    order.sort_by(|a, b| worth(a).total_cmp(&worth(b)));
    let (mut out, mut freed) = (Vec::new(), 0.0);
    for k in order {
        if freed >= over {
            break;
        }
        freed += items[k].takes;
        out.push(k);
    }
    // The best of them may come back if the others are enough.
    for place in (0..out.len()).rev() {
        let takes = items[out[place]].takes;
        if freed - takes >= over {
            freed -= takes;
            out.remove(place);
        }
    }
    out.sort_unstable();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_little_is_left_out_as_is_enough_and_the_worst_first() {
        let items =
            [(9.0, 1.0), (1.0, 1.0), (8.0, 4.0), (3.0, 3.0)].map(|(gain, takes)| Weighed { gain, takes });
        let out = |over: f64| least_useful(&items, over);
        assert_eq!(out(-1.0), [] as [usize; 0]);
        assert_eq!(out(0.0), [] as [usize; 0]);
        assert_eq!(out(1.0), [1]);
        assert_eq!(out(2.0), [3]);
        assert_eq!(out(4.0), [1, 3]);
        assert_eq!(out(8.5), [0, 1, 2, 3]);
        assert_eq!(out(99.0), [0, 1, 2, 3]);
    }
}
