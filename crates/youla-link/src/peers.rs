//! The hosts that have changed something on a machine, each with the number of its last request.
//!
//! A request that only reads takes no place, and a stop needs none, so that no number of hosts keeps one out. A host that changes something
//! takes the place of the one that was silent for longest, but never of the one that armed the machine. The largest number of those that have lost
//! their places is kept: a host without a place begins above it, so that no request of a host that is forgotten is executed again.

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
pub(crate) struct Peers {
    places: [Option<Peer>; PLACES],
    /// The largest number of a host that has lost its place.
    forgotten: Option<u32>,
}

impl Peers {
    pub(crate) const NONE: Peers = Peers { places: [None; PLACES], forgotten: None };

    fn place(&self, host: u32) -> Option<usize> {
        self.places.iter().position(|peer| peer.is_some_and(|peer| peer.host == host))
    }

    pub(crate) fn number(&self, frame: &Frame<'_>) -> Number {
        match self.places.iter().flatten().find(|peer| peer.host == frame.host) {
            Some(peer) if peer.sequence == frame.sequence && peer.request == checksum(frame.body) => {
                Number::Again(peer.outcome)
            }
            Some(peer) if is_later(frame.sequence, peer.sequence) => Number::New,
            None if self.forgotten.is_none_or(|forgotten| is_later(frame.sequence, forgotten)) => Number::New,
            _ => Number::Late,
        }
    }

    /// The number above which a host without a place begins.
    pub(crate) fn above(&self, host: u32) -> Option<u32> {
        self.forgotten.filter(|_| self.place(host).is_none())
    }

    /// A new request of a host that has a place already.
    pub(crate) fn passed(&mut self, frame: &Frame<'_>, outcome: Outcome) {
        if let Some(place) = self.place(frame.host).filter(|_| self.number(frame) == Number::New) {
            self.put(place, frame, outcome);
        }
    }

    /// A new request, for which its host takes a place; the host `kept` keeps its own.
    pub(crate) fn changed(&mut self, frame: &Frame<'_>, outcome: Outcome, kept: Option<u32>) {
        let free = self.places.iter().rposition(|peer| peer.is_none_or(|peer| Some(peer.host) != kept));
        let own = self.place(frame.host);
        let Some(place) = own.or(free) else { return };
        let before = self.places.get(place).copied().flatten().filter(|_| own.is_none()).map(|peer| peer.sequence);
        if let Some(before) = before.filter(|before| self.forgotten.is_none_or(|most| is_later(*before, most))) {
            self.forgotten = Some(before);
        }
        self.put(place, frame, outcome);
    }

    fn put(&mut self, place: usize, frame: &Frame<'_>, outcome: Outcome) {
        let (host, sequence, request) = (frame.host, frame.sequence, checksum(frame.body));
        if let Some(up_to_place) = self.places.get_mut(..=place) {
            up_to_place.rotate_right(1);
        }
        if let Some(first) = self.places.first_mut() {
            *first = Some(Peer { host, sequence, request, outcome });
        }
    }
}

/// In a count that begins again from 0.
fn is_later(number: u32, before: u32) -> bool {
    number != before && number.wrapping_sub(before) <= u32::MAX / 2
}

fn checksum(body: &[u8]) -> u32 {
    let mut checksum = Checksum::new();
    checksum.append(body);
    checksum.value()
}
