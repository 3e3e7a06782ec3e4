//! From a declaration to a structure: dependence, bounds, and every check of what was read.

use super::declaration::{Declaration, ParameterDeclaration};
use super::names::{Names, finite};
use super::{Cell, DeclaredStructure, Formula, Parameter, Quantity};
use crate::{Error, Result};
use std::cmp::Ordering;
use youla::error::nearest_name;
use youla::lti::Discrete;

impl DeclaredStructure {
    /// The structure of a declaration.
    ///
    /// # Errors
    /// One sentence with matrix, row, column, name and expression for whatever does not fit: [`Error::MissingMatrix`],
    /// [`youla::Error::Shape`], [`Error::Expression`], [`Error::UnknownName`], [`Error::BadName`], [`Error::CircularDefinition`],
    /// [`Error::UnusedParameter`], [`Error::NoInitialValue`], [`Error::EmptyBounds`], [`Error::OutsideBounds`],
    /// [`youla::Error::OutOfRange`] for a scale that is not positive; [`Error::EntryNotFinite`] where an entry or its derivative is
    /// not finite at the initial values.
    pub fn new(declaration: &Declaration) -> Result<Self> {
        let whole = declaration.whole()?;
        let names = Names::new(&whole)?;
        let derived = names.derived(&whole.derived)?;
        let order = order_of_evaluation(&derived, whole.parameters.len())?;
        let (numbers, mut cells) = names.matrices(&whole)?;
        let time = time(declaration, &whole)?;
        let mut structure = DeclaredStructure {
            time,
            parameters: Vec::new(),
            free: Vec::new(),
            derived,
            order,
            numbers,
            cells: Vec::new(),
        };
        structure.spread_dependence(whole.parameters.len(), &mut cells);
        structure.cells = cells;
        structure.check_use(declaration, &whole)?;
        structure.parameters =
            whole.parameters.iter().map(|(name, declared)| parameter(name, declared)).collect::<Result<_>>()?;
        structure.free = (0..structure.parameters.len()).filter(|k| !structure.parameters[*k].fixed).collect();
        structure.check_at_start()?;
        Ok(structure)
    }

    /// Which parameters move each derived quantity and each entry, through all derived quantities.
    fn spread_dependence(&mut self, parameters: usize, cells: &mut [Cell]) {
        for k in self.order.clone() {
            self.derived[k].formula.moved_by = dependence(&self.derived, &self.derived[k].formula, parameters);
        }
        for cell in cells {
            cell.formula.moved_by = dependence(&self.derived, &cell.formula, parameters);
        }
    }

    /// Every parameter occurs in an entry; fixed parameters of a template are exempt.
    fn check_use(&self, given: &Declaration, whole: &Declaration) -> Result<()> {
        let used = |k: usize| self.cells.iter().any(|cell| cell.formula.moved_by[k]);
        let mut of_template = Vec::new();
        if let Some(template) = given.template {
            of_template.extend(template.declaration()?.parameters.into_keys());
        }
        let excused = |name: &String, fixed: Option<bool>| fixed == Some(true) && of_template.contains(name);
        for (k, (name, declared)) in whole.parameters.iter().enumerate() {
            if !used(k) && !excused(name, declared.fixed) {
                let others: Vec<&str> = whole
                    .parameters
                    .keys()
                    .enumerate()
                    .filter(|(j, _)| used(*j))
                    .map(|(_, name)| name.as_str())
                    .collect();
                return Err(Error::UnusedParameter {
                    name: name.clone(),
                    nearest: nearest_name(name, others).map(str::to_owned),
                });
            }
        }
        Ok(())
    }

    /// Entries, their derivatives and the derived quantities at the initial values.
    fn check_at_start(&self) -> Result<()> {
        let start = self.start();
        self.evaluated(&start)?;
        let values = self.quantities(&start, None);
        for (quantity, value) in self.derived.iter().zip(&values[self.parameters.len()..]) {
            finite(|| quantity.place(), &quantity.formula.text, value.value, None)?;
        }
        for (parameter, number) in self.free.iter().enumerate() {
            let values = self.quantities(&start, Some(parameter));
            for cell in self.cells.iter().filter(|cell| cell.formula.moved_by[*number]) {
                let slope = cell.formula.expression.evaluate(&values).slope;
                finite(|| cell.place(), &cell.formula.text, slope, Some(&self.parameters[*number].name))?;
            }
        }
        Ok(())
    }
}

/// The sample time of a structure of discrete time. The matrices of templates are of continuous time.
fn time(declaration: &Declaration, whole: &Declaration) -> Result<Option<Discrete>> {
    let Some(ts) = whole.sample_time else { return Ok(None) };
    if declaration.template.is_some() && (declaration.a.is_none() || declaration.b.is_none()) {
        let what = "the sample time of the structure".into();
        let must = "absent: the template is a structure of continuous time";
        return Err(Error::Method(youla::Error::OutOfRange { what, value: ts, must }));
    }
    Discrete::new(ts).map(Some).map_err(Error::from)
}

fn parameter(name: &str, declared: &ParameterDeclaration) -> Result<Parameter> {
    let Some(initial) = declared.initial else { return Err(Error::NoInitialValue { name: name.to_owned() }) };
    let (min, max) = (declared.min.unwrap_or(f64::NEG_INFINITY), declared.max.unwrap_or(f64::INFINITY));
    let default = if initial == 0.0 { 1.0 } else { initial.abs() };
    let scale = declared.scale.unwrap_or(default);
    if !initial.is_finite() {
        let what = format!("the initial value of the parameter {name:?}");
        return Err(Error::Method(youla::Error::OutOfRange { what, value: initial, must: "a finite number" }));
    }
    if !(scale > 0.0 && scale.is_finite()) {
        let what = format!("the scale of the parameter {name:?}");
        return Err(Error::Method(youla::Error::OutOfRange { what, value: scale, must: "a positive number" }));
    }
    if min.partial_cmp(&max) != Some(Ordering::Less) {
        return Err(Error::EmptyBounds { name: name.to_owned(), min, max });
    }
    if !(min..=max).contains(&initial) {
        return Err(Error::OutsideBounds { name: name.to_owned(), value: initial, min, max });
    }
    let unit = declared.unit.clone().unwrap_or_default();
    Ok(Parameter { name: name.to_owned(), unit, initial, min, max, scale, fixed: declared.fixed.unwrap_or(false) })
}

/// The parameters that a formula depends on, given those of the derived quantities before it.
fn dependence(derived: &[Quantity], formula: &Formula, parameters: usize) -> Vec<bool> {
    let mut moved = vec![false; parameters];
    for number in formula.expression.names() {
        match number.checked_sub(parameters) {
            None => moved[number] = true,
            Some(k) => moved.iter_mut().zip(&derived[k].formula.moved_by).for_each(|(moved, by)| *moved |= by),
        }
    }
    moved
}

/// Derived quantities in an order in which each comes after those that it uses.
fn order_of_evaluation(derived: &[Quantity], parameters: usize) -> Result<Vec<usize>> {
    let mut order: Vec<usize> = Vec::new();
    let mut waiting: Vec<usize> = (0..derived.len()).collect();
    while !waiting.is_empty() {
        let known = |number: usize| number < parameters || order.contains(&(number - parameters));
        let (ready, later): (Vec<usize>, Vec<usize>) =
            waiting.iter().partition(|k| derived[**k].formula.expression.names().all(known));
        if ready.is_empty() {
            let names = later.iter().map(|k| derived[*k].name.clone()).collect();
            return Err(Error::CircularDefinition { names });
        }
        order.extend(ready);
        waiting = later;
    }
    Ok(order)
}
