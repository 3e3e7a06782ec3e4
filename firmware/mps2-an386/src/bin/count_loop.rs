//! Instructions of the whole loop per sample, with its guard and an excitation, and with a Q of order 4: order 4, 6, 10, 20 with 2 inputs
//! and 2 outputs. The last line is the sample of the switch of Q, at order 20.
#![no_std]
#![no_main]

#[path = "../board.rs"]
mod board;

use board::{controller, now, start_timer};
use core::hint::black_box;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use youla_rt::{ExcitedLoop, Limits, QCoefficients};

type Running<const N: usize> = ExcitedLoop<f32, N, 2, 2, 4>;

const LIMITS: Limits<f32, 2, 2> =
    Limits { y: [1e6; 2], beta: [1e6; 2], u: [1e6; 2], rate: [1e6; 2], clipped: 0, stuck: 100, host: 0, duration: 0 };

fn instructions<const N: usize>(running: &mut Running<N>, samples: u32) -> u32 {
    let before = now();
    for k in 0..samples {
        let y = black_box([(k & 7) as f32, (k & 3) as f32]);
        let u = running.command(&black_box([0.1, -0.1]));
        black_box(running.observe(&y, &u));
    }
    before.wrapping_sub(now()) * 40 / samples
}

fn measure<const N: usize>() -> Option<u32> {
    let mut running = Running::<N>::new(controller()?, LIMITS, 10).ok()?;
    running.arm().ok()?;
    running.start().ok()?;
    let without = instructions(&mut running, 10_000);
    let q = QCoefficients { a: [[0.1; 4]; 4], b: [[0.1; 2]; 4], c: [[0.1; 4]; 2] };
    running.begin_q().ok()?;
    q.values().try_for_each(|value| running.write_q(value)).ok()?;
    running.commit_q(q.checksum()).ok()?;
    let before = now();
    running.switch_q().ok()?;
    let switch = before.wrapping_sub(now()) * 40;
    let with_q = instructions(&mut running, 10_000);
    hprintln!("{} {} {}", N, without, with_q);
    Some(switch)
}

#[entry]
fn main() -> ! {
    start_timer();
    let switch =
        measure::<4>().and_then(|_| measure::<6>()).and_then(|_| measure::<10>()).and_then(|_| measure::<20>());
    match switch {
        Some(instructions) => {
            hprintln!("switch {}", instructions);
            debug::exit(debug::EXIT_SUCCESS);
        }
        None => debug::exit(debug::EXIT_FAILURE),
    }
    loop {}
}
