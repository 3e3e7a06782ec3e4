//! `[data.computed]`: channels that are computed from columns of the file, row by row, and constants.
//!
//! ```text
//! name = "expression of columns and of other computed channels"
//! name = "slope(expression, n)"        (x(k+n) - x(k-n)) / (2 n ts); less wide at both ends of a record
//! name = "filter(expression, [b0, b1], [a0, a1])"        a(z^-1) result = b(z^-1) expression
//! ```

mod dynamics;

use crate::settings::DataSettings;
use crate::{Error, Result};
use dynamics::{Dynamics, dynamics_of};
use std::collections::HashMap;
use std::path::Path;
use youla::Mat;
use youla::error::{Names, short};
use youla::signal::{Channel, Record};
use youla_greybox::NamedExpression;
use youla_io::{ChannelRef, ChannelSpec};
use youla_loop::check::{Finding, Test};

/// Most computed channels, each at most as many characters long. Chosen, not measured.
const MOST: usize = 100;
const LONGEST: usize = 1000;
/// The computed channels of a run, read and in an order in which each follows those that it uses.
#[derive(Default)]
pub(crate) struct ComputedChannels {
    formulas: Vec<ChannelFormula>,
}

struct ChannelFormula {
    name: String,
    text: String,
    expression: NamedExpression,
    dynamics: Dynamics,
    /// Where the value of each name comes from.
    operands: Vec<Operand>,
}

#[derive(Clone)]
enum Operand {
    /// Number of an earlier formula.
    Computed(usize),
    /// A column of the file.
    Column(ChannelRef),
}

impl ComputedChannels {
    /// Reads all expressions of `[data.computed]`.
    ///
    /// # Errors
    /// An expression that is none, channels that need each other, more than the limits allow.
    pub(crate) fn new(data: &DataSettings) -> Result<Self> {
        let declared = &data.computed;
        if declared.len() > MOST {
            return refused(format!("[data.computed] has {} channels, but may have at most {MOST}", declared.len()));
        }
        let mut waiting = declared.iter().map(|(name, text)| read(name, text)).collect::<Result<Vec<_>>>()?;
        let mut formulas: Vec<ChannelFormula> = Vec::new();
        while !waiting.is_empty() {
            let known = |name: &String| match target(name, data) {
                Target::Column(_) => true,
                Target::Computed(name) => formulas.iter().any(|f| f.name == name),
            };
            let Some(next) = waiting.iter().position(|f| f.expression.names().iter().all(known)) else {
                let names: Vec<String> = waiting.iter().map(|f| f.name.clone()).collect();
                return refused(format!(
                    "[data.computed] {} need each other: a column of the file with the name of a computed channel must be \
                     computed under another name",
                    Names(&names)
                ));
            };
            let mut formula = waiting.remove(next);
            let operand = |name: &String| match target(name, data) {
                Target::Column(column) => Operand::Column(column),
                // Every computed name has its formula by now.
                Target::Computed(name) => {
                    Operand::Computed(formulas.iter().position(|f| f.name == name).unwrap_or(usize::MAX))
                }
            };
            formula.operands = formula.expression.names().iter().map(operand).collect();
            formulas.push(formula);
        }
        Ok(ComputedChannels { formulas })
    }

    /// Whether a channel is computed from no column, and so is constant.
    pub(crate) fn is_constant(&self, channel: &ChannelSpec) -> bool {
        fn constant(all: &[ChannelFormula], number: usize) -> bool {
            all[number].operands.iter().all(|o| matches!(o, Operand::Computed(k) if constant(all, *k)))
        }
        self.formula_of(channel).is_some_and(|number| constant(&self.formulas, number))
    }

    /// The time column where it is computed.
    pub(crate) fn time(&self, data: &DataSettings) -> Option<ChannelSpec> {
        let time = ChannelSpec::from("(time)", data.time_column.clone()?, "");
        self.formula_of(&time).map(|_| time)
    }

    /// Takes away what a check finds of computed channels because of how they are declared: the limits of a `tanh`, a constant.
    pub(crate) fn without_expected(&self, channels: &[&ChannelSpec], findings: Vec<Finding>) -> Vec<Finding> {
        let expected = |f: &Finding| {
            let channel = channels.iter().find(|c| Some(&c.name) == f.channel.as_ref());
            channel.is_some_and(|channel| match f.test {
                Test::Clipping | Test::Quantisation => self.formula_of(channel).is_some(),
                Test::Stuck | Test::Excitation => self.is_constant(channel),
                _ => false,
            })
        };
        findings.into_iter().filter(|f| !expected(f)).collect()
    }

    /// The number of the formula of a channel that is not in the file.
    pub(crate) fn formula_of(&self, channel: &ChannelSpec) -> Option<usize> {
        let ChannelRef::Name(place) = channel.source() else { return None };
        self.formulas.iter().position(|f| f.name == place)
    }

    /// What is to be read for the channels that are wanted: those that are in the file, and the columns that the others use.
    pub(crate) fn to_read(&self, wanted: &[ChannelSpec]) -> Vec<ChannelSpec> {
        let mut read: Vec<ChannelSpec> = wanted.iter().filter(|c| self.formula_of(c).is_none()).cloned().collect();
        for column in self.used(wanted) {
            let name = name_of(&column);
            if !read.iter().any(|c| c.name == name) {
                read.push(ChannelSpec::from(name, column, ""));
            }
        }
        read
    }

    /// The columns that the wanted channels need.
    fn used(&self, wanted: &[ChannelSpec]) -> Vec<ChannelRef> {
        let mut needed: Vec<bool> = vec![false; self.formulas.len()];
        wanted.iter().filter_map(|c| self.formula_of(c)).for_each(|number| needed[number] = true);
        let mut columns = Vec::new();
        for number in (0..self.formulas.len()).rev() {
            if !needed[number] {
                continue;
            }
            for operand in &self.formulas[number].operands {
                match operand {
                    Operand::Computed(earlier) => needed[*earlier] = true,
                    Operand::Column(column) => columns.push(column.clone()),
                }
            }
        }
        columns
    }

    /// The wanted channels of a record of what was read; `first` is its first row in the file, counted from 1.
    ///
    /// # Errors
    /// A value that is not finite, with its row.
    pub(crate) fn apply(&self, wanted: &[ChannelSpec], read: Record, first: usize) -> Result<Record> {
        if wanted.iter().all(|c| self.formula_of(c).is_none()) {
            return Ok(read);
        }
        let mut values: HashMap<usize, Vec<f64>> = HashMap::new();
        let mut columns = Vec::new();
        for channel in wanted {
            columns.push(match self.formula_of(channel) {
                None => read.column(&channel.name)?.to_vec(),
                Some(number) => {
                    self.compute(number, &read, first, &mut values)?;
                    values[&number].clone()
                }
            });
        }
        let data = Mat::from_fn(read.samples(), columns.len(), |k, j| columns[j][k]);
        let channels: Vec<Channel> = wanted.iter().map(|c| Channel::new(&c.name, &c.unit)).collect();
        Ok(Record::new(read.name(), channels, data, read.time())?.starting_at(read.start())?)
    }

    /// Computes a formula and those that it uses, each once.
    fn compute(&self, number: usize, read: &Record, first: usize, values: &mut HashMap<usize, Vec<f64>>) -> Result<()> {
        if values.contains_key(&number) {
            return Ok(());
        }
        let formula = &self.formulas[number];
        for operand in &formula.operands {
            if let Operand::Computed(earlier) = operand {
                self.compute(*earlier, read, first, values)?;
            }
        }
        let operands = formula
            .operands
            .iter()
            .map(|operand| match operand {
                Operand::Computed(earlier) => Ok(values[earlier].as_slice()),
                // A record in memory has its columns by their own names.
                Operand::Column(column) => {
                    Ok(read.column(&name_of(column)).or_else(|_| read.column(&column.to_string()))?)
                }
            })
            .collect::<Result<Vec<&[f64]>>>()?;
        let row = |k: usize| operands.iter().map(|x| x[k]).collect::<Vec<f64>>();
        let of_row: Vec<f64> = (0..read.samples()).map(|k| formula.expression.value(&row(k))).collect();
        let result = formula.dynamics.along(of_row, read.time().ts());
        if let Some(k) = result.iter().position(|x| !x.is_finite()) {
            let names = formula.expression.names().iter().zip(row(k));
            let values: Vec<String> = names.map(|(name, value)| format!("{name} = {value}")).collect();
            let at = if values.is_empty() { String::new() } else { format!(" ({})", Names(&values)) };
            return refused(format!(
                "[data.computed] {} = {:?} is {} in row {} of {}{at}; a computed channel must be a finite number in every row",
                short(&formula.name),
                short(&formula.text),
                result[k],
                first + k,
                read.name(),
            ));
        }
        values.insert(number, result);
        Ok(())
    }
}

/// Name of a column while a file is read; no channel of a user is likely to have it.
fn name_of(column: &ChannelRef) -> String {
    format!("(column {column})")
}

/// What a name of an expression means: a computed channel, a channel of `[data]` by its name, or a column of the file.
enum Target {
    Computed(String),
    Column(ChannelRef),
}

fn target(name: &str, data: &DataSettings) -> Target {
    if data.computed.contains_key(name) {
        return Target::Computed(name.to_owned());
    }
    let channel = data.groups().into_iter().flatten().find(|c| c.name == name);
    // A text is always a name or a number of a column.
    let column = channel.map_or_else(|| name.parse().unwrap_or(ChannelRef::Column(0)), ChannelSpec::source);
    match column {
        ChannelRef::Name(source) if data.computed.contains_key(&source) => Target::Computed(source),
        column => Target::Column(column),
    }
}

fn read(name: &str, text: &str) -> Result<ChannelFormula> {
    let place = format!("[data.computed] {name}");
    if text.len() > LONGEST {
        return refused(format!("{place} is {} bytes long, but may have at most {LONGEST}", text.len()));
    }
    let (inner, dynamics) =
        dynamics_of(text).or_else(|problem| refused(format!("{place} is {text:?}, but {problem}")))?;
    let expression = NamedExpression::new(&place, inner)?;
    Ok(ChannelFormula { name: name.to_owned(), text: text.to_owned(), expression, dynamics, operands: Vec::new() })
}

fn refused<T>(problem: String) -> Result<T> {
    let (path, at) = (Path::new("run.toml").to_owned(), None);
    Err(Error::File(youla_io::Error::Settings { path, at, problem }))
}

/// What is wrong with the computed channels, in words.
pub(crate) fn problem(data: &DataSettings) -> Option<String> {
    let computed = match ComputedChannels::new(data) {
        Err(Error::File(youla_io::Error::Settings { problem, .. })) => return Some(problem),
        Err(other) => return Some(other.to_string()),
        Ok(computed) => computed,
    };
    let constant = data.inputs.iter().find(|c| computed.is_constant(c))?;
    (data.detrend != youla::signal::Detrend::None).then(|| {
        format!(
            "[data] the input {:?} is constant, and detrend = \"{}\" takes it away: write detrend = \"none\"",
            constant.name,
            if data.detrend == youla::signal::Detrend::Mean { "mean" } else { "linear" }
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use youla::lti::Discrete;

    fn data(computed: &[(&str, &str)]) -> DataSettings {
        let channels = |names: &[&str]| names.iter().map(|n| ChannelSpec::named(*n)).collect::<Vec<_>>();
        let computed = computed.iter().map(|(name, text)| (name.to_string(), text.to_string())).collect();
        DataSettings { computed, ..DataSettings::new(channels(&["u", "shape"]), channels(&["y"]), Vec::new()) }
    }

    /// The wanted channels of a file with the columns u, y and "my v".
    fn read(data: &DataSettings) -> Result<Record> {
        let computed = ComputedChannels::new(data)?;
        let wanted: Vec<ChannelSpec> = data.inputs.iter().chain(&data.outputs).cloned().collect();
        let columns = BTreeMap::from([("u", [1.0, 2.0, 3.0, 4.0]), ("y", [0.0, 1.0, 4.0, 9.0]), ("my v", [1.0; 4])]);
        let channels = computed.to_read(&wanted);
        let source = |c: &ChannelSpec| columns[c.source().to_string().as_str()];
        let matrix = Mat::from_fn(4, channels.len(), |k, j| source(&channels[j])[k]);
        let named = channels.iter().map(|c| Channel::new(&c.name, &c.unit)).collect();
        let record = Record::new("log", named, matrix, Discrete::new(0.5).unwrap()).unwrap();
        computed.apply(&wanted, record, 11)
    }

    #[test]
    fn channels_are_computed_from_columns_and_from_each_other() {
        for (computed, expected) in [
            (vec![("shape", "-y^2 + 'my v'")], [1.0, 0.0, -15.0, -80.0]),
            (vec![("speed", "slope(y, 1)"), ("shape", "2 * speed")], [4.0, 8.0, 16.0, 20.0]),
            (vec![("shape", "1")], [1.0; 4]),
            (vec![("shape", "sign(y) * abs(-u)")], [0.0, 2.0, 3.0, 4.0]),
            // at rest at its gain of 2 before, then y(k) = 0.5 y(k-1) + u(k)
            (vec![("shape", "filter(u, [1], [1, -0.5])")], [2.0, 3.0, 4.5, 6.25]),
            // an integrator starts at zero
            (vec![("shape", "filter(2 * u, [0, 1], [1, -1])")], [0.0, 2.0, 6.0, 12.0]),
        ] {
            let record = read(&data(&computed)).unwrap();
            assert_eq!(record.column("shape").unwrap(), expected, "{computed:?}");
            assert_eq!(record.channels().len(), 3);
        }
    }

    #[test]
    fn what_cannot_be_computed_is_named_with_its_row() {
        for (computed, words) in [
            (vec![("shape", "1 / y")], "[data.computed] shape = \"1 / y\" is inf in row 11 of log (y = 0)"),
            (vec![("shape", "2 * ")], "[data.computed] shape is \"2 *\": it ends where a number"),
            (vec![("shape", "log(y)")], "log is not a function; the functions are sqrt"),
            (vec![("shape", "b"), ("b", "shape")], "[data.computed] b, shape need each other"),
            (vec![("shape", "filter(y, [1], [0, 1])")], "\"filter(expression, [b0, b1], [a0, a1])\""),
            (vec![("shape", "slope(y)")], "\"slope(expression, n)\""),
            (vec![("shape", "1 + slope(y, 1)")], "slope is not a function"),
        ] {
            let error = read(&data(&computed)).unwrap_err().to_string();
            assert!(error.contains(words), "{error}\nlacks {words}");
        }
    }

    /// `detrend = "mean"` would leave zeros of a constant input.
    #[test]
    fn a_constant_input_needs_its_mean() {
        let mut settings = data(&[("one", "1"), ("shape", "2 * one")]);
        assert!(problem(&settings).unwrap().contains("detrend = \"none\""));
        settings.detrend = youla::signal::Detrend::None;
        assert_eq!(problem(&settings), None);
    }
}
