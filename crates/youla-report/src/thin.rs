//! Figures with as many points and digits as a page takes.
//!
//! A long line is drawn by the minimum and maximum of each bucket, except within the range of its horizontal axis, which is
//! what the page shows first. Clouds, boxes and maps stay whole.

use std::ops::Range;

use super::figure::{Axis, Content, Curve, Drawn, Figure, Panel, Sample};
use super::trace::MAX_POINTS;
use super::{decimate, numbers};

/// Significant digits of positions: they only lose the noise of their last bits.
const DIGITS_OF_POSITIONS: i32 = 9;
const DIGITS_OF_VALUES: i32 = 5;

/// Most points per line such that all lines together have at most `together`.
pub(super) fn most_points<'a>(figures: impl Iterator<Item = &'a Figure>, together: usize) -> usize {
    let all: usize = figures.flat_map(lines).map(|line| line.y.len().min(MAX_POINTS)).sum();
    if all > together { MAX_POINTS * together / all } else { MAX_POINTS }
}

/// Whether a line of the figure has more points than that.
pub(super) fn is_thinned(figure: &Figure, most: usize) -> bool {
    lines(figure).any(|line| line.y.len() > most)
}

/// The figure as it is drawn.
pub(super) fn for_drawing(figure: &Figure, most: usize) -> Figure {
    let panels = figure.panels.iter().map(|panel| Panel { content: content(panel, most), ..without_content(panel) });
    Figure { panels: panels.collect(), ..without_panels(figure) }
}

/// Key, title, caption and layout.
fn without_panels(figure: &Figure) -> Figure {
    Figure {
        key: figure.key.clone(),
        title: figure.title.clone(),
        caption: figure.caption.clone(),
        layout: figure.layout,
        choice: figure.choice.clone(),
        panels: Vec::new(),
    }
}

fn without_content(panel: &Panel) -> Panel {
    Panel {
        title: panel.title.clone(),
        x: panel.x.clone(),
        y: panel.y.clone(),
        content: Content::default(),
        regions: panel.regions.clone(),
        guides: panel.guides.clone(),
        shades: panel.shades.clone(),
        equal: panel.equal,
        along: panel.along.clone(),
        height: panel.height,
    }
}

fn lines(figure: &Figure) -> impl Iterator<Item = &Curve> {
    let curves = figure.panels.iter().filter_map(|panel| match &panel.content {
        Content::Curves(curves) => Some(curves),
        _ => None,
    });
    curves.flatten().filter(|curve| curve.drawn == Drawn::Line)
}

fn content(panel: &Panel, most: usize) -> Content {
    match &panel.content {
        Content::Curves(curves) => Content::Curves(curves.iter().map(|curve| thinned(curve, panel, most)).collect()),
        Content::Boxes(samples) => Content::Boxes(samples.iter().map(rounded).collect()),
        Content::Cells(cells) => Content::Cells(cells.clone()),
    }
}

fn rounded(sample: &Sample) -> Sample {
    Sample { values: numbers::for_drawing(sample.values.iter().copied(), DIGITS_OF_VALUES), ..sample.clone() }
}

fn thinned(curve: &Curve, panel: &Panel, most: usize) -> Curve {
    let samples = curve.x.len().min(curve.y.len());
    let points = curve.y[..samples].iter().copied().enumerate();
    let kept = if curve.drawn == Drawn::Line && samples > most {
        let detail = first_view(&curve.x[..samples], &panel.x, most);
        decimate::min_max(points, samples, &detail, decimate::width_for(samples, detail.len(), most))
    } else {
        points.collect()
    };
    // In a plane both axes are values.
    let digits_of_positions = if panel.equal { DIGITS_OF_VALUES } else { DIGITS_OF_POSITIONS };
    Curve {
        method: curve.method.clone(),
        note: curve.note.clone(),
        drawn: curve.drawn,
        x: numbers::for_drawing(kept.iter().map(|point| curve.x[point.0]), digits_of_positions),
        y: numbers::for_drawing(kept.iter().map(|point| point.1), DIGITS_OF_VALUES),
        along: numbers::for_drawing(
            kept.iter().filter_map(|point| curve.along.get(point.0).copied()),
            DIGITS_OF_VALUES,
        ),
        details: kept.iter().filter_map(|point| curve.details.get(point.0).cloned()).collect(),
    }
}

/// Rows that are shown first, where they leave points for the rest.
fn first_view(x: &[f64], axis: &Axis, most: usize) -> Range<usize> {
    let Some([low, high]) = axis.range else { return 0..0 };
    let (start, end) = (x.partition_point(|&x| x < low), x.partition_point(|&x| x <= high));
    if end.saturating_sub(start) > most * 2 / 3 { 0..0 } else { start..end.max(start) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(samples: usize, range: Option<[f64; 2]>) -> Figure {
        let line = |drawn, samples: usize| Curve {
            method: "hansen".into(),
            note: String::new(),
            drawn,
            x: (0..samples).map(|k| k as f64 * 1e-4).collect(),
            y: (0..samples).map(|k| (k as f64 * 0.7).sin() / 3.0).collect(),
            ..Curve::default()
        };
        let content = Content::Curves(vec![line(Drawn::Line, samples), line(Drawn::Points, samples)]);
        Figure {
            panels: vec![Panel { x: Axis { range, ..Axis::default() }, content, ..Panel::default() }],
            ..Figure::default()
        }
    }

    fn curves(figure: &Figure) -> &[Curve] {
        match &figure.panels[0].content {
            Content::Curves(curves) => curves,
            _ => &[],
        }
    }

    #[test]
    fn long_lines_keep_their_first_view_and_clouds_stay_whole() {
        let whole = figure(50_000, Some([1.0, 1.1]));
        let drawn = for_drawing(&whole, MAX_POINTS);
        let (line, cloud) = (&curves(&drawn)[0], &curves(&drawn)[1]);
        assert!(line.x.len() <= MAX_POINTS && line.x.len() > MAX_POINTS / 2, "{} points", line.x.len());
        assert_eq!(line.x.iter().filter(|&&x| (1.0..=1.1).contains(&x)).count(), 1001);
        assert_eq!(cloud.y.len(), 50_000);
        assert!(is_thinned(&whole, MAX_POINTS) && !is_thinned(&drawn, MAX_POINTS));
        for (x, y) in line.x.iter().zip(&line.y) {
            assert!((y - (x * 7000.0).sin() / 3.0).abs() < 1e-5);
        }
    }

    #[test]
    fn a_first_view_of_nearly_all_points_is_thinned_too() {
        for range in [Some([0.0, 4.0]), Some([3.0, 1.0]), None] {
            let drawn = for_drawing(&figure(50_000, range), 1000);
            assert!(curves(&drawn)[0].x.len() <= 1000);
        }
    }

    #[test]
    fn lines_share_the_points_of_a_page() {
        let figures = vec![figure(50_000, None); 10];
        assert_eq!(most_points(figures.iter(), 100_000), MAX_POINTS);
        assert_eq!(most_points(figures.iter(), 20_000), MAX_POINTS / 2);
    }

    #[test]
    fn columns_of_unequal_length_are_drawn_as_far_as_both_go() {
        let mut whole = figure(20, None);
        if let Content::Curves(curves) = &mut whole.panels[0].content {
            curves[0].x.truncate(7);
        }
        assert_eq!(curves(&for_drawing(&whole, 10))[0].y.len(), 7);
    }
}
