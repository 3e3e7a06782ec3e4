//! Options of an excitation.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The shape of the sequence.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Square waves whose half periods are drawn between those of the two edges of the band.
    Square,
    /// Pseudo-random binary sequence: its clock by the upper edge of the band, its period by the length and the lower edge.
    Prbs,
    /// Sum of sines of equal size on lines within the band, with the phases of Schroeder.
    #[default]
    Multisine,
    /// Sine that sweeps from the lower to the upper edge of the band.
    Chirp,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Shape; 4] = [Shape::Square, Shape::Prbs, Shape::Multisine, Shape::Chirp];
}

/// How long the sequence is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Length {
    /// In seconds, rounded to whole samples.
    Seconds(f64),
    /// In samples.
    Samples(usize),
}

impl Default for Length {
    fn default() -> Self {
        Length::Samples(0)
    }
}

/// How several inputs are excited.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InputOrder {
    /// All at a time, with signals that are independent of each other: multisines on lines of their own, one PRBS shifted by equal
    /// parts of its period, square waves drawn independently. Chirps follow each other all the same.
    #[default]
    Together,
    /// One after the other, each in an equal part of the length.
    OneAtATime,
}

/// Frequency bands without excitation, around multiples of the shaft speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExcitationNotch {
    /// The speed, Hz.
    pub hz: f64,
    /// Width of each band, Hz: from half of it below to half of it above.
    #[serde(default = "usual_width")]
    pub width: f64,
    /// The multiples.
    #[serde(default = "usual_harmonics")]
    pub harmonics: Vec<u32>,
}

fn usual_width() -> f64 {
    4.0
}

fn usual_harmonics() -> Vec<u32> {
    vec![1, 2]
}

impl ExcitationNotch {
    /// Around once and twice a speed in Hz, 4 Hz wide.
    pub fn at(hz: f64) -> Self {
        ExcitationNotch { hz, width: usual_width(), harmonics: usual_harmonics() }
    }

    /// The bands, lowest and highest frequency in Hz.
    pub(crate) fn bands(&self) -> Vec<[f64; 2]> {
        let around = |h: &u32| f64::from(*h) * self.hz;
        self.harmonics.iter().map(around).map(|f| [f - self.width / 2.0, f + self.width / 2.0]).collect()
    }
}

/// Options of an excitation. Amplitude, band and length have no safe default and must be set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExciteOptions {
    /// The shape.
    pub shape: Shape,
    /// Greatest absolute value, in the unit of the input: one for each input, or one for all. 0 leaves an input unexcited.
    pub amplitude: Vec<f64>,
    /// Lowest and highest frequency, Hz.
    pub band: [f64; 2],
    /// Length of the whole sequence.
    pub length: Length,
    /// Seed of everything random; the same seed gives the same sequence.
    pub seed: u64,
    /// Time in seconds in which the amplitude grows linearly at the start, and falls at the end.
    pub ramp: f64,
    /// Bands around the shaft speed without excitation; none when absent.
    pub notch: Option<ExcitationNotch>,
    /// How several inputs are excited.
    pub inputs: InputOrder,
    /// Periods of a multisine or PRBS within the length, or within the part of one input. One period has the densest lines; several periods
    /// separate noise from response. The period of a PRBS is the next longer one that a register has, at least that of the lowest frequency.
    pub periods: usize,
    /// Largest predicted magnitude of each input u, in its unit: one for each, or one for all; none when empty.
    pub limit_input: Vec<f64>,
    /// The same for each output y.
    pub limit_output: Vec<f64>,
    /// Reduces the amplitude of an excitation that exceeds a limit to the largest that keeps it; otherwise it is rejected.
    pub scale_to_limit: bool,
    /// Relative error theta of the nominal model for which the prediction is repeated: all entries of A, or of B, in continuous
    /// time, times `1 - theta` and `1 + theta`.
    pub model_error: f64,
    /// Standard deviation of the white noise of each output, in its unit: one for each, or one for all. Empty: the accuracy of the
    /// modes is not computed.
    pub noise: Vec<f64>,
    /// Required standard deviation of the damping ratios, from which the required length follows; optional.
    pub damping_deviation: Option<f64>,
}

impl Default for ExciteOptions {
    fn default() -> Self {
        ExciteOptions {
            shape: Shape::default(),
            amplitude: Vec::new(),
            band: [0.0, 0.0],
            length: Length::default(),
            seed: 1,
            ramp: 0.0,
            notch: None,
            inputs: InputOrder::default(),
            periods: 1,
            limit_input: Vec::new(),
            limit_output: Vec::new(),
            scale_to_limit: false,
            model_error: 0.1,
            noise: Vec::new(),
            damping_deviation: None,
        }
    }
}

/// Most samples of a sequence.
/// 128 MB for one channel. Chosen, not measured.
const LONGEST: usize = 1 << 24;

impl ExciteOptions {
    /// Number of samples.
    pub(super) fn samples(&self, ts: f64) -> Result<usize> {
        let samples = match self.length {
            Length::Samples(samples) => samples as f64,
            Length::Seconds(seconds) => (seconds / ts).round(),
        };
        let fits = (2.0..=LONGEST as f64).contains(&samples);
        check(
            "the length of the excitation in samples",
            samples,
            fits,
            "from 2 to 2^24; state it in seconds or samples",
        )?;
        Ok(samples as usize)
    }

    /// Checks the options that do not depend on the plant.
    pub(super) fn check(&self, ts: f64) -> Result<()> {
        let [low, high] = self.band;
        check("the lowest frequency of the band in Hz", low, low > 0.0 && low.is_finite(), "positive")?;
        let fits = high > low && high < 0.5 / ts;
        check(
            "the highest frequency of the band in Hz",
            high,
            fits,
            "above the lowest and below half the sample rate",
        )?;
        let periods = self.samples(ts)? as f64 * ts * low;
        let must = "at least 1; make the excitation longer, or raise the lowest frequency of its band";
        check("the length of the excitation in periods of its lowest frequency", periods, periods >= 1.0 - 1e-9, must)?;
        let part = |x: f64| (0.0..1.0).contains(&x);
        check(
            "the relative error of the nominal model",
            self.model_error,
            part(self.model_error),
            "at least 0 and below 1",
        )?;
        check("the number of periods", self.periods as f64, self.periods >= 1, "at least 1")?;
        if let Some(wanted) = self.damping_deviation {
            check(
                "the required standard deviation of the damping (damping_deviation)",
                wanted,
                positive(wanted),
                "positive",
            )?;
            if self.noise.is_empty() {
                let what = "the number of noise levels, which the accuracy of the damping needs,".into();
                return Err(Error::Method(youla::Error::Ports { what, expected: 1, found: 0 }));
            }
        }
        let Some(notch) = &self.notch else { return Ok(()) };
        check("the speed of the notch in Hz", notch.hz, positive(notch.hz), "positive")?;
        check("the width of the notch in Hz", notch.width, positive(notch.width), "positive")
    }
}

/// One value for each channel, from one for each or one for all.
pub(super) fn spread(what: &str, given: &[f64], channels: usize, least: f64) -> Result<Vec<f64>> {
    let all = match given {
        [one] => vec![*one; channels],
        many if many.len() == channels => many.to_vec(),
        many => {
            return Err(Error::Method(youla::Error::Ports {
                what: format!("the number of {what}"),
                expected: channels,
                found: many.len(),
            }));
        }
    };
    match all.iter().find(|x| !(x.is_finite() && **x >= least)) {
        Some(bad) => {
            let must = if least > 0.0 { "finite and positive" } else { "finite and not negative" };
            Err(Error::Method(youla::Error::OutOfRange { what: format!("one of the {what}"), value: *bad, must }))
        }
        None => Ok(all),
    }
}

fn positive(x: f64) -> bool {
    x > 0.0 && x.is_finite()
}

pub(super) fn check(what: &str, value: f64, good: bool, must: &'static str) -> Result<()> {
    if good { Ok(()) } else { Err(Error::Method(youla::Error::OutOfRange { what: what.to_owned(), value, must })) }
}
