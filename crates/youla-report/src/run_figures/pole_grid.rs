//! Lines of constant natural frequency and of constant damping ratio: `s = omega (-zeta + i sqrt(1 - zeta^2))`, `z = exp(s ts)`.

use crate::figure::{Guide, GuideKind};
use crate::with_minus;
use std::f64::consts::{PI, TAU};

const DAMPINGS: [f64; 15] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
/// Points of an arc and of a ray.
const ARC: usize = 60;
const RAY: usize = 160;
/// About how many frequencies are drawn.
const FREQUENCIES: f64 = 7.0;

/// The plane of z with a sample time, or that of s.
pub(super) struct Plane {
    pub(super) sample_time: Option<f64>,
}

impl Plane {
    fn pole(&self, hz: f64, zeta: f64, sign: f64) -> [f64; 2] {
        let (re, im) = (-TAU * hz * zeta, sign * TAU * hz * (1.0 - zeta * zeta).max(0.0).sqrt());
        match self.sample_time {
            Some(ts) => [(re * ts).exp() * (im * ts).cos(), (re * ts).exp() * (im * ts).sin()],
            None => [re, im],
        }
    }

    /// A place in words: its value, natural frequency and damping ratio.
    pub(super) fn details(&self, [x, y]: [f64; 2]) -> String {
        let [re, im] = match self.sample_time {
            Some(ts) => [x.hypot(y).ln() / ts, y.atan2(x) / ts],
            None => [x, y],
        };
        let places = |value: f64| if value.abs() < 100.0 { 5 } else { 1 };
        let imaginary = match y {
            0.0 => String::new(),
            y => format!(" {} {:.*}i", if y < 0.0 { "-" } else { "+" }, places(y), y.abs()),
        };
        let (letter, size) = match self.sample_time {
            Some(_) => ("z", format!("|z| = {:.5}\n", x.hypot(y))),
            None => ("s", String::new()),
        };
        let omega = re.hypot(im);
        if omega.is_infinite() {
            return format!("{letter} = 0\na sample of delay");
        }
        let hz = omega / TAU;
        let digits = crate::numbers::decimals(hz, 4).clamp(0, 6) as usize;
        let zeta = if omega == 0.0 { 1.0 } else { -re / omega };
        with_minus(format!("{letter} = {x:.*}{imaginary}\n{size}{hz:.digits$} Hz, ζ = {zeta:.4}", places(x)))
    }

    /// Frequency of a place on the boundary of stability in its direction.
    fn hz(&self, [x, y]: [f64; 2]) -> f64 {
        match self.sample_time {
            Some(ts) => y.atan2(x).abs() / (TAU * ts),
            None => x.hypot(y) / TAU,
        }
    }

    fn nyquist(&self) -> f64 {
        self.sample_time.map_or(f64::INFINITY, |ts| 0.5 / ts)
    }
}

/// The grid of a view, which may be widened when it is drawn, and the boundary of stability.
pub(super) fn grid(plane: &Plane, [x, y]: [[f64; 2]; 2]) -> Vec<Guide> {
    // Lines reach beyond the view, labels stay in it.
    let (wide, high) = (x[1] - x[0], y[1] - y[0]);
    let reach = wide.max(high);
    let view = [[x[0] - 0.3 * reach, x[1] + 0.3 * reach], [y[0] - 0.3 * reach, y[1] + 0.3 * reach]];
    let [low, top] = frequencies(plane, view);
    let signs: &[f64] = if view[0][0] > view[0][1] || y[0] >= 0.0 { &[1.0] } else { &[1.0, -1.0] };
    let mut guides = arcs(plane, [low, top], reach, signs);
    guides.extend(rays(plane, [low, top], reach, signs));
    guides.push(boundary(plane, view));
    guides
}

fn arcs(plane: &Plane, [low, top]: [f64; 2], reach: f64, signs: &[f64]) -> Vec<Guide> {
    let top = top.min(plane.nyquist());
    let step = round_step((top - low) / FREQUENCIES);
    let places = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    let first = (low / step).ceil().max(1.0) as usize;
    let list = (first..first + 40).map(|k| k as f64 * step).take_while(|hz| *hz <= top * (1.0 + 1e-9));
    let arc = |(hz, sign): (f64, f64)| {
        let (x, y) = (0..=ARC).map(|k| plane.pole(hz, k as f64 / ARC as f64, sign)).map(|[x, y]| (x, y)).unzip();
        let [x0, y0] = plane.pole(hz, 0.0, sign);
        let outward = if plane.sample_time.is_some() { 1.0 + 0.045 * reach } else { 1.0 };
        Guide { kind: GuideKind::Grid, x, y, label: format!("{hz:.places$}"), at: [x0 * outward, y0 * outward] }
    };
    let both = list.flat_map(|hz| signs.iter().map(move |sign| (hz, *sign)));
    // The frequency at z = -1 is one place, not two.
    both.filter(|(hz, sign)| *sign > 0.0 || *hz < plane.nyquist() * (1.0 - 1e-9)).map(arc).collect()
}

fn rays(plane: &Plane, [low, top]: [f64; 2], reach: f64, signs: &[f64]) -> Vec<Guide> {
    let middle = (low + top.min(plane.nyquist())) / 2.0;
    let mut previous = plane.pole(middle, 0.0, 1.0);
    let mut guides = Vec::new();
    for zeta in DAMPINGS {
        let here = plane.pole(middle, zeta, 1.0);
        if (here[0] - previous[0]).hypot(here[1] - previous[1]) < 0.09 * reach {
            continue;
        }
        previous = here;
        let end = (1.6 * top).min(plane.nyquist() / (1.0 - zeta * zeta).sqrt());
        for &sign in signs {
            let ray = (0..=RAY).map(|k| plane.pole(end * k as f64 / RAY as f64, zeta, sign));
            let (x, y) = ray.map(|[x, y]| (x, y)).unzip();
            let label = if sign > 0.0 { format!("ζ {zeta}") } else { String::new() };
            guides.push(Guide { kind: GuideKind::Grid, x, y, label, at: here });
        }
    }
    guides
}

fn boundary(plane: &Plane, [_, y]: [[f64; 2]; 2]) -> Guide {
    let (x, y) = match plane.sample_time {
        Some(_) => (0..=720).map(|k| f64::from(k) / 360.0 * PI).map(|a| (a.cos(), a.sin())).unzip(),
        None => (vec![0.0; 2], y.to_vec()),
    };
    Guide { kind: GuideKind::Boundary, x, y, ..Guide::default() }
}

/// Smallest and largest frequency in a view.
fn frequencies(plane: &Plane, [x, y]: [[f64; 2]; 2]) -> [f64; 2] {
    let shares = (0..=40).map(|k| f64::from(k) / 40.0);
    let edge = shares.flat_map(|t| {
        let (a, b) = (x[0] + t * (x[1] - x[0]), y[0] + t * (y[1] - y[0]));
        [[a, y[0]], [a, y[1]], [x[0], b], [x[1], b]]
    });
    let all = edge.map(|place| plane.hz(place));
    let [low, high] = super::span(all).unwrap_or([0.0, 1.0]);
    let holds_real_axis = y[0] < 0.0 && y[1] > 0.0 && x[1] > 0.0 && (plane.sample_time.is_some() || x[0] < 0.0);
    [if holds_real_axis { 0.0 } else { low }, high]
}

/// 1, 2 or 5 times a power of ten, not smaller.
fn round_step(raw: f64) -> f64 {
    let raw = if raw > 0.0 && raw.is_finite() { raw } else { 1.0 };
    let power = 10f64.powf(raw.log10().floor());
    power * [1.0, 2.0, 5.0].into_iter().find(|digit| raw <= digit * power * (1.0 + 1e-9)).unwrap_or(10.0)
}
