//! What the numbers of a controller may mean beside what is stated. A log that contradicts the stated controller may agree with one of these.

use super::controller::{ControllerSettings, Hold};
use super::models::Polynomials;
use super::pid::{IdealPid, LoopGain, ParallelPid};
use std::f64::consts::TAU;
use std::path::Path;
use youla::lti::{Discrete, StateSpace};
use youla_loop::check::{GainPart, Reading};
use youla_loop::redesign::structured::Discretisation;

/// The true sample time over the stated one, where times were written in another unit.
const CLOCKS: [(f64, &str); 3] = [
    (1e-3, "the time of the log is in milliseconds"),
    (1e-6, "the time of the log is in microseconds"),
    (1e3, "the stated one is a thousandth of it"),
];

/// Delays of a PID that are tried, samples.
const LONGEST_DELAY: usize = 3;

impl ControllerSettings {
    /// Other controllers with the same numbers, positive feedback.
    pub(crate) fn readings(
        &self,
        time: Discrete,
        nominal: Option<&StateSpace<Discrete>>,
        folder: &Path,
    ) -> Vec<Reading> {
        let of = |settings: &ControllerSettings, ts: f64| {
            let read = settings.realise(Discrete::new(ts).ok()?, nominal, folder).ok()?;
            let k = read.system();
            let [a, b, c, d] = [k.a(), k.b(), k.c(), k.d()].map(|m| m.to_owned());
            StateSpace::new(a, b, c, d, time).ok()
        };
        let of_form = |(words, settings): (String, ControllerSettings)| {
            Some(Reading { words, controller: of(&settings, time.ts())? })
        };
        let mut all: Vec<Reading> = self.forms().into_iter().filter_map(of_form).collect();
        if self.depends_on_time() {
            let ts = time.ts();
            let rate = (1.0 / (ts * ts), "the sample rate was stated as the sample time");
            for (factor, why) in CLOCKS.into_iter().chain([rate]) {
                let words = format!("a sample time of {} s: {why}", ts * factor);
                all.extend(of(self, ts * factor).map(|controller| Reading { words, controller }));
            }
        }
        all
    }

    /// The parts of a PID with a gain of one each, positive feedback.
    pub(crate) fn gain_parts(&self, time: Discrete, folder: &Path) -> Vec<GainPart> {
        // A wrong kp of the ideal form is a factor on the whole.
        let (pid, keys, first) = match self {
            Self::Pid(pid) => (pid.clone(), ["kp", "ki", "kd"], 0),
            Self::IdealPid(pid) => (pid.parallel(), ["", "ti", "td"], 1),
            _ => return Vec::new(),
        };
        let loops = pid.loops();
        let of = |(gain, place): (usize, usize)| {
            let unit = |k: usize| {
                let of = |loops: usize| (0..loops).map(|l| f64::from(u8::from(k == gain && l == place))).collect();
                loops.map_or(LoopGain::One(f64::from(u8::from(k == gain))), |loops| LoopGain::Each(of(loops)))
            };
            let part = Self::Pid(ParallelPid { kp: unit(0), ki: unit(1), kd: unit(2), ..pid.clone() });
            let (key, value) = (keys[gain], [&pid.kp, &pid.ki, &pid.kd][gain]);
            let key = if loops.is_some() { format!("{key} of loop {}", place + 1) } else { key.to_owned() };
            let controller = part.realise(time, None, folder).ok()?.system().clone();
            let kp = pid.kp.of(place);
            let stated = [(1.0, 1), (kp, -1), (1.0 / kp, 1)][if first == 0 { 0 } else { gain }];
            Some(GainPart { key, value: value.of(place), stated, controller })
        };
        (first..3).flat_map(|gain| (0..loops.unwrap_or(1)).map(move |place| (gain, place))).filter_map(of).collect()
    }

    /// Whether it is stated with times or in s.
    fn depends_on_time(&self) -> bool {
        match self {
            Self::Pid(_) | Self::IdealPid(_) | Self::Cascade(_) => true,
            Self::TransferFunction { hold, .. } | Self::StateSpace { hold, .. } => hold.is_some(),
            Self::DifferenceEquation { .. } | Self::ModelFile { .. } | Self::Observer { .. } => false,
        }
    }

    /// The same numbers under another rule, in another form or in the opposite order.
    fn forms(&self) -> Vec<(String, ControllerSettings)> {
        match self {
            Self::Pid(pid) => {
                let ideal = IdealPid {
                    feedback: pid.feedback,
                    discretisation: pid.discretisation,
                    kp: pid.kp.clone(),
                    ti: Some(pid.ki.clone()),
                    td: pid.kd.clone(),
                    derivative_filter: pid.derivative_filter.clone(),
                    delay: pid.delay,
                };
                let form = "[controller.ideal_pid], ki as ti and kd as td".to_owned();
                let mut all = vec![self.under_other_rule(pid.discretisation), (form, Self::IdealPid(ideal))];
                all.extend(
                    (0..=LONGEST_DELAY)
                        .filter(|delay| *delay != pid.delay)
                        .map(|delay| (format!("delay = {delay}"), Self::Pid(ParallelPid { delay, ..pid.clone() }))),
                );
                if let LoopGain::One(filter) = pid.derivative_filter
                    && filter > 0.0
                {
                    // Milliseconds, a cutoff in rad/s or in Hz for its time constant, and one over it without 2 pi.
                    let others =
                        [1e-3 * filter, 1e3 * filter, 1.0 / filter, 1.0 / (TAU * filter), filter / TAU, filter * TAU];
                    all.extend(others.map(|filter| {
                        let derivative_filter = LoopGain::One(filter);
                        let words = format!("derivative_filter = {filter}");
                        (words, Self::Pid(ParallelPid { derivative_filter, ..pid.clone() }))
                    }));
                }
                all
            }
            Self::IdealPid(pid) => {
                let parallel = ParallelPid {
                    feedback: pid.feedback,
                    discretisation: pid.discretisation,
                    kp: pid.kp.clone(),
                    ki: pid.ti.clone().unwrap_or(LoopGain::One(0.0)),
                    kd: pid.td.clone(),
                    derivative_filter: pid.derivative_filter.clone(),
                    delay: pid.delay,
                };
                let form = "[controller.pid], ti as ki and td as kd".to_owned();
                vec![self.under_other_rule(pid.discretisation), (form, Self::Pid(parallel))]
            }
            Self::DifferenceEquation { .. } => {
                vec![("the coefficients in the opposite order, that of z^-1 ascending".to_owned(), self.turned())]
            }
            Self::TransferFunction { hold: None, .. } => {
                vec![("the coefficients in the opposite order, that of z descending".to_owned(), self.turned())]
            }
            Self::TransferFunction { hold: Some(stated), .. } | Self::StateSpace { hold: Some(stated), .. } => {
                let (other, name) = match stated {
                    Hold::Zoh => (Hold::Tustin, "tustin"),
                    Hold::Tustin => (Hold::Zoh, "zoh"),
                };
                let mut held = self.clone();
                if let Self::TransferFunction { hold, .. } | Self::StateSpace { hold, .. } = &mut held {
                    *hold = Some(other);
                }
                vec![(format!("hold = \"{name}\""), held)]
            }
            _ => Vec::new(),
        }
    }

    /// The same PID under the other rule than the stated one.
    fn under_other_rule(&self, stated: Discretisation) -> (String, ControllerSettings) {
        let (other, name) = match stated {
            Discretisation::Tustin => (Discretisation::BackwardEuler, "backward-euler"),
            Discretisation::BackwardEuler => (Discretisation::Tustin, "tustin"),
        };
        let mut ruled = self.clone();
        if let Self::Pid(ParallelPid { discretisation, .. }) | Self::IdealPid(IdealPid { discretisation, .. }) =
            &mut ruled
        {
            *discretisation = other;
        }
        (format!("discretisation = \"{name}\""), ruled)
    }

    /// The same coefficients in the opposite order.
    fn turned(&self) -> ControllerSettings {
        let mut turned = self.clone();
        if let Self::DifferenceEquation { numerator, denominator, .. }
        | Self::TransferFunction { numerator, denominator, .. } = &mut turned
        {
            (*numerator, *denominator) = (reversed(numerator), reversed(denominator));
        }
        turned
    }
}

fn reversed(polynomials: &Polynomials) -> Polynomials {
    let turned = |c: &Vec<f64>| c.iter().rev().copied().collect();
    match polynomials {
        Polynomials::Single(c) => Polynomials::Single(turned(c)),
        Polynomials::Matrix(m) => Polynomials::Matrix(m.iter().map(|row| row.iter().map(turned).collect()).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_the_ideal_form_are_gains_of_the_parallel_one() {
        let text =
            "[ideal_pid]\nfeedback = \"negative\"\ndiscretisation = \"backward-euler\"\nkp = 2.0\nti = 0.5\ntd = 0.1";
        let ideal: ControllerSettings = toml::from_str(text).unwrap();
        let (time, folder) = (Discrete::new(0.01).unwrap(), Path::new("."));
        let parts = ideal.gain_parts(time, folder);
        let stated: Vec<(&str, f64)> = parts.iter().map(|p| (p.key.as_str(), p.value)).collect();
        assert_eq!(stated, [("ti", 4.0), ("td", 0.2)]);
        assert_eq!(parts.iter().map(|p| p.stated).collect::<Vec<_>>(), [(2.0, -1), (0.5, 1)]);
        // One sample of error, u = -(kp + ki ts + kd / ts): the parts are those of the whole.
        let whole = ideal.realise(time, None, folder).unwrap().system().d()[(0, 0)];
        let of_parts: f64 = parts.iter().map(|p| p.value * p.controller.d()[(0, 0)]).sum();
        assert!((whole - (of_parts - 2.0)).abs() < 1e-12, "{whole} {of_parts}");
    }
}
