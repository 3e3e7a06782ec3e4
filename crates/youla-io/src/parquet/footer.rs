//! The footer of a file: its columns, and where their chunks are.
//!
//! Source: Apache Parquet format 2, `FileMetaData`, `SchemaElement`, `RowGroup` and `ColumnMetaData` in `parquet.thrift`.

use super::Fault;
use super::thrift::{Field, Fields};

/// Groups of columns inside of each other.
const MAX_DEPTH: usize = 32;

/// Columns, and chunks of them by groups of rows.
pub(super) struct Footer {
    pub(super) columns: Vec<Column>,
    pub(super) groups: Vec<Group>,
}

/// A column; the levels of nested ones are joined by points in its name.
pub(super) struct Column {
    pub(super) name: String,
    /// Cells may be empty.
    pub(super) optional: bool,
    /// How its numbers are stored, or its type if it is not numeric.
    pub(super) content: Result<Number, &'static str>,
}

/// How a number is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Number {
    Bool,
    Int32,
    Int64,
    Unsigned32,
    Unsigned64,
    Float,
    Double,
    /// Counts of so many seconds since 1970.
    Clock(f64),
}

/// A group of rows.
pub(super) struct Group {
    pub(super) rows: u64,
    /// One for each column.
    pub(super) chunks: Vec<Chunk>,
}

/// Bytes of the file.
pub(super) struct Chunk {
    pub(super) start: u64,
    pub(super) length: u64,
    /// Number of the way in which its pages are packed.
    pub(super) packing: i64,
}

impl Footer {
    pub(super) fn parse(mut bytes: &[u8]) -> Result<Self, Fault> {
        let file = Fields::take(&mut bytes).ok_or("a footer of columns and groups of rows")?;
        let columns = columns(file.list(2).unwrap_or_default())?;
        let groups = file.list(4).unwrap_or_default().iter().map(|group| group.fields().and_then(self::group));
        let groups: Vec<Group> = groups.collect::<Option<_>>().ok_or("groups of rows with their chunks")?;
        if groups.iter().any(|group| group.chunks.len() != columns.len()) {
            return Err("a chunk of each column in each group of rows".into());
        }
        Ok(Footer { columns, groups })
    }
}

fn group(group: &Fields<'_>) -> Option<Group> {
    let chunk = |chunk: &Field<'_>| {
        let about = chunk.fields()?.fields(3)?;
        let start = about.size(11).filter(|at| *at > 0).or_else(|| about.size(9))?;
        Some(Chunk { start, length: about.size(7)?, packing: about.integer(4)? })
    };
    Some(Group { rows: group.size(3)?, chunks: group.list(1)?.iter().map(chunk).collect::<Option<_>>()? })
}

/// The columns of a schema, which lists a tree: each node before its children.
fn columns(schema: &[Field<'_>]) -> Result<Vec<Column>, Fault> {
    let mut columns = Vec::new();
    // Names of the nodes above, and how many of their children are to come.
    let mut above: Vec<(String, i64)> = Vec::new();
    let (root, nodes) = schema.split_first().ok_or("a schema")?;
    above.push((String::new(), root.fields().and_then(|root| root.integer(5)).unwrap_or(0)));
    for node in nodes {
        let node = node.fields().ok_or("a schema of columns")?;
        while above.pop_if(|(_, left)| *left <= 0).is_some() {}
        let (prefix, left) = above.last_mut().ok_or("a schema with as many columns as announced")?;
        *left -= 1;
        let name = format!("{prefix}{}", String::from_utf8_lossy(node.bytes(4).ok_or("columns with names")?));
        match node.integer(5) {
            Some(children) if children > 0 => above.push((format!("{name}."), children)),
            _ => columns.push(Column {
                name,
                optional: node.integer(3) == Some(1),
                content: if above.len() > 1 || node.integer(3) == Some(2) {
                    Err("a nested column")
                } else {
                    number(node)
                },
            }),
        }
        if above.len() > MAX_DEPTH {
            return Err(format!("columns of at most {MAX_DEPTH} levels"));
        }
    }
    Ok(columns)
}

/// By the type in which a number is stored, and by what it means, as newer and as older files say it.
fn number(node: &Fields<'_>) -> Result<Number, &'static str> {
    let logical = |number| node.fields(10).and_then(|logical| logical.fields(number));
    let older = node.integer(6);
    let is =
        |number, old: &[i64]| logical(number).is_some() || older.is_some_and(|old_number| old.contains(&old_number));
    let unsigned = match logical(10) {
        Some(integer) => integer.bool(2) == Some(false),
        None => older.is_some_and(|number| (11..=14).contains(&number)),
    };
    if is(5, &[5]) {
        return Err("a decimal number");
    } else if is(6, &[6]) {
        return Err("a date");
    } else if is(7, &[7, 8]) {
        return Err("a time of day");
    }
    match node.integer(1) {
        Some(0) => Ok(Number::Bool),
        Some(1) => Ok(if unsigned { Number::Unsigned32 } else { Number::Int32 }),
        Some(2) if is(8, &[9, 10]) => {
            seconds(logical(8), older).map(Number::Clock).ok_or("a timestamp of another unit")
        }
        Some(2) => Ok(if unsigned { Number::Unsigned64 } else { Number::Int64 }),
        Some(3) => Err("a timestamp of 96 bits"),
        Some(4) => Ok(Number::Float),
        Some(5) => Ok(Number::Double),
        _ => Err("text or bytes"),
    }
}

/// Of one count of a timestamp.
fn seconds(logical: Option<&Fields<'_>>, older: Option<i64>) -> Option<f64> {
    match (logical.and_then(|timestamp| timestamp.fields(2)), older) {
        (Some(unit), _) => [(1, 1e-3), (2, 1e-6), (3, 1e-9)].into_iter().find_map(|(n, s)| unit.fields(n).map(|_| s)),
        (None, Some(9)) => Some(1e-3),
        (None, Some(10)) => Some(1e-6),
        _ => None,
    }
}
