//! The way to a machine: datagrams on UDP, packets on a serial line.

use crate::{Error, Result};
use serial2::SerialPort;
use std::io::{Error as IoError, ErrorKind};
use std::net::UdpSocket;
use std::time::{Duration, Instant};
use youla_link::{LARGEST_PACKET, PacketReader, write_packet};

/// Speed of a serial line where the address states none, bits per second.
const BAUD: u32 = 921_600;

/// An open way.
pub(crate) enum Way {
    Udp(UdpSocket),
    Serial(Box<SerialLine>),
}

impl Way {
    /// `udp://HOST:PORT` or `serial:DEVICE`, with `@BAUD` behind it.
    ///
    /// # Errors
    /// [`Error::Address`].
    pub(crate) fn open(address: &str) -> Result<Self> {
        let wrong = |source| Error::Address { address: address.to_owned(), source };
        if let Some(line) = address.strip_prefix("serial:") {
            let (device, baud) = match line.rsplit_once('@') {
                Some((device, baud)) => (device, baud.parse().ok()),
                None => (line, Some(BAUD)),
            };
            let baud: u32 =
                baud.ok_or_else(|| wrong(IoError::new(ErrorKind::InvalidInput, "the speed is no number")))?;
            return Ok(Self::serial(SerialPort::open(device, baud).map_err(wrong)?));
        }
        let place = address.strip_prefix("udp://").unwrap_or(address);
        let socket = UdpSocket::bind(("0.0.0.0", 0)).map_err(wrong)?;
        socket.connect(place).map_err(wrong)?;
        Ok(Way::Udp(socket))
    }

    pub(crate) fn serial(port: SerialPort) -> Self {
        let line = SerialLine { port, packets: PacketReader::new(), bytes: Vec::new(), begun: false };
        Way::Serial(Box::new(line))
    }

    /// Sends a frame. What cannot be sent is lost: the next attempt may arrive.
    pub(crate) fn send(&mut self, frame: &[u8]) {
        match self {
            // A machine that is not there yet refuses.
            Way::Udp(socket) => {
                let _ = socket.send(frame);
            }
            Way::Serial(line) => {
                let mut packet = [0; LARGEST_PACKET];
                let sent = write_packet(frame, &mut packet).ok().and_then(|length| packet.get(..length));
                let _ = sent.map(|packet| line.port.write_all(packet));
            }
        }
    }

    /// The bytes of the next frame within a time; none that can be read as a frame where it was damaged.
    ///
    /// # Errors
    /// [`Error::Connection`].
    pub(crate) fn receive(&mut self, within: Duration) -> Result<Option<Vec<u8>>> {
        let within = within.max(Duration::from_millis(1));
        match self {
            Way::Udp(socket) => {
                socket.set_read_timeout(Some(within))?;
                let mut bytes = [0; 2048];
                let received = socket.recv(&mut bytes);
                Ok(self::received(received)?.and_then(|length| bytes.get(..length).map(<[u8]>::to_vec)))
            }
            Way::Serial(line) => line.receive(within),
        }
    }
}

/// `None` where nothing came in time, or nobody is there (yet): no failure of the connection.
pub(crate) fn received<T>(received: std::io::Result<T>) -> Result<Option<T>> {
    use ErrorKind::{ConnectionRefused, Interrupted, TimedOut, WouldBlock};
    match received {
        Ok(found) => Ok(Some(found)),
        Err(e) if matches!(e.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused) => Ok(None),
        Err(e) => Err(e.into()),
    }
}

/// A serial line with the bytes that wait to be taken apart.
pub(crate) struct SerialLine {
    port: SerialPort,
    packets: PacketReader,
    bytes: Vec<u8>,
    /// Behind the first zero; what comes before is a part of a packet.
    begun: bool,
}

impl SerialLine {
    fn receive(&mut self, within: Duration) -> Result<Option<Vec<u8>>> {
        let until = Instant::now() + within;
        loop {
            if let Some(frame) = self.waiting() {
                return Ok(Some(frame));
            }
            let Some(left) = until.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) else {
                return Ok(None);
            };
            self.port.set_read_timeout(left)?;
            let mut bytes = [0; 4096];
            let Some(length) = received(self.port.read(&mut bytes))? else { continue };
            self.bytes.extend_from_slice(bytes.get(..length).unwrap_or_default());
        }
    }

    /// The first whole frame among the bytes that have come; empty for a damaged packet.
    fn waiting(&mut self) -> Option<Vec<u8>> {
        let (mut taken, mut found) = (0, None);
        for byte in &self.bytes {
            taken += 1;
            if !self.begun {
                self.begun = *byte == 0;
                continue;
            }
            if let Some(packet) = self.packets.push(*byte) {
                found = Some(packet.map_or_else(|_| Vec::new(), <[u8]>::to_vec));
                break;
            }
        }
        self.bytes.drain(..taken);
        found
    }
}

#[cfg(unix)]
#[cfg(test)]
mod tests;
