//! Several starts.

use super::{bearing, open_loop, time, truth};
use crate::{Error, GreyBoxOptions, MultiStart, MultiStartOptions, Problem, greybox_multi_start};
use youla::identify::subspace::InitialState;

fn pem() -> GreyBoxOptions {
    GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() }
}

#[test]
fn several_starts_do_not_depend_on_the_number_of_threads() {
    let log = open_loop(600, [0.2; 2], &[0.0; 6], 3);
    let start: Vec<f64> = truth().iter().map(|v| 0.25 * v).collect();
    let options = MultiStartOptions { starts: 9, searched: Some(5), pem: pem(), ..Default::default() };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| greybox_multi_start(&Problem::new(bearing(), &[log.experiment()], time()), &start, &options))
            .unwrap()
    };
    let bits = |found: &MultiStart| {
        let costs = found.runs.iter().map(|r| r.cost_at_start.to_bits()).collect::<Vec<_>>();
        let ends =
            found.runs.iter().map(|r| r.end.as_ref()?.as_ref().ok().map(|e| e.cost.to_bits())).collect::<Vec<_>>();
        (found.won, found.model.parameters.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), costs, ends)
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(bits(&one), bits(&three));
    assert_eq!(one.runs[0].start, start);
    // The five searched ones are those with the lowest criterion, and the winner is the lowest of them.
    let highest = one.runs.iter().filter(|r| r.end.is_some()).map(|r| r.cost_at_start).fold(0.0, f64::max);
    assert!(one.runs.iter().filter(|r| r.end.is_none()).all(|r| r.cost_at_start >= highest));
    let end = |run: &crate::StartRun| run.end.as_ref().unwrap().as_ref().unwrap().cost;
    assert!(one.runs.iter().filter(|r| r.end.is_some()).all(|r| end(r) >= one.model.cost));
    assert_eq!(end(&one.runs[one.won]), one.model.cost);
}

#[test]
fn options_without_meaning_are_refused() {
    let log = open_loop(300, [0.2; 2], &[0.0; 6], 3);
    let (theta, records) = (truth(), [log.experiment()]);
    let several =
        |options: MultiStartOptions| greybox_multi_start(&Problem::new(bearing(), &records, time()), &theta, &options);
    for bad in [
        MultiStartOptions { starts: 0, ..Default::default() },
        MultiStartOptions { searched: Some(0), ..Default::default() },
        MultiStartOptions { factor: 0.5, ..Default::default() },
        MultiStartOptions { factor: f64::NAN, ..Default::default() },
    ] {
        assert!(matches!(several(bad.clone()), Err(Error::Method(youla::Error::OutOfRange { .. }))), "{bad:?}");
    }
    let short =
        greybox_multi_start(&Problem::new(bearing(), &records, time()), &theta[1..], &MultiStartOptions::default());
    assert!(matches!(short, Err(Error::Method(youla::Error::Shape { .. }))));
}
