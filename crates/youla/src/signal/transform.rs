//! Discrete Fourier transforms of real signals, two at a time.

use faer::c64;

/// At place k, `2 scale` times the transforms of a and of b, from that of `a + i b`.
///
/// ```text
/// Z = F(a + i b):     F(a) = (Z(k) + conj Z(-k)) / 2,     F(b) = (Z(k) - conj Z(-k)) / 2i
/// ```
pub(crate) fn of_two_real(both: &[c64], k: usize, scale: f64) -> [c64; 2] {
    let (ahead, back) = (both[k], both[(both.len() - k) % both.len()].conj());
    [(ahead + back) * scale, (ahead - back) * c64::new(0.0, -scale)]
}
