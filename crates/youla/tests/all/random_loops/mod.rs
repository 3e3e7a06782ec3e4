//! 1000 random loops, or as many as `YOULA_LOOPS` says, continuous and discrete: every one factorises with a Bezout residual of at most 1e-8, from which G
//! and K come back, or is refused with the condition that forbids it, and the condition is found out here by other means
//! (`judge.rs`). What is drawn is told in `draw.rs`.

mod draw;
mod judge;

use crate::common::{random_stable, rng};
use draw::{Drawn, foreign, plant};
use judge::{NEAR, Nearness, condition_of_loop, worst_of_feedback, worst_of_loop};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::BTreeMap;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::lti::{Continuous, Discrete, StateSpace, TimeDomain, frequency_response};
use youla::{Error, Mat, Result};

/// Loops where `YOULA_LOOPS` does not say another number.
const LOOPS: u64 = 1000;
const RESIDUAL: f64 = 1e-8;

/// The six constructions: their factors hold.
const ACCEPTED: [&str; 6] =
    ["observer", "observer, any gain", "K(Q), shifted", "K(Q), stacked", "any K, shifted", "any K, stacked"];

/// Refusals that exact arithmetic would not need.
const ROUNDING: [&str; 5] = [
    "weights without units",
    "K(Q) not well posed",
    "K(Q) lost to rounding",
    "lost to rounding",
    "controller out of proportion",
];

/// What became of a loop; a text for what must not be.
type Outcome = std::result::Result<&'static str, String>;

/// Why there is no gain, and how near the plant was to having none.
type Refused = Box<(Error, Nearness)>;

#[test]
fn every_loop_factorises_or_is_refused_for_a_reason() {
    let discrete = Discrete::new(0.1).unwrap();
    let loops = std::env::var("YOULA_LOOPS").map_or(LOOPS, |number| number.parse().unwrap());
    let outcomes: Vec<Outcome> = (0..loops)
        .into_par_iter()
        .map(|seed| if seed % 2 == 0 { one_loop(seed, Continuous) } else { one_loop(seed, discrete) })
        .collect();
    let mut shares = BTreeMap::<&str, usize>::new();
    let mut failures = Vec::new();
    for outcome in outcomes {
        match outcome {
            Ok(name) => *shares.entry(name).or_default() += 1,
            Err(failure) => failures.push(failure),
        }
    }
    let shown = failures.len().min(20);
    assert!(failures.is_empty(), "{} of {loops} loops, such as\n{}", failures.len(), failures[..shown].join("\n"));
    // Nothing of this passes by refusing everything.
    let share = |names: &[&str]| names.iter().filter_map(|name| shares.get(name)).sum::<usize>() as f64 / loops as f64;
    // The limits are those of the share of infinitely many loops; of these, it scatters as a binomial share.
    let scatter = |share: f64| 3.0 * (share * (1.0 - share) / loops as f64).sqrt();
    let above = |names: &[&str], least: f64| assert!(share(names) > least - scatter(least), "{names:?}: {shares:?}");
    let below = |names: &[&str], most: f64| assert!(share(names) < most + scatter(most), "{names:?}: {shares:?}");
    above(&ACCEPTED, 0.65);
    for (name, least) in ACCEPTED.iter().zip([0.14, 0.1, 0.14, 0.14, 0.05, 0.05]) {
        above(&[name], least);
    }
    above(&["not stabilising"], 0.1);
    above(&["gain refused"], 0.03);
    below(&["out of reach", "nearly out of reach"], 0.08);
    below(&ROUNDING, 0.01);
}

/// Draws a loop, designs what its construction needs and judges what comes of it.
fn one_loop<T: TimeDomain>(seed: u64, time: T) -> Outcome {
    let rng = &mut rng(seed);
    let drawn = plant(rng, time);
    let (n, m, p) = (drawn.core.order(), drawn.core.inputs(), drawn.core.outputs());
    let label = |text: String| {
        format!("seed {seed}, {n} states, {m} inputs, {p} outputs, {time:?}, mindful {}: {text}", drawn.mindful)
    };
    let result = match design(rng, &drawn) {
        Ok((f, l)) => with_gains(rng, &drawn, &f, &l),
        Err(refused) => design_refused(&drawn, &refused.0, &refused.1),
    };
    result.map_err(label)
}

/// Gains of a regulator and a filter with unit weights, in the units of the plant or without minding them.
fn design<T: TimeDomain>(rng: &mut ChaCha8Rng, drawn: &Drawn<T>) -> std::result::Result<(Mat<f64>, Mat<f64>), Refused> {
    let weight = draw::decades(rng, -2.0, 2.0);
    let square = |unit: &[f64], power: i32, factor: f64| {
        Mat::from_fn(unit.len(), unit.len(), |i, j| match i == j {
            true if drawn.mindful => factor * unit[i].powi(power),
            true => factor,
            false => 0.0,
        })
    };
    let weights = LqrWeights { q: square(&drawn.state, 2, 1.0), r: square(&drawn.input, 2, weight), s: None };
    let f = lqr(&drawn.plant, &weights).map_err(|e| Box::new((e, Nearness::of(&drawn.core))))?.f;
    let (process, measurement) = (square(&drawn.state, -2, 1.0), square(&drawn.output, 2, weight));
    let noise = NoiseCovariance { process, measurement, cross: None };
    let l = kalman(&drawn.plant, &noise).map_err(|e| Box::new((e, Nearness::of(&drawn.core.dual()))))?.l;
    Ok((f, l))
}

fn design_refused<T: TimeDomain>(drawn: &Drawn<T>, error: &Error, nearness: &Nearness) -> Outcome {
    let Nearness { reach, boundary } = *nearness;
    match error {
        Error::NotStabilisable { .. } | Error::NotDetectable { .. } if reach <= 1e-8 || boundary <= NEAR => {
            Ok("out of reach")
        }
        Error::NoSolution { .. } | Error::Singular { .. } if nearness.is_hard() => Ok("nearly out of reach"),
        Error::NoSolution { .. } | Error::Singular { .. } if !drawn.mindful => Ok("weights without units"),
        error => Err(format!("design refused at reach {reach:.1e}, boundary {boundary:.1e}: {error}")),
    }
}

fn with_gains<T: TimeDomain>(rng: &mut ChaCha8Rng, drawn: &Drawn<T>, f: &Mat<f64>, l: &Mat<f64>) -> Outcome {
    let plant = &drawn.plant;
    let observer = |f: &Mat<f64>| CoprimeFactors::observer(plant, f.as_ref(), l.as_ref());
    let form = rng.random_range(0..6);
    if form == 0 {
        let f = f * faer::Scale(rng.random_range(-1.0..3.0));
        let worst = worst_of_feedback(drawn, &f);
        return match observer(&f) {
            Ok(factors) if worst < NEAR => {
                accept(drawn, &factors.controller().unwrap(), &factors, "observer, any gain")
            }
            Err(Error::Unstable { .. }) if worst > -NEAR => Ok("gain refused"),
            Ok(_) => Err(format!("a gain is accepted that leaves {worst:.1e}")),
            Err(e) => Err(format!("a gain that leaves {worst:.1e} is refused: {e}")),
        };
    }
    let factors = match observer(f) {
        Ok(factors) => factors,
        Err(e) => return Err(format!("the gains of the design leave {:.1e}: {e}", worst_of_feedback(drawn, f))),
    };
    if form == 1 {
        return accept(drawn, &factors.controller().unwrap(), &factors, "observer");
    }
    let controller = if form < 4 {
        let order = rng.random_range(0..4);
        let q = random_stable(rng, (order, plant.outputs(), plant.inputs()), plant.time());
        match factors.controller_of(&drawn.in_units(q)) {
            Ok(k) => k,
            Err(Error::AlgebraicLoop { rcond }) if rcond <= f64::EPSILON => return Ok("K(Q) not well posed"),
            Err(e) => return Err(format!("K(Q): {e}")),
        }
    } else {
        let k = foreign(rng, plant);
        drawn.in_units(k)
    };
    let shifted = form % 2 == 0;
    let made = if shifted { factors.shifted_to(&controller) } else { stacked(plant, &controller, f) };
    let name = ACCEPTED[form];
    let worst = worst_of_loop(plant, &controller);
    let condition = condition_of_loop(drawn, &controller, &frequencies(&drawn.core));
    match made {
        Ok(made) if worst.is_some_and(|w| w < NEAR) => accept(drawn, &controller, &made, name),
        Ok(_) => Err(format!("{name}: accepted, but the loop is {worst:?}")),
        Err(Error::NotStabilising { .. }) if form >= 4 && worst.is_none_or(|w| w > -NEAR) => Ok("not stabilising"),
        Err(Error::NotStabilising { .. }) if form < 4 && (worst.is_none_or(|w| w > -NEAR) || condition > 1e6) => {
            Ok("K(Q) lost to rounding")
        }
        Err(Error::AlgebraicLoop { .. }) if worst.is_none() => Ok("not well posed"),
        Err(Error::NoSolution { .. }) if condition > 1e6 || worst.is_some_and(|w| w > -1e-4) => Ok("lost to rounding"),
        Err(Error::NotStabilisable { .. } | Error::NotDetectable { .. } | Error::NoSolution { .. })
            if !shifted && is_out_of_proportion(drawn, &controller) =>
        {
            Ok("controller out of proportion")
        }
        Err(e) => Err(format!("{name}: refused, but the loop is {worst:?}, condition {condition:.1e}: {e}")),
    }
}

/// Whether a regulator for the controller itself meets a mode near the boundary, or parts that differ by more than double
/// precision holds.
fn is_out_of_proportion<T: TimeDomain>(drawn: &Drawn<T>, controller: &StateSpace<T>) -> bool {
    let balanced = controller.balanced().unwrap();
    balanced.a().norm_l2() > 1e6 * (1.0 + drawn.core.a().norm_l2())
        || Nearness::of(&balanced).is_hard()
        || !drawn.mindful
}

fn stacked<T: TimeDomain>(plant: &StateSpace<T>, k: &StateSpace<T>, f: &Mat<f64>) -> Result<CoprimeFactors<T>> {
    let one = |n: usize| Mat::<f64>::identity(n, n);
    let fk = if k.is_stable()? {
        Mat::zeros(k.inputs(), k.order())
    } else {
        let balanced = k.balanced()?;
        let scale = k.state_scales()?;
        let weight = one(k.inputs()) * faer::Scale(balanced.b().norm_max().powi(2).max(1e-30));
        let fk = lqr(&balanced, &LqrWeights { q: one(k.order()), r: weight, s: None })?.f;
        Mat::from_fn(fk.nrows(), fk.ncols(), |i, j| fk[(i, j)] / scale[j])
    };
    CoprimeFactors::stacked(plant, k, f.as_ref(), fk.as_ref())
}

/// The Bezout identity, and G and K from the left factors, at 16 frequencies: to 1e-8, or 1e-13 times the condition number of
/// the factors where the plant is nearly out of reach or the weights mind no units.
fn accept<T: TimeDomain>(
    drawn: &Drawn<T>,
    k: &StateSpace<T>,
    factors: &CoprimeFactors<T>,
    name: &'static str,
) -> Outcome {
    let plant = &drawn.plant;
    let omega = frequencies(&drawn.core);
    let residual = factors.bezout_residual(&omega).unwrap();
    if residual > RESIDUAL {
        return Err(format!("{name}: Bezout residual {residual:.1e}"));
    }
    let response = |s: &StateSpace<T>| frequency_response(s, &omega);
    let (Ok(g), Ok(k)) = (response(plant), response(k)) else { return Ok(name) };
    let left = response(factors.left().system()).unwrap();
    let right = response(factors.right().system()).unwrap();
    let condition = (0..omega.len()).map(|i| right.at(i).norm_l2() * left.at(i).norm_l2()).fold(0.0, f64::max);
    let hard = !drawn.mindful || Nearness::of(&drawn.core).is_hard() || Nearness::of(&drawn.core.dual()).is_hard();
    let tolerance = if hard { RESIDUAL.max(1e-13 * condition) } else { RESIDUAL };
    let m = plant.inputs();
    for i in 0..omega.len() {
        let (vt, ut) = (left.at(i).submatrix(0, 0, m, m), left.at(i).submatrix(0, m, m, plant.outputs()));
        let (nt, mt) = (
            left.at(i).submatrix(m, 0, plant.outputs(), m),
            left.at(i).submatrix(m, m, plant.outputs(), plant.outputs()),
        );
        // Vt K = Ut and Mt G = Nt, the second row with its sign.
        for (what, x, y, product) in [("K", vt, ut, vt * k.at(i)), ("G", mt, nt, mt * g.at(i))] {
            let of = if what == "K" { k.at(i) } else { g.at(i) };
            let size =
                if of.norm_l2() == 0.0 { left.at(i).norm_l2() } else { x.norm_l2() * of.norm_l2() + y.norm_l2() };
            let error = (&product + y).norm_l2() / size.max(f64::MIN_POSITIVE);
            if error > tolerance {
                return Err(format!("{name}: {what} misses by {error:.1e}, Bezout residual {residual:.1e}"));
            }
        }
    }
    Ok(name)
}

fn frequencies<T: TimeDomain>(core: &StateSpace<T>) -> Vec<f64> {
    let (low, high) = match core.time().sample_time() {
        None => (1e-3, 1e3),
        Some(ts) => (1e-3 / ts, std::f64::consts::PI / ts),
    };
    (0..16).map(|k| low * (high / low).powf(f64::from(k) / 15.0)).collect()
}
