//! Files that pyarrow and polars wrote (`fuzz/seeds.py`), each with the same 40 rows.

use super::*;
use crate::{ChannelSpec, TimeSource};
use std::path::PathBuf;

/// Dictionaries in two groups of rows; plain; the second kind of pages; numbers by bytes and differences; what polars writes.
const FILES: [&str; 5] = ["snappy", "plain", "lz4", "gzip", "zstd"];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/seeds/parquet/{name}.parquet"))
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(file(name)).unwrap()
}

#[test]
fn columns_of_numbers_come_back_from_every_packing() {
    for name in FILES {
        let found = read_parquet(file(name)).unwrap();
        let column = |name: &str| found.column(name).unwrap();
        let is = |name: &str, expected: &dyn Fn(f64) -> f64| {
            let expected: Vec<f64> = (0..40).map(|k| expected(f64::from(k))).collect();
            assert_eq!(column(name), expected, "{name}");
        };
        is("u [V]", &|k| k * k / 8.0);
        is("y.1", &|k| k / 4.0);
        is("count", &|_| f64::from(u32::MAX));
        is("whole", &|k| 1000.0 - 7.0 * k);
        is("on", &|k| k % 2.0);
        assert_eq!(column("#2"), column("u [V]"));
        assert!(column("none").iter().all(|x| x.is_nan()));
        let gap = column("gap");
        assert!((0..40).all(|k| if k == 30 { gap[k].is_nan() } else { gap[k] == k as f64 }), "{gap:?}");
    }
}

#[test]
fn a_column_of_timestamps_is_the_clock() {
    for name in FILES {
        let found = read_parquet(file(name)).unwrap();
        let record = found.record(&[ChannelSpec::named("y.1")], &TimeSource::column("t".parse().unwrap())).unwrap();
        assert_eq!((record.samples(), record.time().ts()), (40, 1e-3), "{name}");
    }
}

#[test]
fn what_is_not_a_number_is_named() {
    let found = parquet_from_bytes(&bytes("snappy"), "log.parquet").unwrap();
    let refused =
        |name: &str| found.record(&[ChannelSpec::named(name)], &TimeSource::ts(1e-3)).unwrap_err().to_string();
    assert!(refused("gap").contains("row 31"), "{}", refused("gap"));
    assert!(refused("note").contains("text"), "{}", refused("note"));
    assert!(refused("whale").contains("whole"), "{}", refused("whale"));
}

#[test]
fn columns_that_are_not_asked_for_are_not_read() {
    let chosen = ["y.1".parse().unwrap(), ChannelRef::Column(7)];
    let found = read_columns(&file("lz4"), &chosen).unwrap();
    let read = |variable: &&Variable| matches!(variable.value, Value::Real { .. });
    assert_eq!(found.variables().iter().filter(read).map(|v| v.name.as_str()).collect::<Vec<_>>(), ["y.1", "on"]);
}

#[test]
fn a_packing_that_is_not_read_is_named() {
    let error = read_parquet(file("brotli")).unwrap_err().to_string();
    assert!(error.contains("zstd") && error.contains("brotli") && error.contains("u [V]"), "{error}");
}

#[test]
fn damaged_files_are_refused() {
    for name in FILES {
        let whole = bytes(name);
        for cut in [3, 8, whole.len() / 2, whole.len() - 1] {
            let error = parquet_from_bytes(&whole[..cut], "log.parquet").unwrap_err();
            assert!(matches!(error, Error::Corrupt { .. }), "{error}");
        }
    }
}

/// More columns than a short list of the format holds, two groups, numbers at the ends of their range.
#[test]
fn what_is_written_is_read_back() {
    let path = std::env::temp_dir().join(format!("youla-parquet-{}.parquet", std::process::id()));
    let names: Vec<String> = (0..20).map(|k| format!("c{k}")).collect();
    let mut written = ParquetWriter::create(&path, &names).unwrap();
    let whole = [i32::MIN, -1, i32::MAX];
    for group in 0..2 {
        let double: Vec<f64> = (0..3).map(|k| 0.1 * f64::from(3 * group + k)).collect();
        let single = [f32::MIN_POSITIVE, f32::NAN, -1.5];
        let columns: Vec<ColumnValues<'_>> = (0..20)
            .map(|k| match k % 3 {
                0 => ColumnValues::Double(&double),
                1 => ColumnValues::Float(&single),
                _ => ColumnValues::Integer(&whole),
            })
            .collect();
        written.group(&columns).unwrap();
        assert!(written.group(&columns[1..]).is_err(), "a group with a column too few");
    }
    written.finish().unwrap();
    let found = read_parquet(&path).unwrap();
    assert_eq!(found.column("c18").unwrap(), (0..6).map(|k| 0.1 * f64::from(k)).collect::<Vec<_>>());
    let single = found.column("c19").unwrap();
    assert!(single[0] == f64::from(f32::MIN_POSITIVE) && single[1].is_nan() && single[5] == -1.5, "{single:?}");
    assert_eq!(found.column("c17").unwrap(), whole.map(f64::from).repeat(2));

    // Without its end a file is refused.
    let mut cut = ParquetWriter::create(&path, &["t"]).unwrap();
    cut.group(&[ColumnValues::Double(&[1.0])]).unwrap();
    drop(cut);
    assert!(matches!(read_parquet(&path), Err(Error::Corrupt { .. })));
    ParquetWriter::create(&path, &["t"]).unwrap().finish().unwrap();
    assert_eq!(read_parquet(&path).unwrap().column("t").unwrap(), Vec::<f64>::new());
    std::fs::remove_file(path).unwrap();
}
