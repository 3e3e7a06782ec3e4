//! What both counts share: the timer of the board and a controller of any order.

use cortex_m_semihosting::debug;
use youla_rt::{Controller, Matrices};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

/// CMSDK timer 0 of the MPS2 boards: 25 MHz, counts down.
const TIMER: *mut u32 = 0x4000_0000 as *mut u32;

pub(crate) fn start_timer() {
    // SAFETY: the registers of the timer, which nothing else uses.
    unsafe {
        TIMER.add(2).write_volatile(u32::MAX);
        TIMER.add(1).write_volatile(u32::MAX);
        TIMER.write_volatile(1);
    }
}

/// With `-icount shift=0` an instruction takes 1 ns, a tick 40.
pub(crate) fn now() -> u32 {
    // SAFETY: as above.
    unsafe { TIMER.add(1).read_volatile() }
}

pub(crate) fn controller<const N: usize>() -> Option<Controller<f32, N, 2, 2>> {
    let mut seed = 1_u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / 16_777_216.0 - 0.5
    };
    let mut m = Matrices {
        a: [[0.0; N]; N],
        b: [[0.0; 2]; N],
        c: [[0.0; N]; 2],
        d: [[0.0; 2]; 2],
        f: [[0.0; N]; 2],
        l: [[0.0; 2]; N],
    };
    for i in 0..N {
        for j in 0..N {
            m.a[i][j] = random() * 0.1;
        }
        m.a[i][i] = 0.5;
        for j in 0..2 {
            m.b[i][j] = random();
            m.l[i][j] = random() * 0.1;
            m.c[j][i] = random();
            m.f[j][i] = random() * 0.1;
        }
    }
    Controller::new(m).ok()
}
