//! Unstable plants, `x+ = 1.1 x + u` and `x+ = 1.05 x + u`, under the loop.

use super::*;
use crate::{Filter, Matrices, OUT_WITHIN};

type Real2<T> = ExcitedLoop<T, 2, 2, 2, 2>;

fn controller() -> Controller<f64, 2, 2, 2> {
    let matrices = Matrices {
        a: [[1.1, 0.0], [0.0, 1.05]],
        b: [[1.0, 0.0], [0.0, 1.0]],
        c: [[1.0, 0.0], [0.0, 1.0]],
        d: [[0.0; 2]; 2],
        f: [[-0.6, 0.0], [0.0, -0.55]],
        l: [[-0.7, 0.0], [0.0, -0.65]],
    };
    Controller::new(matrices).unwrap()
}

fn limits() -> Limits<f64, 2, 2> {
    Limits { y: [50.0; 2], beta: [1.0; 2], u: [20.0; 2], rate: [40.0; 2], clipped: 3, stuck: 4, host: 0, duration: 0 }
}

fn q(gain: f64) -> QCoefficients<f64, 2, 2, 2> {
    QCoefficients { a: [[0.5, 0.1], [0.0, -0.4]], b: [[gain, 0.1], [0.2, gain]], c: [[0.3, 0.0], [0.1, gain]] }
}

fn load(running: &mut Real2<f64>, q: &QCoefficients<f64, 2, 2, 2>) {
    running.begin_q().unwrap();
    q.values().for_each(|value| running.write_q(value).unwrap());
    running.commit_q(q.checksum()).unwrap();
}

/// Plant, noise and a source of two levels around a loop.
struct Bench {
    running: Real2<f64>,
    x: [f64; 2],
    gain: f64,
    seed: u32,
    /// What the sensors make of y.
    sensor: fn([f64; 2]) -> [f64; 2],
}

impl Bench {
    fn new(limits: Limits<f64, 2, 2>, ramp: u16) -> Self {
        let running = ExcitedLoop::new(controller(), limits, ramp).unwrap();
        Bench { running, x: [0.0; 2], gain: 1.0, seed: 1, sensor: |y| y }
    }

    fn excited(limits: Limits<f64, 2, 2>, ramp: u16) -> Self {
        let mut bench = Self::new(limits, ramp);
        bench.running.arm().unwrap();
        bench.running.start().unwrap();
        bench
    }

    fn random(&mut self) -> f64 {
        self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.seed >> 8) / 16_777_216.0 - 0.5
    }

    fn sample(&mut self) -> Row<f64, 2, 2> {
        let wanted = [self.random().signum(), self.random().signum()];
        let u = self.running.command(&wanted);
        let row = self.running.observe(&(self.sensor)(self.x), &u);
        let noise = [0.02 * self.random(), 0.02 * self.random()];
        self.x = [1.1 * self.x[0] + self.gain * u[0] + noise[0], 1.05 * self.x[1] + self.gain * u[1] + noise[1]];
        row
    }
}

#[test]
fn loop_without_q_is_the_controller_bit_by_bit() {
    let mut bench = Bench::excited(limits(), 50);
    let plain = controller();
    let mut state = State::at_rest();
    for k in 0..2000_u32 {
        let row = bench.sample();
        let output = plain.step(&mut state, &row.y, &row.alpha);
        assert_eq!((output.u, output.beta, row.sample), (row.u, row.beta, u64::from(k)));
        let size = row.alpha[0].abs();
        assert!(if k < 50 { (size - f64::from(k) / 50.0).abs() < 1e-12 } else { size == 1.0 }, "{k}: {size}");
        assert_eq!(row.status.phase(), Phase::Exciting);
    }
    bench.running.stop();
    let last = (0..50).map(|_| bench.sample()).last().unwrap();
    assert!(last.alpha[0] != 0.0 && last.status.phase() == Phase::Idle);
    assert_eq!(bench.sample().alpha, [0.0; 2]);
}

#[test]
fn switch_of_q_is_bumpless_and_exact() {
    let mut bench = Bench::excited(limits(), 30);
    (0..100).for_each(|_| _ = bench.sample());
    load(&mut bench.running, &q(0.2));
    bench.running.switch_q().unwrap();
    (0..200).for_each(|_| _ = bench.sample());
    load(&mut bench.running, &q(-0.3));
    let mut before = bench.running.clone();
    bench.running.switch_q().unwrap();
    let wanted = [0.7, -0.2];
    let (kept, switched) = (before.command(&wanted), bench.running.clone().command(&wanted));
    assert!(kept.iter().zip(&switched).all(|(a, b)| (a - b).abs() < 1e-14), "{kept:?} {switched:?}");
    assert!(bench.running.status().is_fading() && bench.running.status().bank() == 2);

    // K(new Q) from rest, excited by the logged alpha: the same loop.
    let new = q(-0.3);
    let filter = Filter::new(new.a, new.b, new.c, [[0.0; 2]; 2]).unwrap();
    let (mut of_q, mut state) = (State::at_rest(), bench.running.state);
    for k in 0..300 {
        let row = bench.sample();
        let port: [f64; 2] = core::array::from_fn(|i| row.alpha[i] + filter.output(&of_q, &[0.0; 2])[i]);
        let output = bench.running.controller().step(&mut state, &row.y, &port);
        filter.step(&mut of_q, &output.beta);
        let error = (output.u[0] - row.u[0]).abs() + (output.u[1] - row.u[1]).abs();
        assert!(error < 1e-12, "{k}: {error}");
        assert!(k < 30 || !row.status.is_fading());
    }
    // Back to the Q before, which is still in its bank.
    bench.running.switch_q().unwrap();
    assert_eq!(bench.running.running_q(), Some(&q(0.2)));
}

#[test]
fn q_is_refused_and_what_runs_goes_on() {
    let mut bench = Bench::new(limits(), 20);
    assert_eq!(bench.running.switch_q(), Err(LoopRefusal::Q(QRefusal::NotLoaded)));
    load(&mut bench.running, &q(0.2));
    bench.running.switch_q().unwrap();
    let good = q(0.1);
    let refuse = |running: &mut Real2<f64>, values: &[f64], checksum: u32| {
        running.begin_q()?;
        values.iter().try_for_each(|value| running.write_q(*value))?;
        running.commit_q(checksum)
    };
    let mut values: [f64; 12] = [0.0; 12];
    good.values().zip(&mut values).for_each(|(value, place)| *place = value);
    let cases =
        [(&values[..11], good.checksum(), QRefusal::Count), (&values[..], good.checksum() ^ 1, QRefusal::Checksum)];
    for (values, checksum, expected) in cases {
        assert_eq!(refuse(&mut bench.running, values, checksum), Err(LoopRefusal::Q(expected)));
        assert_eq!(bench.running.switch_q(), Err(LoopRefusal::Q(QRefusal::NotLoaded)));
    }
    values[3] += 1e-15; // one bit of one coefficient
    assert_eq!(refuse(&mut bench.running, &values, good.checksum()), Err(LoopRefusal::Q(QRefusal::Checksum)));
    values[5] = f64::NAN;
    assert_eq!(refuse(&mut bench.running, &values, 0), Err(LoopRefusal::Q(QRefusal::NotFinite)));
    assert_eq!(bench.running.commit_q(0), Err(LoopRefusal::Q(QRefusal::Count)));
    assert_eq!(bench.running.running_q(), Some(&q(0.2)));
    assert_eq!(bench.sample().status.phase(), Phase::Idle);

    load(&mut bench.running, &good);
    bench.running.switch_q().unwrap();
    assert_eq!(bench.running.begin_q(), Err(LoopRefusal::Q(QRefusal::Fading)));
    (0..20).for_each(|_| _ = bench.sample());
    bench.running.begin_q().unwrap();
}

/// Excites, spoils, and demands: the cause within `delay` samples, alpha and Q at zero 10 samples later, the plant near 0 in the end.
fn trips(cause: Cause, channel: u8, delay: usize, limits: Limits<f64, 2, 2>, spoil: fn(&mut Bench)) {
    for start in [5, 400, 777] {
        let mut bench = Bench::excited(limits, 300);
        load(&mut bench.running, &q(0.1));
        bench.running.switch_q().unwrap();
        (0..start).for_each(|_| assert_eq!(bench.sample().status.trip(), None, "before {cause:?}"));
        spoil(&mut bench);
        let detected = (0..=delay).find(|_| bench.sample().status.trip().is_some());
        let trip = bench.running.status().trip();
        assert!(detected.is_some(), "{cause:?} at {start}");
        assert_eq!(trip, Some(Trip { cause, channel }), "at {start}");
        assert!((1..OUT_WITHIN).all(|_| bench.sample().status.phase() == Phase::Tripped));
        assert_eq!(bench.sample().alpha, [0.0; 2], "{cause:?}");
        assert_eq!(bench.running.status().bank(), 0);
        assert_eq!(bench.running.switch_q(), Err(LoopRefusal::Tripped));
        // The loop stays closed and the log goes on.
        bench.sensor = |y| y;
        let rows = (0..300).map(|_| bench.sample());
        let last = rows.last().unwrap();
        assert!(last.y.iter().all(|y| y.abs() < 0.2), "{cause:?}: {last:?}");
        assert_eq!(bench.running.status().trip(), trip);
        bench.running.arm().unwrap();
        bench.running.start().unwrap();
    }
}

#[test]
fn guard_ends_every_excitation() {
    trips(Cause::SensorNotFinite, 2, 0, limits(), |b| b.sensor = |y| [y[0], f64::NAN]);
    let open = Limits { beta: [f64::INFINITY; 2], ..limits() };
    trips(Cause::SensorStuck, 1, 5, open, |b| b.sensor = |y| [0.25, y[1]]);
    trips(Cause::OutputLimit, 1, 0, open, |b| b.x[0] += 100.0);
    trips(Cause::ResidualLimit, 2, 0, limits(), |b| b.x[1] += 2.0);
    trips(Cause::ResidualLimit, 1, 300, Limits { beta: [0.2, f64::INFINITY], ..limits() }, |b| b.gain = 0.5);
    trips(Cause::InputLimit, 1, 10, Limits { y: [f64::INFINITY; 2], ..open }, |b| {
        b.x[0] = 120.0;
        b.running.u = [0.0; 2];
    });
}

#[test]
fn times_and_refused_data_end_the_excitation() {
    let mut bench = Bench::excited(Limits { duration: 40, ..limits() }, 10);
    assert!((0..40).all(|_| bench.sample().status.trip().is_none()));
    assert_eq!(bench.sample().status.trip(), Some(Trip::new(Cause::TimeOver)));

    let mut bench = Bench::excited(Limits { host: 20, ..limits() }, 10);
    for k in 0..100 {
        if k % 20 == 0 {
            bench.running.heard();
        }
        assert_eq!(bench.sample().status.trip(), None);
    }
    let until = (0..100).find(|_| bench.sample().status.trip().is_some());
    assert_eq!((until, bench.running.status().trip()), (Some(0), Some(Trip::new(Cause::HostSilent))));

    let mut bench = Bench::excited(limits(), 10);
    bench.running.begin_q().unwrap();
    assert!(bench.running.commit_q(7).is_err());
    assert_eq!(bench.sample().status.trip(), Some(Trip::new(Cause::QRefused)));
    let mut running = Bench::excited(limits(), 10).running;
    let _ = running.command(&[f64::NAN, 0.0]);
    assert_eq!(running.observe(&[0.1; 2], &[0.0; 2]).status.trip(), Some(Trip::new(Cause::ExcitationNotFinite)));
}

#[test]
fn states_and_requests() {
    let mut running = Real2::new(controller(), limits(), 10).unwrap();
    assert_eq!(running.start(), Err(LoopRefusal::NotArmed));
    let spoiled = Limits { rate: [1.0, f64::NAN], ..limits() };
    assert_eq!(Real2::new(controller(), spoiled, 10), Err(LoopRefusal::Limits));
    let row = running.observe(&[f64::NAN, 1.0], &[f64::NAN; 2]);
    assert_eq!((row.beta[0], row.u), (0.0, [0.0; 2]));
    assert!(row.status.is_masked(1) && !row.status.is_masked(2) && row.y[0].is_nan());
    assert_eq!(running.arm(), Err(LoopRefusal::Sensor));
    assert_eq!(Status::from_bits(f64::from(row.status.bits() as f32) as u32), row.status);
    let _ = running.observe(&[0.0, 1.0], &[0.0; 2]);
    running.arm().unwrap();
    running.start().unwrap();
    assert_eq!(running.arm(), Err(LoopRefusal::Exciting));
}

/// A step of 10 at most 3 per sample, at most 5 in all.
#[test]
fn command_keeps_size_and_rate() {
    let open = Limits { y: [f64::INFINITY; 2], beta: [f64::INFINITY; 2], clipped: 0, stuck: 0, ..limits() };
    let mut running = Real2::<f64>::new(controller(), Limits { u: [5.0; 2], rate: [3.0; 2], ..open }, 1).unwrap();
    running.arm().unwrap();
    running.start().unwrap();
    let mut given = || {
        let u = running.command(&[10.0, -10.0]);
        (u, running.observe(&[0.0; 2], &u).status.is_clipped())
    };
    given();
    assert_eq!([given(), given()], [([3.0, -3.0], true), ([5.0, -5.0], true)]);
}

/// Single precision is the double-precision loop to 1e-5 of the largest value.
#[test]
fn single_precision() {
    let single = controller().to_f32().unwrap();
    let infinite = Limits {
        y: [f32::INFINITY; 2],
        beta: [f32::INFINITY; 2],
        u: [f32::INFINITY; 2],
        rate: [f32::INFINITY; 2],
        clipped: 0,
        stuck: 0,
        host: 0,
        duration: 0,
    };
    let mut running = ExcitedLoop::<f32, 2, 2, 2, 2>::new(single, infinite, 1).unwrap();
    running.arm().unwrap();
    running.start().unwrap();
    let mut bench = Bench::excited(limits(), 1);
    let mut x = [0.0_f64; 2];
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for _ in 0..20_000 {
        let before = bench.x;
        let row = bench.sample();
        let u = running.command(&row.alpha.map(|a| a as f32));
        let _ = running.observe(&x.map(|x| x as f32), &u);
        let noise: [f64; 2] = core::array::from_fn(|i| bench.x[i] - [1.1, 1.05][i] * before[i] - row.u[i]);
        x = core::array::from_fn(|i| [1.1, 1.05][i] * x[i] + f64::from(u[i]) + noise[i]);
        worst = (0..2).fold(worst, |worst, i| worst.max((f64::from(u[i]) - row.u[i]).abs()));
        largest = largest.max(row.u[0].abs());
    }
    assert!(worst > 0.0 && worst < 1e-5 * largest, "{worst} of {largest}");
}
