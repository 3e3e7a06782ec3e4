//! The step of time stamps, whatever the rounding of the stamps.

/// Steps between the time stamps of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampSteps {
    /// Median step, which a gap or a repeated stamp does not move.
    pub median: f64,
    /// Mean of the steps near the median, as the shortest decimal number within the rounding of the stamps.
    pub mean: f64,
    /// A step that differs from the mean by more is irregular: the tolerance, or what rounding of an even clock makes of a step.
    pub slack: f64,
}

impl StampSteps {
    /// The steps of time stamps; `tolerance` is a part of a step. `None` for less than two stamps.
    ///
    /// Stamps with d decimals that lie on an even clock have steps of two neighbouring multiples of `q = 10^-d`, no more. This is taken for
    /// rounding where `q` is at most a quarter of a step and no stamp leaves the even clock by more than it.
    ///
    /// ```
    /// let stamp = |k: u32| 1764352842.0 + (f64::from(k) / 3.0).round() / 1e3; // 3 kHz, in milliseconds
    /// let of = |every: u32| youla::signal::StampSteps::of(&(0..3001).map(|k| stamp(every * k)).collect::<Vec<_>>(), 1e-3).unwrap();
    /// assert!((of(20).mean - 20.0 / 3e3).abs() < 1e-6 && of(20).slack > 9e-4); // 150 Hz: steps of 6 and 7 ms
    /// assert_eq!((of(30).mean, of(30).slack < 2e-5), (0.01, true)); // 100 Hz: steps of 10 ms
    /// ```
    pub fn of(times: &[f64], tolerance: f64) -> Option<Self> {
        let (first, last) = (*times.first()?, *times.last()?);
        let mut steps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        if steps.is_empty() {
            return None;
        }
        let middle = steps.len() / 2;
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let spacing = f64::EPSILON * times.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
        let digit = digit(times, spacing);
        let digit = if digit <= 0.25 * median { digit } else { 0.0 };
        let near = |dt: f64| (dt - median).abs() <= (tolerance * median).max(digit + spacing);
        let (others, count) =
            steps.iter().fold((0.0, 0), |(sum, n), &dt| if near(dt) { (sum, n + 1) } else { (sum + dt, n) });
        let (length, count) = if count > 0 { (last - first - others, count) } else { (last - first, steps.len()) };
        let mean = shortest(length / count as f64, 2.0 * spacing / count as f64);
        let (mut from_even, mut wander, mut range) = (0.0, [0.0_f64; 2], [median; 2]);
        let wider = |of: [f64; 2], x: f64| [of[0].min(x), of[1].max(x)];
        for dt in times.windows(2).map(|w| w[1] - w[0]) {
            from_even = if near(dt) { from_even + dt - mean } else { 0.0 };
            wander = wider(wander, from_even);
            range = if near(dt) { wider(range, dt) } else { range };
        }
        let even = range[1] - range[0] <= digit + 2.0 * spacing && wander[1] - wander[0] <= 2.0 * (digit + spacing);
        Some(StampSteps { median, mean, slack: (tolerance * mean).max(if even { digit } else { 0.0 } + spacing) })
    }
}

/// One in the last decimal that the stamps have.
fn digit(times: &[f64], spacing: f64) -> f64 {
    let has = |digit: &f64| times.iter().all(|t| (t - (t / digit).round() * digit).abs() <= spacing);
    (0..17).map(|d| 10f64.powi(-d)).find(has).unwrap_or(0.0)
}

/// The shortest decimal number within `rounding` of `mean`.
fn shortest(mean: f64, rounding: f64) -> f64 {
    let rounding = rounding.max(f64::EPSILON * mean.abs());
    let rounded = (0..17).filter_map(|digits| format!("{mean:.digits$e}").parse::<f64>().ok());
    rounded.into_iter().find(|r| (r - mean).abs() <= rounding).unwrap_or(mean)
}
