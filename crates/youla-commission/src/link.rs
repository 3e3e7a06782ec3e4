//! A machine over its link. A thread takes its rows and gives signs of life, so that the excitation goes on while the campaign computes.

use crate::error::{failed, refuse};
use crate::{Error, Result};
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use youla_link::{LARGEST_CHUNK, Request};
use youla_rig::{LogRow, Recorder, Rig, RowSink};
use youla_rt::{Phase, Status, Trip};
use youla_twin::LoggedValues;

/// Time between two signs of life.
const BEAT: Duration = Duration::from_millis(100);
/// A machine that sends no row for so long works in lock-step: it waits for the next request.
const LOCK_STEP: Duration = Duration::from_millis(50);
/// Time after which a machine that sends no rows counts as gone.
const GONE: Duration = Duration::from_secs(5);

/// What the thread hands over.
#[derive(Default)]
struct Shared {
    rows: Vec<LoggedValues>,
    status: Option<Status>,
    missing: u64,
    /// Rows are waited for.
    wanted: bool,
    failed: Option<Error>,
}

/// The body of a request, and where its outcome goes.
type Asked = (Vec<u8>, Sender<Result<()>>);

/// A connection.
pub(crate) struct Link {
    shared: Arc<Mutex<Shared>>,
    /// Until the end.
    requests: Option<Sender<Asked>>,
    thread: Option<JoinHandle<()>>,
    q_states: usize,
    /// Limits of y, u and beta.
    limits: [f64; 3],
}

impl Link {
    /// Connects to a machine of two inputs and two outputs.
    ///
    /// # Errors
    /// [`Error::Connection`]; [`Error::Controller`] for another machine.
    pub(crate) fn connect(address: &str, limits: [f64; 3]) -> Result<Self> {
        let rig = Rig::connect(address)?;
        let machine = rig.description();
        let q_states = machine.q_order.unwrap_or(0);
        let shared = Arc::new(Mutex::new(Shared::default()));
        let recorder = Recorder::with(vec![Box::new(Rows(shared.clone()))], Path::new(address), machine, rig.schema());
        let (requests, receiver) = channel();
        let of_thread = shared.clone();
        let thread = std::thread::spawn(move || serve(rig, recorder, &of_thread, &receiver));
        Ok(Link { shared, requests: Some(requests), thread: Some(thread), q_states, limits })
    }

    /// Largest order of Q.
    pub(crate) fn q_states(&self) -> usize {
        self.q_states
    }

    /// Waits for so many rows, or until the guard trips.
    ///
    /// # Errors
    /// [`Error::Refused`] where rows were lost or, while excited, a signal is beyond its limit; [`Error::Controller`] where no rows come;
    /// the failure of the connection.
    pub(crate) fn run(&mut self, samples: usize, excited: bool) -> Result<()> {
        let (mut seen, begin_missing) = {
            let mut shared = locked(&self.shared);
            shared.wanted = true;
            (shared.rows.len(), shared.missing)
        };
        let until = seen + samples;
        let mut last = Instant::now();
        let ended = loop {
            std::thread::sleep(Duration::from_millis(1));
            let mut shared = locked(&self.shared);
            if let Some(failure) = shared.failed.take() {
                break Err(failure);
            }
            if shared.missing > begin_missing {
                let lost = shared.missing - begin_missing;
                break refuse(format!("{lost} rows were lost on the way from the machine; record over a better line"));
            }
            let new = shared.rows.get(seen..).unwrap_or_default();
            if let Some(beyond) = new.iter().find_map(|row| self.beyond(row)).filter(|_| excited) {
                break refuse(beyond);
            }
            if !new.is_empty() {
                (seen, last) = (shared.rows.len(), Instant::now());
            }
            if seen >= until || excited && tripped(&shared).is_some() {
                break Ok(());
            }
            if last.elapsed() > GONE {
                break Err(failed("sends no rows"));
            }
        };
        locked(&self.shared).wanted = false;
        ended
    }

    fn beyond(&self, row: &LoggedValues) -> Option<String> {
        let signals = [("y", 0, self.limits[0]), ("u", 2, self.limits[1]), ("beta", 6, self.limits[2])];
        signals.into_iter().find_map(|(name, first, limit)| {
            let channel = (0..2).find(|i| row[first + i].is_nan() || row[first + i].abs() > limit)?;
            Some(format!("{name}_{} reached {:.3}, beyond its limit of {limit}", channel + 1, row[first + channel]))
        })
    }

    /// Sends a request and awaits its reply.
    ///
    /// # Errors
    /// Where it is refused or not answered.
    pub(crate) fn ask(&mut self, request: &Request<'_>) -> Result<()> {
        let mut body = [0; 4 * LARGEST_CHUNK + 8];
        let length = request.write(&mut body).ok_or_else(|| failed("takes no request of this length"))?;
        let (sender, answer) = channel();
        let bytes = body.get(..length).unwrap_or_default().to_vec();
        let sent = self.requests.as_ref().is_some_and(|requests| requests.send((bytes, sender)).is_ok());
        let gone = || failed("does not answer any more");
        if sent { answer.recv().map_err(|_| gone())? } else { Err(gone()) }
    }

    pub(crate) fn take_rows(&mut self) -> Vec<LoggedValues> {
        std::mem::take(&mut locked(&self.shared).rows)
    }

    pub(crate) fn trip(&self) -> Option<Trip> {
        tripped(&locked(&self.shared))
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // The thread ends with its channel; a panic there is none of the campaign's.
            let _ = thread.join();
        }
    }
}

fn tripped(shared: &Shared) -> Option<Trip> {
    shared.status.filter(|status| status.phase() == Phase::Tripped)?.trip()
}

fn locked(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    // Nobody panics with the lock; if so, the rows are still whole.
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hands rows over.
struct Rows(Arc<Mutex<Shared>>);

impl RowSink for Rows {
    fn take(&mut self, row: &LogRow<'_>) -> std::io::Result<()> {
        let mut values = [0.0; 8];
        values.iter_mut().zip(row.values).for_each(|(place, value)| *place = (*value).into());
        let mut shared = locked(&self.0);
        shared.rows.push(values);
        shared.status = Some(row.status);
        Ok(())
    }

    fn part(&mut self, _: usize) -> std::io::Result<()> {
        Err(std::io::Error::other("the machine has started again, or its rows do not follow those before"))
    }

    fn finish(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// The thread, until the campaign lets the link go or the connection fails.
fn serve(mut rig: Rig, mut recorder: Recorder, shared: &Mutex<Shared>, requests: &Receiver<Asked>) {
    let (mut beat, mut row, mut rows) = (Instant::now(), Instant::now(), 0);
    let (mut lock_step, mut wanted) = (false, false);
    let ended = loop {
        match requests.try_recv() {
            Ok((body, answer)) => {
                let asked = Request::read(&body).map(|request| rig.ask(&request));
                let outcome = asked.map_or_else(|| Err(failed("takes no such request")), |done| Ok(done.map(drop)?));
                // Whoever asked may have gone.
                let _ = answer.send(outcome);
                beat = Instant::now();
            }
            Err(TryRecvError::Disconnected) => break Ok(()),
            Err(TryRecvError::Empty) => (),
        }
        // In lock-step nothing comes before the next request.
        let patience = if lock_step && wanted { Duration::ZERO } else { Duration::from_millis(1) };
        if let Err(e) = rig.record(&mut recorder, patience) {
            break Err(e);
        }
        let report = recorder.report();
        let (came, missing) = (report.rows > rows, report.missing);
        rows = report.rows;
        wanted = {
            let mut shared = locked(shared);
            shared.missing = missing;
            shared.wanted
        };
        if came || !wanted {
            row = Instant::now();
        }
        lock_step |= row.elapsed() > LOCK_STEP && beat.elapsed() > LOCK_STEP;
        if beat.elapsed() > BEAT || wanted && lock_step {
            if let Err(e) = rig.ask(&Request::Alive) {
                break Err(e);
            }
            beat = Instant::now();
        }
    };
    if let Err(e) = ended {
        locked(shared).failed = Some(e.into());
    }
}
