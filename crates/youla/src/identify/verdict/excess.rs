//! Mean squares of local errors over neighbouring bands, beyond what chance explains.

use super::limits::{BAND_RATIO, LEAST_BANDS};
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use std::ops::Range;

/// Unit of a band over that at the frequency in question, below which the band says nothing: half an octave of a double integrator.
const LEAST_UNIT: f64 = 0.5;

/// Mean squares over bands, beyond what chance explains.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Excess {
    pub(super) bands: Vec<ExcessBand>,
    /// Standard deviations by which a mean must exceed chance.
    pub(super) least: f64,
}

/// The excess of one band, entry by entry.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ExcessBand {
    /// Middle of the band as a share of the sample rate.
    pub(super) share: f64,
    /// Mean square of each entry less its mean by chance.
    pub(super) squares: Vec<f64>,
    /// Mean square of each entry by chance.
    pub(super) chance: Vec<f64>,
    /// Complex degrees of freedom of a mean square: its variance by chance is the square of its mean over them.
    pub(super) freedom: f64,
    /// Of the first band, over which the response of an integrator falls by decades: frequencies, shares of the sample rate, with their
    /// portions of the power of the inputs. E is a mean over the lines with these weights. Empty of the others.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) power: Vec<(f64, f64)>,
}

impl ExcessBand {
    /// Square of the unit of each entry, its mean over the power of the inputs; `squares` gives that at a frequency.
    pub(super) fn units(&self, squares: &dyn Fn(f64) -> Vec<f64>) -> Vec<f64> {
        if self.power.is_empty() {
            return squares(self.share);
        }
        let mut units = vec![0.0; self.squares.len()];
        for (share, portion) in &self.power {
            units.iter_mut().zip(squares(*share)).for_each(|(unit, square)| *unit += portion * square.sqrt());
        }
        units.iter().map(|unit| unit * unit).collect()
    }
}

impl Excess {
    /// Whether any band speaks.
    pub(crate) fn is_empty(&self) -> bool {
        self.bands.is_empty()
    }

    /// Whether every band states so many entries.
    #[cfg(feature = "serde")]
    pub(crate) fn is_of(&self, entries: usize) -> bool {
        let fits = |b: &ExcessBand| b.freedom >= 1.0 && [b.squares.len(), b.chance.len()] == [entries; 2];
        self.bands.iter().all(fits)
    }

    /// Mean square of each of `entries` near a frequency beyond chance, by how many standard deviations of a normal variable the largest
    /// exceeds it.
    pub(crate) fn near(&self, share: f64, entries: usize) -> (Vec<f64>, f64) {
        self.near_in_units(share, &|_| vec![1.0; entries])
    }

    /// The same where the errors are alike in other units from band to band: `squares` gives the square of the unit of each entry. Of few wide
    /// bands around a low frequency a response falls by decades, and its errors with it. Bands in which the unit is less than half are left
    /// out.
    pub(crate) fn near_in_units(&self, share: f64, squares: &dyn Fn(f64) -> Vec<f64>) -> (Vec<f64>, f64) {
        let mut largest = 0.0_f64;
        let of = |(square, Mean { excess, deviations, .. }): (f64, Mean)| {
            largest = largest.max(deviations);
            square * if deviations > self.least { excess.max(0.0) } else { 0.0 }
        };
        (self.means_at(share, squares).map(of).collect(), largest)
    }

    /// Mean square of each entry near a frequency with what chance explains of it, in units of which `squares` gives the squares: what the error
    /// may be where the bands are all that is known of it.
    pub(crate) fn with_chance(&self, share: f64, squares: &dyn Fn(f64) -> Vec<f64>) -> Vec<f64> {
        let of = |(square, mean): (f64, Mean)| square * (mean.excess.max(0.0) + mean.chance);
        self.means_at(share, squares).map(of).collect()
    }

    /// Whether the bands show an error of each entry of more than its unit at any frequency, by so many deviations.
    pub(crate) fn exceeds(&self, squares: &dyn Fn(f64) -> Vec<f64>, deviations: f64) -> Vec<bool> {
        let mut out = vec![false; self.bands.first().map_or(0, |band| band.squares.len())];
        let units: Vec<Vec<f64>> = self.bands.iter().map(|band| band.units(squares)).collect();
        for band in &self.bands {
            let means = self.means(band.share, squares(band.share), |near| units[near].as_slice());
            out.iter_mut()
                .zip(means)
                .for_each(|(o, (_, mean))| *o |= mean.excess > 1.0 && mean.deviations > deviations);
        }
        out
    }

    /// The square of the unit of each entry at a frequency with the means of its bands in that unit.
    fn means_at(&self, share: f64, squares: &dyn Fn(f64) -> Vec<f64>) -> impl Iterator<Item = (f64, Mean)> {
        self.means(share, squares(share), |band| self.bands[band].units(squares))
    }

    /// The same, given the squares of the units at the frequency and those of a band.
    fn means<U: AsRef<[f64]>>(
        &self,
        share: f64,
        squares: Vec<f64>,
        units: impl Fn(usize) -> U,
    ) -> impl Iterator<Item = (f64, Mean)> {
        let near: Vec<(&ExcessBand, U)> = self.window(share).map(|k| (&self.bands[k], units(k))).collect();
        squares.into_iter().enumerate().map(move |(i, square)| {
            let of_entry = near.iter().map(|(band, units)| (*band, i, units.as_ref()[i]));
            let alike = of_entry.filter(|(.., unit)| *unit >= LEAST_UNIT * LEAST_UNIT * square);
            (square, beyond_chance(alike.map(|(band, i, unit)| (band, i, unit.max(TINY)))))
        })
    }

    /// The bands around a frequency; none where the nearest is farther away than the window is wide.
    fn window(&self, share: f64) -> Range<usize> {
        let (from, to) = (share / BAND_RATIO, share * BAND_RATIO);
        let mut first = self.bands.partition_point(|b| b.share < from);
        let mut end = self.bands.partition_point(|b| b.share <= to);
        while end - first < LEAST_BANDS.min(self.bands.len()) {
            first = first.saturating_sub(1);
            end = (end + 1).min(self.bands.len());
        }
        first..end
    }
}

/// A mean square over some bands.
struct Mean {
    /// Less its mean by chance.
    excess: f64,
    /// Its mean by chance.
    chance: f64,
    /// Standard deviations of a normal variable by which the mean square exceeds chance.
    deviations: f64,
}

/// Mean square of an entry over some bands with the squares of their units.
///
/// The bands count with the inverse variances `w = freedom / chance^2` of their mean squares. By chance the sum of these is nearly
/// chi-square with `2 (sum w chance)^2 / sum w` degrees of freedom (F. E. Satterthwaite, Biometrics Bull. 2 (1946), 110).
fn beyond_chance<'a>(bands: impl Iterator<Item = (&'a ExcessBand, usize, f64)>) -> Mean {
    let (mut excess, mut chance, mut weights) = (0.0, 0.0, 0.0);
    for (band, entry, unit) in bands {
        let by_chance = band.chance[entry] / unit;
        let weight = band.freedom / (by_chance * by_chance).max(TINY);
        excess += weight * band.squares[entry] / unit;
        chance += weight * by_chance.max(TINY);
        weights += weight;
    }
    if weights == 0.0 {
        return Mean { excess: 0.0, chance: 0.0, deviations: 0.0 };
    }
    let degrees = 2.0 * chance * chance / weights;
    let deviations = chi_square_deviations(degrees * (1.0 + excess / chance), degrees);
    Mean { excess: excess / weights, chance: chance / weights, deviations }
}
