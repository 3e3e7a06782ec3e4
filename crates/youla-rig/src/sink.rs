//! Where the rows of a log go: a CSV file, and a stream for PlotJuggler. Other files are made by whoever has a writer for them.

use crate::Description;
use std::fs::{File, TryLockError};
use std::io::{BufWriter, Error, ErrorKind, Result, Write};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use youla_rt::Status;

/// A row of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogRow<'a> {
    /// Sample times sample time, seconds.
    pub time: f64,
    /// y, u, alpha, beta.
    pub values: &'a [f32],
    /// Phase, bank of Q, causes of the guard.
    pub status: Status,
}

/// Takes the rows of a log in the order of their samples.
pub trait RowSink: Send {
    /// A row.
    ///
    /// # Errors
    /// Of the file.
    fn take(&mut self, row: &LogRow<'_>) -> Result<()>;

    /// What comes now does not continue the rows before: it is part `number`, from 2 on, of its own.
    ///
    /// # Errors
    /// Of the file.
    fn part(&mut self, number: usize) -> Result<()>;

    /// The end of the log.
    ///
    /// # Errors
    /// Of the file.
    fn finish(&mut self) -> Result<()>;
}

/// A CSV file: `t`, y, u, alpha, beta, `status`. A further part goes into a file of its own, `log-part-2.csv` beside `log.csv`.
pub struct CsvLog {
    file: BufWriter<File>,
    path: PathBuf,
    header: String,
}

impl CsvLog {
    /// Begins a file.
    ///
    /// # Errors
    /// Of the file; for one that another recorder writes, and for what is no regular file.
    pub fn create(path: &Path, machine: &Description) -> Result<Self> {
        let header = machine.columns().join(",");
        Ok(CsvLog { file: begun(path, &header)?, path: path.to_owned(), header })
    }

    /// The file of a part.
    pub fn part_path(path: &Path, number: usize) -> PathBuf {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{name}-part-{number}.csv"))
    }
}

/// A new file with its first line. It is locked until it is whole, so that no other recorder empties it.
fn begun(path: &Path, header: &str) -> Result<BufWriter<File>> {
    let refused = |kind, why| Err(Error::new(kind, why));
    if path.metadata().is_ok_and(|found| !found.is_file()) {
        return refused(ErrorKind::InvalidInput, "it is no regular file; choose another place for the log");
    }
    let file = File::options().write(true).create(true).truncate(false).open(path)?;
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return refused(ErrorKind::ResourceBusy, "another recorder writes it; choose another place for the log");
    }
    file.set_len(0)?;
    let mut file = BufWriter::new(file);
    writeln!(file, "{header}")?;
    Ok(file)
}

impl RowSink for CsvLog {
    fn take(&mut self, row: &LogRow<'_>) -> Result<()> {
        write!(self.file, "{:?}", row.time)?;
        for value in row.values {
            write!(self.file, ",{value:?}")?;
        }
        writeln!(self.file, ",{}", row.status.bits())
    }

    fn part(&mut self, number: usize) -> Result<()> {
        self.file.flush()?;
        self.file = begun(&Self::part_path(&self.path, number), &self.header)?;
        Ok(())
    }

    fn finish(&mut self) -> Result<()> {
        self.file.flush()
    }
}

/// At most so many rows a second go to a plot.
const ROWS_PER_SECOND: f64 = 1000.0;

/// Rows as JSON datagrams, as the UDP server of PlotJuggler takes them: `timestamp` and one number per column. At most 1000 rows a
/// second are sent, and one that does not arrive is missing in the plot only.
pub struct PlotStream {
    socket: UdpSocket,
    columns: Vec<String>,
    every: u64,
    row: u64,
}

impl PlotStream {
    /// To `HOST:PORT`; PlotJuggler listens at port 9870.
    ///
    /// # Errors
    /// For an address that cannot be used.
    pub fn open(address: &str, machine: &Description) -> Result<Self> {
        let socket = UdpSocket::bind(("0.0.0.0", 0))?;
        socket.connect(address)?;
        let every = (1.0 / (machine.sample_time * ROWS_PER_SECOND)).ceil().max(1.0) as u64;
        Ok(PlotStream { socket, columns: machine.columns(), every, row: 0 })
    }

    fn json(&self, row: &LogRow<'_>) -> String {
        let number = |value: f32| if value.is_finite() { format!("{value:?}") } else { "null".into() };
        let values = row.values.iter().map(|value| number(*value)).chain([row.status.bits().to_string()]);
        let fields = self.columns.iter().skip(1).zip(values).map(|(name, value)| format!("{name:?}:{value}"));
        format!("{{\"timestamp\":{:?},{}}}", row.time, fields.collect::<Vec<_>>().join(","))
    }
}

impl RowSink for PlotStream {
    fn take(&mut self, row: &LogRow<'_>) -> Result<()> {
        if self.row.is_multiple_of(self.every) {
            // A plot that is not there yet.
            let _ = self.socket.send(self.json(row).as_bytes());
        }
        self.row += 1;
        Ok(())
    }

    fn part(&mut self, _: usize) -> Result<()> {
        Ok(())
    }

    fn finish(&mut self) -> Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RigChannel;
    use std::time::Duration;

    /// Rows of the first recorder were lost, and both reported a whole log.
    #[test]
    fn a_second_recorder_does_not_empty_a_log() {
        let path = std::env::temp_dir().join(format!("youla-log-{}.csv", std::process::id()));
        let machine = Description::default();
        let mut first = CsvLog::create(&path, &machine).unwrap();
        let row = LogRow { time: 0.0, values: &[0.5], status: Status::from_bits(0) };
        first.take(&row).unwrap();
        first.file.flush().unwrap();
        let refused = CsvLog::create(&path, &machine).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(refused.contains("another recorder"), "{refused}");
        assert!(std::fs::read_to_string(&path).unwrap().ends_with("0.0,0.5,0\n"));
        drop(first);
        drop(CsvLog::create(&path, &machine).unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "t,status\n");
        std::fs::remove_file(&path).unwrap();
        assert!(CsvLog::create(&std::env::temp_dir(), &machine).is_err());
    }

    #[test]
    fn a_plot_gets_a_row_each_millisecond() {
        let listener = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
        listener.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let channel = |name: &str| vec![RigChannel { name: name.into(), unit: String::new() }];
        let machine =
            Description { sample_time: 2e-4, inputs: channel("u"), outputs: channel("y"), ..Description::default() };
        let mut stream = PlotStream::open(&listener.local_addr().unwrap().to_string(), &machine).unwrap();
        for k in 0..10 {
            let values = [f32::NAN, 0.25, 0.0, k as f32];
            stream.take(&LogRow { time: 2e-4 * f64::from(k), values: &values, status: Status::from_bits(5) }).unwrap();
        }
        let mut bytes = [0; 500];
        let mut next = || {
            let length = listener.recv(&mut bytes).unwrap();
            String::from_utf8(bytes[..length].to_vec()).unwrap()
        };
        assert_eq!(next(), r#"{"timestamp":0.0,"y":null,"u":0.25,"alpha_1":0.0,"beta_1":0.0,"status":5}"#);
        assert_eq!(next(), r#"{"timestamp":0.001,"y":null,"u":0.25,"alpha_1":0.0,"beta_1":5.0,"status":5}"#);
    }
}
