//! The loop in lock-step with a plant on the host, through two pipes in the folder where QEMU runs.
//!
//! Each sample: the target writes `u` to `from`, the length of a frame and the frame; the host writes `y` to `to`, the length of a
//! request and the request. The end of `to` ends the program, which prints its stack and its flash memory in bytes.
#![no_std]
#![no_main]

#[path = "../machine.rs"]
mod machine;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln, syscall};
use youla_link::LARGEST_FRAME;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

const READ: usize = 1;
const WRITE: usize = 5;

fn open(path: &[u8], mode: usize) -> usize {
    // SAFETY: the path ends with a zero, which its length leaves out.
    unsafe { syscall!(OPEN, path.as_ptr(), mode, path.len() - 1) }
}

/// Whether the buffer was filled.
fn read(file: usize, buffer: &mut [u8]) -> bool {
    // SAFETY: the emulator writes at most so many bytes into the buffer.
    buffer.is_empty() || unsafe { syscall!(READ, file, buffer.as_mut_ptr(), buffer.len()) } == 0
}

fn write(file: usize, bytes: &[u8]) {
    // SAFETY: the emulator reads so many bytes.
    let _ = unsafe { syscall!(WRITE, file, bytes.as_ptr(), bytes.len()) };
}

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
    let (to, from) = (open(b"to\0", READ), open(b"from\0", WRITE));
    let mut output = [0; 8 + 2 + LARGEST_FRAME];
    let mut request = [0; LARGEST_FRAME];
    // A reply, or the rows that are complete.
    let mut frame = [0; LARGEST_FRAME];
    let mut length = 0;
    loop {
        let u = station.command();
        let (head, body) = output.split_at_mut(10);
        for (place, value) in head.chunks_exact_mut(4).zip(&u) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        head.get_mut(8..)?.copy_from_slice(&(length as u16).to_le_bytes());
        body.get_mut(..length)?.copy_from_slice(frame.get(..length)?);
        write(from, output.get(..10 + length)?);

        let mut head = [0; 10];
        if !read(to, &mut head) {
            return Some(());
        }
        let [a, b, c, d, e, f, g, h, low, high] = head;
        let y = [f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h])];
        let of_request = request.get_mut(..u16::from_le_bytes([low, high]).into())?;
        if !read(to, of_request) {
            return None;
        }
        let _ = station.observe(&y, &u);
        length = match station.frame(&mut frame) {
            Some(written) => written.ok()?,
            None => 0,
        };
        if !of_request.is_empty() {
            length = station.receive(of_request, &mut frame).ok()??;
        }
    }
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
