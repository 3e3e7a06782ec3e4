//! Records of any length: the same model from a stream as from memory.

use super::*;
use crate::Error;
use crate::signal::SampleStream;
use faer::MatMut;

/// Experiments that count the passes over them; in one of these the last samples may be lost.
struct Handed<'a> {
    inner: ExperimentStream<'a>,
    passes: usize,
    lost_in_pass: Option<usize>,
}

impl SampleStream for Handed<'_> {
    fn inputs(&self) -> usize {
        self.inner.inputs()
    }
    fn outputs(&self) -> usize {
        self.inner.outputs()
    }
    fn rewind(&mut self) -> Result<()> {
        self.passes += 1;
        self.inner.rewind()
    }
    fn read(&mut self, mut rows: MatMut<'_, f64>) -> Result<usize> {
        let lost = usize::from(self.lost_in_pass == Some(self.passes));
        // Values that are left over in the rows must not matter.
        rows.fill(f64::NAN);
        Ok(self.inner.read(rows)?.saturating_sub(lost))
    }
    fn next_experiment(&mut self) -> Result<bool> {
        self.inner.next_experiment()
    }
}

/// Two inputs, two outputs with noise: one experiment over several batches, two that share one.
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

/// To the last bit.
fn same(left: &SubspaceModel, right: &SubspaceModel) {
    assert_eq!(left.model, right.model);
    assert_eq!((&left.singular_values, &left.initial_states), (&right.singular_values, &right.initial_states));
    assert_eq!((&left.fit, left.factor, left.columns), (&right.fit, right.factor, right.columns));
}

/// To rounding errors.
fn close(left: &SubspaceModel, right: &SubspaceModel) {
    assert!(distance(&left.model, &right.model) < 1e-9, "{:.1e}", distance(&left.model, &right.model));
    assert_eq!((left.factor.by, left.columns, left.fit.rank), (right.factor.by, right.columns, right.fit.rank));
    let pairs =
        left.singular_values.iter().zip(&right.singular_values).chain(left.fit.percent.iter().zip(&right.fit.percent));
    let numbers = left.initial_states.iter().flatten().zip(right.initial_states.iter().flatten());
    for (one, other) in pairs.chain(numbers) {
        assert!((one - other).abs() < 1e-8 * left.singular_values[0].max(1.0), "{one} {other}");
    }
}

#[test]
fn a_stream_gives_the_model_of_the_memory() {
    let records = records();
    let experiments = views(&records);
    for method in [SubspaceMethod::Moesp, SubspaceMethod::PbsidOpt] {
        for (factorisation, passes) in [(Factorisation::Auto, 2), (Factorisation::Qr, 2)] {
            let options = SubspaceOptions { method, factorisation, ..fixed(4, 6) };
            let inner = ExperimentStream::new(&experiments).unwrap();
            let mut stream = Handed { inner, passes: 0, lost_in_pass: None };
            let streamed = subspace_stream(&mut stream, clock(), &options).unwrap();
            assert_eq!(stream.passes, passes);
            let whole = subspace(&experiments, clock(), &options).unwrap();
            close(&streamed, &whole);
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            same(&whole, &one.install(|| subspace(&experiments, clock(), &options)).unwrap());
            same(&streamed, &one.install(|| subspace_stream(&mut stream, clock(), &options)).unwrap());
        }
    }
}

/// The sums over batches are those over the whole record: R'R by the plain product, the fit by simulation.
#[test]
fn batches_leave_no_seam() {
    let records = records();
    let experiments = views(&records);
    let options = SubspaceOptions { scaling: ChannelScaling::None, ..fixed(4, 3) };
    for factorisation in [Factorisation::Gram, Factorisation::Qr] {
        let options = SubspaceOptions { factorisation, ..options.clone() };
        let (triangle, _, _) =
            super::super::stream::factor(&mut ExperimentStream::new(&experiments).unwrap(), &options).unwrap();
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
        let r = triangle.arranged(super::super::hankel_layout::HankelLayout::InputsFirst, 3, 3).unwrap();
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
fn records_without_noise_take_more_passes() {
    let system = random_system(&[0.95], 1, 1, false, 23);
    let u = uniform(400, 1, &mut ChaCha8Rng::seed_from_u64(24));
    let y = respond(&system, &u, 0.0, None);
    let experiments = one(&u, &y);
    let mut stream = Handed { inner: ExperimentStream::new(&experiments).unwrap(), passes: 0, lost_in_pass: None };
    let found = subspace_stream(&mut stream, clock(), &fixed(2, 5)).unwrap();
    // The Gram matrix, QR; sums of products, rows.
    assert_eq!((stream.passes, found.factor.by), (4, Factorisation::Qr));
    assert!(distance(&found.model, &system) < 1e-9);
}

#[test]
fn streams_are_checked() {
    let records = records();
    let experiments = views(&records[1..]);
    let run = |experiments: &[Experiment<'_>], lost_in_pass| {
        let mut stream = Handed { inner: ExperimentStream::new(experiments)?, passes: 0, lost_in_pass };
        subspace_stream(&mut stream, clock(), &fixed(4, 6))
    };
    assert!(matches!(run(&experiments, Some(2)), Err(Error::RecordChanged)));
    let (u, mut y) = records[0].clone();
    y[(250_000, 1)] = f64::INFINITY;
    let late = [experiments[0], Experiment::new(u.as_ref(), y.as_ref())];
    let error = run(&late, None).unwrap_err();
    let place = "the output record of experiment 2 holds a value that is not finite in row 250001, column 2";
    assert!(error.to_string().starts_with(place), "{error}");
    // Constant but for one sample far behind, or constant at a value of its own in each experiment.
    let (mut y, at) = (y, records[0].0.nrows() - 1);
    y.col_mut(1).fill(2.0);
    y[(at, 1)] = 2.5;
    let moves = run(&[Experiment::new(u.as_ref(), y.as_ref())], None);
    assert!(!matches!(moves, Err(Error::ConstantChannel { .. })));
    y[(at, 1)] = 2.0;
    let mut other = records[1].1.clone();
    other.col_mut(1).fill(3.0);
    let still = [Experiment::new(u.as_ref(), y.as_ref()), Experiment::new(experiments[0].u, other.as_ref())];
    let error = run(&still, None).unwrap_err();
    assert!(matches!(error, Error::ConstantChannel { ref what, value: 2.0 } if what == "output channel 2"), "{error}");
}
