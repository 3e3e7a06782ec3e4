//! Long work beside the interpreter: the GIL is released, Ctrl-C is seen within a twentieth of a second.
//!
//! The work runs on a thread of its own. After an interrupt the caller gets `KeyboardInterrupt` at once; the thread ends at its next
//! stage ([`Stop::announce`]), and its result is dropped.

use crate::failure::{Failure, Result};
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::Builder;
use std::time::Duration;

/// How often signals are looked for.
const POLL: Duration = Duration::from_millis(50);
/// Stack of the thread, as the main thread of a program has it.
const STACK: usize = 8 << 20;

const WITHOUT_RESULT: &str = "the computation ended without a result; please report the input as a defect of youla";

/// The process that loaded the module.
static LOADED: OnceLock<u32> = OnceLock::new();

/// Called when the module is loaded.
pub(crate) fn loaded() {
    LOADED.get_or_init(std::process::id);
}

/// Whether this process was forked from the one that loaded the module: the threads of its pool did not follow.
fn forked() -> bool {
    LOADED.get().is_some_and(|id| *id != std::process::id())
}

/// Whether the caller has been interrupted.
#[derive(Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Called at the start of each stage: ends the thread where nobody waits for it.
    pub(crate) fn announce(&self) {
        if self.0.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Interrupted));
        }
    }
}

/// What unwinds an interrupted thread; no panic, so that no message is printed.
struct Interrupted;

/// Runs `work` on a thread, on one core only where `single` says so, and waits for it. A forked process gets threads of its own.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    single: bool,
    work: impl FnOnce(&Stop) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let stop = Stop::default();
    let (sender, mut receiver) = sync_channel(1);
    let of_thread = stop.clone();
    let body = move || {
        let work = || work(&of_thread);
        let result = if single { on_threads(1, work) } else { on_live_threads(work) };
        // Nobody waits after an interrupt.
        let _ = sender.send(result);
    };
    let spawned = Builder::new().name("youla".into()).stack_size(STACK).spawn(body);
    spawned.map_err(|e| Failure::numerical(format!("no thread can be started: {e}")))?;
    loop {
        // A receiver cannot be shared between threads, but moves through the part without the GIL.
        let (back, outcome) = py.detach(move || {
            let outcome = receiver.recv_timeout(POLL);
            (receiver, outcome)
        });
        receiver = back;
        match outcome {
            Ok(result) => return Ok(result?),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| stop.0.store(true, Ordering::Relaxed))?
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Failure::numerical(WITHOUT_RESULT).into());
            }
        }
    }
}

/// Does short work without the GIL, on threads of its own in a forked process.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    Ok(py.detach(|| on_live_threads(work))?)
}

/// On the pool of the process, in a forked one on a pool of its own.
fn on_live_threads<T: Send>(work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    if forked() { on_threads(0, work) } else { work() }
}

/// On a pool of so many threads; 0 for one per core.
fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).stack_size(STACK).build();
    pool.map_err(|e| Failure::numerical(format!("no thread can be started: {e}")))?.install(work)
}
