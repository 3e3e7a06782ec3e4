use super::*;
use crate::identify::subspace::records::view::Signals;
use crate::identify::subspace::{Experiment, SubspaceOptions};

/// Two inputs and one output with noise, in experiments of unequal length.
fn experiments(noise: f64) -> Vec<(Mat<f64>, Mat<f64>)> {
    let wave = |k: usize, seed: usize| ((k * k * (seed + 2) + 7 * k) as f64 * 0.37).sin();
    let experiment = |samples: usize, seed: usize| {
        let u = Mat::from_fn(samples, 2, |k, j| wave(k, seed + 3 * j));
        let mut y = Mat::zeros(samples, 1);
        for k in 2..samples {
            let clean = 1.6 * y[(k - 1, 0)] - 0.8 * y[(k - 2, 0)] + u[(k - 1, 0)] - 0.4 * u[(k - 2, 1)];
            y[(k, 0)] = clean + noise * wave(k, seed + 11);
        }
        (u, y)
    };
    vec![experiment(9000, 1), experiment(700, 2)]
}

fn factors(noise: f64, horizon: usize, by: Factorisation) -> Result<HankelLq> {
    let records = experiments(noise);
    let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
    let data = Channels::new(&experiments, &SubspaceOptions { horizon, ..Default::default() })?;
    HankelLq::new(&data, (horizon, horizon), HankelLayout::InputsFirst, by)
}

/// Rows of R with a positive diagonal.
fn normal(r: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] * r[(i, i)].signum())
}

#[test]
fn gram_and_qr_give_the_same_factor() {
    for horizon in [2, 7, 20] {
        let [gram, qr] = [Factorisation::Auto, Factorisation::Qr].map(|by| factors(0.3, horizon, by).unwrap());
        assert_eq!((gram.report.by, qr.report.by), (Factorisation::Gram, Factorisation::Qr));
        let (one, other) = (normal(&gram.r), normal(&qr.r));
        let error = (&one - &other).norm_max() / other.norm_max();
        assert!(error < 1e-11, "horizon {horizon}: {error:.1e}");
        let sigma = Mat::from_fn(qr.r.ncols(), qr.r.ncols(), |i, j| qr.r[(i, j)] / qr.r.col(j).norm_l2());
        let sigma = sigma.singular_values().unwrap();
        let ratio = gram.report.condition.unwrap() / (sigma[0] / sigma[sigma.len() - 1]);
        assert!((0.5..1.0 + 1e-9).contains(&ratio), "horizon {horizon}: {ratio}");
    }
}

#[test]
fn data_without_noise_are_left_to_qr() {
    let found = factors(0.0, 7, Factorisation::Auto).unwrap();
    assert_eq!(found.report.by, Factorisation::Qr);
    let refused = factors(0.0, 7, Factorisation::Gram);
    assert!(matches!(refused.err(), None | Some(Error::Singular { .. })));
    let nearly = factors(1e-6, 7, Factorisation::Auto).unwrap();
    assert_eq!(nearly.report.by, Factorisation::Qr);
    assert!(nearly.report.condition.is_some_and(|condition| condition > gram::LIMIT));
}

#[test]
fn a_shorter_horizon_comes_from_the_same_factor() {
    let records = experiments(0.3);
    let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
    let data = Channels::new(&experiments, &SubspaceOptions { horizon: 9, ..Default::default() }).unwrap();
    let whole = HankelLq::new(&data, (9, 9), HankelLayout::InputsFirst, Factorisation::Qr).unwrap();
    let r = whole.arranged(HankelLayout::Chronological, 4, 3).unwrap();
    // The Gram matrix of the same rows over the same columns.
    let places = HankelLayout::Chronological.places(2, 1, 4, 3);
    let shifted: Vec<usize> = places.iter().map(|place| place + 5 * 3).collect();
    let scaled = data.scaled();
    let rows = RowMap::new(scaled.iter().map(Signals::view).collect(), 18, &shifted);
    let mut hankel = Mat::zeros(rows.total, shifted.len());
    rows.fill(0, hankel.as_mut());
    let gram = hankel.transpose() * &hankel;
    let error = (r.transpose() * &r - &gram).norm_max() / gram.norm_max();
    assert!(error < 1e-13, "{error:.1e}");
    assert!(whole.arranged(HankelLayout::Chronological, 10, 3).is_err());
}
