//! Known lines in the outputs, `[data.disturbance]`: their cosines and sines, and outputs without them.
//!
//! Identification projects them out of its data and finds their amplitudes. Verification is fair to every model in the same
//! way: measured and predicted outputs are compared after the best lines of each have been taken out,
//! ```text
//! fit(P y, P yp),    P: onto the complement of the lines over the samples that count
//! ```
//! so that no model is blamed for what it cannot predict and none is credited with it. What the model does at exactly these
//! frequencies does not count.

use crate::Result;
use crate::settings::{DisturbanceSettings, TACHO, TachoUnit};
use youla::identify::subspace::{harmonics, lines};
use youla::linalg::least_squares;
use youla::signal::Record;
use youla::{Mat, MatRef};

/// Cosine and sine of each line, samples x 2 per line; `record` as it was read, before anything is taken out of it.
///
/// # Errors
/// A frequency that is not between 0 and that of Nyquist.
pub(crate) fn disturbance_signals(settings: &DisturbanceSettings, record: &Record) -> Result<Mat<f64>> {
    let found = match &settings.tacho {
        None => lines(&settings.frequencies_hz, record.samples(), record.time()),
        Some(_) => {
            let factor = if settings.tacho_unit == Some(TachoUnit::Rpm) { 1.0 / 60.0 } else { 1.0 };
            let speed: Vec<f64> = record.column(TACHO)?.iter().map(|value| factor * value).collect();
            harmonics(&speed, &settings.harmonics, record.time())
        }
    };
    Ok(found.map_err(|e| e.within("[data.disturbance]"))?)
}

/// Outputs without the lines that explain them best, least squares.
pub(crate) fn without_lines(y: MatRef<'_, f64>, w: Option<MatRef<'_, f64>>) -> Result<Mat<f64>> {
    let Some(w) = w else { return Ok(y.to_owned()) };
    let found = least_squares("the lines of [data.disturbance]", w, y)?;
    Ok(y - w * found.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::lti::Discrete;

    fn signals(text: &str, record: &Record) -> Result<Mat<f64>> {
        disturbance_signals(&toml::from_str(text).unwrap(), record)
    }

    /// A constant speed gives the lines of its frequency.
    #[test]
    fn tacho_and_frequencies_agree() {
        let time = Discrete::new(1e-3).unwrap();
        let channels = vec![youla::signal::Channel::new(TACHO, "")];
        let record = Record::new("r", channels, Mat::from_fn(400, 1, |_, _| 2500.0), time).unwrap();
        let by_speed = signals("tacho = 1\ntacho_unit = \"rpm\"\nharmonics = [1, 2]", &record).unwrap();
        let by_frequency = signals("frequencies_hz = [41.666666666666664, 83.33333333333333]", &record).unwrap();
        assert!((&by_speed - &by_frequency).norm_max() < 1e-10);
        let rest = without_lines(by_frequency.as_ref(), Some(by_speed.as_ref())).unwrap();
        assert!(rest.norm_max() < 1e-10);
        assert!(signals("frequencies_hz = [600.0]", &record).is_err());
    }
}
