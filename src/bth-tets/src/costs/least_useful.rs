//! Selects the nodes to drop when a limit is exceeded.

/// The gain of a chosen node and its share of a limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weighed {
    /// Saving, in any unit.
    pub gain: f64,
    /// Bytes or seconds, more than zero.
    pub takes: f64,
}

/// The rows to drop so that at least `over` bytes or seconds are freed: the rows of min gain per
/// unit, without any row that the others make unnecessary. Ascending; all rows if together they
/// take less than `over`.
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
    // The rows of max gain stay if the others free enough.
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
