//! A loop in the user space of Linux: priority of real time, memory locked, a sleep until absolute times; its station answers over UDP.
//!
//! ```text
//! cargo run --release -p youla-rig --example linux_loop -- 1000 10 4000       samples per second, seconds, port
//! youla rig excite udp://127.0.0.1:4000 --amplitude 0.5 --out log.csv --duration 5
//! ```
//!
//! The thread of the loop makes no call that waits for anything but the next period: frames and requests pass through channels to a
//! thread of ordinary priority, which owns the socket. docs/firmware.md states what it reached and what limits it.
#![allow(clippy::print_stdout)]

#[cfg(target_os = "linux")]
mod control;
#[cfg(target_os = "linux")]
mod lateness;
#[cfg(target_os = "linux")]
mod link;
#[cfg(target_os = "linux")]
mod machine;
#[cfg(target_os = "linux")]
mod privilege;

#[cfg(target_os = "linux")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    use std::net::UdpSocket;
    use std::thread;
    use std::time::Duration;

    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [rate, seconds, port] = arguments.as_slice() else {
        return Err("usage: linux_loop SAMPLES_PER_SECOND SECONDS PORT".into());
    };
    let (rate, seconds): (u32, u64) = (rate.parse()?, seconds.parse()?);
    let period = 1_000_000_000_u64.checked_div(rate.into()).ok_or("the rate must be above 0")?;
    let socket = UdpSocket::bind(("127.0.0.1", port.parse()?))?;
    let description = machine::description(Duration::from_nanos(period).as_secs_f64());
    let station = machine::station(&description, rate)?;

    let (loop_end, host_end) = link::channels();
    let lateness = thread::scope(|scope| {
        // Before the priority rises: a thread inherits that of its maker.
        scope.spawn(|| link::serve(&socket, host_end));
        privilege::lock_memory();
        privilege::raise_priority();
        control::run(station, machine::plant(), loop_end, period, seconds * u64::from(rate))
    })?;
    println!("{lateness}");
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn main() {
    println!("this example needs Linux");
}
