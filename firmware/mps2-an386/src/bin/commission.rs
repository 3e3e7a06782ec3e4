//! The loop of a campaign in lock-step with the twin on the host, which first writes the numbers of which it is made.
#![no_std]
#![no_main]

#[path = "../lock_step.rs"]
mod lock_step;
#[path = "../../../../crates/youla-twin/src/station.rs"]
mod station;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;

#[entry]
fn main() -> ! {
    let done = run();
    debug::exit(if done.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {}
}

fn run() -> Option<()> {
    let pipes = lock_step::Pipes::open();
    let mut numbers = [0.0; station::NUMBERS];
    for number in &mut numbers {
        let mut bytes = [0; 4];
        if !pipes.read(&mut bytes) {
            return None;
        }
        *number = f32::from_le_bytes(bytes);
    }
    lock_step::serve(&mut station::station(&numbers)?, &pipes)
}
