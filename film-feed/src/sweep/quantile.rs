/// The `share` quantile of values in ascending order, 0…1; NaN when there are none.
///
/// Between two values along a straight line: definition 7 of Hyndman and Fan, *Sample quantiles in statistical packages*, The
/// American Statistician 50 (1996), the one of R, NumPy and spreadsheets.
pub fn quantile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let (low, high) = (ascending[below], ascending[(below + 1).min(last)]);
    low + (place - below as f64) * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_r_type_7() {
        // R 4.3: quantile(c(1, 2, 4, 8, 16), c(0, .05, .5, .9, 1)) gives 1.0 1.2 4.0 12.8 16.0.
        let values = [1.0, 2.0, 4.0, 8.0, 16.0];
        for (share, expected) in [(0.0, 1.0), (0.05, 1.2), (0.5, 4.0), (0.9, 12.8), (1.0, 16.0)] {
            assert!((quantile(&values, share) - expected).abs() < 1e-12, "{share}");
        }
        assert_eq!(quantile(&[3.0], 0.7), 3.0);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
