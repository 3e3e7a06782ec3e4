//! Instructions of the controller per sample, limits of the input included: order 4, 6, 10, 20 with 2 inputs and 2 outputs.
#![no_std]
#![no_main]

#[path = "../board.rs"]
mod board;

use board::{controller, now, start_timer};
use core::hint::black_box;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use youla_rt::State;

fn measure<const N: usize>() -> Option<()> {
    let c = controller::<N>()?;
    let mut state = State::at_rest();
    let mut sum = 0.0_f32;
    let samples = 10_000;
    let before = now();
    for k in 0..samples {
        let y = black_box([(k & 7) as f32, 1.0]);
        let alpha = black_box([0.1, -0.1]);
        let u = c.command(&state, &alpha);
        let u = [u[0].clamp(-5.0, 5.0), u[1].clamp(-5.0, 5.0)];
        let beta = c.observe(&mut state, &y, &u);
        sum += black_box(beta)[0];
    }
    let instructions = before.wrapping_sub(now()) * 40 / samples;
    black_box(sum);
    hprintln!("{} {}", N, instructions);
    Some(())
}

#[entry]
fn main() -> ! {
    start_timer();
    let done =
        measure::<4>().and_then(|()| measure::<6>()).and_then(|()| measure::<10>()).and_then(|()| measure::<20>());
    debug::exit(if done.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {}
}
