//! A machine over UDP: the loop of the firmware around a plant on the host.

use crate::plant::{LinearPlant, Plant};
use crate::rig::random_number;
use crate::way::received;
use crate::{Error, Result};
use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};
use youla_link::{Key, LARGEST_SIGNED, Machine, Station};
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices, Row};

/// How a twin takes its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// One sample each period.
    RealTime(Duration),
    /// One frame of rows for each request.
    LockStep,
}

/// A station with its plant, any [`Plant`].
#[derive(Debug, Clone)]
pub struct Twin<'a, const N: usize, const M: usize, const P: usize, const K: usize, G = LinearPlant<N, M, P>> {
    /// The loop of the firmware.
    pub station: Station<'a, N, M, P, K>,
    /// What it controls.
    pub plant: G,
}

impl<const N: usize, const M: usize, const P: usize, const K: usize, G: Plant<M, P>> Twin<'_, N, M, P, K, G> {
    /// One sample.
    pub fn sample(&mut self) -> Row<f32, M, P> {
        let u = self.station.command();
        let y = self.plant.measure();
        let row = self.station.observe(&y, &u);
        self.plant.apply(&u);
        row
    }
}

/// Where hosts reach a twin.
#[derive(Debug, Clone, Copy)]
pub struct Port<'a> {
    /// Datagrams from any host.
    pub socket: &'a UdpSocket,
    /// The key that it shares with its hosts.
    pub key: Option<&'a Key>,
}

impl Port<'_> {
    /// Signs the frame in the front of a buffer where there is a key, and sends it. A datagram that cannot be sent is lost; its number says so.
    fn send(&self, buffer: &mut [u8], length: usize, to: impl Iterator<Item = SocketAddr>) {
        let signed = self.key.map_or(Ok(length), |key| key.sign(buffer, length));
        let bytes = signed.ok().and_then(|length| buffer.get(..length)).unwrap_or_default();
        to.for_each(|host| _ = self.socket.send_to(bytes, host));
    }
}

/// Serves a twin until `end` says so. Rows go to each host that asked within the last second.
///
/// # Errors
/// [`Error::Connection`].
pub fn serve<const N: usize, const M: usize, const P: usize, const K: usize, G: Plant<M, P>>(
    port: Port<'_>,
    twin: &mut Twin<'_, N, M, P, K, G>,
    pace: Pace,
    end: impl Fn() -> bool,
) -> Result<()> {
    let begin = Instant::now();
    let mut hosts = Hosts::default();
    let mut done = 0_u64;
    port.socket.set_read_timeout(Some(Duration::from_micros(500)))?;
    while !end() {
        let asked = take_requests(port, twin, &mut hosts, pace)?;
        match pace {
            Pace::RealTime(period) => {
                let due = begin.elapsed().as_nanos() / period.as_nanos().max(1);
                while u128::from(done) < due {
                    done += 1;
                    step(port, twin, &hosts)?;
                }
            }
            Pace::LockStep if asked => while !step(port, twin, &hosts)? {},
            Pace::LockStep => (),
        }
    }
    Ok(())
}

/// Hosts with the time of their last request: one records, another may ask for the status meanwhile.
#[derive(Default)]
struct Hosts(Vec<(SocketAddr, Instant)>);

/// Time after which a host that asks no more gets no more rows, and most hosts at a time.
const PRESENT: Duration = Duration::from_secs(1);
const MOST_HOSTS: usize = 4;

impl Hosts {
    fn heard(&mut self, host: SocketAddr) {
        self.0.retain(|(known, at)| *known != host && at.elapsed() < PRESENT);
        if self.0.len() == MOST_HOSTS {
            // The one that was silent for longest.
            self.0.remove(0);
        }
        self.0.push((host, Instant::now()));
    }

    fn present(&self) -> impl Iterator<Item = SocketAddr> {
        self.0.iter().filter(|(_, at)| at.elapsed() < PRESENT).map(|(host, _)| *host)
    }
}

/// Requests that are taken between two samples: none waits for the samples behind those of a host that asks fast.
const REQUESTS: usize = 256;

/// Whether there was a request. In lock-step one at a time.
fn take_requests<const N: usize, const M: usize, const P: usize, const K: usize, G: Plant<M, P>>(
    port: Port<'_>,
    twin: &mut Twin<'_, N, M, P, K, G>,
    hosts: &mut Hosts,
    pace: Pace,
) -> Result<bool> {
    let asked = take_request(port, twin, hosts)?;
    if pace != Pace::LockStep && asked {
        port.socket.set_nonblocking(true)?;
        let mut further = 1;
        while further < REQUESTS && take_request(port, twin, hosts)? {
            further += 1;
        }
        port.socket.set_nonblocking(false)?;
    }
    Ok(asked)
}

/// Whether there was a request.
fn take_request<const N: usize, const M: usize, const P: usize, const K: usize, G: Plant<M, P>>(
    port: Port<'_>,
    twin: &mut Twin<'_, N, M, P, K, G>,
    hosts: &mut Hosts,
) -> Result<bool> {
    let mut bytes = [0; 2048];
    let Some((length, from)) = received(port.socket.recv_from(&mut bytes))? else { return Ok(false) };
    let mut reply = [0; LARGEST_SIGNED];
    let request = bytes.get(..length).unwrap_or_default();
    let verified = port.key.is_none_or(|key| key.verify(request).is_ok());
    let station = &mut twin.station;
    let received =
        if verified { station.receive(request, &mut reply) } else { station.receive_unsigned(request, &mut reply) };
    let Ok(Some(length)) = received else { return Ok(false) };
    let answering = Port { key: port.key.filter(|_| verified), ..port };
    answering.send(&mut reply, length, std::iter::once(from));
    if verified {
        hosts.heard(from);
    }
    Ok(verified)
}

/// One sample; whether a frame was complete.
fn step<const N: usize, const M: usize, const P: usize, const K: usize, G: Plant<M, P>>(
    port: Port<'_>,
    twin: &mut Twin<'_, N, M, P, K, G>,
    hosts: &Hosts,
) -> Result<bool> {
    twin.sample();
    let mut bytes = [0; LARGEST_SIGNED];
    let Some(Ok(length)) = twin.station.frame(&mut bytes) else { return Ok(false) };
    port.send(&mut bytes, length, hosts.present());
    Ok(true)
}

/// The station of [`rotor`].
pub type RotorStation = Station<'static, 4, 2, 2, 4>;

const ROTOR: &str = r#"name = "rotor"
sample_time = 5e-5
q_order = 4
inputs = [{ name = "u_h", unit = "V" }, { name = "u_v", unit = "V" }]
outputs = [{ name = "y_h", unit = "um" }, { name = "y_v", unit = "um" }]

[nominal.state_space]
domain = "discrete"
a = [[0.998, 0.025, 0, 0], [-0.025, 0.998, 0, 0], [0, 0, 0.997, 0.031], [0, 0, -0.031, 0.997]]
b = [[0, 0], [0.05, 0], [0, 0], [0, 0.05]]
c = [[1, 0, 0, 0], [0, 0, 1, 0]]
d = [[0, 0], [0, 0]]

[controller.observer]
feedback = "positive"
state_feedback = [[0, -0.4, 0, 0], [0, 0, 0, -0.4]]
observer_gain = [[-0.1, 0], [0, 0], [0, -0.1], [0, 0]]
"#;

static STEPS: [[f32; 2]; 4] = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]];

/// A rotor with two lightly damped modes near 80 and 100 Hz at 20 kHz, under a controller for modes that are more damped and do
/// not couple.
///
/// # Errors
/// [`Error::Description`], never for the numbers that are built in.
pub fn rotor(seed: u64) -> Result<Twin<'static, 4, 2, 2, 4>> {
    let wrong = |problem: &dyn std::fmt::Display| Error::Description(problem.to_string());
    let b = [[0.0, 0.0], [0.05, 0.0], [0.0, 0.0], [0.0, 0.05]];
    let c = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let nominal = Matrices {
        a: [[0.998, 0.025, 0.0, 0.0], [-0.025, 0.998, 0.0, 0.0], [0.0, 0.0, 0.997, 0.031], [0.0, 0.0, -0.031, 0.997]],
        b,
        c,
        d: [[0.0; 2]; 2],
        f: [[0.0, -0.4, 0.0, 0.0], [0.0, 0.0, 0.0, -0.4]],
        l: [[-0.1, 0.0], [0.0, 0.0], [0.0, -0.1], [0.0, 0.0]],
    };
    let controller = Controller::new(nominal).and_then(|exact| exact.to_f32()).map_err(|e| wrong(&e))?;
    let limits = Limits {
        y: [20.0; 2],
        // Half the actuator gain shows as 0.23 or more under an excitation of 1 V; the model error as 0.08.
        beta: [0.15; 2],
        u: [10.0; 2],
        rate: [8.0; 2],
        clipped: 20,
        stuck: 4,
        host: 20_000,
        duration: 0,
    };
    let running = ExcitedLoop::new(controller, limits, 400).map_err(|e| wrong(&e))?;
    let a = [
        [0.9993, 0.0262, 0.0, 0.001],
        [-0.0262, 0.9993, 0.001, 0.0],
        [0.0, -0.001, 0.9991, 0.0303],
        [-0.001, 0.0, -0.0303, 0.9991],
    ];
    let station = Station::new(running, Machine { description: ROTOR, table: &STEPS, rows: 20, life: random_number() });
    Ok(Twin { station, plant: LinearPlant::new(a, b, c, [1e-3, 1e-2], seed) })
}
