//! A station in lock-step with a plant on the host, through two pipes in the folder where QEMU runs.
//!
//! Each sample: the target writes `u` to `from`, the length of a frame and the frame; the host writes `y` to `to`, the length of a
//! request and the request. The end of `to` ends the program.

use cortex_m_semihosting::{debug, syscall};
use youla_link::{LARGEST_FRAME, Station};

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

/// The two pipes.
pub(crate) struct Pipes {
    to: usize,
    from: usize,
}

impl Pipes {
    pub(crate) fn open() -> Self {
        Pipes { to: open(b"to\0", READ), from: open(b"from\0", WRITE) }
    }

    /// Whether the buffer was filled.
    pub(crate) fn read(&self, buffer: &mut [u8]) -> bool {
        // SAFETY: the emulator writes at most so many bytes into the buffer.
        buffer.is_empty() || unsafe { syscall!(READ, self.to, buffer.as_mut_ptr(), buffer.len()) } == 0
    }

    fn write(&self, bytes: &[u8]) {
        // SAFETY: the emulator reads so many bytes.
        let _ = unsafe { syscall!(WRITE, self.from, bytes.as_ptr(), bytes.len()) };
    }
}

/// Until the host ends.
pub(crate) fn serve<const N: usize, const K: usize>(
    station: &mut Station<'_, N, 2, 2, K>,
    pipes: &Pipes,
) -> Option<()> {
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
        pipes.write(output.get(..10 + length)?);

        let mut head = [0; 10];
        if !pipes.read(&mut head) {
            return Some(());
        }
        let [a, b, c, d, e, f, g, h, low, high] = head;
        let y = [f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h])];
        let of_request = request.get_mut(..u16::from_le_bytes([low, high]).into())?;
        if !pipes.read(of_request) {
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
