//! Interleaved rounds: what is compared is measured in turn, so that other work of the machine
//! affects all alike.

/// Runs each measurement once per round, in turn, after a round that warms up and is not kept.
/// Returns the median of each; `measure` returns `None` if a measurement does not apply.
pub(crate) fn medians<T>(
    items: &[T],
    rounds: usize,
    measure: impl FnMut(usize, &T) -> Option<f64>,
) -> Vec<Option<f64>> {
    interleaved(items, rounds, measure).into_iter().map(median).collect()
}

/// Returns the smallest of each instead, as other work of the machine can only add to a time; else
/// like [`medians`].
pub(crate) fn least<T>(
    items: &[T],
    rounds: usize,
    measure: impl FnMut(usize, &T) -> Option<f64>,
) -> Vec<Option<f64>> {
    let least = |values: Vec<f64>| values.into_iter().min_by(f64::total_cmp);
    interleaved(items, rounds, measure).into_iter().map(least).collect()
}

fn interleaved<T>(
    items: &[T],
    rounds: usize,
    mut measure: impl FnMut(usize, &T) -> Option<f64>,
) -> Vec<Vec<f64>> {
    let mut taken = vec![Vec::with_capacity(rounds); items.len()];
    for round in 0..=rounds {
        for (item, taken) in items.iter().zip(&mut taken) {
            if let Some(value) = measure(round, item).filter(|_| round > 0) {
                taken.push(value);
            }
        }
    }
    taken
}

/// The median, between the middle two of an even number.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().checked_sub(1)? / 2, values.len() / 2);
    Some((values[low] + values[high]) / 2.0)
}

/// Lower quartile, median and upper quartile, by linear interpolation; NaN if there are no values.
pub(crate) fn quartiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| {
        let at = share * values.len().saturating_sub(1) as f64;
        let (low, part) = (at.floor() as usize, at.fract());
        match (values.get(low), values.get(low + 1)) {
            (Some(a), Some(b)) => a + (b - a) * part,
            (Some(a), None) => *a,
            (None, _) => f64::NAN,
        }
    })
}

/// The geometric mean of positive values.
pub(crate) fn geometric_mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.into_iter().fold((0.0, 0), |(sum, n), value| (sum + value.ln(), n + 1));
    (count > 0).then(|| (sum / f64::from(count)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_round_does_not_count_and_rounds_are_interleaved() {
        let mut order = Vec::new();
        let times = medians(&['a', 'b'], 2, |round, name| {
            order.push(format!("{round}{name}"));
            Some(if round == 0 { 100.0 } else { round as f64 })
        });
        assert_eq!(times, [Some(1.5), Some(1.5)]);
        assert_eq!(order, ["0a", "0b", "1a", "1b", "2a", "2b"]);
    }

    #[test]
    fn medians_and_means() {
        assert_eq!((median(vec![]), median(vec![4.0, 1.0, 2.0, 3.0])), (None, Some(2.5)));
        assert_eq!(quartiles(vec![5.0, 1.0, 2.0, 3.0, 4.0]), [2.0, 3.0, 4.0]);
        assert!((geometric_mean([1.0, 4.0]).unwrap() - 2.0).abs() < 1e-12);
    }
}
