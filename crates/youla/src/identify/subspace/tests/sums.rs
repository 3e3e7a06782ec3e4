//! Sums over long records are taken in pieces: the pieces leave no seam, and the threads no trace.

use super::*;
use crate::Error;

/// Two inputs, two outputs with noise: one experiment of many pieces, two of less than one.
fn records() -> Vec<(Mat<f64>, Mat<f64>)> {
    let system = random_system(&[0.97, 0.9], 2, 2, false, 21);
    let rng = &mut ChaCha8Rng::seed_from_u64(22);
    [300_000, 2500, 700]
        .map(|samples| {
            let (u, e) = (3.0 * uniform(samples, 2, rng), 0.3 * uniform(samples, 2, rng));
            let y = respond(&system, &u, 1.0, Some((&Mat::zeros(4, 2), &e)));
            (u, y)
        })
        .into()
}

fn views(records: &[(Mat<f64>, Mat<f64>)]) -> Vec<Experiment<'_>> {
    records.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect()
}

#[test]
fn threads_change_no_bit() {
    let records = records();
    let experiments = views(&records);
    for method in [SubspaceMethod::Moesp, SubspaceMethod::PbsidOpt] {
        for factorisation in [Factorisation::Auto, Factorisation::Qr] {
            let options = SubspaceOptions { method, factorisation, ..fixed(4, 6) };
            let run = || subspace(&experiments, clock(), &options).unwrap();
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            let (left, right) = (run(), one.install(run));
            assert_eq!(left.model, right.model);
            assert_eq!((&left.singular_values, &left.initial_states), (&right.singular_values, &right.initial_states));
            assert_eq!((&left.fit, left.factor, left.columns), (&right.fit, right.factor, right.columns));
        }
    }
}

/// The sums over pieces are those over the whole record: R'R by the plain product, the fit by simulation.
#[test]
fn pieces_leave_no_seam() {
    let records = records();
    let experiments = views(&records);
    let options = SubspaceOptions { scaling: ChannelScaling::None, ..fixed(4, 3) };
    for factorisation in [Factorisation::Gram, Factorisation::Qr] {
        let options = SubspaceOptions { factorisation, ..options.clone() };
        let channels = Channels::new(&experiments, &options).unwrap();
        let layout = HankelLayout::of(&options);
        let triangle = HankelLq::new(&channels, (3, 3), layout, options.factorisation).unwrap();
        let hankel: Vec<Mat<f64>> = records
            .iter()
            .map(|(u, y)| {
                // [U_f U_p Y_p Y_f], three block rows each.
                let at = |t: usize, j: usize| {
                    let (group, place) = (j / 6, j % 6);
                    let (k, c) = (t + place / 2 + if matches!(group, 0 | 3) { 3 } else { 0 }, place % 2);
                    if group < 2 { u[(k, c)] } else { y[(k, c)] }
                };
                Mat::from_fn(u.nrows() - 5, 24, at)
            })
            .collect();
        let gram = hankel.iter().fold(Mat::zeros(24, 24), |sum, h| sum + h.transpose() * h);
        let r = triangle.arranged(HankelLayout::InputsFirst, 3, 3).unwrap();
        let error = (r.transpose() * &r - &gram).norm_max() / gram.norm_max();
        assert!(error < 1e-12, "{factorisation:?}: {error:.1e}");
    }
    for method in [SubspaceMethod::Moesp, SubspaceMethod::PbsidOpt] {
        let found = subspace(&experiments, clock(), &SubspaceOptions { method, ..options.clone() }).unwrap();
        let (model, gain) = (&found.model, found.innovation.gain());
        let (mut errors, mut count, mut sum, mut squares) = (0.0, 0.0, 0.0, 0.0);
        for ((u, y), x0) in records.iter().zip(&found.initial_states) {
            let mut x = Mat::from_fn(4, 1, |i, _| x0[i]);
            for k in 0..u.nrows() {
                let uk = u.row(k).transpose().as_mat();
                let error = y.row(k).transpose().as_mat() - model.c() * &x - model.d() * uk;
                x = model.a() * &x + model.b() * uk;
                if method == SubspaceMethod::PbsidOpt {
                    x += gain.unwrap() * &error;
                }
                errors += error[(0, 0)].powi(2);
                (count, sum, squares) = (count + 1.0, sum + y[(k, 0)], squares + y[(k, 0)].powi(2));
            }
        }
        let percent = 100.0 * (1.0 - (errors / (squares - sum * sum / count)).sqrt());
        assert!((percent - found.fit.percent[0]).abs() < 1e-9, "{method:?}: {percent} {}", found.fit.percent[0]);
    }
}

#[test]
fn records_without_noise_are_factored_by_qr() {
    let system = random_system(&[0.95], 1, 1, false, 23);
    let u = uniform(400, 1, &mut ChaCha8Rng::seed_from_u64(24));
    let y = respond(&system, &u, 0.0, None);
    let found = subspace(&one(&u, &y), clock(), &fixed(2, 5)).unwrap();
    assert_eq!(found.factor.by, Factorisation::Qr);
    assert!(distance(&found.model, &system) < 1e-9);
}

#[test]
fn bad_samples_and_constant_channels_are_refused() {
    let records = records();
    let experiments = views(&records[1..]);
    let run = |experiments: &[Experiment<'_>]| subspace(experiments, clock(), &fixed(4, 6));
    let (u, mut y) = records[0].clone();
    y[(250_000, 1)] = f64::INFINITY;
    let late = [experiments[0], Experiment::new(u.as_ref(), y.as_ref())];
    let error = run(&late).unwrap_err();
    let place = "the output record of experiment 2 holds a value that is not finite in row 250001, column 2";
    assert!(error.to_string().starts_with(place), "{error}");
    // Constant but for one sample far behind, or constant at a value of its own in each experiment.
    let (mut y, at) = (y, records[0].0.nrows() - 1);
    y.col_mut(1).fill(2.0);
    y[(at, 1)] = 2.5;
    let moves = run(&[Experiment::new(u.as_ref(), y.as_ref())]);
    assert!(!matches!(moves, Err(Error::ConstantChannel { .. })));
    y[(at, 1)] = 2.0;
    let mut other = records[1].1.clone();
    other.col_mut(1).fill(3.0);
    let still = [Experiment::new(u.as_ref(), y.as_ref()), Experiment::new(experiments[0].u, other.as_ref())];
    let error = run(&still).unwrap_err();
    assert!(matches!(error, Error::ConstantChannel { ref what, value: 2.0 } if what == "output channel 2"), "{error}");
}
