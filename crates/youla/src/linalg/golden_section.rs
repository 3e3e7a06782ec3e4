//! The least value of a function of one variable.

/// The least value of a function with one minimum in a range, and where, to within `width`, by golden section.
///
/// # Errors
/// Those of the function.
pub(crate) fn golden_section<E>(
    [mut low, mut high]: [f64; 2],
    width: f64,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<(f64, f64), E> {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut x, mut y) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_x, mut at_y) = (f(x)?, f(y)?);
    while high - low > width {
        if at_x < at_y {
            (high, y, at_y) = (y, x, at_x);
            x = high - ratio * (high - low);
            at_x = f(x)?;
        } else {
            (low, x, at_x) = (x, y, at_y);
            y = low + ratio * (high - low);
            at_y = f(y)?;
        }
    }
    Ok(if at_x < at_y { (at_x, x) } else { (at_y, y) })
}
