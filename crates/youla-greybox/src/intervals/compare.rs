//! Which of several structures the data prefer.
//!
//! For white Gaussian noise of unknown variance, with N residuals and the criterion V at its minimum,
//! ```text
//! LR = N ln(V_smaller / V_larger) ~ chi^2(difference of the unknowns)        nested structures, the smaller one being true
//! AIC = N ln(2 V / N) + 2 k,   BIC = N ln(2 V / N) + k ln N                  any structures of k unknowns
//! ```
//! (S. S. Wilks, Ann. Math. Statist. 9 (1938), 60; H. Akaike, IEEE Trans. Autom. Control 19 (1974), 716; G. Schwarz, Ann.
//! Statist. 6 (1978), 461). Nested: the smaller structure is the larger one with some parameters fixed. Where that puts them
//! at a bound, the probability is an upper bound. Coloured residuals make differences of V look more certain than they are.

use crate::GreyBoxModel;
use crate::{Error, Result};
use serde::Serialize;
use youla::statistics::chi_square_tail;

/// Outcome of the likelihood-ratio test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LikelihoodRatio {
    /// `N ln(V_smaller / V_larger)`; negative where the search of the larger structure ended in a local minimum.
    pub statistic: f64,
    /// Unknowns by which the structures differ.
    pub degrees_of_freedom: usize,
    /// Probability of a larger statistic where the smaller structure is true: small where the data ask for the larger one.
    pub p_value: f64,
}

/// One of several structures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedStructure {
    /// Name.
    pub name: String,
    /// Parameters and estimated initial states.
    pub unknowns: usize,
    /// The criterion V.
    pub cost: f64,
    /// Akaike's criterion, less the smallest of all.
    pub aic: f64,
    /// Schwarz's criterion, less the smallest of all.
    pub bic: f64,
}

/// Tests a structure against a larger one that holds it.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for estimates from other numbers of residuals, or a larger structure without more unknowns.
///
/// ```
/// use youla_greybox::{DeclaredStructure, GreyBoxOptions, Problem, Structure, Template, greybox, likelihood_ratio};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::Mat;
/// let mut declared = Template::MassSpringDamper.declaration()?;
/// let larger = DeclaredStructure::new(&declared)?;
/// declared.parameters.get_mut("damping").unwrap().fixed = Some(true);
/// let smaller = DeclaredStructure::new(&declared)?;
/// let (theta, time) = (larger.start(), Discrete::new(5e-3)?);
/// let u = Mat::from_fn(600, 1, |k, _| if (k * k / 90) % 2 == 0 { 1.0 } else { -1.0 });
/// let clean = simulate(&larger.model(&theta)?.zoh(time)?, u.as_ref(), &[0.0; 2])?;
/// let noise = |k: usize| 1e-4 * (((k * 7919 + 13) * (k + 5)) % 1009) as f64 / 1009.0;
/// let y = Mat::from_fn(600, 1, |k, _| clean[(k, 0)] + noise(k));
/// let (records, options) = ([Experiment::new(u.as_ref(), y.as_ref())], GreyBoxOptions::default());
/// let estimate = |s: &DeclaredStructure| greybox(&Problem::new(s, &records, time), &s.start(), &options);
/// let test = likelihood_ratio(&estimate(&smaller)?, &estimate(&larger)?)?;
/// assert!(test.degrees_of_freedom == 1 && test.p_value > 1e-4);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn likelihood_ratio(smaller: &GreyBoxModel, larger: &GreyBoxModel) -> Result<LikelihoodRatio> {
    same_residuals(smaller, larger)?;
    let (must, what) =
        ("more than that of the smaller one", "the number of unknowns of the larger structure".to_owned());
    let Some(degrees_of_freedom @ 1..) = larger.unknowns.checked_sub(smaller.unknowns) else {
        return Err(Error::Method(youla::Error::OutOfRange { what, value: larger.unknowns as f64, must }));
    };
    let statistic = smaller.residuals as f64 * (smaller.cost / larger.cost).ln();
    Ok(LikelihoodRatio { statistic, degrees_of_freedom, p_value: chi_square_tail(statistic, degrees_of_freedom) })
}

/// Ranks structures, nested or not, by AIC and BIC; in the order given.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for estimates from different numbers of residuals.
pub fn compare(structures: &[(&str, &GreyBoxModel)]) -> Result<Vec<ComparedStructure>> {
    if let Some((_, first)) = structures.first() {
        structures.iter().try_for_each(|(_, other)| same_residuals(first, other))?;
    }
    let entry = |(name, model): &(&str, &GreyBoxModel)| {
        let (n, k) = (model.residuals as f64, model.unknowns as f64);
        let fit = n * (2.0 * model.cost / n).ln();
        ComparedStructure {
            name: (*name).to_owned(),
            unknowns: model.unknowns,
            cost: model.cost,
            aic: fit + 2.0 * k,
            bic: fit + k * n.ln(),
        }
    };
    let mut all: Vec<ComparedStructure> = structures.iter().map(entry).collect();
    let least = |value: fn(&ComparedStructure) -> f64| all.iter().map(value).fold(f64::INFINITY, f64::min);
    let (aic, bic) = (least(|s| s.aic), least(|s| s.bic));
    for structure in &mut all {
        structure.aic -= aic;
        structure.bic -= bic;
    }
    Ok(all)
}

fn same_residuals(one: &GreyBoxModel, other: &GreyBoxModel) -> Result<()> {
    if one.residuals == other.residuals {
        return Ok(());
    }
    let what = format!("the number of residuals of a structure compared with one of {}", one.residuals);
    Err(Error::Method(youla::Error::OutOfRange {
        what,
        value: other.residuals as f64,
        must: "the same: take the same records and delays",
    }))
}
