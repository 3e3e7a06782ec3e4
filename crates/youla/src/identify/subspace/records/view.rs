//! Views of the records of one experiment, in the units of the caller or scaled.

use faer::{Mat, MatRef};

/// Views of the records of one experiment, or of a part of it.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) u: MatRef<'a, f64>,
    pub(crate) y: MatRef<'a, f64>,
    /// Known signals of a disturbance of the outputs; no columns where none is known.
    pub(crate) w: MatRef<'a, f64>,
}

impl<'a> View<'a> {
    /// Without known disturbances.
    pub(crate) fn of(u: MatRef<'a, f64>, y: MatRef<'a, f64>) -> Self {
        View { u, y, w: y.subcols(0, 0) }
    }

    pub(crate) fn samples(&self) -> usize {
        self.u.nrows()
    }

    pub(crate) fn part(&self, start: usize, count: usize) -> View<'a> {
        let part = |m: MatRef<'a, f64>| m.subrows(start, count);
        View { u: part(self.u), y: part(self.y), w: part(self.w) }
    }
}

/// The records of one experiment in scaled units, one contiguous column per channel.
#[derive(Clone)]
pub(crate) struct Signals {
    pub(crate) u: Mat<f64>,
    pub(crate) y: Mat<f64>,
    /// Of unit rms.
    pub(crate) w: Mat<f64>,
}

impl Signals {
    pub(crate) fn view(&self) -> View<'_> {
        View { u: self.u.as_ref(), y: self.y.as_ref(), w: self.w.as_ref() }
    }
}
