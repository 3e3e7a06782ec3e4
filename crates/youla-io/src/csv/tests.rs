use super::*;
use crate::error::{CorruptAt, Error, Result};
use crate::scratch::{data_folder, scratch};
use crate::{ChannelRef, ChannelSpec, Format, Source, TimeSource};
use proptest::prelude::*;
use std::io::Write;
use youla::Mat;
use youla::lti::Discrete;
use youla::signal::{Channel, Record};

fn read(text: &[u8], channels: &[ChannelSpec], time: &TimeSource) -> Result<Record> {
    let file = scratch("csv");
    std::fs::write(file.path(), text).unwrap();
    read_csv(file.path(), channels, time, &CsvOptions::default())
}

fn second() -> TimeSource {
    TimeSource::ts(1.0)
}

#[test]
fn names_and_numbers_in_every_dialect() {
    let expected = Mat::from_fn(2, 2, |i, j| (1 + 2 * i + j) as f64);
    for text in [
        "a,b\n1,2\n3,4\n",
        "# note\n\n a , b \r\n1.0, 2e0\r\n% between\r\n3,4",
        "a;b\n1;2\n3;4\n",
        "\"a\";\"b\"\n\"1\";\"2\"\n3;4\n",
        "a\tb\n1\t2\n3\t4\n",
        "  a  b\n  1\t 2\t\n 3\t 4\t\n",
        "\u{feff}a,b\n1,2\n3,4\n",
    ] {
        let record = read(text.as_bytes(), &[], &second()).unwrap();
        assert_eq!(record.data(), expected, "{text:?}");
        assert_eq!(record.channels()[1].name, "b", "{text:?}");
    }
    let record = read(b"a;Gr\xf6\xdfe\n1;2\n", &[ChannelSpec::named("Gr\u{f6}\u{df}e")], &second()).unwrap();
    assert_eq!(record.data()[(0, 0)], 2.0, "Latin-1");
    let spec = [ChannelSpec::from("y", ChannelRef::Column(2), "V")];
    let record = read(b" 1\t2\t\n 3\t4\t\n", &spec, &second()).unwrap();
    assert_eq!((record.column("y").unwrap(), record.channels()[0].label()), (&[2.0, 4.0][..], "y [V]".to_owned()));
}

#[test]
fn errors_say_where() {
    let cut = format!("a,b\n{}3\n", "1,2\n".repeat(30));
    for (text, part) in [
        ("a,b\n1,2\n# x\n3,oops\n", "line 4, column b: \"oops\" is not a finite number; a line of units or notes"),
        ("a,b\n1,NaN\n", "line 2, column b: \"NaN\""),
        ("a,b\n1,inf\n", "line 2, column b: \"inf\""),
        ("a,b\n1,\n", "line 2, column b: \"\""),
        ("1,2\n1,b\n", "line 2, column #2: \"b\""),
        ("a,b\n1,2\n3\n", "line 3: 1 fields, but the first line has 2"),
        ("a,b\n1,2,3\n", "line 2: 3 fields"),
        (
            "Rig no b\nBy: X\na,b\n1,2\n",
            "pass over notes above the names by --skip-lines 1 (skip_lines in [data] csv), a line that",
        ),
        (
            cut.as_str(),
            "line 32: 1 fields, but the first line has 2; pass over a line that is no row, as the last one of a log that was cut, by --skip-lines 32",
        ),
        ("a,b\n", "there is no line with data"),
        ("# only\n", "there is no line with data"),
        ("", "the file is empty (0 bytes)"),
        ("PK\u{3}\u{4}\0", "a zip archive or an Excel workbook cannot be read; give the log in it as text"),
        ("a,a\n1,2\n", "more than one channel named \"a\""),
        ("1,5;2,5\n", "the delimiter is ambiguous: line 1 contains a comma and a semicolon"),
        ("t\n1\n", "there is no column besides the time"),
        ("a,2\n1,2\n", "line 1, column #1: \"a\""),
        (
            "a,b\n1,\"1,234.5\"\n",
            "line 2, column b: \"1,234.5\" is not a finite number; write numbers without separators",
        ),
        ("a,b\n\"1,234.5\",x\n", "line 2, column a: \"1,234.5\" is not a finite number; write numbers without"),
        ("t,b\n10:00:00.1,2\n", "column t: \"10:00:00.1\" is not a finite number; a date with a time is read as"),
    ] {
        let time = if text.starts_with('t') { TimeSource::column("t".parse().unwrap()) } else { second() };
        let message = read(text.as_bytes(), &[], &time).unwrap_err().to_string();
        assert!(message.contains(part), "{text:?}: {message}");
    }
    let error = read_csv("no/such/file.csv", &[], &second(), &CsvOptions::default()).unwrap_err();
    assert!(matches!(error, Error::MissingFile { .. }), "{error}");
    let error = read(b"a,b\n1,2\n", &[ChannelSpec::named("aa")], &second()).unwrap_err().to_string();
    assert!(error.contains("did you mean \"a\"") && error.contains("known: a, b"), "{error}");
}

/// A clock in milliseconds that the name of a numbered column or a line of units states; the log is named.
#[test]
fn a_line_of_units_tells_the_unit_of_the_time() {
    let of = |text: &str, column: &str, skip_lines: &[usize]| {
        let (file, time) = (scratch("csv"), TimeSource::column(column.parse().unwrap()));
        std::fs::write(file.path(), text).unwrap();
        let options = CsvOptions { skip_lines: skip_lines.to_vec(), ..CsvOptions::default() };
        let read = read_csv(file.path(), &[], &time, &options).map(|record| record.samples());
        read.map_err(|e| e.to_string().replace(&file.path().display().to_string(), "LOG"))
    };
    for (text, column, skip, by) in [
        ("t,u\n# ms,V\n0,1\n1,2\n", "t", &[][..], "line of units"),
        ("t,u\nms,V\n0,1\n1,2\n", "t", &[2], "line of units"),
        ("# t_ms u\n0 1\n1 2\n", "#1", &[], "line of units"),
        ("t_ms,u\n0,1\n1,2\n", "#1", &[], "name"),
    ] {
        let error = of(text, column, skip).unwrap_err();
        assert!(error.starts_with("LOG: the time column"), "{error}");
        assert!(error.contains(&format!("in milliseconds by its {by}")) && error.contains("/ 1e3"), "{error}");
    }
    for text in ["t,u\n# s,V\n0,1\n1,2\n", "t,u\n# V,ms\n0,1\n1,2\n", "# every 5 ms\nt,u\n0,1\n1,2\n"] {
        assert_eq!(of(text, "t", &[]), Ok(2), "{text:?}");
    }
}

#[test]
fn unchosen_columns_may_hold_text() {
    let record = read(b"a,note\n1,x\n2,\n", &[ChannelSpec::named("a")], &second()).unwrap();
    assert_eq!(record.column("a").unwrap(), [1.0, 2.0]);
    let record = read(b"note x\ta\tmore\nx\t1\ty\n\t2\t\n", &[ChannelSpec::named("a")], &second()).unwrap();
    assert_eq!(record.column("a").unwrap(), [1.0, 2.0]);
}

#[test]
fn time_column_and_declaration() {
    let text = b"t,a\n5.0,1\n5.5,2\n6.0,3\n";
    let by_column = TimeSource::column("t".parse().unwrap());
    let record = read(text, &[], &by_column).unwrap();
    assert_eq!((record.time().ts(), record.start(), record.channels().len()), (0.5, 5.0, 1));
    for stamps in [
        ["2024-02-29T23:59:59.75Z", "2024-03-01T00:00:00Z"],
        ["2024-03-01 01:59:59.75+02:00", "2024-03-01 02:00:00+02:00"],
    ] {
        let record = read(format!("t,a\n{},1\n{},2\n", stamps[0], stamps[1]).as_bytes(), &[], &by_column).unwrap();
        assert_eq!((record.time().ts(), record.start()), (0.25, 1_709_251_199.75), "{stamps:?}");
    }
    let both = TimeSource { ts: Some(0.4), ..by_column.clone() };
    assert!(matches!(read(text, &[], &both), Err(Error::Method(youla::Error::SampleTimeMismatch { .. }))));
    let gap = read(b"t,a\n0,1\n1,2\n2,3\n4,4\n5,5\n", &[], &by_column).unwrap_err();
    assert!(matches!(gap, Error::NonUniformTime { row: 4, dt: 2.0, .. }), "{gap}");
    assert!(matches!(read(text, &[], &TimeSource::default()), Err(Error::SampleTimeMissing { .. })));
}

#[test]
fn written_records_read_back_exactly() {
    let channels = vec![Channel::new("u,1", ""), Channel::new("y \"q\"", "")];
    let data = Mat::from_fn(50, 2, |i, j| ((i * 7 + j) as f64 * 0.7).sin() * 10f64.powi(i as i32 * 8 - 300));
    let time = Discrete::new(2e-4).unwrap();
    let record = Record::new("r", channels, data, time).unwrap().starting_at(-0.01).unwrap();
    let file = scratch("csv");
    write_csv(&record, file.path()).unwrap();
    let back = read_csv(file.path(), &[], &TimeSource::column("t".parse().unwrap()), &CsvOptions::default()).unwrap();
    assert_eq!((back.data(), back.channels()), (record.data(), record.channels()));
    assert_eq!((back.time(), back.start()), (record.time(), record.start()));
}

#[test]
fn gzip_is_found_by_its_first_bytes_and_damage_is_named() {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    (0..1000).for_each(|k| writeln!(encoder, "{k},{}", k * k).unwrap());
    let packed = encoder.finish().unwrap();
    assert_eq!(read(&packed, &[], &second()).unwrap().samples(), 1000);
    for damaged in [&packed[..packed.len() / 2], &packed[..packed.len() - 4], &packed[..5]] {
        let error = read(damaged, &[], &second()).unwrap_err();
        assert!(matches!(error, Error::Corrupt { at: CorruptAt::Line(_), .. }), "{error}");
    }
    let mut flipped = packed.clone();
    flipped[packed.len() - 6] ^= 0x55;
    assert!(matches!(read(&flipped, &[], &second()), Err(Error::Corrupt { at: CorruptAt::Line(_), .. })));
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn the_real_text_files_load() {
    let folder = data_folder();
    let numbered = |n: usize| -> Vec<_> {
        (1..=n).map(|j| ChannelSpec::from(format!("c{j}"), ChannelRef::Column(j), "")).collect()
    };
    for (file, columns, samples) in [
        ("cd_player_arm/CD_player_arm.dat", 4, 2048),
        ("hair_dryer/dryer.dat", 2, 1000),
        ("robot_arm/robot_arm.dat", 2, 1024),
        ("evaporator/evaporator.dat", 6, 6305),
    ] {
        let options = CsvOptions::default();
        let record = read_csv(folder.join(file), &numbered(columns), &second(), &options).unwrap();
        assert_eq!((record.samples(), record.channels().len()), (samples, columns), "{file}");
    }
    let qube = folder.join("qube_pendulum/episodes/qube_20230828T150615_434_696_394.csv.gz");
    let record = read_csv(qube, &[], &TimeSource::column("t".parse().unwrap()), &CsvOptions::default()).unwrap();
    assert_eq!((record.samples(), record.channels().len(), record.time().ts()), (10000, 8, 0.002));
    assert_eq!(record.column("control_output").unwrap()[0], -11.799938031611969);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, rng_seed: proptest::test_runner::RngSeed::Fixed(3), ..ProptestConfig::default() })]

    /// Whatever the bytes, the outcome is a record of finite numbers or an error that names the file.
    #[test]
    fn any_text_is_a_record_or_an_error(text in "[ab12.,;\\t \"\r\n#e\\-]{0,60}", by_column in any::<bool>(), raw in any::<[u8; 3]>()) {
        let mut bytes = text.into_bytes();
        if raw[0] < 32 {
            bytes.extend(raw);
        }
        let time = if by_column { TimeSource::column(ChannelRef::Column(1)) } else { second() };
        if let Err(error) = read(&bytes, &[], &time) {
            prop_assert!(error.to_string().contains(".csv") || matches!(error, Error::Method(youla::Error::OutOfRange { .. })), "{}", error);
        }
    }
}

mod dialects {
    use super::super::*;
    use crate::TimeSource;
    use crate::error::Result;
    use youla::signal::Record;

    fn read(text: &str, delimiter: Delimiter, decimal: DecimalSign) -> Result<Record> {
        let options = CsvOptions { delimiter, decimal, ..Default::default() };
        csv_from_bytes(text.as_bytes(), "log.csv", &[], &TimeSource::ts(0.1), &options)
    }

    fn sentence(text: &str, delimiter: Delimiter, decimal: DecimalSign) -> String {
        read(text, delimiter, decimal).unwrap_err().to_string()
    }

    #[test]
    fn a_decimal_comma_is_read_where_it_is_declared() {
        let columns = |record: &Record| ["u", "y"].map(|name| record.column(name).unwrap().to_vec());
        let expected = [vec![0.5, -1.0, 1200.0], vec![-2e-3, 3.25, 0.0]];
        for (delimiter, between) in [(Delimiter::Semicolon, ";"), (Delimiter::Tab, "\t"), (Delimiter::Whitespace, " ")]
        {
            let text = "u;y\n0,5;-2,0e-3\n-1;\"3,25\"\n+1,2e3;,0\n".replace(';', between);
            for delimiter in [delimiter, Delimiter::Detect] {
                assert_eq!(columns(&read(&text, delimiter, DecimalSign::Comma).unwrap()), expected, "{between:?}");
            }
            let points = text.replace(',', ".");
            assert_eq!(columns(&read(&points, delimiter, DecimalSign::Point).unwrap()), expected);
        }
    }

    #[test]
    fn the_other_decimal_sign_is_refused_with_its_line() {
        let (point, comma) = (DecimalSign::Point, DecimalSign::Comma);
        let detect = Delimiter::Detect;
        assert_eq!(
            sentence("# log\nu;y\n1;2\n0,5;1\n", detect, point),
            "log.csv, line 4, column u: \"0,5\" is not a finite number with the declared decimal sign; set decimal = \"comma\" if \
             the whole file uses the comma"
        );
        let mixed = sentence("u;y\n1,5;2\n1,5;2.5\n", detect, comma);
        assert!(mixed.starts_with("log.csv, line 3, column y: \"2.5\" is not a finite number with the declared decimal sign; set decimal = \"point\""), "{mixed}");
        // A first line of numbers is no line of names, whatever their sign.
        assert!(
            sentence("0,5;1,5\n1,0;2,0\n", Delimiter::Semicolon, point).starts_with("log.csv, line 1, column #1: ")
        );
        assert!(sentence("0.5\t1.5\n", Delimiter::Tab, comma).starts_with("log.csv, line 1, column #1: "));
        assert_eq!(read("0,5;1,5\n1,0;2,0\n", detect, comma).unwrap().column("#2").unwrap(), [1.5, 2.0]);
    }

    #[test]
    fn what_does_not_fit_the_declared_dialect_is_refused() {
        let (point, comma) = (DecimalSign::Point, DecimalSign::Comma);
        for (text, delimiter, decimal, expected) in [
            (
                "u,y\n1,2\n",
                Delimiter::Comma,
                comma,
                "log.csv: the delimiter is ambiguous: the comma cannot be both the delimiter and the decimal sign",
            ),
            (
                "0,5;1,5\n",
                Delimiter::Detect,
                point,
                "log.csv: the delimiter is ambiguous: line 1 contains a comma and a semi",
            ),
            (
                "u;y\n1.000,5;2\n",
                Delimiter::Detect,
                comma,
                "log.csv, line 2, column u: \"1.000,5\" is not a finite number",
            ),
            ("u;y\n1,2,3;2\n", Delimiter::Detect, comma, "log.csv, line 2, column u: \"1,2,3\" is not a finite number"),
            ("u;y\n1,5;2\n1,5\n", Delimiter::Semicolon, comma, "log.csv, line 3: 1 fields, but the first line has 2"),
            ("u;y\n1;nan\n", Delimiter::Semicolon, comma, "log.csv, line 2, column y: \"nan\" is not a finite number"),
        ] {
            let found = sentence(text, delimiter, decimal);
            assert!(found.starts_with(expected), "{found}");
        }
    }
}

/// A clock that nobody named contradicts a declared sample time; milliseconds, counters of rows and other columns do not.
#[test]
fn a_clock_that_is_not_used_must_agree_with_the_declared_sample_time() {
    let file = scratch("csv");
    let read_with = |heading: &str, step: f64, ts: f64| {
        let rows: String = (0..50).map(|k| format!("{},{}\n", 3.0 + step * f64::from(k), k % 7)).collect();
        std::fs::write(file.path(), format!("{heading},y\n{rows}")).unwrap();
        let (channels, csv) = (vec![ChannelSpec::named("y")], CsvOptions::default());
        let source =
            Source { path: file.path().to_owned(), format: Format::Detect, time: TimeSource::ts(ts), channels, csv };
        crate::read(&source).map(|record| record.samples())
    };
    for (heading, step, ts) in
        [("t", 0.002, 0.002), ("time [ms]", 2.0, 0.002), ("Zeit", 1.0, 0.002), ("ramp", 0.001, 0.002)]
    {
        assert_eq!(read_with(heading, step, ts).unwrap(), 50, "{heading}");
    }
    for (heading, step, ts) in [("t", 0.001, 0.002), ("time [ms]", 2.0, 2.0), ("timestampUs", 500.0, 0.001)] {
        let refused = read_with(heading, step, ts).unwrap_err().to_string();
        assert!(refused.contains(heading) && refused.contains("sample_time"), "{refused}");
    }
}

/// A date with dots has the day first, also with a decimal comma; one with slashes is not guessed. `sep=;` is a note of a spreadsheet.
#[test]
fn stamps_of_spreadsheets() {
    let clock = TimeSource::column("t".parse().unwrap());
    let rows = "01.03.2026 10:00:00,25;1\n1.3.2026 10:00:00,50;2\n01.03.2026 10:00:00,75;3\n";
    let record = read(format!("sep=;\nt;y\n{rows}").as_bytes(), &[], &clock).unwrap();
    assert_eq!((record.time().ts(), record.column("y").unwrap()), (0.25, &[1.0, 2.0, 3.0][..]));
    let slashes = rows.replace("1.3.", "1/3/").replace("01.03.", "01/03/");
    let message = read(format!("t;y\n{slashes}").as_bytes(), &[], &clock).unwrap_err().to_string();
    assert!(message.contains("is read as 2026-03-01T10:00:00.000 or 01.03.2026 10:00:00.000"), "{message}");
}
