//! Seeded mutations: bytes and bits changed, runs cut out, doubled, moved between seeds, and numbers and words of the formats
//! put in.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const LONGEST: usize = 16384;

/// What is in the formats, and what their lengths and numbers may be taken for.
const WORDS: [&[u8]; 24] = [
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x80",
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x00\x00\x00\x00\x80",
    b"\x0e\x00\x00\x00",
    b"\x0f\x00\x00\x00",
    b"1e308",
    b"-1e999",
    b"nan",
    b"inf",
    b"18446744073709551615",
    b"-9223372036854775808",
    b"0",
    b"((((((((((((((((",
    b"[[[[[[[[[[[[[[[[",
    b"{a={a={a={a={",
    b"'",
    b"\"",
    b"\n",
    b",,,,,,,,,,,,,,,,",
    b"\xef\xbb\xbf",
    b"= 1\n",
    b"^2^3",
    b"sqrt(",
];

/// An endless row of inputs.
pub(crate) struct Mutations<'a> {
    seeds: &'a [Vec<u8>],
    rng: ChaCha8Rng,
    input: Vec<u8>,
}

impl<'a> Mutations<'a> {
    pub(crate) fn new(seeds: &'a [Vec<u8>], seed: u64) -> Self {
        Mutations { seeds, rng: ChaCha8Rng::seed_from_u64(seed), input: Vec::new() }
    }

    pub(crate) fn next(&mut self) -> &[u8] {
        let source = self.rng.random_range(0..self.seeds.len());
        self.input.clone_from(&self.seeds[source]);
        for _ in 0..self.rng.random_range(1..=6) {
            self.change();
        }
        self.input.truncate(LONGEST);
        &self.input
    }

    fn change(&mut self) {
        let rng = &mut self.rng;
        let length = self.input.len();
        let at = rng.random_range(0..=length);
        let to = rng.random_range(at..=length).min(at + 64);
        match rng.random_range(0..8) {
            0 | 1 if at < length => self.input[at] = rng.random(),
            2 if at < length => self.input[at] ^= 1 << rng.random_range(0..8),
            3 => drop(self.input.drain(at..to)),
            4 => {
                let run = self.input[at..to].to_vec();
                drop(self.input.splice(at..at, run));
            }
            5 => self.input.truncate(at),
            6 => {
                let other = &self.seeds[rng.random_range(0..self.seeds.len())];
                let from = rng.random_range(0..=other.len());
                let end = (from + 64).min(other.len());
                drop(self.input.splice(at..to, other[from..end].iter().copied()));
            }
            _ => {
                let word = WORDS[rng.random_range(0..WORDS.len())];
                drop(self.input.splice(at..at, word.iter().copied()));
            }
        }
    }
}
