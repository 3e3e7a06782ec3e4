//! What a computed channel makes of an expression along the record: a slope, or a difference equation.

/// Widest slope, samples to either side. Chosen, not measured.
const WIDEST: usize = 10_000;

/// What is done with the values of the expression, along the record.
pub(super) enum Dynamics {
    None,
    /// Samples to either side.
    Slope(usize),
    /// Numerator and denominator in ascending powers of z^-1.
    Filter(Vec<f64>, Vec<f64>),
}

impl Dynamics {
    pub(super) fn along(&self, of_row: Vec<f64>, ts: f64) -> Vec<f64> {
        match self {
            Dynamics::None => of_row,
            Dynamics::Slope(n) => slope(&of_row, *n, ts),
            Dynamics::Filter(numerator, denominator) => filtered(&of_row, numerator, denominator),
        }
    }
}

/// The expression in a text, and what is done with it; what is wrong, in words.
pub(super) fn dynamics_of(text: &str) -> Result<(&str, Dynamics), String> {
    match (call(text, "slope"), call(text, "filter")) {
        (Some(arguments), _) => slope_of(arguments).ok_or_else(|| {
            format!("a slope is a channel of its own, \"slope(expression, n)\" with 1 to {WIDEST} samples to either side")
        }),
        (_, Some(arguments)) => filter_of(arguments).ok_or_else(|| {
            "a filter is a channel of its own, \"filter(expression, [b0, b1], [a0, a1])\" with coefficients in ascending powers of \
             z^-1, the first of the denominator not zero"
                .to_owned()
        }),
        _ => Ok((text.trim(), Dynamics::None)),
    }
}

/// What follows `name(` in a text.
fn call<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.trim().strip_prefix(name)?.trim_start().strip_prefix('(')
}

/// `expression, n)`.
fn slope_of(arguments: &str) -> Option<(&str, Dynamics)> {
    let (inner, n) = arguments.strip_suffix(')')?.rsplit_once(',')?;
    let n = n.trim().parse::<usize>().ok().filter(|n| (1..=WIDEST).contains(n))?;
    Some((inner, Dynamics::Slope(n)))
}

/// `expression, [b0, b1], [a0, a1])`.
fn filter_of(arguments: &str) -> Option<(&str, Dynamics)> {
    let list = |text: &'_ str| -> Option<(usize, Vec<f64>)> {
        let (before, numbers) = text.trim_end().strip_suffix(']')?.rsplit_once('[')?;
        let numbers: Option<Vec<f64>> = numbers.split(',').map(|x| x.trim().parse().ok()).collect();
        let before = before.trim_end().strip_suffix(',')?;
        Some((before.len(), numbers.filter(|all| all.iter().all(|x| x.is_finite()))?))
    };
    let text = arguments.trim_end().strip_suffix(')')?;
    let (end, denominator) = list(text)?;
    let (inner, numerator) = list(&text[..end])?;
    (denominator[0] != 0.0).then(|| (&text[..inner], Dynamics::Filter(numerator, denominator)))
}

/// `a(z^-1) y = b(z^-1) x`; before the record x has its first value and y the value at which it then rests, or zero where there is none.
fn filtered(x: &[f64], b: &[f64], a: &[f64]) -> Vec<f64> {
    let Some(first) = x.first().copied() else { return Vec::new() };
    let sum = |c: &[f64]| c.iter().sum::<f64>();
    let rests = sum(a).abs() > 1e-9 * a.iter().map(|c| c.abs()).sum::<f64>();
    let (x_before, y_before) = if rests { (first, first * sum(b) / sum(a)) } else { (0.0, 0.0) };
    let mut y: Vec<f64> = Vec::with_capacity(x.len());
    for k in 0..x.len() {
        let past = |values: &[f64], before: f64, i: usize| if i > k { before } else { values[k - i] };
        let driven: f64 = b.iter().enumerate().map(|(i, b)| b * past(x, x_before, i)).sum();
        let own: f64 = a.iter().enumerate().skip(1).map(|(i, a)| a * past(&y, y_before, i)).sum();
        y.push((driven - own) / a[0]);
    }
    y
}

/// The central difference, with fewer samples at both ends.
fn slope(x: &[f64], n: usize, ts: f64) -> Vec<f64> {
    let last = x.len().saturating_sub(1);
    let at = |k: usize| {
        let (from, to) = (k.saturating_sub(n), (k + n).min(last));
        if to > from { (x[to] - x[from]) / ((to - from) as f64 * ts) } else { 0.0 }
    };
    (0..x.len()).map(at).collect()
}
