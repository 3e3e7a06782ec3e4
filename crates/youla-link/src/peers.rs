//! The hosts that have changed something on a machine, each with the number of its last request.
//!
//! A request that only reads takes no place, and a stop needs none, so that no number of hosts keeps one out. A host that changes something
//! takes the place of the one that was silent for longest, but never of the one that armed the machine.

use crate::{Frame, Outcome};
use youla_rt::Checksum;

/// Hosts at a time.
const PLACES: usize = 4;

/// What the number of a request says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    /// Later than all requests of its host.
    New,
    /// The last request again, which had this outcome.
    Again(Outcome),
    /// An older one, or another one with the number of the last.
    Late,
}

#[derive(Debug, Clone, Copy)]
struct Peer {
    host: u32,
    sequence: u32,
    /// CRC-32 of the request.
    request: u32,
    outcome: Outcome,
}

/// The one that was heard last comes first.
#[derive(Debug, Clone)]
pub(crate) struct Peers([Option<Peer>; PLACES]);

impl Peers {
    pub(crate) const NONE: Peers = Peers([None; PLACES]);

    fn place(&self, host: u32) -> Option<usize> {
        self.0.iter().position(|peer| peer.is_some_and(|peer| peer.host == host))
    }

    pub(crate) fn number(&self, frame: &Frame<'_>) -> Number {
        let Some(peer) = self.0.iter().flatten().find(|peer| peer.host == frame.host) else { return Number::New };
        match frame.sequence.wrapping_sub(peer.sequence) {
            0 if peer.request == checksum(frame.body) => Number::Again(peer.outcome),
            ahead if 0 < ahead && ahead <= u32::MAX / 2 => Number::New,
            _ => Number::Late,
        }
    }

    /// A new request of a host that has a place already.
    pub(crate) fn passed(&mut self, frame: &Frame<'_>, outcome: Outcome) {
        if let Some(place) = self.place(frame.host).filter(|_| self.number(frame) == Number::New) {
            self.put(place, frame, outcome);
        }
    }

    /// A new request, for which its host takes a place; the host `kept` keeps its own.
    pub(crate) fn changed(&mut self, frame: &Frame<'_>, outcome: Outcome, kept: Option<u32>) {
        let free = self.0.iter().rposition(|peer| peer.is_none_or(|peer| Some(peer.host) != kept));
        if let Some(place) = self.place(frame.host).or(free) {
            self.put(place, frame, outcome);
        }
    }

    fn put(&mut self, place: usize, frame: &Frame<'_>, outcome: Outcome) {
        let (host, sequence, request) = (frame.host, frame.sequence, checksum(frame.body));
        if let Some(up_to_place) = self.0.get_mut(..=place) {
            up_to_place.rotate_right(1);
        }
        if let Some(first) = self.0.first_mut() {
            *first = Some(Peer { host, sequence, request, outcome });
        }
    }
}

fn checksum(body: &[u8]) -> u32 {
    let mut checksum = Checksum::new();
    checksum.append(body);
    checksum.value()
}
