//! The rig, the controller and the nominal model.

use crate::Result;
use crate::story::order::lacking_in_words;
use crate::story::words::{and, both, count, percent, short};
use crate::story::{figures_experiments, figures_study, tables_nominal, tables_rig};
use crate::study::{Paper, RowStatus, StudyMethod, StudyRow};
use youla_report::story::section;
use youla_report::story::{Block, Section};

/// The digital twin and its excitation.
pub(in crate::story) fn rig(paper: &Paper) -> Section {
    let rig = &paper.rig;
    let text = format!(
        "A disc on a flexible shaft is held by an active gas bearing: two piezo valves let air in, two sensors measure the \
         displacement of the disc, horizontally and vertically. At rest it is the model (1)-(12) with six states: the \
         positions, the velocities and the two actuators. The controller runs at {} kHz.",
        short(1e-3 / rig.timing.sample_time.value, 4)
    );
    let levels = "The twin has three levels, each including the one before. Linear: the paper's model and white noise on the \
                  outputs. Instrumented: bandwidth and converter of the sensors, limits and hysteresis of the valves, the delay \
                  of the controller. Rotating: gyroscopic and cross-coupled terms, falling damping, unbalance, run-out and a \
                  bending mode. The study uses the linear level, the experiments the other two.";
    let turning = format!(
        "Where the shaft turns, the mean and the first {} of the speed are subtracted from u, y, alpha and beta before \
         identification; the verification records are as measured, so unbalance and run-out bound the fit that any model can \
         reach there.",
        count(paper.settings.experiments.harmonics, "harmonic", "harmonics")
    );
    let blocks = vec![
        Block::Text(text),
        Block::Text(levels.into()),
        Block::Table(tables_rig::experiments(paper)),
        Block::Text(turning),
        Block::Table(tables_rig::outcomes(paper)),
        Block::Table(tables_rig::excitation(paper)),
        Block::Figure(figures_experiments::excitation(paper)),
        Block::Table(tables_rig::parameters(paper)),
    ];
    section("rig", "The rig", "Rig", blocks)
}

/// How a controller is chosen.
pub(in crate::story) fn controller(paper: &Paper) -> Section {
    let c = &paper.settings.controller;
    let design = format!(
        "Each controller is LQG on its nominal model, discretised at the sample time: state feedback with weights {} per um^2 on \
         displacements, {} per (um/s)^2 on velocities and a weight per V^2 on the command, and an observer that assumes noise of \
         {} V^2 at the inputs and {} um^2 at the outputs. It runs as in Fig. 3: alpha is added to the command and beta is the \
         innovation of the observer.",
        short(c.displacement_weight, 4),
        short(c.velocity_weight, 4),
        short(c.input_noise, 4),
        short(c.output_noise, 4)
    );
    let choice = format!(
        "The paper asks for a controller that stabilises the nominal model and the real plant and does not say how it was \
         found. Here the weights of the command {} are tried in this order, and the first whose peak of the output sensitivity \
         is at most {} with both is taken, that is the strongest feedback with this margin. {} The experiments all use the \
         weight {}.",
        and(&c.command_weights.iter().map(|w| short(*w, 4)).collect::<Vec<_>>()),
        short(c.peak_sensitivity, 4),
        chosen(paper),
        short(paper.settings.experiments.command_weight, 4)
    );
    let blocks = vec![Block::Text(design), Block::Text(choice), Block::Figure(figures_study::controllers(paper))];
    section("controller", "The controller", "Controller", blocks)
}

/// The range of the weights that were chosen.
fn chosen(paper: &Paper) -> String {
    let rows = || paper.study.iter().filter(|r| r.method == StudyMethod::Nominal);
    let with_loop: Vec<&StudyRow> = rows().filter(|r| r.status != RowStatus::NoController).collect();
    let by_weight = |a: &&&StudyRow, b: &&&StudyRow| a.command_weight.total_cmp(&b.command_weight);
    let (Some(low), Some(high)) = (with_loop.iter().min_by(by_weight), with_loop.iter().max_by(by_weight)) else {
        return "No model of the study has a controller.".into();
    };
    let without = rows().count() - with_loop.len();
    let none = if without == 0 { "every model has one".into() } else { format!("{without} models have none") };
    format!(
        "In the study they lie between {} and {}; {none}.",
        short(low.command_weight, 4),
        short(high.command_weight, 4)
    )
}

/// The open-loop fit at rest.
pub(in crate::story) fn nominal(paper: &Paper) -> Result<Section> {
    let found = &paper.experiments.nominal.found;
    let fit = [found.fit[0], found.fit[1]];
    let text = format!(
        "As in the paper the nominal model comes from an open-loop record at 0 rpm: {} of the instrumented rig, {} s, and the 14 \
         parameters of (9)-(12) by prediction error in {}. On its own record it fits {} (horizontal and vertical), with residuals \
         of {} and {} um rms.",
        count(paper.experiments.nominal.record.y.nrows(), "sample", "samples"),
        short(paper.experiments.nominal.record.y.nrows() as f64 * paper.rig.timing.sample_time.value, 4),
        count(found.iterations, "step", "steps"),
        both(fit),
        short(found.residual[0], 3),
        short(found.residual[1], 3)
    );
    let mut blocks = vec![Block::Text(text), Block::Table(tables_nominal::parameters(paper))];
    blocks.extend(bias(paper).map(Block::Text));
    blocks.push(Block::Table(tables_nominal::modes(paper)?));
    Ok(section("nominal", "The nominal model", "Nominal model", blocks))
}

/// Why the parameters are not those of the rig.
fn bias(paper: &Paper) -> Option<String> {
    let missing = lacking_in_words(&paper.rig)?;
    let (found, rig) = (paper.experiments.nominal.bearing.actuator_pole, paper.rig.bearing.actuator_pole.value);
    let change = [0, 1].map(|i| 100.0 * (found[i] / rig[i] - 1.0));
    // The poles are the last two parameters.
    let deviations = paper.experiments.nominal.found.standard_deviations().map_or_else(String::new, |s| {
        let times = [0, 1].map(|i| short(((found[i] - rig[i]) / s[12 + i]).abs(), 2));
        format!(", {} and {} standard deviations", times[0], times[1])
    });
    Some(format!(
        "The estimate is biased, for {missing} have no parameter in this structure; what they do is put down to the others, so that \
         the actuator poles differ from those of the rig by {} and {} %{deviations}.",
        percent(change[0], 1),
        percent(change[1], 1)
    ))
}
