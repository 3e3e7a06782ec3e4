//! MATLAB files of version 7.3 (`save -v7.3`), which are HDF5 files: real arrays of any class, text, and structs of them.
//!
//! Source: The MathWorks, "MAT-File Versions"; the attribute `MATLAB_class` of each array names its class, and its sizes are in
//! reverse order, so the numbers are by column. An array without that attribute, from another program, is by row. Declared sizes
//! above 32 MB + 1032 x file size are rejected.

use crate::error::{CorruptAt, Error, Result};
use crate::limits::declared_limit;
use crate::values::{Value, Variable, Variables};
use hdf5_pure::{AttrValue, DType, Dataset, File, Group};
use std::collections::HashMap;
use std::path::Path;

/// Largest nesting of structs.
const MAX_DEPTH: usize = 32;
/// Largest number of arrays and structs of a file; links may lead to one many times.
const MOST_VALUES: usize = 10_000;
/// Longest name of a variable or field, in bytes.
const LONGEST_NAME: usize = 1024;
/// Bytes of numbers that any file may declare.
const BASE: u64 = 1 << 25;

/// The variables of a file that is in memory; `path` is named in errors.
///
/// # Errors
/// [`Error::Corrupt`] for a damaged file and for one that declares more numbers than it can contain.
pub(super) fn hdf_from_bytes(bytes: &[u8], path: &Path) -> Result<Variables> {
    let numbers = declared_limit(BASE, bytes.len() as u64);
    let mut budget = Budget { values: MOST_VALUES, numbers };
    let mut read = || {
        let file = File::from_bytes(bytes.to_vec()).map_err(damaged)?;
        budget.members(&file.root(), 0)
    };
    match read() {
        Ok(members) => {
            let variables = members.into_iter().map(|(name, value)| Variable { name, value });
            Ok(Variables::new(path, variables.collect()))
        }
        Err(expected) => Err(Error::Corrupt { path: path.to_owned(), at: CorruptAt::Byte(0), expected }),
    }
}

/// What was expected instead.
type Fault = String;

fn damaged(error: hdf5_pure::Error) -> Fault {
    format!("a readable HDF5 file ({error})")
}

/// The remaining number of values and bytes.
struct Budget {
    values: usize,
    /// Bytes of numbers.
    numbers: u64,
}

impl Budget {
    /// The arrays and structs of a group; MATLAB keeps what is behind them in groups whose names begin with `#`.
    fn members(&mut self, group: &Group, depth: usize) -> Result<Vec<(String, Value)>, Fault> {
        if depth > MAX_DEPTH {
            return Err(format!("structs of at most {MAX_DEPTH} levels"));
        }
        let mut members = Vec::new();
        for name in visible(group.datasets().map_err(damaged)?)? {
            self.count()?;
            let value = self.array(&group.dataset(&name).map_err(damaged)?)?;
            members.push((name, value));
        }
        for name in visible(group.groups().map_err(damaged)?)? {
            self.count()?;
            let value = self.structure(&group.group(&name).map_err(damaged)?, depth + 1)?;
            members.push((name, value));
        }
        Ok(members)
    }

    fn count(&mut self) -> Result<(), Fault> {
        self.values = self.values.checked_sub(1).ok_or(format!("at most {MOST_VALUES} arrays and structs"))?;
        Ok(())
    }

    fn structure(&mut self, group: &Group, depth: usize) -> Result<Value, Fault> {
        if group.attrs().map_err(damaged)?.contains_key("MATLAB_sparse") {
            return Ok(Value::Unsupported { class: "sparse".into() });
        }
        let (fields, items) = self.members(group, depth)?.into_iter().unzip();
        Ok(Value::Struct { dims: vec![1, 1], fields, items })
    }

    fn array(&mut self, dataset: &Dataset) -> Result<Value, Fault> {
        let attributes = dataset.attrs().map_err(damaged)?;
        let class = attributes.get("MATLAB_class").and_then(AttrValue::as_str);
        let kind = dataset.dtype().map_err(damaged)?;
        let set = |name: &str| is_set(&attributes, name);
        if !is_real(&kind)
            || set("MATLAB_object_decode")
            || matches!(class, Some("cell" | "struct" | "function_handle"))
        {
            return Ok(Value::Unsupported { class: class.map_or_else(|| kind.to_string(), str::to_owned) });
        }
        let mut dims = self.sizes(dataset)?;
        let data = dataset.read_f64().map_err(damaged)?;
        if set("MATLAB_empty") {
            // The numbers are the sizes of an empty array.
            dims = data.iter().map(|x| *x as usize).collect();
            let empty = dims.len() >= 2 && dims.contains(&0);
            return if empty { Ok(Value::Real { dims, data: Vec::new() }) } else { Err("an empty array".into()) };
        }
        if data.len() != dims.iter().product::<usize>() {
            return Err(format!("as many numbers as the sizes of the array state, not {}", data.len()));
        }
        match class {
            Some("char") => Ok(text(&reversed(dims), &data)),
            Some(_) => Ok(Value::Real { dims: reversed(dims), data }),
            None => Ok(by_row(dims, data)),
        }
    }

    /// Sizes in the order of the file; their product is charged to the budget.
    fn sizes(&mut self, dataset: &Dataset) -> Result<Vec<usize>, Fault> {
        let shape = dataset.shape().map_err(damaged)?;
        let size = dataset.element_size().map_err(damaged)?.max(8);
        let bytes = shape.iter().try_fold(size, |product, &n| product.checked_mul(n));
        let left = bytes.and_then(|bytes| self.numbers.checked_sub(bytes));
        self.numbers = left.ok_or_else(|| format!("array sizes that fit a file of this size, not {shape:?}"))?;
        shape.into_iter().map(|n| usize::try_from(n).map_err(|_| "sizes that fit into memory".to_owned())).collect()
    }
}

/// The names that a user has given.
fn visible(names: Vec<String>) -> Result<Vec<String>, Fault> {
    match names.iter().find(|name| name.len() > LONGEST_NAME) {
        Some(name) => Err(format!("names of at most {LONGEST_NAME} bytes, not of {}", name.len())),
        None => Ok(names.into_iter().filter(|name| !name.starts_with('#')).collect()),
    }
}

fn is_real(kind: &DType) -> bool {
    use DType::*;
    matches!(kind, F32 | F64 | I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64)
}

/// Whether an attribute is there and not zero.
fn is_set(attributes: &HashMap<String, AttrValue>, name: &str) -> bool {
    attributes.get(name).is_some_and(|value| value.as_i64() != Some(0))
}

/// At least two sizes, in MATLAB's order.
fn reversed(mut dims: Vec<usize>) -> Vec<usize> {
    dims.reverse();
    while dims.len() < 2 {
        dims.push(1);
    }
    dims
}

/// Numbers by row become numbers by column; one size is a column.
fn by_row(mut dims: Vec<usize>, data: Vec<f64>) -> Value {
    while dims.len() < 2 {
        dims.push(1);
    }
    let &[rows, columns] = &dims[..] else {
        return Value::Unsupported { class: format!("array of {} dimensions, by row", dims.len()) };
    };
    if data.is_empty() {
        return Value::Real { dims, data };
    }
    let by_column = (0..columns).flat_map(|j| (0..rows).map(move |i| (i, j))).map(|(i, j)| data[i * columns + j]);
    Value::Real { data: by_column.collect(), dims }
}

/// The rows of a character array, UTF-16 by column.
fn text(dims: &[usize], units: &[f64]) -> Value {
    let rows = if units.is_empty() { 0 } else { dims[0] };
    let row = |i: usize| {
        let units: Vec<u16> = units.iter().skip(i).step_by(rows).map(|unit| *unit as u16).collect();
        String::from_utf16_lossy(&units)
    };
    Value::Text((0..rows).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ChannelRef, ChannelSpec, TimeSource, mat_from_bytes};
    use hdf5_pure::FileBuilder;
    use hdf5_pure::mat::{MatBuilder, Options};

    /// A struct with a record, matrices of several classes and text, as MATLAB lays them out.
    fn sample() -> Vec<u8> {
        let mut file = MatBuilder::new(Options::default());
        file.write_scalar_f64("ts", 5e-4).unwrap();
        file.write_f64("x", &[3, 2], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        file.write_i16("i", &[1, 3], &[-2, 0, 300]).unwrap();
        file.write_logical("flag", &[2, 1], &[1, 0]).unwrap();
        file.write_char("name", "rig µ").unwrap();
        file.struct_("Data", |data| {
            data.write_f64("u", &[4, 1], &[0.5, 1.0, 1.5, -0.1])?;
            data.write_f32("y", &[4, 1], &[1.5, 2.5, 3.5, 4.5])?;
            Ok(())
        })
        .unwrap();
        file.finish().unwrap()
    }

    #[test]
    fn arrays_of_matlab_are_by_column() {
        let file = mat_from_bytes(&sample(), "log.mat").unwrap();
        assert_eq!(file.column("x(:,2)").unwrap(), [4.0, 5.0, 6.0]);
        assert_eq!(file.get("x").unwrap().description(), "3 x 2 real");
        assert_eq!((file.column("i").unwrap(), file.column("flag").unwrap()), (vec![-2.0, 0.0, 300.0], vec![1.0, 0.0]));
        assert_eq!(file.get("name").unwrap(), &Value::text("rig µ"));
        assert_eq!(file.scalar("ts").unwrap(), 5e-4);
    }

    #[test]
    fn records_come_with_channels_units_and_clock() {
        let channel = |name: &str| ChannelSpec::from(name, ChannelRef::Name(format!("Data.{name}")), "V");
        let file = mat_from_bytes(&sample(), "log.mat").unwrap();
        let record = file.record(&[channel("u"), channel("y")], &TimeSource::ts(5e-4)).unwrap();
        assert_eq!(
            (record.column("u").unwrap(), record.column("y").unwrap()),
            (&[0.5, 1.0, 1.5, -0.1][..], &[1.5, 2.5, 3.5, 4.5][..])
        );
        assert_eq!(record.channels()[0].unit, "V");
        let wrong = file.record(&[channel("v")], &TimeSource::ts(5e-4)).unwrap_err().to_string();
        assert!(wrong.contains("known: ") && wrong.contains("Data.u"), "{wrong}");
    }

    /// The same from the HDF5 library itself, which `fuzz/seeds.py` calls.
    #[test]
    fn files_of_another_writer_are_read() {
        let seed = |bytes: &[u8]| mat_from_bytes(bytes, "log.mat");
        let file = seed(include_bytes!("../tests/seeds/mat73/structs.mat")).unwrap();
        assert_eq!((file.column("x(:,2)").unwrap(), file.scalar("ts").unwrap()), (vec![3.0, 4.0, 5.0], 5e-4));
        assert_eq!(file.get("name").unwrap(), &Value::text("rig"));
        assert_eq!(file.get("none").unwrap(), &Value::Real { dims: vec![0, 0], data: Vec::new() });
        assert_eq!(
            (file.column("Data.u").unwrap(), file.column("Data.y").unwrap()),
            (vec![0.0, 1.0, 2.0, 3.0], vec![0.0, 1.0, 2.0, 3.0])
        );
        let packed = seed(include_bytes!("../tests/seeds/mat73/chunks.mat")).unwrap();
        assert_eq!(packed.column("x").unwrap(), (0..1011).map(f64::from).collect::<Vec<_>>());
        // Cut out of a larger file: the addresses in it lead elsewhere.
        assert!(seed(include_bytes!("../tests/seeds/mat73/rows.h5")).is_err());
        let cycle = seed(include_bytes!("../tests/seeds/mat73/cycle.mat")).unwrap_err().to_string();
        assert!(cycle.contains("structs of at most 32 levels"), "{cycle}");
    }

    #[test]
    fn arrays_of_other_programs_are_by_row() {
        let mut file = FileBuilder::new();
        file.create_dataset("x").with_f64_data(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).with_shape(&[3, 2]);
        file.create_dataset("t").with_f64_data(&[0.0, 0.5]).with_shape(&[2]);
        let file = mat_from_bytes(&file.finish().unwrap(), "log.h5").unwrap();
        assert_eq!((file.column("x(:,2)").unwrap(), file.column("t").unwrap()), (vec![2.0, 4.0, 6.0], vec![0.0, 0.5]));
    }

    #[test]
    fn packed_numbers_are_read_and_damage_is_an_error() {
        let mut file = FileBuilder::new();
        let values: Vec<f64> = (0..20_000).map(|k| f64::from(k % 7)).collect();
        file.create_dataset("x").with_f64_data(&values).with_shape(&[20_000]).with_chunks(&[4096]).with_deflate(6);
        let bytes = file.finish().unwrap();
        assert!(bytes.len() < 20_000, "{}", bytes.len());
        assert_eq!(mat_from_bytes(&bytes, "log.mat").unwrap().column("x").unwrap(), values);
        for cut in [600, 100, bytes.len() / 2] {
            assert!(matches!(mat_from_bytes(&bytes[..cut], "log.mat"), Err(Error::Corrupt { .. })), "{cut}");
        }
    }
}
