//! The firmware for a Cortex-M4 in QEMU against the host's build of the same code, in lock-step with a plant on the host.

#[path = "../../../../firmware/mps2-an386/src/machine.rs"]
mod machine;

use crate::{Frame, Kind, LARGEST_FRAME, Reply, Request, SequenceOrigin};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::string::String;
use std::vec::Vec;
use std::{env, fs, println};
use youla_rt::{Phase, QCoefficients};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Builds the images; returns their folder.
fn images() -> PathBuf {
    let source = root().join("firmware/mps2-an386");
    let target = root().join("target/firmware");
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
    cargo.args(["build", "--release", "--locked"]).current_dir(source);
    // What concerns the host concerns not the target.
    cargo.env_remove("RUSTFLAGS").env("CARGO_INCREMENTAL", "0").env("CARGO_TARGET_DIR", &target);
    assert!(cargo.status().unwrap().success());
    target.join("thumbv7em-none-eabihf/release")
}

fn qemu(image: &Path, options: &[&str]) -> Command {
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native"]).args(options).arg("-kernel").arg(image);
    qemu
}

/// The lines of numbers that an image prints.
fn printed(image: &str) -> Vec<Vec<u32>> {
    let output = qemu(&images().join(image), &["-icount", "shift=0"]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    // QEMU prints to either.
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    println!("{text}");
    text.lines().map(|line| line.split_whitespace().filter_map(|number| number.parse().ok()).collect()).collect()
}

fn within_five_percent(found: &[Vec<u32>], stated: &[&[u32]]) {
    assert_eq!(found.len(), stated.len(), "{found:?}");
    for (found, stated) in found.iter().zip(stated) {
        assert!(
            found.len() == stated.len() && found.iter().zip(*stated).all(|(f, s)| 20 * f <= 21 * s),
            "{found:?} instructions, stated are {stated:?}: docs/firmware.md"
        );
    }
}

#[test]
#[ignore = "needs qemu-system-arm and the target thumbv7em-none-eabihf"]
fn instructions_per_sample() {
    within_five_percent(&printed("count"), &[&[4, 167], &[6, 277], &[10, 702], &[20, 2015]]);
    let of_loop: [&[u32]; 5] = [&[4, 697, 833], &[6, 822, 958], &[10, 1250, 1386], &[20, 2608, 2744], &[40]];
    within_five_percent(&printed("count-loop"), &of_loop);
}

/// The image in QEMU with its two pipes.
struct Target {
    qemu: Child,
    to: File,
    from: File,
    folder: PathBuf,
}

impl Target {
    fn start() -> Self {
        let image = images().join("loop");
        let folder = env::temp_dir().join(std::format!("youla-firmware-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        for pipe in ["to", "from"] {
            let _ = fs::remove_file(folder.join(pipe));
            assert!(Command::new("mkfifo").arg(folder.join(pipe)).status().unwrap().success());
        }
        let mut command = qemu(&image, &[]);
        let qemu = command.current_dir(&folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        // In the order of the target: each waits for the other end.
        let to = fs::OpenOptions::new().write(true).open(folder.join("to")).unwrap();
        let from = File::open(folder.join("from")).unwrap();
        Target { qemu, to, from, folder }
    }

    /// The input, and a frame or nothing.
    fn receive(&mut self, frame: &mut Vec<u8>) -> [f32; 2] {
        let mut bytes = [0; 10 + LARGEST_FRAME];
        let mut length = self.from.read(&mut bytes).unwrap();
        let whole = |bytes: &[u8]| 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        while length < 10 || length < whole(&bytes) {
            let more = self.from.read(&mut bytes[length..]).unwrap();
            assert!(more > 0, "the target has stopped");
            length += more;
        }
        assert_eq!(length, whole(&bytes));
        frame.clear();
        frame.extend_from_slice(&bytes[10..length]);
        [0, 4].map(|at| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
    }

    fn send(&mut self, y: &[f32; 2], request: &[u8]) {
        let mut bytes = Vec::with_capacity(10 + request.len());
        y.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
        bytes.extend_from_slice(&(request.len() as u16).to_le_bytes());
        bytes.extend_from_slice(request);
        self.to.write_all(&bytes).unwrap();
    }

    /// Ends it; returns the numbers that it prints.
    fn end(self) -> Vec<usize> {
        drop(self.to);
        let output = self.qemu.wait_with_output().unwrap();
        assert!(output.status.success());
        let _ = fs::remove_dir_all(self.folder);
        let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        text.split_whitespace().filter_map(|number| number.parse().ok()).collect()
    }
}

/// What the host asks for at some samples: an excitation, and three changes of Q while it runs.
fn request_at(sample: u64) -> Option<Vec<u8>> {
    let q = |gain: f32| QCoefficients::<f32, 2, 2, 2> {
        a: [[0.5, 0.1], [0.0, -0.4]],
        b: [[gain, 0.1], [0.2, gain]],
        c: [[0.3, 0.0], [0.1, gain]],
    };
    let (gain, step) = (0.1 + 0.1 * (sample / 100_000) as f32, sample % 100_000);
    let values: Vec<u8> = q(gain).values().flat_map(f32::to_le_bytes).collect();
    let request = match step {
        _ if sample > 300_000 && !step.is_multiple_of(50_000) => return None,
        100 if sample < 100_000 => Request::Arm,
        101 if sample < 100_000 => {
            Request::Start { source: SequenceOrigin::Prbs { order: 15, hold: 2 }, amplitude: 0.5 }
        }
        1000 => Request::BeginQ,
        1001 => Request::WriteQ { place: 0, values: &values },
        1002 => Request::CommitQ(q(gain).checksum()),
        1003 => Request::SwitchQ,
        50_000 | 0 => Request::Alive,
        _ => return None,
    };
    let mut body = [0; 200];
    let length = request.write(&mut body).unwrap();
    Some(body[..length].to_vec())
}

/// 1e6 samples of an unstable plant: inputs and frames have the same bits on target and host.
#[test]
#[ignore = "needs qemu-system-arm and the target thumbv7em-none-eabihf"]
fn lock_step() {
    const SAMPLES: u64 = 1_000_000;
    let mut target = Target::start();
    let mut host = machine::rig().unwrap();
    let (mut x, mut seed) = ([0.0_f64; 2], 1_u32);
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / 16_777_216.0 - 0.5
    };
    let (mut of_host, mut of_target) = (Vec::new(), Vec::new());
    let (mut requests, mut rows, mut excited, mut largest) = (0, 0, 0_u64, 0.0_f64);
    for sample in 0..SAMPLES {
        let u = host.command();
        let applied = target.receive(&mut of_target);
        assert_eq!(applied.map(f32::to_bits), u.map(f32::to_bits), "sample {sample}: {applied:?}, host {u:?}");
        assert!(of_target == of_host, "frame before sample {sample}");
        rows += u64::from(!of_target.is_empty());
        let y = x.map(|x| x as f32);
        let body = request_at(sample);
        let mut request = [0; LARGEST_FRAME];
        let length = body.map_or(0, |body| {
            requests += 1;
            let frame =
                Frame { kind: Kind::Request, schema: host.schema(), sequence: requests, host: 1, life: 1, body: &body };
            frame.write(&mut request).unwrap()
        });
        let request = &request[..length];
        target.send(&y, request);
        let row = host.observe(&y, &u);
        let mut buffer = [0; LARGEST_FRAME];
        let mut length = host.frame(&mut buffer).map_or(0, |written| written.unwrap());
        if !request.is_empty() {
            length = host.receive(request, &mut buffer).unwrap().unwrap();
            let reply = Frame::read(&buffer[..length]).unwrap();
            assert_eq!(Reply::read(reply.body).unwrap().outcome, crate::Outcome::Done, "sample {sample}");
        }
        of_host.clear();
        of_host.extend_from_slice(&buffer[..length]);
        excited += u64::from(row.status.phase() == Phase::Exciting);
        x = core::array::from_fn(|i| [1.1, 1.05][i] * x[i] + f64::from(applied[i]) + 0.02 * noise());
        largest = largest.max(x[0].abs());
    }
    let sizes = target.end();
    println!("{rows} frames, largest y {largest:.2}, stack and flash {sizes:?} bytes");
    assert!(excited > SAMPLES - 200 && requests > 16 && rows > SAMPLES / 21, "{excited} {requests} {rows}");
    assert!(largest > 0.5 && largest < 20.0);
    assert!(sizes.len() == 2 && sizes[0] < 16_000 && sizes[1] < 40_000, "{sizes:?}");
}
