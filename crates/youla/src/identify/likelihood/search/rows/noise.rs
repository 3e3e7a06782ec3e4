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
    pub(super) fn innovations(
        &mut self,
        place: &Place<'_>,
        entering: &Entering,
        (z, ends, u): (&Lanes, &Lanes, &[Lanes]),
    ) {
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
        if let Some(joint) = &self.joint {
            for (j, end) in place.ends.iter().enumerate() {
                let by = |o| joint.driven((o, j), ends);
                self.innovations.iter_mut().enumerate().for_each(|(o, v)| v.add_scaled(&by(o), -end));
            }
            joint.apply(&mut self.innovations, 1, &mut self.unfiltered);
        }
        self.entered.fill(Lanes::ZERO);
        if let Some(pole) = entering.colour() {
            let colour = z.shifted(-pole).inverse();
            for (o, innovation) in self.innovations.iter().enumerate() {
                let coloured = colour.times(innovation);
                let entered = self.entered.iter_mut().enumerate();
                entered.for_each(|(j, w)| w.add_scaled(&coloured, entering.of_colour(j, o)));
            }
            let free = colour.times(ends);
            self.entered.iter_mut().zip(place.ends).for_each(|(w, end)| w.add_scaled(&free, *end));
        }
    }

    /// Takes what the ends of the colours drive out of the residual.
    #[inline(always)]
    pub(super) fn without_ends(&mut self, place: &Place<'_>, ends: &Lanes) {
        let Some(joint) = &self.joint else { return };
        for (j, end) in place.ends.iter().enumerate() {
            for (o, values) in self.values.chunks_mut(self.columns).enumerate() {
                values[self.columns - 1].add_scaled(&joint.driven((o, j), ends), -end);
            }
        }
    }

    /// X of one block as the Kalman filter of the outputs has it, `M (B (U + w) + z t + K epsilon)`; its L is kept for `gains`.
    #[inline(always)]
    pub(super) fn filtered(&mut self, block: &Block, first: usize, entering: &Entering) {
        let (s, m) = (block.states, block.b.len() / block.states);
        let states = self.states_of_filter();
        for o in 0..self.filters.len() {
            self.all_left[o * states + first..][..s].copy_from_slice(&self.left[o * s..][..s]);
        }
        self.filtered[..s].copy_from_slice(&self.x[..s]);
        for j in 0..s {
            let mut drive = Lanes::ZERO;
            let innovations = self.innovations.iter().enumerate();
            innovations.for_each(|(o, innovation)| drive.add_scaled(innovation, entering.gain(first + j, o)));
            (0..m).for_each(|l| drive.add_scaled(&self.entered[l], block.b[j * m + l]));
            (0..s).for_each(|i| self.filtered[i].add_product(&self.inverse[i * s + j], &drive));
        }
    }

    /// States of the plant and of the colours.
    fn states_of_filter(&self) -> usize {
        self.all_left.len() / self.filters.len()
    }

    /// `L dK epsilon` of the parameters, whose columns begin at `first`.
    #[inline(always)]
    pub(super) fn gains(&mut self, place: &Place<'_>, entering: &Entering, (z, first): (&Lanes, usize)) {
        let (p, states, columns) = (self.filters.len(), self.states_of_filter(), self.columns);
        if let Some(pole) = entering.colour() {
            self.see_colours(place.model, &z.shifted(-pole).inverse(), entering);
        }
        let parameters = place.chart.parameters();
        if p == 1 {
            // L epsilon is the same for all parameters.
            for state in 0..states {
                let along = self.all_left[state].times(&self.innovations[0]);
                let values = self.values[first..first + parameters].iter_mut().enumerate();
                values.for_each(|(q, v)| v.add_scaled(&along, entering.slope((state, 0), q)));
            }
            return;
        }
        for q in 0..parameters {
            for state in 0..states {
                // dK epsilon is the same for all outputs.
                let mut change = Lanes::ZERO;
                let innovations = self.innovations.iter().enumerate();
                innovations.for_each(|(l, epsilon)| change.add_scaled(epsilon, entering.slope((state, l), q)));
                for o in 0..p {
                    self.values[o * columns + first + q].add_product(&self.all_left[o * states + state], &change);
                }
            }
        }
    }

    /// L of the colours, given `1 / (z - c)`.
    #[inline(always)]
    fn see_colours(&mut self, model: &Model, colour: &Lanes, entering: &Entering) {
        let (n, m) = (model.order(), model.inputs);
        for all in self.all_left.chunks_mut(n + m) {
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
    }

    /// The columns of the coefficients of the noise: of a_k `H z^-k epsilon / A(z)`, of b `H z^-1 epsilon / (1 - b / z)`, of a variance
    /// `L dK epsilon`, of the pole of the colour `L_w w` beside it.
    #[inline(always)]
    pub(super) fn coefficients(&mut self, place: &Place<'_>, back: &Lanes, first: usize) {
        let (p, columns) = (self.filters.len(), self.columns);
        let count = place.noise.parameters();
        for o in 0..p {
            self.values[o * columns + first..][..count].fill(Lanes::ZERO);
        }
        let mut own: Vec<Lanes> = (0..p).map(|o| self.values[o * columns + columns - 1]).collect();
        if let Some(joint) = &self.joint {
            joint.apply(&mut own, 1, &mut self.unfiltered);
        }
        let mut column = first;
        for (o, (regression, own)) in place.noise.regression.iter().zip(&own).enumerate() {
            let zero = back.scaled(-regression.zero).shifted(1.0);
            let mut lagged = *own;
            lagged.multiply(&regression.behind(back).times(&zero).inverse());
            for _ in &regression.coefficients {
                lagged.multiply(back);
                self.put_coefficient((o, column), &lagged);
                column += 1;
            }
            if regression.zero != 0.0 {
                self.put_coefficient((o, column), &own.times(back).times(&zero.inverse()));
                column += 1;
            }
        }
        if let Some(entering) = place.entering {
            self.variances(place, entering, column);
        }
    }

    /// A column by what moves the innovation of one output.
    #[inline(always)]
    fn put_coefficient(&mut self, (output, column): (usize, usize), value: &Lanes) {
        let (p, columns) = (self.filters.len(), self.columns);
        match &self.joint {
            None => self.values[output * columns + column] = *value,
            Some(joint) => {
                (0..p).for_each(|l| self.values[l * columns + column] = joint.h[l * p + output].times(value))
            }
        }
    }

    /// The columns of the variances and of the pole of the colour, from `column` on.
    #[inline(always)]
    fn variances(&mut self, place: &Place<'_>, entering: &Entering, column: usize) {
        let (m, n, columns) = (place.model.inputs, place.model.order(), self.columns);
        for which in 0..entering.parameters() {
            for (o, left) in self.all_left.chunks(n + m).enumerate() {
                let mut sum = Lanes::ZERO;
                for (state, left) in left.iter().enumerate() {
                    for (l, innovation) in self.innovations.iter().enumerate() {
                        sum.add_scaled(&left.times(innovation), entering.by_entry((state, l), which));
                    }
                }
                if entering.colour().is_some() && which + 1 == entering.parameters() {
                    (0..m).for_each(|j| sum.add_product(&left[n + j], &self.entered[j]));
                }
                self.values[o * columns + column + which] = sum;
            }
        }
    }
}
