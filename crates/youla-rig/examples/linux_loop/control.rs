//! The loop: sleep, command, measure, observe, and at most one frame.

use crate::lateness::Lateness;
use crate::link::{Letter, LoopEnd};
use crate::machine::Rig;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use std::sync::atomic::Ordering;
use youla_rig::Plant;

const SECOND: u64 = 1_000_000_000;

/// Nanoseconds of the monotonic clock.
fn now() -> u64 {
    let time = clock_gettime(ClockId::Monotonic);
    time.tv_sec as u64 * SECOND + time.tv_nsec as u64
}

/// Absolute, so that what a sample takes does not add up. A signal may end the sleep early.
fn sleep_until(time: u64) -> std::io::Result<()> {
    let until = Timespec { tv_sec: (time / SECOND) as i64, tv_nsec: (time % SECOND) as _ };
    loop {
        match clock_nanosleep_absolute(ClockId::Monotonic, &until) {
            Err(rustix::io::Errno::INTR) => (),
            other => return Ok(other?),
        }
    }
}

/// Sample k begins at `begin + k period`. One that is late is not left out, since the log counts samples: row k stays time k.
pub(crate) fn run(
    mut rig: Rig<'_>,
    mut plant: impl Plant<1, 1>,
    end: LoopEnd,
    period: u64,
    samples: u64,
) -> std::io::Result<Lateness> {
    let mut lateness = Lateness::new(period);
    let begin = now() + period;
    for sample in 0..samples {
        let due = begin + sample * period;
        sleep_until(due)?;
        let started = now();
        if end.stop.swap(false, Ordering::Relaxed) {
            rig.stop();
        }
        let u = rig.command();
        let y = plant.measure();
        plant.apply(&u);
        let _ = rig.observe(&y, &u);
        exchange(&mut rig, &end);
        lateness.add(started.saturating_sub(due), now() - started);
    }
    Ok(lateness)
}

/// Rows if a frame of them is complete, else the reply to a request if there is one.
fn exchange(rig: &mut Rig<'_>, end: &LoopEnd) {
    let letter = Letter::written(|buffer| match rig.frame(buffer) {
        Some(written) => written.ok(),
        None => rig.receive(end.requests.try_recv().ok()?.bytes(), buffer).ok().flatten(),
    });
    if let Some(letter) = letter {
        let _ = end.frames.try_send(letter);
    }
}
