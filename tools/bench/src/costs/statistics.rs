//! How well predictions follow measurements.

use crate::rounds::median;

/// Spearman's rank correlation; equal values share their mean rank. `None` for fewer than three pairs.
pub(super) fn rank_correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    if pairs.len() < 3 {
        return None;
    }
    let ranks = |value: fn(&(f64, f64)) -> f64| {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by(|a, b| value(&pairs[*a]).total_cmp(&value(&pairs[*b])));
        let mut ranks = vec![0.0; pairs.len()];
        let mut first = 0;
        while first < order.len() {
            let same = |i: &usize| value(&pairs[*i]) == value(&pairs[order[first]]);
            let end = first + order[first..].iter().take_while(|i| same(i)).count();
            order[first..end].iter().for_each(|i| ranks[*i] = (first + end - 1) as f64 / 2.0);
            first = end;
        }
        ranks
    };
    let (a, b) = (ranks(|p| p.0), ranks(|p| p.1));
    let middle = (pairs.len() - 1) as f64 / 2.0;
    let sum = |f: &dyn Fn(usize) -> f64| (0..pairs.len()).map(f).sum::<f64>();
    let both = sum(&|i| (a[i] - middle) * (b[i] - middle));
    let own = |r: &[f64]| sum(&|i| (r[i] - middle).powi(2));
    let spread = (own(&a) * own(&b)).sqrt();
    (spread > 0.0).then(|| both / spread)
}

/// Median of |predicted - measured| / measured over (predicted, measured).
pub(super) fn median_error(pairs: &[(f64, f64)]) -> Option<f64> {
    median(pairs.iter().map(|(predicted, measured)| (predicted - measured).abs() / measured).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_follow_order_and_not_size() {
        let rising: Vec<(f64, f64)> = (1..9).map(|i| (f64::from(i), f64::from(i * i * i))).collect();
        assert!((rank_correlation(&rising).unwrap() - 1.0).abs() < 1e-12);
        let falling: Vec<(f64, f64)> = rising.iter().map(|(a, b)| (*a, -b)).collect();
        assert!((rank_correlation(&falling).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&[(1.0, 1.0), (1.0, 2.0), (1.0, 3.0)]), None);
        // By hand: ranks 0.5 0.5 2 against 0 1 2.
        let tied = rank_correlation(&[(1.0, 1.0), (1.0, 2.0), (5.0, 3.0)]).unwrap();
        assert!((tied - 1.5 / (1.5f64 * 2.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn errors_are_relative_to_what_was_measured() {
        assert_eq!(median_error(&[(11.0, 10.0), (8.0, 10.0), (10.0, 10.0)]), Some(0.1));
    }
}
