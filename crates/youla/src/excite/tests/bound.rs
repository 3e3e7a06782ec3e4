//! The bound against what estimates reach, and for plants of all kinds.

use super::*;

/// Prediction error of output-error models on y = G u + n in closed loop, by Gauss-Newton on the difference equation from the truth on:
/// another parametrisation and another domain than the bound's. 300 estimates determine a standard deviation to 4 %.
#[test]
fn the_bound_is_what_prediction_error_reaches() {
    const RUNS: usize = 300;
    const NOISE: f64 = 0.01;
    let plant = plant(-0.3);
    let options = ExciteOptions {
        length: Length::Samples(1500),
        noise: vec![NOISE],
        damping_deviation: Some(1e-4),
        ..usual(Shape::Multisine)
    };
    let found = excite(&plant.on(), &options).unwrap();
    let [bound] = found.summary.modes[..] else { panic!("one mode") };
    let closed = crate::control::closed_loop(&plant.nominal, &plant.controller).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let estimates: Vec<[f64; 2]> = (0..RUNS)
        .map(|_| {
            let alpha = Mat::from_fn(found.u.nrows(), 1, |k, _| if k < 1500 { found.alpha[(k, 0)] } else { 0.0 });
            let noise = Mat::from_fn(alpha.nrows(), 1, |_, _| NOISE * rng.sample::<f64, _>(StandardNormal));
            let driving = crate::linalg::block(&[&[alpha.as_ref(), noise.as_ref()]]);
            let z = simulate(&closed, driving.as_ref(), &[0.0; 2]).unwrap();
            estimate(plant.coefficients, z.subcols(0, 1), z.subcols(1, 1))
        })
        .collect();
    let ratio = |k: usize, bound: f64| {
        let mean = estimates.iter().map(|e| e[k]).sum::<f64>() / RUNS as f64;
        (estimates.iter().map(|e| (e[k] - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64).sqrt() / bound
    };
    let (hz, zeta) = (ratio(0, bound.hz_deviation.unwrap()), ratio(1, bound.zeta_deviation.unwrap()));
    assert!((0.85..1.15).contains(&hz) && (0.85..1.15).contains(&zeta), "{hz:.3} {zeta:.3}");
    // Four times as long at half the deviation, by the stated law and by computing it again.
    let needed = bound.needed.unwrap();
    let expected = 1.5 * (bound.zeta_deviation.unwrap() / 1e-4).powi(2);
    assert!((needed / expected - 1.0).abs() < 1e-12 && found.summary.needed == Some(needed));
    let longer = excite(&plant.on(), &ExciteOptions { length: Length::Samples(6000), ..options }).unwrap();
    let gain = bound.zeta_deviation.unwrap() / longer.summary.modes[0].zeta_deviation.unwrap();
    assert!((1.8..2.2).contains(&gain), "{gain}");
}

/// Natural frequency and damping ratio of the output-error estimate.
fn estimate(start: [f64; 4], u: MatRef<'_, f64>, y: MatRef<'_, f64>) -> [f64; 2] {
    let n = u.nrows();
    let mut theta = start;
    for _ in 0..4 {
        let [a1, a2, b1, b2] = theta;
        let filtered = |drive: &dyn Fn(usize) -> f64| {
            let mut x = vec![0.0; n];
            for k in 0..n {
                let back = |d: usize| if k >= d { x[k - d] } else { 0.0 };
                x[k] = drive(k) - a1 * back(1) - a2 * back(2);
            }
            x
        };
        let at = |x: &dyn Fn(usize) -> f64, k: usize, d: usize| if k >= d { x(k - d) } else { 0.0 };
        let input = |k: usize| u[(k, 0)];
        let model = filtered(&|k| b1 * at(&input, k, 1) + b2 * at(&input, k, 2));
        let (by_u, by_model) = (filtered(&input), filtered(&|k| model[k]));
        let psi = Mat::from_fn(n, 4, |k, j| {
            let source = if j < 2 { &by_model } else { &by_u };
            let sign = if j < 2 { -1.0 } else { 1.0 };
            sign * at(&|k| source[k], k, j % 2 + 1)
        });
        let e = Mat::from_fn(n, 1, |k, _| y[(k, 0)] - model[k]);
        use faer::linalg::solvers::SolveLstsq;
        let step = psi.qr().solve_lstsq(&e);
        (0..4).for_each(|j| theta[j] += step[(j, 0)]);
    }
    let [a1, a2, ..] = theta;
    let pole = c64::new(-a1 / 2.0, (a2 - a1 * a1 / 4.0).sqrt());
    let found = mode(Discrete::new(TS).unwrap(), pole);
    [found.hz, found.zeta]
}

/// The same system in two forms, an unstable plant, delays and an integrator.
#[test]
fn the_bound_holds_for_plants_of_all_kinds() {
    let deviation = |plant: &Plant, shape: Shape| {
        let options = ExciteOptions { noise: vec![0.1], ..usual(shape) };
        excite(&plant.on(), &options).unwrap().summary.modes
    };
    let simple = plant(-0.3);
    let expected = deviation(&simple, Shape::Multisine)[0].zeta_deviation.unwrap();
    // Three samples of delay: a shift, which leaves the information what it is.
    let time = simple.nominal.time();
    let delay = StateSpace::new(
        Mat::from_fn(3, 3, |i, j| if j + 1 == i { 1.0 } else { 0.0 }),
        Mat::from_fn(3, 1, |i, _| if i == 0 { 1.0 } else { 0.0 }),
        Mat::from_fn(1, 3, |_, j| if j == 2 { 1.0 } else { 0.0 }),
        Mat::zeros(1, 1),
        time,
    )
    .unwrap();
    let quiet = StateSpace::gain(Mat::zeros(1, 1), time).unwrap();
    let open = Plant { controller: with_input_port(&quiet).unwrap(), ..plant(0.0) };
    let alone = deviation(&open, Shape::Multisine)[0].zeta_deviation.unwrap();
    let delayed = Plant { nominal: open.nominal.then(&delay).unwrap(), ..plant(0.0) };
    let late = deviation(&delayed, Shape::Multisine);
    assert!((late[0].zeta_deviation.unwrap() / alone - 1.0).abs() < 1e-6, "{late:?} {alone}");
    assert!((alone / expected - 1.0).abs() < 0.5);
    // Twice the noise, twice the deviation; an excitation of a fifth, five times.
    let options = ExciteOptions { noise: vec![0.2], amplitude: vec![0.1], ..usual(Shape::Multisine) };
    let worse = excite(&simple.on(), &options).unwrap().summary.modes[0].zeta_deviation.unwrap();
    assert!((worse / expected - 10.0).abs() < 1e-6);
    let mut unstable = plant(-0.3);
    let growing =
        unstable.nominal.a().to_owned() * Scale(1.003 / unstable.nominal.worst_pole().unwrap().unwrap().norm());
    let (b, c) = (unstable.nominal.b().to_owned(), unstable.nominal.c().to_owned());
    unstable.nominal = StateSpace::new(growing, b, c, Mat::zeros(1, 1), time).unwrap();
    let damper = StateSpace::new(
        Mat::zeros(1, 1),
        eye(1),
        Mat::from_fn(1, 1, |_, _| 3.0),
        Mat::from_fn(1, 1, |_, _| -3.0),
        time,
    )
    .unwrap();
    unstable.controller = with_input_port(&damper).unwrap();
    let found = deviation(&unstable, Shape::Multisine);
    assert!(found[0].zeta < 0.0 && found[0].zeta_deviation.is_some_and(|d| d > 0.0 && d < 1.0), "{found:?}");
}
