//! The recommended model: maximum likelihood on u and y, chosen and judged by the evidence of the records and of the loop.

use crate::records::LoopRecord;
use crate::records::disturbance::without_lines;
use crate::stages::context::RunContext;
use crate::{Error, Result};
use youla::Mat;
use youla::identify::likelihood::{self, Experiment, LoopKnowledge, LoopSignals, Recommendation};
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace};

/// The model that the records support.
///
/// # Errors
/// Those of [`likelihood::recommend`].
pub(crate) fn recommend(run: RunContext<'_>) -> Result<Recommendation> {
    let records = run.records;
    if let Some(measured) = &records.measured {
        let (response, k) = (measured.response(records.time)?, &run.declared.controller);
        let controller = (!k.is_zero()).then_some(k);
        let found = likelihood::recommend_from_response(&response, controller, &run.settings.recommended);
        let mut found = found.map_err(|e| Error::from(e).within("[recommended]"))?;
        if !run.settings.data.input_excitation.is_empty() {
            found.evidence.extend(controller.map(|k| measured.controller(k)).transpose()?.flatten());
        }
        return Ok(found);
    }
    let law = Law::of(run)?;
    let signals = |group: &[LoopRecord]| -> Vec<Signals> { group.iter().map(|r| law.signals(r)).collect() };
    let (estimation, verification) = (signals(&records.estimation), signals(&records.verification));
    let controller = (!run.declared.controller.is_zero()).then_some(&law.controller);
    let known = LoopKnowledge::new(controller, views(&estimation), views(&verification))?;
    let outputs = |group: &[LoopRecord]| -> Result<Vec<Mat<f64>>> {
        group.iter().map(|r| without_lines(r.y.as_ref(), r.disturbance.as_ref().map(|w| w.as_ref()))).collect()
    };
    let (y, fresh) = (outputs(&records.estimation)?, outputs(&records.verification)?);
    let (y, fresh) = (experiments(&records.estimation, &y), experiments(&records.verification, &fresh));
    let found = likelihood::recommend(&y, &fresh, Some(&known), records.time, &run.settings.recommended);
    found.map_err(|e| Error::from(e).within("[recommended]"))
}

fn experiments<'a>(records: &'a [LoopRecord], outputs: &'a [Mat<f64>]) -> Vec<Experiment<'a>> {
    records.iter().zip(outputs).map(|(r, y)| Experiment::new(r.u.as_ref(), y.as_ref())).collect()
}

fn views(all: &[Signals]) -> Vec<LoopSignals<'_>> {
    all.iter().map(Signals::view).collect()
}

/// The controller from what it sees to the inputs that it explains.
struct Law {
    controller: StateSpace<Discrete>,
    observer: bool,
}

/// What [`LoopSignals`] views.
struct Signals {
    seen: Mat<f64>,
    explained: Mat<f64>,
    excitation: Option<Mat<f64>>,
}

impl Signals {
    fn view(&self) -> LoopSignals<'_> {
        let excitation = self.excitation.as_ref().map(|x| x.as_ref());
        LoopSignals { seen: self.seen.as_ref(), explained: self.explained.as_ref(), excitation }
    }
}

impl Law {
    /// `u - alpha = F x`, `x+ = (A + L C) x + (B + L D) u - L y` where alpha is injected into an observer-based controller, so that
    /// u and y are seen; else `u - d = K (y - r)`.
    fn of(run: RunContext<'_>) -> Result<Law> {
        let nominal = &run.declared.nominal;
        match &run.declared.gains {
            Some([f, l]) if !run.settings.data.alpha.is_empty() => {
                let a = nominal.a() + l * nominal.c();
                let b = block(&[&[(nominal.b() + l * nominal.d()).as_ref(), (-l).as_ref()]]);
                let d = Mat::zeros(f.nrows(), b.ncols());
                Ok(Law { controller: StateSpace::new(a, b, f.clone(), d, nominal.time())?, observer: true })
            }
            _ => Ok(Law { controller: run.declared.controller.clone(), observer: false }),
        }
    }

    fn signals(&self, r: &LoopRecord) -> Signals {
        if let (true, Some(alpha)) = (self.observer, &r.alpha) {
            let seen = block(&[&[r.u.as_ref(), r.y.as_ref()]]);
            return Signals { seen, explained: &r.u - alpha, excitation: Some(alpha.clone()) };
        }
        let seen = r.reference.as_ref().map_or_else(|| r.y.clone(), |reference| &r.y - reference);
        let explained = r.input_excitation.as_ref().map_or_else(|| r.u.clone(), |d| &r.u - d);
        let known: Vec<_> = [&r.input_excitation, &r.reference, &r.alpha].into_iter().flatten().collect();
        let parts: Vec<_> = known.iter().map(|x| x.as_ref()).collect();
        // Without feedback the inputs come from outside.
        let excitation = match parts.is_empty() {
            true => self.controller.is_zero().then(|| r.u.clone()),
            false => Some(block(&[&parts])),
        };
        Signals { seen, explained, excitation }
    }
}
