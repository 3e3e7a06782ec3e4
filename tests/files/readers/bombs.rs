//! Inputs of at most some kilobytes that announce, unpack to or nest into far more.

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use std::io::Write;

/// The bombs for a reader, with what they are.
pub(crate) fn of(name: &str) -> Vec<(&'static str, Vec<u8>)> {
    let deep = |open: &str, close: &str| [open.repeat(2000), close.repeat(2000)].concat();
    let nested = |key: &str| {
        vec![
            ("deep arrays", format!("{key} = {}", deep("[", "]")).into_bytes()),
            ("deep tables", format!("{key} = {}", deep("{a=", "}")).into_bytes()),
            ("deep keys", format!("{}a = 1", "a.".repeat(2000)).into_bytes()),
            ("deep headers", format!("[{}a]", "a.".repeat(2000)).into_bytes()),
        ]
    };
    match name {
        "csv" => vec![
            ("gzip of commas", gzip(&[b','; 3 << 20])),
            ("gzip of zeros", gzip(&[b'0'; 3 << 20])),
            ("gzip of one line", gzip(&vec![b'1'; 6 << 20])),
            ("gzip of lines", gzip(&b"1,2\n".repeat(700_000))),
            ("gzip of gzip", gzip(&gzip(&[b' '; 64 << 20]))),
            ("gzip of columns", gzip(&b"1,".repeat(1_500_000))),
            ("gzip of some columns", gzip(&[b"1,".repeat(65_535), b"1\n".to_vec()].concat())),
            ("many columns", b"1,".repeat(2000)),
            ("a huge gap in time", b"t,u\n0,1\n1,1\n1e300,1\n".to_vec()),
            ("times that are all but equal", b"0,1\n1e-300,1\n2e-300,1\n".to_vec()),
        ],
        "mat" => vec![
            ("a matrix of 2^31 x 2^31", mat(&matrix([0x7fff_ffff, 0x7fff_ffff], 6, &[]))),
            ("a cell of 2^31 items", mat(&matrix([0x7fff_ffff, 1], 1, &[]))),
            ("a cell of 2^30 x 2^30 items", mat(&matrix([1 << 30, 1 << 30], 1, &[]))),
            ("characters of 2^31 rows", mat(&matrix([0x7fff_ffff, 0], 4, &[]))),
            ("structs without fields", mat(&matrix([0x7fff_ffff, 1], 2, &fields(32, &[])))),
            ("structs with one field", mat(&matrix([0x7fff_ffff, 1], 2, &fields(32, &[0; 32])))),
            ("names of 2^31 bytes", mat(&matrix([1, 1], 2, &fields(0x7fff_ffff, &[0; 32])))),
            ("packed zeros", mat(&packed(&[0; 3 << 20]))),
            ("packed cells", mat(&packed(&matrix([1 << 18, 1], 1, &[14, 0, 0, 0, 0, 0, 0, 0].repeat(1 << 18))))),
            ("a long name of a field", mat(&packed(&matrix([1000, 1], 2, &long_field(3 << 20))))),
            ("cells inside of cells", mat(&(0..80).fold(Vec::new(), |inner, _| matrix([1, 1], 1, &inner)))),
        ],
        "mat73" => vec![
            ("an array of 2^40 numbers that are not there", hdf(&[1 << 20, 1 << 20], None)),
            ("an array of 2^62 numbers that are not there", hdf(&[1 << 31, 1 << 31], None)),
            ("zeros in one chunk", hdf(&[64 << 20], Some(64 << 20))),
            ("zeros in many chunks", hdf(&[1 << 40], Some(1 << 16))),
        ],
        "model" => vec![
            ("a huge shape", npz(&npy("(1000000000000, 0)"))),
            ("zeros", npz(&[npy("(3000000,)"), vec![0; 24 << 20]].concat())),
            ("deep details", format!("{{\"details\":{}}}", deep("[", "]")).into_bytes()),
        ],
        "npz" => ["(4294967296, 4294967296)", "(1000000000000,)", "(0, 1000000000000)", "(1000000000000, 0)"]
            .into_iter()
            .map(|shape| ("a huge shape", npz(&npy(shape))))
            .chain([("zeros", npz(&[npy("(3000000,)"), vec![0; 24 << 20]].concat()))])
            .chain([("entries that share their bytes", shared(40))])
            .collect(),
        "structure" => [
            nested("a"),
            vec![
                ("parentheses", structure(&deep("(", ")"))),
                ("powers", structure(&"2^".repeat(1900))),
                ("signs", structure(&"-".repeat(3000))),
                ("a tower", structure("9^9^9^9^9^9^9")),
                ("a sum", structure(&"1+".repeat(1500))),
            ],
        ]
        .concat(),
        "row" => vec![("fields", b",".repeat(4000))],
        "report_json" | "model_json" | "controller_json" => vec![
            ("deep arrays", deep("[", "]").into_bytes()),
            ("deep objects", deep("{\"a\":", "}").into_bytes()),
            ("deep details", format!("{{\"details\":{}}}", deep("[", "]")).into_bytes()),
        ],
        _ => nested("record"),
    }
}

fn gzip(data: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(data).unwrap();
    encoder.finish().unwrap()
}

fn element(kind: u32, body: &[u8]) -> Vec<u8> {
    let padding = vec![0; body.len().next_multiple_of(8) - body.len()];
    [&kind.to_le_bytes()[..], &(body.len() as u32).to_le_bytes(), body, &padding].concat()
}

/// A MATLAB array: flags, dimensions, the name x, contents.
fn matrix(dims: [u32; 2], class: u32, contents: &[u8]) -> Vec<u8> {
    let flags = [class.to_le_bytes(), [0; 4]].concat();
    let dims = dims.map(u32::to_le_bytes).concat();
    element(14, &[element(6, &flags), element(5, &dims), element(1, b"x"), contents.to_vec()].concat())
}

/// Length and names of the fields of a struct.
fn fields(length: u32, names: &[u8]) -> Vec<u8> {
    let small = [&(4 << 16 | 5_u32).to_le_bytes()[..], &length.to_le_bytes()].concat();
    [small, element(1, names)].concat()
}

/// A thousand structs with one field, whose name is this long.
fn long_field(width: u32) -> Vec<u8> {
    [fields(width, &vec![b'n'; width as usize]), [14, 0, 0, 0, 0, 0, 0, 0].repeat(1000)].concat()
}

fn packed(data: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(data).unwrap();
    let body = encoder.finish().unwrap();
    [&15_u32.to_le_bytes()[..], &(body.len() as u32).to_le_bytes(), &body].concat()
}

fn mat(variable: &[u8]) -> Vec<u8> {
    [&[b' '; 124][..], &[0, 1, b'I', b'M'], variable].concat()
}

fn npy(shape: &str) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()].concat()
}

/// The seed with the array x, whose sizes are `from` there, said to be `sizes`; `chunk` takes the place of the size of its chunks.
fn hdf(sizes: &[u64], chunk: Option<u32>) -> Vec<u8> {
    let name = if chunk.is_some() { "chunks.mat" } else { "rows.h5" };
    let mut file = super::seeds::file("mat73", name);
    let words = |values: &[u64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
    let mut replace = |old: Vec<u8>, new: Vec<u8>| {
        let places: Vec<usize> = (0..=file.len() - old.len()).filter(|at| file[*at..].starts_with(&old)).collect();
        assert!(!places.is_empty(), "{name} holds {old:?}");
        places.iter().for_each(|at| file[*at..at + old.len()].copy_from_slice(&new));
    };
    match chunk {
        None => replace(words(&[3, 2]), words(sizes)),
        Some(chunk) => {
            replace(words(&[1011]), words(sizes));
            replace(503_u32.to_le_bytes().to_vec(), chunk.to_le_bytes().to_vec());
        }
    }
    file
}

fn npz(array: &[u8]) -> Vec<u8> {
    let mut writer = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    writer.start_file("x.npy", zip::write::SimpleFileOptions::default()).unwrap();
    writer.write_all(array).unwrap();
    writer.finish().unwrap().into_inner()
}

/// An archive whose entries of different names all lead to the same packed bytes: 2 MB, 16 MB as numbers.
fn shared(count: u8) -> Vec<u8> {
    let mut array = [npy("(2000000,)"), vec![0; 2_000_000]].concat();
    // The type, behind the magic string and `{'descr': '`.
    array[21..24].copy_from_slice(b"|i1");
    let archive = npz(&array);
    // Directory and its end: the entry "x.npy" and 22 bytes.
    let end = archive.len() - 22;
    let start = u32::from_le_bytes(archive[end + 16..end + 20].try_into().unwrap()) as usize;
    let entry = &archive[start..end];
    let mut out = archive[..start].to_vec();
    for number in 0..count {
        let mut entry = entry.to_vec();
        entry[46] = b'0' + number;
        out.extend(entry);
    }
    let mut tail = archive[end..].to_vec();
    for at in [8, 10] {
        tail[at..at + 2].copy_from_slice(&u16::from(count).to_le_bytes());
    }
    tail[12..16].copy_from_slice(&(u32::from(count) * entry.len() as u32).to_le_bytes());
    [out, tail].concat()
}

fn structure(expression: &str) -> Vec<u8> {
    format!("a = [[\"{expression}\"]]\nb = [[1.0]]\nc = [[1.0]]\n[parameters]\nk = {{ initial = 1.0 }}\n").into_bytes()
}
