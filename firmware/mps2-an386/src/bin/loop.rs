//! The loop in lock-step with a plant on the host. At its end it prints its stack and its flash memory in bytes.
#![no_std]
#![no_main]

#[path = "../lock_step.rs"]
mod lock_step;
#[path = "../machine.rs"]
mod machine;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};

#[entry]
fn main() -> ! {
    stack::paint();
    let done = run();
    hprintln!("stack {} flash {}", stack::used(), stack::flash());
    debug::exit(if done.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {}
}

fn run() -> Option<()> {
    let mut station = machine::rig()?;
    lock_step::serve(&mut station, &lock_step::Pipes::open())
}

/// How much of the stack was used: it is filled with a pattern first.
mod stack {
    const PATTERN: u32 = 0x5a5a_5a5a;

    unsafe extern "C" {
        static mut __sheap: u32;
        static mut _stack_start: u32;
        static mut __sidata: u32;
        static mut __sdata: u32;
        static mut __edata: u32;
    }

    const BELOW: usize = 64;
    const MOST: usize = 64 * 1024 / 4;

    #[inline(never)]
    pub(crate) fn paint() {
        let here = 0_u32;
        let mut place = (&raw const here).cast_mut().wrapping_sub(BELOW);
        for _ in 0..MOST {
            place = place.wrapping_sub(1);
            // SAFETY: RAM between the variables and the stack, which nothing uses.
            unsafe { place.write_volatile(PATTERN) };
        }
    }

    pub(crate) fn used() -> usize {
        let top = &raw const _stack_start;
        let mut place = top.wrapping_sub(MOST);
        // SAFETY: as above.
        while place < top && unsafe { place.read_volatile() } == PATTERN {
            place = place.wrapping_add(1);
        }
        top as usize - place as usize
    }

    pub(crate) fn flash() -> usize {
        let data = &raw const __edata as usize - &raw const __sdata as usize;
        &raw const __sidata as usize + data
    }
}
