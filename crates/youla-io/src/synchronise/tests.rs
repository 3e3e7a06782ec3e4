use super::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const TS: f64 = 0.0025;

/// Input, output and set point of a loop, a row for each cycle: y(k+1) = 0.9 y + 0.2 u + v, u = 2 (r - y) - 0.5 u(k-1).
fn truth(n: usize, rng: &mut ChaCha8Rng) -> [Vec<f64>; 3] {
    let (mut x, mut u) = (0.0, 0.0);
    let mut columns = [vec![], vec![], vec![]];
    let mut r = 0.0;
    for k in 0..n {
        let mut normal = || -> f64 { rng.sample(StandardNormal) };
        if k % 20 == 0 {
            r = normal();
        }
        let y = x + 0.05 * normal();
        u = 2.0 * (r - y) - 0.5 * u;
        x = 0.9 * x + 0.2 * u;
        for (column, value) in columns.iter_mut().zip([u, y, r]) {
            column.push(value);
        }
    }
    columns
}

const ROLES: [ChannelRole; 3] = [ChannelRole::Input, ChannelRole::Output, ChannelRole::External];

/// The log of the truth: each channel with its own delay, scatter of the stamps, and share of dropped samples.
fn logged(
    truth: &[Vec<f64>; 3],
    (late, scatter, drop): ([f64; 3], f64, f64),
    rng: &mut ChaCha8Rng,
) -> Vec<StampedChannel> {
    let channel = |c: usize| {
        let mut times = Vec::new();
        let mut values = Vec::new();
        for (k, value) in truth[c].iter().enumerate() {
            let jitter = scatter * (rng.random::<f64>() - 0.5);
            if rng.random::<f64>() >= drop || k < 3 {
                // The clock of the logger is 80 ppm slow, so that it slips by cycles over the record.
                times.push(7.0 + TS * (1.0 + 8e-5) * (k as f64 + late[c] + jitter));
                values.push(*value);
            }
        }
        times.sort_by(f64::total_cmp);
        let name = ["u", "y", "r"][c];
        StampedChannel { channel: Channel::new(name, ""), role: ROLES[c], changes_only: false, times, values }
    };
    (0..3).map(channel).collect()
}

/// The set point, written when it changes.
fn on_change(channel: &mut StampedChannel) {
    let kept: Vec<usize> =
        (0..channel.values.len()).filter(|&k| k == 0 || channel.values[k] != channel.values[k - 1]).collect();
    channel.times = kept.iter().map(|&k| channel.times[k]).collect();
    channel.values = kept.iter().map(|&k| channel.values[k]).collect();
    channel.changes_only = true;
}

fn of(channels: &[StampedChannel]) -> Result<Synchronised> {
    synchronise("log", channels, Discrete::new(TS).unwrap())
}

/// Scatter of half a cycle, delays of the channels, a drifting clock and a set point that is written on change: every row is the truth.
#[test]
fn rows_are_those_of_the_cycles() {
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let truth = truth(20_000, &mut rng);
        let late = [rng.random::<f64>() * 0.8, 0.0, -0.1].map(|x| x + rng.random::<f64>() * 0.05);
        let mut channels = logged(&truth, (late, 0.5, 0.0), &mut rng);
        on_change(&mut channels[2]);
        let found = of(&channels).unwrap();
        assert_eq!((found.records.len(), found.left_out), (1, 0));
        let record = &found.records[0];
        let first = (0..5).find(|&k| truth[1][k] == record.column("y").unwrap()[0]).unwrap();
        for (c, name) in ["u", "y", "r"].into_iter().enumerate() {
            let rows = record.column(name).unwrap();
            assert!(rows.len() > 19_990 && rows == &truth[c][first..first + rows.len()], "seed {seed}, {name}");
        }
        assert!((found.drift - 8e-5).abs() < 2e-6, "{}", found.drift);
        let delay = found.timing[0].delay.unwrap() / TS;
        assert!((delay - (late[0] - late[1])).abs() < 0.01, "{delay} {late:?}");
        assert_eq!(found.timing[2].placement, Placement::Held);
    }
}

/// Of 2 % dropped samples of each channel the conditional mean is as good as it says, and the input of the feedback is almost exact.
#[test]
fn what_is_filled_is_as_wrong_as_stated() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let truth = truth(40_000, &mut rng);
    let channels = logged(&truth, ([0.4, 0.0, -0.1], 0.3, 0.02), &mut rng);
    let found = of(&channels).unwrap();
    let record = &found.records[0];
    // No sample of the first three cycles is dropped.
    let first = 0;
    assert_eq!(record.column("y").unwrap()[0], truth[1][0]);
    for (c, name) in ["u", "y", "r"].into_iter().enumerate() {
        let rows = record.column(name).unwrap();
        let exact = &truth[c][first..first + rows.len()];
        let size = (exact.iter().map(|v| v * v).sum::<f64>() / rows.len() as f64).sqrt();
        let timing = &found.timing[c];
        let error = rows.iter().zip(exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / timing.filled as f64;
        let error = error.sqrt() / size;
        assert!((600..1000).contains(&timing.filled), "{}", timing.filled);
        // Of the input single errors, where neighbours are missing too, are most of it.
        assert!(error < 1.5 * timing.error + 0.01 && timing.error < 1.5 * error, "{name}: {error} {}", timing.error);
    }
}

/// A pause of the logger cuts the record; both parts begin at their time.
#[test]
fn a_pause_is_a_gap() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let truth = truth(4000, &mut rng);
    let mut channels = logged(&truth, ([0.4, 0.0, -0.1], 0.3, 0.0), &mut rng);
    for c in &mut channels {
        c.times.drain(1000..1500);
        c.values.drain(1000..1500);
    }
    let found = of(&channels).unwrap();
    let samples: Vec<usize> = found.records.iter().map(youla::signal::Record::samples).collect();
    assert_eq!((samples, found.left_out), (vec![1000, 2500], 500));
    assert!((found.records[1].start() - 7.0 - 1500.0 * TS).abs() < TS);
}

/// An output of a faster sensor with its own clock is interpolated between its samples.
#[test]
fn an_output_of_another_clock_is_interpolated() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let truth = truth(4000, &mut rng);
    let mut channels = logged(&truth, ([0.4, 0.0, -0.1], 0.1, 0.0), &mut rng);
    let wave = |t: f64| (400.0 * t).sin() + 0.3 * (150.0 * t).cos();
    let times: Vec<f64> = (0..11_000).map(|k| 7.0 + 0.000_93 * k as f64).collect();
    let values = times.iter().map(|t| wave(*t)).collect();
    let channel = Channel::new("gyro", "");
    channels.push(StampedChannel { channel, role: ChannelRole::Output, changes_only: false, times, values });
    let found = of(&channels).unwrap();
    let (record, timing) = (&found.records[0], &found.timing[3]);
    assert_eq!((timing.placement, timing.delay), (Placement::Interpolated, None));
    let worst = record.column("gyro").unwrap().iter().enumerate().map(|(k, v)| {
        // The clock of the logger is 80 ppm slow.
        (v - wave(record.start() + k as f64 * TS * (1.0 + 8e-5))).abs()
    });
    assert!(worst.fold(0.0, f64::max) < 0.02);
}

#[test]
fn what_cannot_be_brought_to_one_clock_is_refused_with_the_remedy() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let truth = truth(4000, &mut rng);
    let good = logged(&truth, ([0.4, 0.0, -0.1], 0.3, 0.0), &mut rng);
    let refused = |change: &dyn Fn(&mut Vec<StampedChannel>), ts: f64, says: &[&str]| {
        let mut channels = good.clone();
        change(&mut channels);
        let error = synchronise("log", &channels, Discrete::new(ts).unwrap()).unwrap_err().to_string();
        assert!(error.starts_with("log: ") && says.iter().all(|word| error.contains(word)), "{error}");
    };
    let thin = |c: &mut StampedChannel, step: usize| {
        c.times = c.times.iter().copied().step_by(step).collect();
        c.values = c.values.iter().copied().step_by(step).collect();
    };
    refused(&|c| c[0].role = ChannelRole::Output, TS, &["no channel is an input"]);
    refused(&|_| (), 0.0031, &["no output follows the sample time of 0.0031 s", "\"y\" 0.0025"]);
    refused(&|_| (), 0.00125, &["\"u\" has a sample in 50 % of the cycles", "sample time of the controller"]);
    refused(&|_| (), 0.005, &["no input and no output follows"]);
    refused(&|c| thin(&mut c[1], 4), TS, &["\"y\" is logged every 0.0", "faster than 50"]);
    refused(&|c| thin(&mut c[0], 4), TS, &["\"u\"", "written only when it changes"]);
    refused(&|c| c[1].times[7] = 0.0, TS, &["\"y\", sample 8", "decreases", "sort it by time"]);
    refused(&|c| c[1].values[7] = f64::NAN, TS, &["\"y\", sample 8", "not a finite number"]);
    refused(
        &|c| c[1].times.iter_mut().for_each(|t| *t += 100.0),
        TS,
        &["last sample of \"u\" comes before", "of one clock"],
    );
    refused(&|c| c[1].values.clear(), TS, &["4000 times and 0 values"]);
    refused(
        &|c| {
            // A quantised input, written when it changes, but not said to be.
            c[0].values.iter_mut().for_each(|v| *v = v.round());
            on_change(&mut c[0]);
            c[0].changes_only = false;
        },
        TS,
        &["no value repeats the one before", "written only when it changes"],
    );
    refused(&|c| c[1].times[3999] = 1e300, TS, &["the time stamps span more than 1e12 cycles", "in seconds"]);
    refused(
        &|c| c.iter_mut().for_each(|c| c.times.iter_mut().for_each(|t| *t *= 1e6)),
        TS,
        &["median step", "unit of the time"],
    );
    let a_quarter_dropped = logged(&truth, ([0.4, 0.0, -0.1], 0.3, 0.25), &mut rng);
    let error = of(&a_quarter_dropped).unwrap_err().to_string();
    assert!(error.contains("too few rows"), "{error}");
}

/// Hostile stamps end in records of finite numbers or in a sentence.
#[test]
fn any_channels_end_in_records_or_a_sentence() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut records, mut refused) = (0, 0);
    for _ in 0..4000 {
        let scale = 10f64.powi(rng.random_range(-12..12));
        let count = rng.random_range(1..5);
        let channel = |c: usize, rng: &mut ChaCha8Rng| {
            let n = rng.random_range(1..300);
            let (jitter, rate) =
                (10f64.powi(rng.random_range(-6..2)), [1.0, 1.0, 1.0, 0.37, 4.0, 0.0][rng.random_range(0..6)]);
            let mut times: Vec<f64> =
                (0..n).map(|k| scale * (f64::from(k) / f64::max(rate, 1e-3) + jitter * rng.random::<f64>())).collect();
            if rng.random_range(0..20) == 0 {
                times[(n - 1) as usize] = [f64::MAX, -1e9, 1e18][rng.random_range(0..3)];
            }
            times.sort_by(f64::total_cmp);
            let values =
                times.iter().map(|_| rng.random_range(-3..4) as f64 * 10f64.powi(rng.random_range(-3..2))).collect();
            let role = [ChannelRole::Input, ChannelRole::Output, ChannelRole::External]
                [if c < 2 { c } else { rng.random_range(0..3) }];
            let changes_only = rng.random_range(0..4) == 0;
            StampedChannel { channel: Channel::new(format!("c{c}"), ""), role, changes_only, times, values }
        };
        let channels: Vec<StampedChannel> = (0..count).map(|c| channel(c, &mut rng)).collect();
        match synchronise("log", &channels, Discrete::new(scale).unwrap()) {
            Ok(found) => {
                records += 1;
                assert!(found.records.iter().all(|r| r.columns().flatten().all(|v| v.is_finite())));
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().len() < 600, "{error}");
            }
        }
    }
    assert!(records > 200 && refused > 200, "{records} {refused}");
}
