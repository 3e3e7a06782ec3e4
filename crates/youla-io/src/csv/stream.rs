//! A text file of any length, line by line.

use super::lines::Lines;
use super::options::CsvOptions;
use super::parse::{Fields, Selection, no_rows};
use super::plan::Plan;
use crate::choose::ChannelSpec;
use crate::error::{Error, Result};
use crate::time::{Clock, TimeSource};
use faer::MatMut;
use std::path::{Path, PathBuf};
use youla::lti::Discrete;
use youla::signal::Channel;
use youla::signal::SampleStream;

/// One experiment in a text file, plain or gzip, that need not fit into memory; form, choice of columns, checks and errors are
/// those of [`crate::read_csv`].
///
/// Where the sample time comes from a column, the file is read once when it is opened to check that column; each step is compared
/// with the median of the first 65536.
pub struct CsvStream {
    path: PathBuf,
    options: CsvOptions,
    channels: Vec<Channel>,
    inputs: usize,
    time: Discrete,
    fields: Fields,
    selection: Selection,
    lines: Lines,
    rows: usize,
}

impl CsvStream {
    /// Opens a file and chooses its columns.
    ///
    /// # Errors
    /// As [`crate::read_csv`]; those of lines further on come when they are read.
    ///
    /// ```no_run
    /// use youla_io::{ChannelSpec, CsvOptions, CsvStream, TimeSource};
    /// let [u, y] = ["u", "y"].map(ChannelSpec::named);
    /// let stream = CsvStream::open("long.csv.gz", &[u], &[y], &TimeSource::ts(1e-4), &CsvOptions::default())?;
    /// # Ok::<(), youla_io::Error>(())
    /// ```
    pub fn open(
        path: impl AsRef<Path>,
        inputs: &[ChannelSpec],
        outputs: &[ChannelSpec],
        time: &TimeSource,
        options: &CsvOptions,
    ) -> Result<Self> {
        let path = path.as_ref();
        let specs = [inputs, outputs].concat();
        let mut lines = Lines::open(path)?;
        let begun = begin(&mut lines, &specs, time, options);
        let (fields, mut plan) = begun.map_err(|error| lines.damage().unwrap_or(error))?;
        let clock = match plan.timed {
            true => clock(&mut lines, &fields, &plan, time).map_err(|error| lines.damage().unwrap_or(error))?,
            false => time.resolve(&path.display().to_string(), None)?,
        };
        plan.channels.truncate(specs.len());
        let selection = Selection::new(&fields, &plan.columns[..specs.len()]);
        let mut stream = CsvStream {
            path: path.to_owned(),
            options: options.clone(),
            channels: plan.channels,
            inputs: inputs.len(),
            time: clock.time,
            fields,
            selection,
            lines,
            rows: 0,
        };
        stream.rewind()?;
        Ok(stream)
    }

    /// The clock.
    pub fn time(&self) -> Discrete {
        self.time
    }

    /// Names and units, first of the inputs, then of the outputs.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }
}

/// The form of the file, and which columns become what.
fn begin(lines: &mut Lines, specs: &[ChannelSpec], time: &TimeSource, options: &CsvOptions) -> Result<(Fields, Plan)> {
    let fields = Fields::detect(lines, options)?;
    let plan = Plan::new(lines.path(), fields.names(), specs, time)?;
    let what = lines.path().display().to_string();
    for (j, channel) in plan.channels.iter().enumerate() {
        if plan.channels[..j].iter().any(|earlier| earlier.name == channel.name) {
            return Err(Error::Method(youla::Error::DuplicateChannel { what, name: channel.name.clone() }));
        }
    }
    Ok((fields, plan))
}

/// The clock of the time column, by a pass over the file.
fn clock(lines: &mut Lines, fields: &Fields, plan: &Plan, time: &TimeSource) -> Result<Clock> {
    let what = lines.path().display().to_string();
    let column = Selection::new(fields, &plan.columns[plan.columns.len() - 1..]);
    let mut rows = 0;
    time.resolve_streamed(&what, || {
        let mut value = None;
        column.next(fields, lines, |_, time| value = Some(time))?;
        rows += usize::from(value.is_some());
        if rows == 0 { Err(no_rows(lines)) } else { Ok(value) }
    })
}

impl SampleStream for CsvStream {
    fn inputs(&self) -> usize {
        self.inputs
    }

    fn outputs(&self) -> usize {
        self.channels.len() - self.inputs
    }

    fn rewind(&mut self) -> youla::Result<()> {
        self.lines = Lines::open(&self.path)?;
        self.fields = Fields::detect(&mut self.lines, &self.options)?;
        self.rows = 0;
        Ok(())
    }

    fn read(&mut self, mut rows: MatMut<'_, f64>) -> youla::Result<usize> {
        for k in 0..rows.nrows() {
            let put = |position, value| rows[(k, position)] = value;
            // A damaged gzip stream gives damaged text; report the damage, not the text.
            let next = self.selection.next(&self.fields, &mut self.lines, put);
            if !next.map_err(|error| self.lines.damage().unwrap_or(error))? {
                return if self.rows == 0 { Err(no_rows(&self.lines).into()) } else { Ok(k) };
            }
            self.rows += 1;
        }
        Ok(rows.nrows())
    }

    fn next_experiment(&mut self) -> youla::Result<bool> {
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;
    use crate::{ChannelRef, read_csv};
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;
    use youla::Mat;

    fn specs() -> ([ChannelSpec; 1], [ChannelSpec; 2]) {
        let by_number = ChannelSpec::from("first", ChannelRef::Column(2), "V");
        ([ChannelSpec::named("b")], [ChannelSpec::named("c"), by_number])
    }

    fn text(rows: usize) -> String {
        let row = |k: usize| format!("{},{},{:?},{}\n", 0.25 * k as f64, k, (k as f64).sin(), k * k);
        std::iter::once("t,a,b,c\n# a comment\n".to_owned()).chain((0..rows).map(row)).collect()
    }

    fn gzip(text: &str) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(text.as_bytes()).unwrap();
        encoder.finish().unwrap()
    }

    /// All samples by pieces of 7.
    fn all(stream: &mut CsvStream) -> Result<Vec<Vec<f64>>> {
        let mut rows = Vec::new();
        loop {
            let mut piece = Mat::zeros(7, 3);
            let count = stream.read(piece.as_mut())?;
            rows.extend((0..count).map(|k| piece.row(k).iter().copied().collect()));
            if count < 7 {
                return Ok(rows);
            }
        }
    }

    fn open(bytes: &[u8], time: &TimeSource) -> Result<(Vec<Vec<f64>>, Discrete)> {
        let file = scratch("csv");
        std::fs::write(file.path(), bytes).unwrap();
        let (u, y) = specs();
        let mut stream = CsvStream::open(file.path(), &u, &y, time, &CsvOptions::default())?;
        let first = all(&mut stream)?;
        stream.rewind()?;
        assert_eq!(all(&mut stream)?, first, "the second pass");
        Ok((first, stream.time()))
    }

    /// The same through [`read_csv`].
    fn in_memory(bytes: &[u8], time: &TimeSource) -> Result<(Vec<Vec<f64>>, Discrete)> {
        let file = scratch("csv");
        std::fs::write(file.path(), bytes).unwrap();
        let (u, y) = specs();
        let record = read_csv(file.path(), &[&u[..], &y].concat(), time, &CsvOptions::default())?;
        let rows = (0..record.samples()).map(|k| record.data().row(k).iter().copied().collect());
        Ok((rows.collect(), record.time()))
    }

    #[test]
    fn a_stream_reads_what_the_record_holds() {
        let by_column = TimeSource::column("t".parse().unwrap());
        for time in [by_column, TimeSource::ts(0.1)] {
            for bytes in [text(40).into_bytes(), gzip(&text(35)), text(1 + 6).replace(',', ";").into_bytes()] {
                assert_eq!(open(&bytes, &time).unwrap(), in_memory(&bytes, &time).unwrap());
            }
        }
    }

    #[test]
    fn errors_are_those_of_the_record() {
        let good = text(40);
        let mut cut = gzip(&good);
        cut.truncate(cut.len() - 20);
        let bad = [
            good.replace("\n5,20,", "\n5,20,x,").into_bytes(),
            good.replace(",961\n", ",NaN\n").into_bytes(),
            good.replace("\n5,20,", "\n5.1,20,").into_bytes(),
            good.replace("t,a,b,c", "t,a,bb,c").into_bytes(),
            b"t,a,b,c\n".to_vec(),
            Vec::new(),
            cut,
        ];
        let time = TimeSource::column("t".parse().unwrap());
        for bytes in bad {
            // Files have names of their own, which are before the line.
            let sentence = |error: Error| error.to_string().split_once(".csv").unwrap().1.to_owned();
            let (streamed, read) = (open(&bytes, &time).err(), in_memory(&bytes, &time).err());
            assert_eq!(streamed.map(sentence), read.map(sentence));
        }
        let missing = open(good.as_bytes(), &TimeSource::default());
        assert!(matches!(missing, Err(Error::SampleTimeMissing { .. })));
    }
}
