//! Poles and invariant zeros in the plane of z or s, near the boundary of stability and as a whole.

use super::choice::Chosen;
use super::pole_grid::{Plane, grid};
use super::{RunFigure, axis, key, span};
use crate::data::Poles;
use crate::figure::{Axis, Content, Curve, Drawn, Figure, Layout, Panel};

const ZEROS: &str = " Filled: poles. Outlined: invariant zeros.";

/// One figure of one or two panels.
pub(super) fn figure(chosen: &Chosen) -> Vec<Figure> {
    let sets = &chosen.data.poles;
    let all: Vec<[f64; 2]> = sets.iter().flat_map(|set| &set.poles).copied().collect();
    if all.is_empty() {
        return Vec::new();
    }
    let plane = Plane { sample_time: chosen.data.sample_time };
    let caption = match chosen.data.sample_time {
        Some(_) => {
            "Poles in the z plane. Grid: lines of constant natural frequency (Hz) and of constant damping ratio ζ."
        }
        None => {
            "Poles in the s plane (rad/s). Grid: circles of constant natural frequency (Hz) and rays of constant damping ratio ζ."
        }
    };
    vec![Figure {
        key: key(RunFigure::Poles, &[]),
        title: "Poles".into(),
        caption: format!("{caption}{}", if sets.iter().any(|set| !set.zeros.is_empty()) { ZEROS } else { "" }),
        layout: Layout::Beside,
        panels: views(&plane, &all).into_iter().map(|(title, view)| panel(&plane, sets, title, view)).collect(),
        ..Figure::default()
    }]
}

fn panel(plane: &Plane, sets: &[Poles], title: &str, [x, y]: [[f64; 2]; 2]) -> Panel {
    let curve = |set: &Poles| Curve {
        method: set.method.clone(),
        note: if sets.iter().any(|set| !set.zeros.is_empty()) { "poles".into() } else { String::new() },
        drawn: Drawn::Dots,
        x: set.poles.iter().map(|pole| pole[0]).collect(),
        y: set.poles.iter().map(|pole| pole[1]).collect(),
        details: set.poles.iter().map(|pole| plane.details(*pole)).collect(),
        ..Curve::default()
    };
    let zeros = |set: &Poles| Curve {
        method: set.method.clone(),
        note: "zeros".into(),
        drawn: Drawn::Marks,
        x: set.zeros.iter().map(|zero| zero[0]).collect(),
        y: set.zeros.iter().map(|zero| zero[1]).collect(),
        details: set.zeros.iter().map(|zero| plane.details(*zero)).collect(),
        ..Curve::default()
    };
    let letter = if plane.sample_time.is_some() { "z" } else { "s" };
    let unit = if plane.sample_time.is_some() { "" } else { "rad/s" };
    let drawn = |part: &str, range| Axis { range: Some(range), ..axis(format!("{part} {letter}"), unit) };
    Panel {
        title: title.into(),
        x: drawn("Re", x),
        y: drawn("Im", y),
        content: Content::Curves(
            sets.iter().filter(|set| !set.zeros.is_empty()).map(zeros).chain(sets.iter().map(curve)).collect(),
        ),
        guides: grid(plane, [x, y]),
        equal: true,
        ..Panel::default()
    }
}

type View = [[f64; 2]; 2];

/// Around the lightly damped poles where that shows more, and everything.
fn views(plane: &Plane, all: &[[f64; 2]]) -> Vec<(&'static str, View)> {
    let size = |[re, im]: &[f64; 2]| re.hypot(*im);
    if plane.sample_time.is_none() {
        let light: Vec<[f64; 2]> = all.iter().filter(|p| p[1] > 0.0 && -p[0] < 0.2 * size(p)).copied().collect();
        let whole = ("All poles", around(&[all, &[[0.0; 2]]].concat(), 0.15));
        let ends: Vec<[f64; 2]> = light.first().map(|first| [0.0, first[1]]).into_iter().chain(light).collect();
        return if ends.is_empty() { vec![whole] } else { vec![("Lightly damped", around(&ends, 0.25)), whole] };
    }
    let reach = (1.05 * all.iter().map(size).fold(0.0, f64::max)).max(1.12);
    let whole = ("Unit circle", [[-reach, reach]; 2]);
    let near: Vec<[f64; 2]> = all.iter().filter(|p| p[1] >= 0.0 && size(p) > 0.9).copied().collect();
    let close = around(&near, 0.2);
    let wide = |[low, high]: [f64; 2]| high - low;
    if near.is_empty() || wide(close[0]).max(wide(close[1])) > 0.8 * reach {
        vec![whole]
    } else {
        vec![("Near the unit circle", close), whole]
    }
}

/// A view of these poles with a share of it free at each side.
fn around(poles: &[[f64; 2]], pad: f64) -> View {
    let ends = [0, 1].map(|part| span(poles.iter().map(|pole| pole[part])).unwrap_or([0.0, 0.0]));
    let size = ends.iter().flatten().fold(0.0, |size: f64, end| size.max(end.abs()));
    let free = pad * ends.iter().map(|[low, high]| high - low).fold((1e-3 * size).max(1e-9), f64::max);
    ends.map(|[low, high]| [low - free, high + free])
}
