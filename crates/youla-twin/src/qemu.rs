//! The image of the firmware in QEMU, in lock-step through two pipes.

use crate::error::failed;
use crate::{Error, Result};
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::Duration;
use youla_link::LARGEST_FRAME;

const PROGRAM: &str = "qemu-system-arm";
/// Time in which the image must open its pipes.
const PATIENCE: Duration = Duration::from_secs(10);

/// A running image; it ends with this value.
pub(crate) struct Qemu {
    child: Child,
    to: File,
    from: File,
    folder: PathBuf,
}

impl Qemu {
    /// Whether QEMU is there.
    pub(crate) fn is_there() -> bool {
        let version = Command::new(PROGRAM).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        cfg!(target_os = "linux") && version.is_ok_and(|status| status.success())
    }

    /// Starts an image and writes the numbers of its station.
    ///
    /// # Errors
    /// [`Error::Controller`] where it does not start.
    pub(crate) fn start(image: &Path, numbers: &[f32]) -> Result<Self> {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let image = image.canonicalize().map_err(|source| io(image, source))?;
        let name = format!("youla-twin-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).map_err(|source| io(&folder, source))?;
        let started = Self::connected(&image, &folder);
        let mut qemu = started.inspect_err(|_| drop(fs::remove_dir_all(&folder)))?;
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        qemu.to.write_all(&bytes).map_err(|_| stopped())?;
        Ok(qemu)
    }

    fn connected(image: &Path, folder: &Path) -> Result<Self> {
        let (to, from) = (folder.join("to"), folder.join("from"));
        let made = Command::new("mkfifo").args([&to, &from]).status();
        if !made.is_ok_and(|status| status.success()) {
            return Err(failed("cannot be reached: mkfifo does not make its pipes"));
        }
        let mut qemu = Command::new(PROGRAM);
        qemu.args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none"]);
        qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(image);
        qemu.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = qemu.spawn().map_err(|source| io(Path::new(PROGRAM), source))?;
        let opened = open_both(&to, &from);
        let Ok((to, from)) = opened else {
            let _ = child.kill().and_then(|()| child.wait());
            return Err(failed("does not start: the image in QEMU does not open its pipes"));
        };
        Ok(Qemu { child, to, from, folder: folder.to_owned() })
    }

    /// The input, and a frame or nothing.
    pub(crate) fn receive(&mut self, frame: &mut Vec<u8>) -> Result<[f32; 2]> {
        let mut head = [0; 10];
        self.from.read_exact(&mut head).map_err(|_| stopped())?;
        let [a, b, c, d, e, f, g, h, low, high] = head;
        let length = usize::from(u16::from_le_bytes([low, high]));
        if length > LARGEST_FRAME {
            return Err(failed("sent a frame that cannot be read"));
        }
        frame.resize(length, 0);
        self.from.read_exact(frame).map_err(|_| stopped())?;
        Ok([f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h])])
    }

    /// The outputs, and a request or nothing.
    pub(crate) fn send(&mut self, y: &[f32; 2], request: &[u8]) -> Result<()> {
        let mut bytes = Vec::with_capacity(10 + request.len());
        y.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
        bytes.extend_from_slice(&(request.len() as u16).to_le_bytes());
        bytes.extend_from_slice(request);
        self.to.write_all(&bytes).map_err(|_| stopped())
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // The end of a simulation: nothing is lost with it.
        let _ = self.child.kill().and_then(|()| self.child.wait());
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn io(path: &Path, source: std::io::Error) -> Error {
    Error::File(youla_io::Error::Io { path: path.to_owned(), source })
}

fn stopped() -> Error {
    failed("has stopped: the image in QEMU does not answer")
}

/// Both pipes, in the order of the target. Opening one for reading and writing waits for nobody, so that an image that never opens
/// its end is noticed.
fn open_both(to: &Path, from: &Path) -> std::io::Result<(File, File)> {
    let both = |path: &Path| OpenOptions::new().read(true).write(true).open(path);
    let to = both(to)?;
    let (sender, receiver) = mpsc::channel();
    let path = from.to_owned();
    std::thread::spawn(move || sender.send(File::open(path)));
    match receiver.recv_timeout(PATIENCE) {
        Ok(opened) => Ok((to, opened?)),
        Err(_) => {
            // Lets the thread go.
            drop(both(from));
            Err(std::io::ErrorKind::TimedOut.into())
        }
    }
}
