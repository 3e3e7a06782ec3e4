//! One operating point: check, small excitation, record, proposal, switch, verification.

use crate::bench::{Bench, RAMP};
use crate::campaign::{Campaign, OperatingPoint};
use crate::error::refuse;
use crate::figures::{LoopState, Sizes};
use crate::identify::{CleanRows, loop_response};
use crate::parameter::LoadedQ;
use crate::proposal::{Outcome, Proposal, propose};
use crate::record::{PointRecord, PointStatus};
use crate::{Error, Result};
use youla::Mat;
use youla::lti::{Discrete, StateSpace};
use youla_link::{Request, SequenceOrigin};
use youla_run::Identification;
use youla_twin::{LoggedValues, RunningLoop};

/// Seconds without excitation before and after each step: transients of the loop decay.
const REST: f64 = 1.0;
/// Seconds of the small excitation, and of the first recording.
const SMALL: f64 = 1.0;
pub(crate) const FIRST: f64 = 6.0;
/// Amplitude of the small excitation as a share of the largest.
const SMALL_SHARE: f64 = 0.1;
/// Share of a limit that the recording may use, by the response to the small excitation.
const USED: f64 = 0.8;
/// Relative difference of residuals above which the machine runs another loop than stated; single precision makes less than 1e-4.
const ANOTHER_LOOP: f64 = 0.01;
/// Order of the register of the excitation, and seconds of each of its values: power up to 625 Hz.
const ORDER: u8 = 18;
const HOLD: f64 = 1.6e-3;

/// What is asked of a person before a switch, and said meanwhile.
pub trait Operator {
    /// Whether the switch is allowed; the text says what is known of it.
    fn confirms(&mut self, text: &str) -> bool;
    /// What happens now.
    fn notes(&mut self, text: &str);
}

/// A point as it runs.
pub(crate) struct Point<'a> {
    pub(crate) campaign: &'a Campaign,
    pub(crate) at: &'a OperatingPoint,
    pub(crate) running: &'a RunningLoop,
    pub(crate) bench: Bench,
    pub(crate) record: PointRecord,
}

/// What a point leaves besides its record.
#[derive(Default)]
pub(crate) struct PointFiles {
    pub(crate) found: Option<Box<Identification>>,
    pub(crate) proposal: Option<Box<Proposal>>,
    pub(crate) log: Vec<LoggedValues>,
    pub(crate) verification: Vec<LoggedValues>,
}

impl<'a> Point<'a> {
    pub(crate) fn new(campaign: &'a Campaign, at: &'a OperatingPoint, running: &'a RunningLoop, bench: Bench) -> Self {
        let record = PointRecord {
            name: at.name.clone(),
            status: PointStatus::Stopped,
            reason: None,
            amplitude: 0.0,
            seconds: 0.0,
            before: None,
            modes: Vec::new(),
            region: None,
            predicted: None,
            reached: None,
            q_order: None,
            q_checksum: None,
            certified_models: None,
            switches: 0,
            unstable_switches: 0,
        };
        Point { campaign, at, running, bench, record }
    }

    /// The whole circle. However it ends, alpha is zero, and Q is zero unless the point is done.
    ///
    /// # Errors
    /// Bad input, and a controller that does not answer.
    pub(crate) fn run(mut self, operator: &mut dyn Operator) -> Result<(PointRecord, PointFiles)> {
        let mut files = PointFiles::default();
        let ended = self.circle(operator, &mut files);
        let silent = if ended.is_ok() { Ok(()) } else { self.silence() };
        match ended {
            Err(Error::Refused { reason }) => self.record.reason = Some(reason),
            other => other?,
        }
        silent?;
        Ok((self.record, files))
    }

    /// At least one.
    fn samples(&self, seconds: f64) -> usize {
        (seconds / self.running.nominal.time().ts()).round().max(1.0) as usize
    }

    fn rest(&mut self) -> Result<()> {
        let samples = self.samples(REST);
        self.bench.run(samples)
    }

    /// Alpha and Q to zero.
    pub(crate) fn silence(&mut self) -> Result<()> {
        self.bench.ask(&Request::Stop)?;
        self.bench.ask(&Request::ReleaseQ)?;
        self.rest()
    }

    fn circle(&mut self, operator: &mut dyn Operator, files: &mut PointFiles) -> Result<()> {
        if self.campaign.machine.is_some() {
            let question =
                format!("{}: is the machine at {:.0} rpm, and may it be excited?", self.at.name, self.at.rpm);
            if !operator.confirms(&question) {
                return refuse("the operating point was not confirmed".into());
            }
        }
        operator.notes("check of the loop");
        let still = self.at_rest()?;
        operator.notes("small excitation");
        self.record.amplitude = self.amplitude(&still)?;
        let proposal = self.recorded(operator, files)?;
        self.record.before = Some(proposal.before);
        self.record.predicted = Some(proposal.prediction);
        self.record.q_order = Some(proposal.new.q.system.order());
        self.record.certified_models = Some(proposal.new.models);
        self.record.modes.clone_from(&proposal.modes);
        self.record.region = proposal.region;
        let proposal: &Proposal = files.proposal.insert(proposal);
        if !operator.confirms(&question(&self.at.name, proposal)) {
            return refuse("the switch was not confirmed".into());
        }
        operator.notes("switch and verification");
        self.verified(proposal, &mut files.verification)
    }

    /// Switches and compares the verification with its prediction.
    pub(crate) fn verified(&mut self, proposal: &Proposal, verification: &mut Vec<LoggedValues>) -> Result<()> {
        *verification = match self.switched(&proposal.new.q) {
            Err(Error::Refused { reason }) => return self.fall_back(reason, true),
            other => other?,
        };
        let sizes = Sizes { input: &proposal.sizes.0, output: &proposal.sizes.1 };
        let reached = match self.measured(&proposal.new.q, &proposal.new.controller, sizes, verification) {
            Err(e) => return self.fall_back(format!("the loop could not be measured: {e}"), true),
            Ok(reached) => reached,
        };
        self.record.reached = Some(reached);
        let least = proposal.prediction.bounds[0];
        if reached.damping.is_nan() || reached.damping < least {
            let reason = format!("the damping {:.3} is below the prediction of at least {least:.3}", reached.damping);
            return self.fall_back(reason, false);
        }
        self.record.status = PointStatus::Done;
        Ok(())
    }

    fn fall_back(&mut self, reason: String, unstable: bool) -> Result<()> {
        self.record.status = PointStatus::Fallback;
        self.record.unstable_switches += usize::from(unstable);
        refuse(reason)
    }

    /// Largest magnitudes of the signals without excitation.
    pub(crate) fn at_rest(&mut self) -> Result<[f64; 8]> {
        self.rest()?;
        self.bench.take_rows();
        self.rest()?;
        let largest = largest(&self.bench.take_rows());
        if let Some(trip) = self.bench.trip() {
            return refuse(format!("without an excitation the guard has tripped: {}", trip.cause));
        }
        match self.beyond(&largest, 0.5) {
            Some(signal) => refuse(format!("without an excitation {signal} is beyond half of its limit")),
            None => Ok(largest),
        }
    }

    fn limits(&self) -> [(usize, &'static str, f64); 6] {
        let limits = &self.campaign.limits;
        let of = |at: usize, name: &'static str, limit: f64| (at, name, limit);
        [
            of(0, "y_1", limits.output),
            of(1, "y_2", limits.output),
            of(2, "u_1", limits.input),
            of(3, "u_2", limits.input),
            of(6, "beta_1", limits.residual),
            of(7, "beta_2", limits.residual),
        ]
    }

    fn beyond(&self, largest: &[f64; 8], share: f64) -> Option<&'static str> {
        self.limits().into_iter().find(|(at, _, limit)| largest[*at] > share * limit).map(|(_, name, _)| name)
    }

    /// The amplitude with which no signal exceeds its share of the limit, by the response to a small one.
    fn amplitude(&mut self, still: &[f64; 8]) -> Result<f64> {
        let most = self.campaign.limits.excitation;
        let small = SMALL_SHARE * most;
        let rows = self.excited(small, self.samples(SMALL))?;
        self.stopped()?;
        self.runs_the_loop(&rows)?;
        let excited = largest(&rows);
        let mut amplitude = most;
        for (at, name, limit) in self.limits() {
            let response = (excited[at] - still[at]).max(1e-3 * limit);
            let room = USED * limit - still[at];
            if room < response {
                return refuse(format!(
                    "{name} reaches {:.3} under the small excitation and {:.3} without; its limit of {limit} leaves no room for more",
                    excited[at], still[at]
                ));
            }
            amplitude = amplitude.min(small * room / response);
        }
        Ok(amplitude)
    }

    /// Whether the residuals of the machine are those of the loop that its file states.
    fn runs_the_loop(&self, rows: &[LoggedValues]) -> Result<()> {
        let signal = |first: usize| Mat::from_fn(rows.len(), 2, |i, j| rows[i][first + j]);
        let (y, u, beta) = (signal(0), signal(2), signal(6));
        let signals = self.running.factors.signals(u.as_ref(), y.as_ref())?;
        // From the second half on the filters have settled.
        let half = rows.len() / 2;
        let logged = beta.subrows(half, rows.len() - half);
        let error = (signals.beta().subrows(half, rows.len() - half) - logged).norm_l2() / logged.norm_l2();
        match error <= ANOTHER_LOOP {
            true => Ok(()),
            false => refuse(format!(
                "the machine does not run the loop of {}: its residuals differ from those of the file by {:.1} %",
                self.at.running.display(),
                100.0 * error
            )),
        }
    }

    /// Arms, starts and runs over the ramp, then records.
    fn excited(&mut self, amplitude: f64, samples: usize) -> Result<Vec<LoggedValues>> {
        self.bench.ask(&Request::Arm)?;
        let source = SequenceOrigin::Prbs { order: ORDER, hold: self.samples(HOLD) as u16 };
        self.bench.ask(&Request::Start { source, amplitude: amplitude as f32 })?;
        self.bench.excite(RAMP.into())?;
        self.bench.take_rows();
        self.recorded_rows(samples)
    }

    fn recorded_rows(&mut self, samples: usize) -> Result<Vec<LoggedValues>> {
        self.bench.excite(samples)?;
        match self.bench.trip() {
            None => Ok(self.bench.take_rows()),
            Some(trip) => refuse(format!("the guard ended the excitation: {} (channel {})", trip.cause, trip.channel)),
        }
    }

    fn stopped(&mut self) -> Result<()> {
        self.bench.ask(&Request::Stop)?;
        self.rest()?;
        self.bench.take_rows();
        Ok(())
    }

    /// Records until there is a proposal within the goal, twice as long each time.
    pub(crate) fn recorded(&mut self, operator: &mut dyn Operator, files: &mut PointFiles) -> Result<Box<Proposal>> {
        let ts = self.running.nominal.time().ts();
        let most = (self.campaign.limits.duration / ts) as usize;
        files.log = self.excited(self.record.amplitude, self.samples(FIRST).min(most))?;
        loop {
            self.record.seconds = files.log.len() as f64 * ts;
            operator.notes(&format!("identification from {:.1} s", self.record.seconds));
            let rows = CleanRows::new(&files.log, self.at.rpm, self.running.nominal.time())?;
            match propose(self.running, &rows, &self.at.name, &self.campaign.goal)? {
                Outcome::Proposed(proposal) => {
                    self.stopped()?;
                    return Ok(proposal);
                }
                Outcome::Refused { reason, found } => {
                    files.found = found;
                    let more = files.log.len().min(most.saturating_sub(files.log.len()));
                    if more == 0 {
                        return refuse(format!("after {:.1} s, {reason}", self.record.seconds));
                    }
                    let rows = self.recorded_rows(more)?;
                    files.log.extend(rows);
                }
            }
        }
    }

    /// Loads and switches, rests, and records the verification.
    pub(crate) fn switched(&mut self, q: &LoadedQ) -> Result<Vec<LoggedValues>> {
        self.bench.load(q)?;
        self.bench.ask(&Request::Arm)?;
        self.bench.ask(&Request::SwitchQ)?;
        self.record.switches += 1;
        self.bench.excite(self.samples(REST))?;
        if let Some(trip) = self.bench.trip() {
            return refuse(format!("after the switch the guard has tripped: {}", trip.cause));
        }
        let samples = (self.record.seconds / self.running.nominal.time().ts()).round() as usize;
        let rows = self.excited(self.record.amplitude, samples)?;
        self.stopped()?;
        Ok(rows)
    }

    /// The loop with `controller`, which is K(Q), by a verification record.
    pub(crate) fn measured(
        &self,
        q: &LoadedQ,
        controller: &StateSpace<Discrete>,
        sizes: Sizes<'_>,
        rows: &[LoggedValues],
    ) -> Result<LoopState> {
        let rows = CleanRows::new(rows, self.at.rpm, self.running.nominal.time())?;
        LoopState::new(&loop_response(self.running, Some(q), &rows)?, controller, sizes)
    }
}

fn largest(rows: &[LoggedValues]) -> [f64; 8] {
    let mut largest = [0.0_f64; 8];
    for row in rows {
        largest.iter_mut().zip(row).for_each(|(most, value)| *most = most.max(value.abs()));
    }
    largest
}

fn question(name: &str, proposal: &Proposal) -> String {
    let Proposal { before, prediction, new, .. } = proposal;
    format!(
        "{name}: switch to the new Q of order {}? Least damping {:.3} now, predicted {:.3} to {:.3}; peak sensitivity {:.2} now, predicted \
         {:.2}. It stabilises all {} models within the region of S, at worst with a pole of magnitude {:.4}. If the guard trips or the \
         damping is below the prediction, Q goes back to zero.",
        new.q.system.order(),
        before.damping,
        prediction.bounds[0],
        prediction.bounds[1],
        before.sensitivity,
        prediction.sensitivity,
        new.models,
        new.worst_pole
    )
}
