//! Sources of excitation, one value for each plant input and sample.

use crate::Real;

/// One line of a multisine: a phasor that turns by a fixed angle each sample, and what each input takes of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone<T, const M: usize> {
    /// Cosine of the angle per sample, `cos(2 pi f ts)`.
    pub cosine: T,
    /// Sine of the angle per sample.
    pub sine: T,
    /// Input i gets `gains[i][0] cos(w k) + gains[i][1] sin(w k)`.
    pub gains: [[T; 2]; M],
}

/// A sum of L lines by recursion. It starts again after each period, so that all periods have the same bits and rounding does not add up.
#[derive(Debug, Clone, PartialEq)]
pub struct MultisineSource<T, const M: usize, const L: usize> {
    tones: [Tone<T, M>; L],
    phasors: [[T; 2]; L],
    period: u32,
    place: u32,
}

impl<T: Real, const M: usize, const L: usize> MultisineSource<T, M, L> {
    /// With a period of so many samples, at least 1; each tone must have whole cycles in it.
    #[must_use]
    pub fn new(tones: [Tone<T, M>; L], period: u32) -> Self {
        MultisineSource { tones, phasors: [[T::ONE, T::ZERO]; L], period: period.max(1), place: 0 }
    }

    fn next(&mut self) -> [T; M] {
        let mut sum = [T::ZERO; M];
        for (tone, [c, s]) in self.tones.iter().zip(&mut self.phasors) {
            for (sum, [of_c, of_s]) in sum.iter_mut().zip(&tone.gains) {
                *sum = *sum + *of_c * *c + *of_s * *s;
            }
            (*c, *s) = (tone.cosine * *c - tone.sine * *s, tone.sine * *c + tone.cosine * *s);
        }
        self.place += 1;
        if self.place >= self.period {
            self.place = 0;
            self.phasors = [[T::ONE, T::ZERO]; L];
        }
        sum
    }
}

/// A pseudo-random binary sequence of maximal length for each input, from a shift register.
#[derive(Debug, Clone, PartialEq)]
pub struct PrbsSource<T, const M: usize> {
    registers: [u32; M],
    mask: u32,
    hold: u16,
    left: u16,
    amplitudes: [T; M],
}

/// Orders of the shift register with the second exponent of a primitive trinomial.
const TRINOMIALS: [(u32, u32); 13] = [
    (3, 2),
    (4, 3),
    (5, 3),
    (6, 5),
    (7, 6),
    (9, 5),
    (10, 7),
    (11, 9),
    (15, 14),
    (17, 14),
    (18, 11),
    (20, 17),
    (23, 18),
];

impl<T: Real, const M: usize> PrbsSource<T, M> {
    /// A register of `order` bits has a period of `2^order - 1` values of `hold` samples each. Inputs with different
    /// `starts`, which lie between 1 and the period, get the same sequence at different places. None for an order without a primitive trinomial (3
    /// to 7, 9, 10, 11, 15, 17, 18, 20 and 23 have one) and for a start out of range.
    #[must_use]
    pub fn new(order: u32, hold: u16, starts: [u32; M], amplitudes: [T; M]) -> Option<Self> {
        let (_, second) = TRINOMIALS.into_iter().find(|(known, _)| *known == order)?;
        let mask = 1 << (order - 1) | 1 << (second - 1);
        let in_range = starts.iter().all(|start| (1..1 << order).contains(start));
        in_range.then(|| PrbsSource { registers: starts, mask, hold: hold.max(1), left: hold.max(1), amplitudes })
    }

    fn next(&mut self) -> [T; M] {
        let mut values = self.amplitudes;
        for (value, register) in values.iter_mut().zip(&self.registers) {
            if register & 1 == 0 {
                *value = -*value;
            }
        }
        self.left -= 1;
        if self.left == 0 {
            self.left = self.hold;
            for register in &mut self.registers {
                *register = *register >> 1 ^ if *register & 1 == 1 { self.mask } else { 0 };
            }
        }
        values
    }
}

/// The rows of a table, one for each sample, again and again.
#[derive(Debug, Clone, PartialEq)]
pub struct TableSource<'a, T, const M: usize> {
    rows: &'a [[T; M]],
    place: usize,
}

impl<'a, T: Real, const M: usize> TableSource<'a, T, M> {
    /// From its first row on; without rows it is 0.
    #[must_use]
    pub fn new(rows: &'a [[T; M]]) -> Self {
        TableSource { rows, place: 0 }
    }

    fn next(&mut self) -> [T; M] {
        let row = self.rows.get(self.place).copied().unwrap_or([T::ZERO; M]);
        self.place = if self.place + 1 < self.rows.len() { self.place + 1 } else { 0 };
        row
    }
}

/// A source of excitation. L is the largest number of lines of a multisine.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum ExcitationSource<'a, T, const M: usize, const L: usize> {
    /// Zero.
    #[default]
    Silent,
    /// Lines of given frequencies.
    Multisine(MultisineSource<T, M, L>),
    /// Two levels.
    Prbs(PrbsSource<T, M>),
    /// Any sequence.
    Table(TableSource<'a, T, M>),
}

impl<T: Real, const M: usize, const L: usize> ExcitationSource<'_, T, M, L> {
    /// The value of this sample; the source moves on.
    #[inline]
    pub fn advance(&mut self) -> [T; M] {
        match self {
            ExcitationSource::Silent => [T::ZERO; M],
            ExcitationSource::Multisine(multisine) => multisine.next(),
            ExcitationSource::Prbs(prbs) => prbs.next(),
            ExcitationSource::Table(table) => table.next(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multisine_in_single_precision_keeps_lines_and_periods() {
        const PERIOD: u32 = 5000;
        let angle = |cycles: f64| cycles * core::f64::consts::TAU / f64::from(PERIOD);
        // Cosine and sine of small angles by their series: no mathematics in `core`.
        let series = |x: f64| {
            let (mut cosine, mut sine, mut term) = (0.0, 0.0, 1.0);
            for n in 0..20 {
                match n % 4 {
                    0 => cosine += term,
                    1 => sine += term,
                    2 => cosine -= term,
                    _ => sine -= term,
                }
                term *= x / f64::from(n + 1);
            }
            (cosine, sine)
        };
        let tones = [7.0, 811.0].map(|cycles| {
            let (cosine, sine) = series(angle(cycles));
            Tone { cosine: cosine as f32, sine: sine as f32, gains: [[1.0, 0.0], [0.0, 2.0]] }
        });
        let mut source: ExcitationSource<'_, f32, 2, 2> =
            ExcitationSource::Multisine(MultisineSource::new(tones, PERIOD));
        let first: [[f32; 2]; PERIOD as usize] = core::array::from_fn(|_| source.advance());
        for _ in 0..3 {
            for row in &first {
                assert_eq!(source.advance(), *row);
            }
        }
        // The end of the period, where rounding has added up: 5e-4 of the amplitude.
        let mut worst = 0.0_f64;
        for (k, row) in (0..PERIOD).zip(&first).skip(4000) {
            let exact: f64 = [7.0, 811.0]
                .map(|cycles| series((angle(cycles) * f64::from(k)) % core::f64::consts::TAU - core::f64::consts::PI).0)
                .iter()
                .map(|c| -c)
                .sum();
            worst = worst.max((f64::from(row[0]) - exact).abs());
        }
        assert!(worst < 5e-4, "{worst}");
    }

    #[test]
    fn every_register_has_its_maximal_period() {
        for (order, _) in TRINOMIALS {
            let mut prbs = PrbsSource::new(order, 1, [1], [1.0_f32]).unwrap();
            let period = (1_u32 << order) - 1;
            let mut ones = 0_u32;
            for k in 0..period {
                assert!(k == 0 || prbs.registers != [1], "order {order}: period {k}");
                ones += u32::from(prbs.next() == [1.0]);
            }
            assert_eq!(prbs.registers, [1], "order {order}");
            assert_eq!(ones, 1 << (order - 1), "order {order}");
        }
        assert_eq!(PrbsSource::new(8, 1, [1], [1.0_f32]), None);
        assert_eq!(PrbsSource::new(3, 1, [8], [1.0_f32]), None);
        assert_eq!(PrbsSource::new(3, 1, [0], [1.0_f32]), None);
    }

    #[test]
    fn held_values_and_tables_repeat() {
        let mut source: ExcitationSource<'_, f64, 2, 0> =
            ExcitationSource::Prbs(PrbsSource::new(3, 3, [1, 2], [1.0, 5.0]).unwrap());
        let rows: [[f64; 2]; 9] = core::array::from_fn(|_| source.advance());
        assert!(rows.chunks(3).all(|held| held.iter().all(|row| *row == held[0])));
        assert_ne!(rows[0], rows[3]);
        let table = [[1.0, 2.0], [3.0, 4.0]];
        let mut source: ExcitationSource<'_, f64, 2, 0> = ExcitationSource::Table(TableSource::new(&table));
        assert_eq!([source.advance(), source.advance(), source.advance()], [table[0], table[1], table[0]]);
        let mut none: ExcitationSource<'_, f64, 1, 0> = ExcitationSource::Table(TableSource::new(&[]));
        assert_eq!(none.advance(), [0.0]);
    }
}
