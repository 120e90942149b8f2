//! Fits constants to measurements by linear regression.

/// The coefficients with the smallest sum of squared *relative* errors. Each of `rows` has the
/// terms and the value that their weighted sum should have. `None` if the terms do not determine
/// the coefficients.
pub fn fit<const N: usize>(rows: &[([f64; N], f64)]) -> Option<[f64; N]> {
    let mut system = [[0.0; N]; N];
    let mut right = [0.0; N];
    for (terms, value) in rows {
        let terms = terms.map(|t| t / value);
        for i in 0..N {
            for j in 0..N {
                system[i][j] += terms[i] * terms[j];
            }
            right[i] += terms[i];
        }
    }
    // Gaussian elimination with partial pivoting.
    for i in 0..N {
        let pivot = (i..N).max_by(|a, b| system[*a][i].abs().total_cmp(&system[*b][i].abs()))?;
        system.swap(i, pivot);
        right.swap(i, pivot);
        if system[i][i] == 0.0 {
            return None;
        }
        let (pivot, known) = (system[i], right[i]);
        for (row, value) in system.iter_mut().zip(&mut right).skip(i + 1) {
            let factor = row[i] / pivot[i];
            row.iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
            *value -= factor * known;
        }
    }
    let mut found = [0.0; N];
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|k| system[i][k] * found[k]).sum();
        found[i] = (right[i] - known) / system[i][i];
    }
    found.iter().all(|x| x.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_sums_give_their_coefficients_back() {
        let rows: Vec<([f64; 3], f64)> = (1..20)
            .map(|i| {
                let (a, b) = (f64::from(i), f64::from(i * i % 7));
                ([1.0, a, b], 5.0 + 2.0 * a + 0.5 * b)
            })
            .collect();
        let found = fit(&rows).unwrap();
        assert!(found.iter().zip([5.0, 2.0, 0.5]).all(|(f, e)| (f - e).abs() < 1e-9), "{found:?}");
        assert_eq!(fit(&[([1.0, 2.0], 1.0)]), None);
    }
}
