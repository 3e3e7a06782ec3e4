//! A model as a NumPy archive: the arrays `a`, `b`, `c`, `d` and the number `ts`, stored, by columns; those of its predictor, where it
//! has one, begin with `predictor_`.
//!
//! Source: NumPy, "NEP 1, A simple file format for NumPy arrays", version 1.

use super::NamedModel;
use super::predictor::Predictor;
use crate::error::{Error, Result};
use std::io::{Cursor, Write};
use youla::MatRef;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// The numbers of an array begin at a multiple of this.
const ALIGNMENT: usize = 64;

pub(super) fn npz(model: &NamedModel) -> Result<Vec<u8>> {
    let g = &model.system;
    let ts = g.time().ts().to_le_bytes().to_vec();
    let own = [("a", g.a()), ("b", g.b()), ("c", g.c()), ("d", g.d())].map(|(name, m)| (name.to_owned(), array(m)));
    let mut arrays = own.to_vec();
    arrays.push(("ts".into(), npy("()", ts)));
    if let Some(predictor) = Predictor::of(model) {
        arrays.extend(predictor.matrices(model).map(|(name, m)| (name, array(m.as_ref()))));
    }
    archive(&arrays).map_err(|e| Error::Io { path: format!("{}.npz", model.name).into(), source: e.into() })
}

fn archive(arrays: &[(String, Vec<u8>)]) -> zip::result::ZipResult<Vec<u8>> {
    // The date of a file would make the same model other bytes.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default());
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in arrays {
        writer.start_file(format!("{name}.npy"), options)?;
        writer.write_all(bytes)?;
    }
    Ok(writer.finish()?.into_inner())
}

fn array(matrix: MatRef<'_, f64>) -> Vec<u8> {
    let numbers = matrix.col_iter().flat_map(|column| column.iter().flat_map(|x| x.to_le_bytes()));
    npy(&format!("({}, {})", matrix.nrows(), matrix.ncols()), numbers.collect())
}

fn npy(shape: &str, numbers: Vec<u8>) -> Vec<u8> {
    let mut header = format!("{{'descr': '<f8', 'fortran_order': True, 'shape': {shape}, }}");
    let begin = 10 + header.len() + 1;
    header.push_str(&" ".repeat(begin.next_multiple_of(ALIGNMENT) - begin));
    header.push('\n');
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &numbers].concat()
}
