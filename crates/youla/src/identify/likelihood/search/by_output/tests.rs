use super::*;
use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::energy;
use crate::identify::subspace::Experiment;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Two inputs, eight outputs, three states, two records, coloured noise: the sum of squares, its slopes and those along a step.
#[test]
fn slopes_by_outputs_are_those_of_the_residual() {
    let rng = &mut ChaCha8Rng::seed_from_u64(8);
    let mut random = || rng.random::<f64>() - 0.5;
    let mut many = |count: usize| (0..count).map(|_| random()).collect::<Vec<f64>>();
    let (m, p) = (2, 8);
    let signal = |values: Vec<f64>, c: usize| Mat::from_fn(values.len() / c, c, |t, j| values[t * c + j]);
    let signals = [90, 70].map(|rows| (signal(many(rows * m), m), signal(many(rows * p), p)));
    let records = signals.each_ref().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref()));
    let spectra = Spectra::new(&records, &Sizes::of(&records), &[0; 2], 0);
    let pair = Block { states: 2, a: vec![0.8, 0.4, -0.5, 0.7], b: many(2 * m), c: many(2 * p) };
    let lag = Block { states: 1, a: vec![0.6], b: many(m), c: many(p) };
    let model = Model { inputs: m, outputs: p, blocks: vec![pair, lag], d: many(m * p) };
    let point = Point { ends: vec![many(3 + p), many(3 + p)], model };
    let mut noise = Noise::white(p);
    (0..p).for_each(|o| {
        noise.regression[o].coefficients = vec![-0.3 + 0.1 * o as f64];
        noise.root[(o, o)] = 1.0 + o as f64;
    });
    let chart = Chart::by_outputs(&point.model, true);
    assert_eq!(chart.parameters(), 3 * (m + p) + m * p);
    let normal = Normal::new(&spectra, &point, &chart, &noise, Ends::Shared);
    let squares = |point: &Point| energy(&spectra, &point.residuals(&spectra), &noise);
    let last = normal.grams[0].nrows() - 1;
    let own: f64 = normal.grams.iter().map(|gram| gram[(last, last)]).sum();
    assert!((own / squares(&point) - 1.0).abs() < 1e-12);
    let mut slopes = vec![0.0; chart.parameters()];
    for (gram, places) in normal.grams.iter().zip(&normal.columns.own) {
        places.iter().enumerate().for_each(|(k, place)| slopes[*place] = gram[(last, normal.columns.nuisance() + k)]);
        let plant = normal.columns.plant.iter().enumerate();
        plant.for_each(|(k, entry)| slopes[entry.place] += gram[(last, normal.own + k)]);
    }
    let step = 1e-6;
    for (q, slope) in slopes.iter().enumerate() {
        let moved = |by: f64| {
            let along: Vec<f64> = (0..slopes.len()).map(|k| if k == q { by } else { 0.0 }).collect();
            squares(&Point { model: chart.moved(&point.model, &along), ends: point.ends.clone() })
        };
        let difference = (moved(-step) - moved(step)) / (4.0 * step);
        assert!((difference - slope).abs() < 1e-6 * own, "{q}: {difference} and {slope}");
    }
    // Along a step without damping the slope of the sum of squares is twice what the step promises, t and drifts included.
    let (parameters, ends, promised) = normal.step(0.0);
    let moved = |by: f64| {
        let scaled: Vec<f64> = parameters.iter().map(|s| by * s).collect();
        let end = |(end, change): (&Vec<f64>, &Vec<f64>)| end.iter().zip(change).map(|(e, c)| e + by * c).collect();
        let ends = point.ends.iter().zip(&ends).map(end).collect();
        squares(&Point { model: chart.moved(&point.model, &scaled), ends })
    };
    let along = (moved(-step) - moved(step)) / (2.0 * step);
    assert!((along / (2.0 * promised) - 1.0).abs() < 1e-5, "{along} and {promised}");
}
