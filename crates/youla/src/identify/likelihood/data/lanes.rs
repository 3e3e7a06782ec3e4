//! Complex numbers of several lines side by side: the arithmetic of a line is the same for all lines, so that the processor does it
//! for several at a time.

use faer::c64;

/// Lines side by side.
pub(crate) const LANES: usize = 32;

/// One complex number of each line.
#[derive(Clone, Copy)]
pub(crate) struct Lanes {
    pub(crate) re: [f64; LANES],
    pub(crate) im: [f64; LANES],
}

impl Lanes {
    pub(crate) const ZERO: Lanes = Lanes { re: [0.0; LANES], im: [0.0; LANES] };

    #[inline(always)]
    pub(crate) fn gather(of: impl Fn(usize) -> c64) -> Self {
        let mut out = Lanes::ZERO;
        for l in 0..LANES {
            let v = of(l);
            (out.re[l], out.im[l]) = (v.re, v.im);
        }
        out
    }

    #[inline(always)]
    pub(crate) fn add_scaled(&mut self, a: &Lanes, s: f64) {
        for l in 0..LANES {
            self.re[l] += a.re[l] * s;
            self.im[l] += a.im[l] * s;
        }
    }

    #[inline(always)]
    pub(crate) fn add_product(&mut self, a: &Lanes, b: &Lanes) {
        for l in 0..LANES {
            self.re[l] += a.re[l] * b.re[l] - a.im[l] * b.im[l];
            self.im[l] += a.re[l] * b.im[l] + a.im[l] * b.re[l];
        }
    }

    #[inline(always)]
    pub(crate) fn set_product(&mut self, a: &Lanes, b: &Lanes) {
        for l in 0..LANES {
            self.re[l] = a.re[l] * b.re[l] - a.im[l] * b.im[l];
            self.im[l] = a.re[l] * b.im[l] + a.im[l] * b.re[l];
        }
    }

    #[inline(always)]
    pub(crate) fn multiply(&mut self, b: &Lanes) {
        for l in 0..LANES {
            let (re, im) = (self.re[l], self.im[l]);
            self.re[l] = re * b.re[l] - im * b.im[l];
            self.im[l] = re * b.im[l] + im * b.re[l];
        }
    }

    #[inline(always)]
    pub(crate) fn times(&self, b: &Lanes) -> Lanes {
        let mut out = Lanes::ZERO;
        out.add_product(self, b);
        out
    }

    #[inline(always)]
    pub(crate) fn scaled(&self, s: f64) -> Lanes {
        let mut out = Lanes::ZERO;
        out.add_scaled(self, s);
        out
    }

    /// The numbers plus a real one.
    #[inline(always)]
    pub(crate) fn shifted(&self, by: f64) -> Lanes {
        let mut out = *self;
        out.re.iter_mut().for_each(|v| *v += by);
        out
    }

    #[inline(always)]
    pub(crate) fn plus(&self, by: c64) -> Lanes {
        let mut out = self.shifted(by.re);
        out.im.iter_mut().for_each(|v| *v += by.im);
        out
    }

    #[inline(always)]
    pub(crate) fn sum(&self, b: &Lanes) -> Lanes {
        let mut out = *self;
        out.add_scaled(b, 1.0);
        out
    }

    #[inline(always)]
    pub(crate) fn conj(&self) -> Lanes {
        let mut out = *self;
        out.im.iter_mut().for_each(|v| *v = -*v);
        out
    }

    #[inline(always)]
    pub(crate) fn inverse(&self) -> Lanes {
        let mut out = Lanes::ZERO;
        for l in 0..LANES {
            let scale = 1.0 / (self.re[l] * self.re[l] + self.im[l] * self.im[l]);
            (out.re[l], out.im[l]) = (self.re[l] * scale, -self.im[l] * scale);
        }
        out
    }
}

/// Adds the real part of `conj a b` of each line.
#[inline(always)]
pub(crate) fn add_real_product(sums: &mut [f64; LANES], a: &Lanes, b: &Lanes) {
    for l in 0..LANES {
        sums[l] += a.re[l] * b.re[l] + a.im[l] * b.im[l];
    }
}
