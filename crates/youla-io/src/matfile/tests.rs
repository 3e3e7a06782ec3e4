use super::*;
use crate::error::{Error, Result};
use crate::scratch::{data_folder, scratch};
use crate::{ChannelRef, ChannelSpec, TimeSource, Value, Variable, Variables};
use proptest::prelude::*;
use std::sync::LazyLock;
use youla::linalg::eye;

fn sample() -> Vec<Variable> {
    let model = Value::structure([
        ("a", Value::matrix(eye(3).as_ref())),
        ("ts", Value::scalar(2e-4)),
        ("name", Value::text("Lagerprüfstand")),
        ("nested", Value::structure([("y", Value::Real { dims: vec![5, 1], data: vec![1.5; 5] })])),
    ]);
    let runs = Value::Struct {
        dims: vec![1, 2],
        fields: vec!["u".into(), "y".into()],
        items: (0..4).map(|k| Value::scalar(k.into())).collect(),
    };
    let cell = Value::Cell { dims: vec![1, 2], items: vec![Value::text("x"), Value::scalar(7.0)] };
    let complex = Value::Complex { dims: vec![1, 2], re: vec![1.0, 2.0], im: vec![-1.0, 0.5] };
    let rows = Value::Text(vec!["ab ".into(), "cüe".into(), "x𝄞".into()]);
    let matrix = Value::Real { dims: vec![2, 3], data: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
    let empty = Value::Real { dims: vec![0, 0], data: vec![] };
    [("model", model), ("runs", runs), ("c", cell), ("z", complex), ("rows", rows), ("x", matrix), ("empty", empty)]
        .map(|(name, value)| Variable { name: name.into(), value })
        .to_vec()
}

fn bytes_of(packing: Packing) -> Vec<u8> {
    let file = scratch("mat");
    write_mat(file.path(), &sample(), packing).unwrap();
    std::fs::read(file.path()).unwrap()
}

fn read_bytes(bytes: &[u8]) -> Result<Variables> {
    let file = scratch("mat");
    std::fs::write(file.path(), bytes).unwrap();
    read_mat(file.path())
}

#[test]
fn written_values_read_back() {
    for packing in [Packing::Plain, Packing::Zlib] {
        assert_eq!(read_bytes(&bytes_of(packing)).unwrap().variables(), sample());
    }
}

#[test]
fn paths_reach_every_value() {
    let file = read_bytes(&bytes_of(Packing::Zlib)).unwrap();
    assert_eq!(file.scalar("model.ts").unwrap(), 2e-4);
    assert_eq!(file.column("model.nested.y").unwrap(), [1.5; 5]);
    assert_eq!(file.scalar("runs(2).u").unwrap(), 2.0);
    assert_eq!(file.scalar("c{2}").unwrap(), 7.0);
    assert_eq!(file.column("x(:,2)").unwrap(), [3.0, 4.0]);
    let message = file.get("model.nestd.y").unwrap_err().to_string();
    assert!(message.contains("did you mean \"model.nested.y\"") && message.contains("runs(2).u"), "{message}");
    for missing in
        ["runs.u", "runs(3).u", "runs(0).u", "c{3}", "c", "x.y", "", ".", "(", "model.", "runs(99999999999999999999).u"]
    {
        assert!(file.column(missing).is_err(), "{missing}");
    }
    for (path, part) in [("x", "(:,1)"), ("x(:,4)", "a matrix that has this column"), ("z", "1 x 2 complex")] {
        let message = file.column(path).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

/// Tag, data and padding as another program would write them, in either order of bytes.
fn element(kind: u32, data: &[u8], big: bool) -> Vec<u8> {
    let order = |x: u32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
    let mut out = [order(kind), order(data.len() as u32)].concat();
    out.extend(data);
    out.resize(out.len().next_multiple_of(8), 0);
    out
}

fn file_of(class: u32, storage: u32, dims: [i32; 2], data: &[u8], big: bool) -> Vec<u8> {
    let order = |x: u32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
    let mut body = element(kind::UINT32, &[order(class), order(0)].concat(), big);
    body.extend(element(kind::INT32, &dims.map(|d| order(d as u32)).concat(), big));
    body.extend(element(kind::INT8, b"x", big));
    body.extend(element(storage, data, big));
    let mut out = vec![b' '; HEADER];
    out[..6].copy_from_slice(b"MATLAB");
    out[124..].copy_from_slice(if big { &[1, 0, b'M', b'I'] } else { &[0, 1, b'I', b'M'] });
    out.extend(element(kind::MATRIX, &body, big));
    out
}

#[test]
fn every_storage_type_in_both_byte_orders() {
    for big in [false, true] {
        macro_rules! case {
            ($type:ty, $storage:expr) => {{
                let values: [$type; 3] = [1 as $type, 100 as $type, 7 as $type];
                let data = values.map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() }).concat();
                let file = read_bytes(&file_of(u32::from(class::DOUBLE), $storage, [3, 1], &data, big)).unwrap();
                assert_eq!(file.column("x").unwrap(), [1.0, 100.0, 7.0], "{} {big}", stringify!($type));
            }};
        }
        case!(i8, kind::INT8);
        case!(u8, kind::UINT8);
        case!(i16, kind::INT16);
        case!(u16, kind::UINT16);
        case!(i32, kind::INT32);
        case!(u32, kind::UINT32);
        case!(f32, kind::SINGLE);
        case!(f64, kind::DOUBLE);
        case!(i64, kind::INT64);
        case!(u64, kind::UINT64);
    }
}

#[test]
fn unknown_classes_are_named() {
    for (code, name) in [(5, "sparse matrix (not read)"), (16, "function handle (not read)"), (17, "object (not read)")]
    {
        let file = read_bytes(&file_of(code, kind::INT8, [1, 1], &[0; 8], false)).unwrap();
        assert_eq!(file.variables()[0].value.description(), name);
    }
}

#[test]
fn sizes_beyond_the_file_are_refused() {
    for dims in [[i32::MAX, i32::MAX], [i32::MAX, 1], [-1, 1], [2, 1]] {
        for code in [class::CELL, class::STRUCT, class::CHAR, class::DOUBLE] {
            let error = read_bytes(&file_of(u32::from(code), kind::UINT8, dims, &[0; 8], false)).unwrap_err();
            assert!(matches!(error, Error::Corrupt { .. }), "{code} {dims:?}: {error}");
        }
    }
}

#[test]
fn a_packed_variable_cannot_announce_more_than_it_holds() {
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write;
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&[kind::MATRIX.to_le_bytes(), u32::MAX.to_le_bytes()].concat()).unwrap();
    encoder.write_all(&[0; 1000]).unwrap();
    let mut bytes = bytes_of(Packing::Plain)[..HEADER].to_vec();
    bytes.extend(element(kind::COMPRESSED, &encoder.finish().unwrap(), false));
    let message = read_bytes(&bytes).unwrap_err().to_string();
    assert!(
        message.contains("byte 136: expected 4294967295 bytes packed by zlib, but only 1000 were decompressed"),
        "{message}"
    );
}

#[test]
fn nesting_is_bounded() {
    let mut value = Value::scalar(1.0);
    for _ in 0..5000 {
        value = Value::Cell { dims: vec![1, 1], items: vec![value] };
    }
    let file = scratch("mat");
    write_mat(file.path(), &[Variable { name: "deep".into(), value }], Packing::Zlib).unwrap();
    let message = read_mat(file.path()).unwrap_err().to_string();
    assert!(message.contains("at most 32 levels of structs and cells"), "{message}");
}

#[test]
fn other_formats_are_named() {
    let mut hdf5 = vec![b' '; 600];
    hdf5[512..520].copy_from_slice(b"\x89HDF\r\n\x1a\n");
    let message = read_bytes(&hdf5).unwrap_err().to_string();
    assert!(message.contains("byte 0: expected a readable HDF5 file"), "{message}");
    assert!(matches!(read_bytes(b"").unwrap_err(), Error::NoData { .. }));
    assert!(matches!(read_bytes(&[0; 200]).unwrap_err(), Error::FormatNotRead { .. }));
    assert!(matches!(
        read_bytes(&[b'x'; 200]).unwrap_err(),
        Error::Corrupt { at: crate::error::CorruptAt::Byte(124), .. }
    ));
    assert!(matches!(read_mat("no/such/file.mat").unwrap_err(), Error::MissingFile { .. }));
}

#[test]
fn values_that_cannot_be_written_are_refused() {
    let short = Value::Real { dims: vec![2, 2], data: vec![0.0; 3] };
    let unread = Value::Unsupported { class: "object".into() };
    let long = Value::structure([("f".repeat(64), Value::scalar(0.0))]);
    for (name, value) in [("x", short), ("x", unread), ("x", long), ("", Value::scalar(0.0))] {
        let variable = Variable { name: name.into(), value };
        let error = write_mat("unused.mat", &[variable], Packing::Plain).unwrap_err();
        assert!(matches!(error, Error::WrongVariable { .. }), "{error}");
    }
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn the_real_matlab_files_load() {
    let folder = data_folder();
    let channels =
        ["r", "d", "u", "e", "y"].map(|n| ChannelSpec::from(n, ChannelRef::Name(format!("Data.signals.{n}")), ""));
    for (file, ts) in
        [("fs2000/cycle1", 5e-4), ("fs2000/cycle2", 5e-4), ("fs2000/cycle3", 5e-4), ("fs4000/cycle1", 2.5e-4)]
    {
        let path = folder.join("flexible_drive").join(file).with_extension("mat");
        let record = read_mat(&path).unwrap().record(&channels, &TimeSource::ts(ts)).unwrap();
        assert_eq!(record.samples(), 240_000);
        let (r, e, y) = (record.column("r").unwrap(), record.column("e").unwrap(), record.column("y").unwrap());
        assert!((0..r.len()).all(|k| (e[k] - (r[k] - y[k])).abs() < 1e-6), "e = r - y in {file}");
        let mat = read_mat(&path).unwrap();
        assert_eq!(mat.scalar("Data.settings.fs").unwrap(), 1.0 / ts);
        assert!(mat.get("Data.FileName").unwrap().description().contains("not read"));
    }
    let emps = ["vir", "qm", "qg"].map(ChannelSpec::named);
    let time = TimeSource::column("t".parse().unwrap());
    let record = read_mat(folder.join("emps/DATA_EMPS.mat")).unwrap().record(&emps, &time).unwrap();
    assert_eq!((record.samples(), record.time().ts()), (24_841, 1e-3));
}

static PLAIN: LazyLock<Vec<u8>> = LazyLock::new(|| bytes_of(Packing::Plain));
static PACKED: LazyLock<Vec<u8>> = LazyLock::new(|| bytes_of(Packing::Zlib));

/// A damaged file may still be a file; it must not be a panic, and an error must be one sentence that names the file.
fn survives(bytes: &[u8]) {
    match read_bytes(bytes) {
        Ok(file) => file.leaves().iter().for_each(|path| drop(file.column(path))),
        Err(error) => assert!(error.to_string().contains(".mat"), "{error}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_do_not_panic(
        packed in any::<bool>(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        cut in proptest::option::of(any::<prop::sample::Index>()),
    ) {
        let mut bytes = if packed { PACKED.clone() } else { PLAIN.clone() };
        let length = bytes.len();
        changes.iter().for_each(|(at, byte)| bytes[at.index(length)] = *byte);
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        survives(&bytes);
    }

    #[test]
    fn damaged_sizes_do_not_panic(word in any::<prop::sample::Index>(), value in prop_oneof![0_u32..64, any::<u32>()]) {
        let mut bytes = PLAIN.clone();
        let at = HEADER + 4 * word.index((bytes.len() - HEADER) / 4);
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        survives(&bytes);
    }
}
