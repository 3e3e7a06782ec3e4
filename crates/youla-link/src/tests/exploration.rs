//! Two hosts, one machine, and a way between them that loses, delays, doubles and swaps; the machine may start again at any moment. Every order of
//! events up to a depth is tried on the state machine of the firmware.
//!
//! A message that was sent stays on the way: it arrives never, late, or any number of times. A reply that says "done" is tested where it is
//! made, so that what becomes of it on its way does not matter.

use crate::*;
use std::collections::{BTreeMap, HashSet};
use std::format;
use std::string::String;
use std::vec::Vec;
use youla_rt::{Controller, ExcitedLoop, Limits, Matrices, Phase};

type Small = Station<'static, 1, 1, 1, 1>;

/// Samples for which the host may be silent.
const GUARD: u32 = 2;
const DEPTH: usize = 8;

const ARM: Request<'_> = Request::Arm;
const START: Request<'_> = Request::Start { source: SequenceOrigin::Prbs { order: 3, hold: 1 }, amplitude: 0.0 };
const ALIVE: Request<'_> = Request::Alive;
const STOP: Request<'_> = Request::Stop;

fn machine(life: u32) -> Small {
    let matrices = Matrices { a: [[0.0]], b: [[0.0]], c: [[0.0]], d: [[0.0]], f: [[0.0]], l: [[0.0]] };
    let limits =
        Limits { y: [1.0], beta: [1.0], u: [1.0], rate: [1.0], clipped: 0, stuck: 0, host: GUARD, duration: 0 };
    let running = ExcitedLoop::new(Controller::new(matrices).unwrap(), limits, 1).unwrap();
    Station::new(running, Machine { description: "", table: &[], rows: 1, life })
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Message {
    host: usize,
    sequence: u32,
    life: u32,
    request: Request<'static>,
}

/// What is known without the machine's own books.
#[derive(Debug, Clone, Default)]
struct Watch {
    /// Messages that this life has executed.
    executed: Vec<Message>,
    /// Host of the start that was executed last, and samples since a message of it came that is newer than the start and all that came after it.
    starter: usize,
    silent: u32,
    newest: u32,
    /// Number of the last stop of each host that came.
    stopped: [u32; 2],
}

#[derive(Clone)]
struct World {
    machine: Small,
    life: u32,
    /// Sent messages of both hosts, and the life that each host knows.
    sent: Vec<Message>,
    knows: [u32; 2],
    watch: Watch,
}

/// How often a case came up: each must.
type Seen = BTreeMap<&'static str, u64>;

fn seen(counts: &mut Seen, what: &'static str) {
    *counts.entry(what).or_default() += 1;
}

impl World {
    fn new() -> Self {
        World { machine: machine(1), life: 1, sent: Vec::new(), knows: [1; 2], watch: Watch::default() }
    }

    fn phase(&self) -> Phase {
        self.machine.running().status().phase()
    }

    fn send(&mut self, host: usize, request: Request<'static>) -> Message {
        let sequence = 1 + self.sent.iter().filter(|message| message.host == host).count() as u32;
        let message = Message { host, sequence, life: self.knows[host], request };
        self.sent.push(message);
        message
    }

    fn arrives(&mut self, message: Message, counts: &mut Seen) {
        let Message { host, sequence, life, request } = message;
        let (mut body, mut bytes, mut answer) = ([0; 16], [0; 64], [0; 64]);
        let length = request.write(&mut body).unwrap();
        let number = host as u32 + 1;
        let schema = self.machine.schema();
        let frame = Frame { kind: Kind::Request, schema, sequence, host: number, life, body: &body[..length] };
        let length = frame.write(&mut bytes).unwrap();
        let before = self.phase();
        if life == self.life && host == self.watch.starter && sequence > self.watch.newest {
            (self.watch.newest, self.watch.silent) = (sequence, 0);
        }
        let length = self.machine.receive(&bytes[..length], &mut answer).unwrap().unwrap();
        let frame = Frame::read(&answer[..length]).unwrap();
        assert_eq!((frame.host, frame.life), (number, self.life), "a reply is for its host");
        let reply = Reply::read(frame.body).unwrap();
        let after = self.phase();
        if request == STOP {
            assert!(reply.outcome == Outcome::Done && after != Phase::Exciting, "a stop is executed: {message:?}");
            if life == self.life {
                self.watch.stopped[host] = self.watch.stopped[host].max(sequence);
            }
            seen(counts, if before == Phase::Exciting { "a stop ends an excitation" } else { "a stop at rest" });
            return;
        }
        let wanted = match request {
            ARM => Phase::Armed,
            START => Phase::Exciting,
            _ => return assert_eq!(after, before),
        };
        let again = self.watch.executed.contains(&message);
        let now = before != after;
        assert!(!now || (after == wanted && life == self.life && !again), "executed once, in its life: {message:?}");
        if reply.outcome == Outcome::Done {
            assert!(now || again || after == wanted, "done means executed: {message:?}");
            seen(counts, if again { "done before" } else { "done" });
            if !again {
                self.watch.executed.push(message);
            }
        }
        if now && request == START {
            assert!(sequence > self.watch.stopped[host], "stopped before: {message:?}");
            (self.watch.starter, self.watch.silent, self.watch.newest) = (host, 0, sequence);
            seen(counts, ["an excitation of A", "an excitation of B"][host]);
        }
        match reply.outcome {
            Outcome::Stale => seen(counts, "late"),
            Outcome::OtherLife => seen(counts, "for another life"),
            Outcome::NotArmed => seen(counts, "not armed"),
            _ => (),
        }
    }

    fn sample(&mut self, counts: &mut Seen) {
        let u = self.machine.command();
        let _ = self.machine.observe(&[0.0], &u);
        self.watch.silent += 1;
        let phase = self.phase();
        assert!(phase != Phase::Exciting || self.watch.silent <= GUARD, "its host is silent: {:?}", self.watch);
        if phase == Phase::Tripped {
            seen(counts, "the guard trips");
        }
    }

    fn restart(&mut self) {
        self.life += 1;
        self.machine = machine(self.life);
        self.watch = Watch::default();
    }

    /// Everything that the future depends on.
    fn key(&self) -> String {
        let World { machine, sent, knows, watch, life } = self;
        let mut watch = watch.clone();
        watch.executed.sort_by_key(|message| (message.host, message.sequence));
        // Beyond the guard's time all counts are alike.
        watch.silent = watch.silent.min(GUARD + 1);
        format!("{:?} {} {life} {sent:?} {knows:?} {watch:?}", machine.running(), machine.books())
    }

    /// All worlds after one more event; hosts ask for what their scripts hold, one after the other.
    fn next(&self, scripts: [&[Request<'static>]; 2], counts: &mut Seen) -> Vec<World> {
        let mut worlds = Vec::new();
        let mut then = |event: &mut dyn FnMut(&mut World)| {
            let mut world = self.clone();
            event(&mut world);
            worlds.push(world);
        };
        for (host, script) in scripts.iter().enumerate() {
            let asked = self.sent.iter().filter(|message| message.host == host).count();
            if let Some(request) = script.get(asked) {
                // Delayed, or lost for ever; and at once.
                then(&mut |world| _ = world.send(host, *request));
                then(&mut |world| {
                    let message = world.send(host, *request);
                    world.arrives(message, counts);
                });
            }
            // Asks for the description again.
            if self.knows[host] != self.life {
                then(&mut |world| world.knows[host] = world.life);
            }
        }
        for message in &self.sent {
            then(&mut |world| world.arrives(*message, counts));
        }
        then(&mut |world| world.sample(counts));
        if self.life < 2 {
            then(&mut World::restart);
        }
        worlds
    }
}

fn explore(scripts: [&[Request<'static>]; 2], depth: usize, counts: &mut Seen) -> usize {
    let mut known = HashSet::new();
    let mut worlds = std::vec![World::new()];
    for _ in 0..depth {
        let next: Vec<World> = worlds.iter().flat_map(|world| world.next(scripts, counts)).collect();
        worlds = next.into_iter().filter(|world| known.insert(world.key())).collect();
    }
    known.len()
}

#[test]
fn every_order_of_events() {
    let mut counts = Seen::new();
    let mut states = 0;
    for scripts in [
        [&[ARM, START, ALIVE, ARM, START][..], &[ALIVE, STOP, ALIVE]],
        [&[ARM, START, ALIVE, STOP], &[ARM, START, STOP]],
        [&[ARM, START, STOP, ARM, START], &[ALIVE, ALIVE, ALIVE]],
    ] {
        states += explore(scripts, DEPTH, &mut counts);
    }
    assert_eq!(counts.len(), 10, "{counts:?}");
    assert!(states > 10_000, "{states}");
}
