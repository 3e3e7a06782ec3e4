//! Between the loop and the socket: two channels of fixed size, and the thread that owns the socket.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::time::Duration;
use youla_link::{LARGEST_FRAME, is_stop};

/// A frame by value: nothing is allocated on its way.
pub(crate) struct Letter {
    bytes: [u8; LARGEST_FRAME],
    length: usize,
}

impl Letter {
    /// What `write` puts into the front of a frame, if anything.
    pub(crate) fn written(write: impl FnOnce(&mut [u8]) -> Option<usize>) -> Option<Self> {
        let mut bytes = [0; LARGEST_FRAME];
        let length = write(&mut bytes)?;
        Some(Letter { bytes, length })
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

/// The end of the loop, which only tries: what finds no place is lost, and the log states it.
pub(crate) struct LoopEnd {
    pub(crate) frames: SyncSender<Letter>,
    pub(crate) requests: Receiver<Letter>,
    /// A stop has come, for the next sample: it waits for no place among the requests.
    pub(crate) stop: Arc<AtomicBool>,
}

/// The end of the socket.
pub(crate) struct HostEnd {
    frames: Receiver<Letter>,
    requests: SyncSender<Letter>,
    stop: Arc<AtomicBool>,
}

pub(crate) fn channels() -> (LoopEnd, HostEnd) {
    let (frames, to_send) = sync_channel(64);
    let (received, requests) = sync_channel(8);
    let stop = Arc::new(AtomicBool::new(false));
    (LoopEnd { frames, requests, stop: stop.clone() }, HostEnd { frames: to_send, requests: received, stop })
}

/// Until the loop has gone. It polls each millisecond instead of waiting for a frame, since a sender in a channel on which somebody waits takes
/// a lock, and a thread of real time must not depend on one that an ordinary thread holds.
pub(crate) fn serve(socket: &UdpSocket, end: HostEnd) -> std::io::Result<()> {
    socket.set_read_timeout(Some(Duration::from_millis(1)))?;
    let mut host = None;
    let mut request = [0; LARGEST_FRAME];
    loop {
        // A timeout, a host that has gone, or a datagram that is too long: the host asks again.
        if let Ok((length, from)) = socket.recv_from(&mut request) {
            host = Some(from);
            if request.get(..length).is_some_and(is_stop) {
                end.stop.store(true, Ordering::Relaxed);
            }
            let letter = Letter { bytes: request, length };
            let _ = end.requests.try_send(letter);
        }
        loop {
            match (end.frames.try_recv(), host) {
                // A datagram that cannot be sent is lost; its sequence number says so.
                (Ok(frame), Some(host)) => drop(socket.send_to(frame.bytes(), host)),
                (Ok(_), None) => (),
                (Err(TryRecvError::Empty), _) => break,
                (Err(TryRecvError::Disconnected), _) => return Ok(()),
            }
        }
    }
}
