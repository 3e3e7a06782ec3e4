//! Columns of noise at the inputs, whose filter moves with the parameters of the plant, and of the coefficients of the noise.

use super::{Place, Rows};
use crate::identify::likelihood::data::lanes::Lanes;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::driven::entering::Entering;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::state_lanes::states;

impl Rows {
    /// `epsilon` of each output: what all blocks, the drift and D leave of it, behind `1 / H`.
    #[inline(always)]
    pub(super) fn innovations(&mut self, place: &Place<'_>, (z, ends, u): (&Lanes, &Lanes, &[Lanes])) {
        let Place { model, t, .. } = *place;
        let (m, p, columns) = (model.inputs, model.outputs, self.columns);
        let drift = ends.times(&z.shifted(-1.0).inverse());
        let states_of_model = model.order();
        for o in 0..p {
            self.innovations[o] = self.values[o * columns + columns - 1];
            self.innovations[o].add_scaled(&drift, -t[states_of_model + o]);
            (0..m).for_each(|j| self.innovations[o].add_scaled(&u[j], -model.d[o * m + j]));
        }
        let mut first = 0;
        for block in &model.blocks {
            let s = block.states;
            states(block, (z, ends, u), &t[first..first + s], (&mut self.inverse, &mut self.x));
            for o in 0..p {
                (0..s).for_each(|i| self.innovations[o].add_scaled(&self.x[i], -block.c[o * s + i]));
            }
            first += s;
        }
        let back = z.conj();
        for (o, entering) in place.entering.iter().enumerate() {
            let Some(entering) = entering else { continue };
            let innovation = entering.innovation(&self.innovations[o], &back);
            self.innovations[o] = innovation;
            self.entered[o * m..(o + 1) * m].fill(Lanes::ZERO);
            if let Some(pole) = entering.colour() {
                let coloured = z.shifted(-pole).inverse().times(&innovation);
                (0..m).for_each(|j| self.entered[o * m + j] = coloured.scaled(entering.of_colour(j)));
            }
        }
    }

    /// X of one block as the Kalman filter of an output that sees it has it, `M (B (U + w) + z t + K epsilon)`; its L is kept for `gains`.
    #[inline(always)]
    pub(super) fn filtered(&mut self, block: &Block, first: usize, (output, entering): (usize, &Entering)) {
        let (s, m) = (block.states, block.b.len() / block.states);
        let states = self.states_of_filter();
        self.all_left[output * states + first..][..s].copy_from_slice(&self.left[output * s..][..s]);
        self.filtered[..s].copy_from_slice(&self.x[..s]);
        for j in 0..s {
            let mut drive = self.innovations[output].scaled(entering.gain(first + j));
            (0..m).for_each(|l| drive.add_scaled(&self.entered[output * m + l], block.b[j * m + l]));
            (0..s).for_each(|i| self.filtered[i].add_product(&self.inverse[i * s + j], &drive));
        }
    }

    /// States of the plant and of the colours.
    fn states_of_filter(&self) -> usize {
        self.all_left.len() / self.filters.len()
    }

    /// `L dK epsilon` of the parameters, whose columns begin at `first`.
    #[inline(always)]
    pub(super) fn gains(&mut self, place: &Place<'_>, z: &Lanes, first: usize) {
        let states = self.states_of_filter();
        for (o, entering) in place.entering.iter().enumerate() {
            let Some(entering) = entering else { continue };
            if let Some(pole) = entering.colour() {
                self.see_colours(place.model, &z.shifted(-pole).inverse(), (o, entering));
            }
            for state in 0..states {
                let along = self.all_left[o * states + state].times(&self.innovations[o]);
                for q in 0..place.chart.parameters() {
                    self.values[o * self.columns + first + q].add_scaled(&along, entering.slope(state, q));
                }
            }
        }
    }

    /// L of the colours, given `1 / (z - c)`.
    #[inline(always)]
    fn see_colours(&mut self, model: &Model, colour: &Lanes, (output, entering): (usize, &Entering)) {
        let (n, m) = (model.order(), model.inputs);
        let all = &mut self.all_left[output * (n + m)..(output + 1) * (n + m)];
        let (left, of_colours) = all.split_at_mut(n);
        of_colours.fill(Lanes::ZERO);
        let rows = model.blocks.iter().flat_map(|block| block.b.chunks(m));
        for (state, (left, b)) in left.iter().zip(rows).enumerate() {
            if entering.sees(state) {
                of_colours.iter_mut().zip(b).for_each(|(sum, b)| sum.add_scaled(left, *b));
            }
        }
        of_colours.iter_mut().for_each(|sum| *sum = sum.times(colour));
    }

    /// The columns of the coefficients of the noise: of a_k `z^-k v / A(z)`, of b `z^-1 v / (1 - b / z)`, of lambda `L dK epsilon`, of the pole
    /// of the colour `L_w w` beside it.
    #[inline(always)]
    pub(super) fn coefficients(&mut self, place: &Place<'_>, back: &Lanes, first: usize) {
        let (p, m, n) = (self.filters.len(), place.model.inputs, place.model.order());
        let columns = self.columns;
        let mut column = first;
        for (o, regression) in place.noise.regression.iter().enumerate() {
            let residual = self.values[o * columns + columns - 1];
            for l in 0..p {
                (0..regression.parameters()).for_each(|c| self.values[l * columns + column + c] = Lanes::ZERO);
            }
            let zero = back.scaled(-regression.zero).shifted(1.0);
            let mut lagged = residual;
            lagged.multiply(&regression.behind(back).times(&zero).inverse());
            for _ in &regression.coefficients {
                lagged.multiply(back);
                self.values[o * columns + column] = lagged;
                column += 1;
            }
            if regression.zero != 0.0 {
                self.values[o * columns + column] = residual.times(back).times(&zero.inverse());
                column += 1;
            }
            let Some(driven) = &regression.driven else { continue };
            if let Some(Some(entering)) = place.entering.get(o) {
                let left = &self.all_left[o * (n + m)..(o + 1) * (n + m)];
                let innovation = self.innovations[o];
                for which in 0..driven.parameters() {
                    let mut sum = Lanes::ZERO;
                    for (state, left) in left.iter().enumerate() {
                        sum.add_scaled(&left.times(&innovation), entering.by_entry(state, which));
                    }
                    if which == 1 {
                        (0..m).for_each(|j| sum.add_product(&left[n + j], &self.entered[o * m + j]));
                    }
                    self.values[o * columns + column + which] = sum;
                }
            }
            column += driven.parameters();
        }
    }
}
