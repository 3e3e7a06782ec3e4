//! The errors of a rig.

use std::path::PathBuf;
use youla_link::Outcome;

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of the connection, the machine or the log.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The address cannot be used.
    #[error("{address}: {source}; give an address as udp://127.0.0.1:4000 or serial:/dev/ttyACM0")]
    Address {
        /// As given.
        address: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// The connection failed.
    #[error("the connection to the rig failed: {0}")]
    Connection(#[from] std::io::Error),
    /// No reply.
    #[error(
        "the rig at {address} does not answer; check that it runs, that no firewall and no other speed of the line keeps its frames, and that the address \
         names its key if it has one"
    )]
    Silent {
        /// Where it was asked.
        address: String,
    },
    /// The machine speaks another version of the format.
    #[error(
        "the rig at {address} speaks version {version} of the link, this program version {}: {}",
        youla_link::VERSION,
        if *version < youla_link::VERSION { "build its firmware with the present youla-link" } else { "update this program" }
    )]
    Version {
        /// Where it was asked.
        address: String,
        /// Of the machine.
        version: u8,
    },
    /// The machine refused a request.
    #[error("the rig refused \"{request}\": {}", of_outcome(*outcome))]
    Refused {
        /// The request.
        request: &'static str,
        /// Its outcome.
        outcome: Outcome,
    },
    /// The key of an address cannot be used.
    #[error("{}: {problem}; a key is a file of 64 hexadecimal digits, and `youla rig key FILE` makes one", path.display())]
    Key {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// Replies come without an authentication tag.
    #[error(
        "the rig at {address} replies without the key: it has none, or another one; leave out \",key=FILE\", or give the rig this key"
    )]
    Unsigned {
        /// Where it was asked.
        address: String,
    },
    /// The description of the machine cannot be used.
    #[error("the description of the rig: {0}")]
    Description(String),
    /// A file cannot be written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
}

fn of_outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Done => "done",
        Outcome::NotUnderstood => "the request is not known to its version",
        Outcome::OtherSchema => "its description has changed; connect again",
        Outcome::NotArmed => "it is not armed",
        Outcome::Exciting => "an excitation runs; stop it first",
        Outcome::Sensor => "an output is not finite or does not change",
        Outcome::Tripped => "its guard has tripped; arm it again",
        Outcome::Fading => "the last Q still fades out; ask again later",
        Outcome::NotFinite => "a coefficient is not finite",
        Outcome::Count => "the number of coefficients is not that of its bank",
        Outcome::Checksum => "the checksum of Q is wrong",
        Outcome::NoQ => "no Q is loaded",
        Outcome::Source => "it cannot make this excitation",
        Outcome::Stale => "the request came too late",
        Outcome::Key => {
            "it executes what is signed with its key only; put \",key=FILE\" with the file of that key behind the address"
        }
        Outcome::OtherLife => "it has started again in the meantime; connect again",
    }
}
