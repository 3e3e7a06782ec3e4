//! Tests.

use crate::bench::Bench;
use crate::identify::{CleanRows, identified, loop_response};
use crate::parameter::parameter_of;
use crate::running::{LoopDescription, RunningLoop};
use crate::target::Target;
use std::path::Path;
use std::time::Instant;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr};
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};
use youla_link::{Request, Source};
use youla_loop::redesign::{LoopFigures, RedesignOptions, RedesignProblem, redesign};
use youla_paper::rig::{BearingRig, Fidelity, RigParameters, bearing_at_speed, degraded};
use youla_run::{ControllerSettings, Domain, Feedback, NominalModel};

fn rows(m: MatRef<'_, f64>) -> Vec<Vec<f64>> {
    (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect()
}

fn weak(parameters: &RigParameters, input_weight: f64) -> RunningLoop {
    let time = Discrete::new(2e-4).unwrap();
    let still = bearing_at_speed(parameters, 0.0).unwrap();
    let nominal = degraded(&still.plant().unwrap(), 0.9, 1.0).unwrap().zoh(time).unwrap().balanced().unwrap();
    let r = Mat::from_fn(2, 2, |i, j| if i == j { input_weight } else { 0.0 });
    let f = lqr(&nominal, &LqrWeights::on_outputs(&nominal, eye(2).as_ref(), r.as_ref()).unwrap()).unwrap().f;
    let q = Mat::from_fn(2, 2, |i, j| if i == j { 0.25 } else { 0.0 });
    let l = kalman(&nominal, &NoiseCovariance::at_inputs(&nominal, q.as_ref(), eye(2).as_ref()).unwrap()).unwrap().l;
    let description = LoopDescription {
        nominal: NominalModel::StateSpace {
            domain: Domain::Discrete,
            a: rows(nominal.a()),
            b: rows(nominal.b()),
            c: rows(nominal.c()),
            d: None,
        },
        controller: ControllerSettings::Observer {
            feedback: Feedback::Positive,
            state_feedback: rows(f.as_ref()),
            observer_gain: rows(l.as_ref()),
        },
    };
    RunningLoop::new(description, Path::new("weak.toml"), time).unwrap()
}

fn least(response: &StateSpace<Discrete>, sizes: (&[f64], &[f64])) -> f64 {
    let modes = response.in_units(sizes.0, sizes.1).shared_modes().unwrap();
    modes.iter().filter(|m| m.share >= 0.05 && m.mode.pole.im > 0.0).map(|m| m.mode.zeta).fold(1.0, f64::min)
}

fn list(figures: &LoopFigures) -> String {
    let of = |m: &youla::lti::SharedMode| format!("{:.0}Hz/{:.3}/{:.2}", m.mode.hz, m.mode.zeta, m.share);
    figures.modes.iter().filter(|m| m.share > 0.03).map(of).collect::<Vec<_>>().join(" ")
}

#[test]
#[ignore = "measurement"]
fn measurement() {
    let samples: usize = std::env::var("SAMPLES").map_or(60_000, |s| s.parse().unwrap());
    let seed: u64 = std::env::var("SEED").map_or(1, |s| s.parse().unwrap());
    for (rpm, coupling, weight) in [(0.0, 0.0, 1000.0), (1250.0, 0.0, 1000.0), (2500.0, 0.0, 1000.0), (2500.0, 0.25, 10.0)] {
        let begin = Instant::now();
        let mut parameters = RigParameters::shipped();
        parameters.rotation.cross_coupling.value = coupling;
        let running = weak(&parameters, weight);
        let plant = BearingRig::new(&parameters, Fidelity::Rotating { rpm }, seed).unwrap();
        let truth = plant.true_plant().unwrap();
        let limits = [12.0, 12.0, 30.0, 30.0, 5.0, 5.0, 10.0, 10.0];
        let target = Target::host(&running.numbers(&limits, [50, 50, 500])).unwrap();
        let mut bench = Bench::new(target, plant).unwrap();
        bench.run(5000).unwrap();
        bench.ask(&Request::Arm).unwrap();
        bench.ask(&Request::Start { source: Source::Prbs { order: 18, hold: 8 }, amplitude: 0.5 }).unwrap();
        bench.run(500).unwrap();
        bench.take_rows();
        bench.excite(samples).unwrap();
        println!("\n{rpm} rpm {coupling}: trip {:?}", bench.trip());
        let log = CleanRows::new(&bench.take_rows(), rpm, truth.time()).unwrap();
        println!("recorded {:.1} s", begin.elapsed().as_secs_f64());
        let found = identified(&running, &log, "x").unwrap();
        println!("identified {:.1} s", begin.elapsed().as_secs_f64());
        let recommended = found.recommended.as_ref().unwrap();
        println!("order {} dead {:?} trusted {} {:?}", recommended.order, recommended.dead_time, recommended.trusted(), recommended.reasons());
        let (u, y) = found.records.sizes();
        let s = &found.scheme().unwrap().hansen.deviation;
        println!("S order {}", s.model.order());
        let k = running.factors.controller().unwrap();
        for (name, g) in [("truth", &truth), ("recommended", &recommended.plant), ("G(S)", &found.scheme().unwrap().hansen.plant)] {
            match LoopFigures::new(g, &k, (&u, &y)) {
                Ok(f) => println!("before {name}: {:.4} Ms {:.2} {}", f.least_damping, f.peak_sensitivity, list(&f)),
                Err(e) => println!("before {name}: {e}"),
            }
        }
        let measured = loop_response(&running, None, &log).unwrap();
        println!("measured before: {:.4} order {}", least(&measured.model, (&u, &y)), measured.model.order());
        let problem = RedesignProblem {
            model: &recommended.plant,
            factors: &running.factors,
            deviation: &s.model,
            uncertainty: s.uncertainty.as_ref(),
            input_size: &u,
            output_size: &y,
        };
        let new = match redesign(&problem, &RedesignOptions::default()) {
            Ok(new) => new,
            Err(e) => {
                println!("no redesign: {e}");
                continue;
            }
        };
        println!("designed {:.1} s", begin.elapsed().as_secs_f64());
        for c in &new.candidates {
            println!("  {c:?}");
        }
        let knew = &new.controller.system;
        println!("K stable {} order {}", knew.is_stable().unwrap(), knew.order());
        for (name, g) in [("truth", &truth), ("recommended", &recommended.plant), ("G(S)", &found.scheme().unwrap().hansen.plant)] {
            match LoopFigures::new(g, knew, (&u, &y)) {
                Ok(f) => println!("after {name}: {:.4} Ms {:.2} {}", f.least_damping, f.peak_sensitivity, list(&f)),
                Err(e) => println!("after {name}: {e}"),
            }
        }
        let damping = |s: &StateSpace<Discrete>| -> youla::Result<Vec<f64>> {
            let g = running.factors.plant_of(s)?;
            let f = LoopFigures::new(&g, knew, (&u, &y)).map_err(|_| youla::Error::NoCandidate { samples: 0 })?;
            Ok(vec![f.least_damping])
        };
        if let Some(uncertainty) = &s.uncertainty {
            println!("interval {:?}", uncertainty.intervals(damping));
        }
        let q = parameter_of(&running, knew).unwrap();
        println!("Q order {}", q.system.order());
        bench.ask(&Request::Stop).unwrap();
        bench.run(1000).unwrap();
        bench.load(&q.coefficients).unwrap();
        bench.ask(&Request::SwitchQ).unwrap();
        bench.run(1000).unwrap();
        bench.ask(&Request::Arm).unwrap();
        bench.ask(&Request::Start { source: Source::Prbs { order: 18, hold: 8 }, amplitude: 0.5 }).unwrap();
        bench.run(500).unwrap();
        bench.take_rows();
        bench.excite(samples).unwrap();
        println!("trip {:?}", bench.trip());
        let log = CleanRows::new(&bench.take_rows(), rpm, truth.time()).unwrap();
        let reached = loop_response(&running, Some(&q), &log).unwrap();
        println!("reached {:.4} order {}", least(&reached.model, (&u, &y)), reached.model.order());
        for m in reached.model.in_units(&u, &y).shared_modes().unwrap().iter().filter(|m| m.share > 0.03) {
            println!("   {:.0} {:.3} {:.2}", m.mode.hz, m.mode.zeta, m.share);
        }
        println!("done {:.1} s", begin.elapsed().as_secs_f64());
    }
}
