//! Files as they come out, read as XML.

use roxmltree::{Document, Node};

use super::*;
use crate::report::figure::{Axis, Cell, Cells, Curve, Drawn, Layout, MEASURED, Sample};

fn methods() -> Vec<Method> {
    vec![Method::nominal(), Method::pem(), Method::direct(), Method::hansen()]
}

fn axis(label: &str, unit: &str, range: Option<[f64; 2]>) -> Axis {
    Axis { label: label.into(), unit: unit.into(), range, log: false }
}

fn curve(method: &str, drawn: Drawn, y: &[f64]) -> Curve {
    let x = (0..y.len()).map(|k| k as f64).collect();
    Curve { method: method.into(), note: String::new(), drawn, x, y: y.to_vec() }
}

fn panel(content: Content, range: Option<[f64; 2]>) -> Panel {
    Panel { title: "horizontal".into(), x: axis("time", "s", None), y: axis("position", "um", range), content }
}

fn figure(panels: Vec<Panel>) -> Figure {
    Figure { key: "one".into(), title: "Figure 1".into(), caption: "All kinds.".into(), panels, ..Figure::default() }
}

fn sample(method: &str, values: &[f64]) -> Sample {
    Sample { method: method.into(), note: String::new(), values: values.to_vec() }
}

fn map() -> Cells {
    let cell =
        |method: &str, text: &str| Cell { method: method.into(), strength: 1.0, text: text.into(), ..Cell::default() };
    Cells {
        columns: vec!["1".into(), "2".into()],
        rows: vec!["low".into(), "high".into()],
        cells: vec![cell("hansen", "+12"), cell("direct", "-3"), cell("", "0"), cell("pem", "1")],
    }
}

fn drawn(figure: &Figure) -> String {
    svg(figure, &methods()).unwrap()
}

fn shapes<'a>(document: &'a Document, method: &str, kind: &str) -> Vec<Node<'a, 'a>> {
    let named = |node: &Node, name: &str, value: &str| node.attribute(name) == Some(value);
    document.descendants().filter(|node| named(node, "data-method", method) && named(node, "data-kind", kind)).collect()
}

fn texts<'a>(document: &'a Document) -> Vec<&'a str> {
    document.descendants().filter(|node| node.has_tag_name("text")).filter_map(|node| node.text()).collect()
}

fn pieces(node: &Node) -> usize {
    node.attribute("d").unwrap().matches('M').count()
}

#[test]
fn every_method_has_its_colour_and_a_legend_entry_in_all_kinds_of_panels() {
    let curves = vec![
        curve(MEASURED, Drawn::Line, &[1.0, 2.0, 3.0]),
        curve("hansen", Drawn::Line, &[1.0, 2.5, 3.0]),
        curve("pem", Drawn::Points, &[1.0, 2.0, 4.0]),
    ];
    let boxes = vec![sample("direct", &[1.0, 2.0, 3.0])];
    let contents = [Content::Curves(curves), Content::Boxes(boxes), Content::Cells(map())];
    for layout in [Layout::Stacked, Layout::Beside] {
        let panels = contents.iter().map(|content| panel(content.clone(), None)).collect();
        let file = drawn(&Figure { layout, ..figure(panels) });
        let document = Document::parse(&file).unwrap();
        for (method, kind, attribute, colour) in [
            (MEASURED, "line", "stroke", "#16191d"),
            ("hansen", "line", "stroke", "#0072b2"),
            ("pem", "points", "fill", "#b0457b"),
            ("direct", "median", "stroke", "#d55e00"),
            ("hansen", "cell", "fill", "#4d9cc9"),
        ] {
            let found = shapes(&document, method, kind);
            assert!(!found.is_empty(), "{method} {kind}");
            assert!(found.iter().all(|node| node.attribute(attribute) == Some(colour)), "{method} {kind}");
        }
        let texts = texts(&document);
        for name in ["measured", "Hansen G(S)", "PEM", "direct N4SID", "time (s)", "position (µm)", "+12", "−3", "low"]
        {
            assert!(texts.contains(&name), "{name} in {texts:?}");
        }
        assert!(!texts.contains(&"nominal G(0)"));
        let named = |tag| document.descendants().find(|node| node.has_tag_name(tag)).and_then(|node| node.text());
        assert_eq!(named("title").map(str::trim), Some("Figure 1"));
        assert_eq!(named("desc").map(str::trim), Some("All kinds."));
    }
}

#[test]
fn points_without_value_or_beyond_the_range_are_at_the_edge() {
    let values = [0.0, f64::NAN, -21.0, -1e9, f64::NEG_INFINITY, 101.0, f64::NAN, 100.0];
    let content = Content::Curves(vec![curve("hansen", Drawn::Points, &values)]);
    let file = drawn(&figure(vec![panel(content, Some([-20.0, 100.0]))]));
    let document = Document::parse(&file).unwrap();
    for (kind, count) in [("points", 2), ("beyond", 4), ("missing", 4)] {
        let found = shapes(&document, "hansen", kind);
        assert_eq!(found.iter().map(pieces).sum::<usize>(), count, "{kind}");
    }
    let texts = texts(&document);
    assert!(texts.contains(&"beyond the range") && texts.contains(&"no value"));
    let plain = drawn(&figure(vec![panel(Content::Curves(vec![curve("hansen", Drawn::Points, &[1.0])]), None)]));
    assert!(!plain.contains("beyond") && !plain.contains("no value"));
}

#[test]
fn a_line_has_gaps_and_ends_at_the_range() {
    let values = [0.0, 10.0, f64::NAN, 20.0, 500.0, 20.0, f64::INFINITY, 30.0];
    let content = Content::Curves(vec![curve("hansen", Drawn::Line, &values)]);
    let file = drawn(&figure(vec![panel(content, Some([-20.0, 100.0]))]));
    let document = Document::parse(&file).unwrap();
    let found = shapes(&document, "hansen", "line");
    // Before the gap, up to the range, back from it, and the lone value at the end.
    assert_eq!(pieces(&found[0]), 4);
    let height: f64 = document.root_element().attribute("viewBox").unwrap().split(' ').nth(3).unwrap().parse().unwrap();
    let starts = found[0].attribute("d").unwrap().split('M').skip(1);
    let heights = starts.map(|piece| piece.split([' ', 'l']).nth(1).unwrap().parse::<f64>().unwrap());
    assert!(heights.into_iter().all(|y| y > 0.0 && y < height));
}

#[test]
fn a_box_says_what_it_does_not_show() {
    let samples = vec![
        sample("direct", &[1.0, 2.0, f64::NAN, 3.0, -50.0, 4.0, 200.0, 300.0]),
        sample("hansen", &[f64::NAN, f64::NAN]),
    ];
    let file = drawn(&figure(vec![panel(Content::Boxes(samples), Some([-20.0, 100.0]))]));
    let document = Document::parse(&file).unwrap();
    let texts = texts(&document);
    for remark in ["1 of 8 failed", "1 below −20", "2 above 100", "2 of 2 failed"] {
        assert!(texts.contains(&remark), "{remark} in {texts:?}");
    }
    assert_eq!(shapes(&document, "direct", "beyond").len(), 2);
    assert!(shapes(&document, "hansen", "box").is_empty());
}

#[test]
fn long_records_make_small_files_and_always_the_same() {
    let wave = |k: usize| (0..20_000).map(|row| ((row * (k + 1)) as f64 * 0.37).sin()).collect::<Vec<_>>();
    let curves = (0..4).map(|k| curve(&methods()[k].key, Drawn::Line, &wave(k))).collect();
    let panels = vec![panel(Content::Curves(curves), None); 3];
    let file = drawn(&figure(panels.clone()));
    assert!(file.len() < 400_000, "{} bytes", file.len());
    assert_eq!(file, drawn(&figure(panels)));
}

#[test]
fn any_text_and_any_number_gives_a_file_that_can_be_read() {
    let hostile = "<&\"'>\u{0}\u{1b}]]>-->";
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 5e-324, 0.0];
    let contents = [
        Content::Curves(vec![]),
        Content::Curves(vec![
            curve(hostile, Drawn::Line, &odd),
            curve("", Drawn::Points, &odd),
            curve("pem", Drawn::Line, &[]),
        ]),
        Content::Boxes(vec![]),
        Content::Boxes(vec![sample(hostile, &odd), sample("hansen", &[])]),
        Content::Cells(Cells::default()),
        Content::Cells(Cells { columns: vec![hostile.repeat(20)], rows: vec![], cells: vec![] }),
    ];
    for count in 0..=contents.len() {
        for (layout, log) in [(Layout::Stacked, false), (Layout::Beside, true)] {
            let mut panels: Vec<Panel> =
                contents.iter().take(count).map(|content| panel(content.clone(), None)).collect();
            for panel in &mut panels {
                panel.title = hostile.into();
                (panel.x.log, panel.y.log) = (log, log);
            }
            let file = drawn(&Figure { layout, caption: hostile.into(), ..figure(panels) });
            let document = Document::parse(&file).unwrap();
            for attribute in document.descendants().flat_map(|node| node.attributes()) {
                let written =
                    matches!(attribute.name(), "x" | "y" | "width" | "height" | "d" | "viewBox" | "transform");
                assert!(!written || !(attribute.value().contains("NaN") || attribute.value().contains("inf")));
            }
        }
    }
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let mut short = curve("pem", Drawn::Line, &[1.0, 2.0]);
    short.x.pop();
    let refused = |content, range| svg(&figure(vec![panel(content, range)]), &methods()).unwrap_err();
    assert!(matches!(
        refused(Content::Curves(vec![short]), None),
        Error::Shape { expected: (1, 1), found: (2, 1), .. }
    ));
    let mut cells = map();
    cells.cells.pop();
    assert!(matches!(refused(Content::Cells(cells), None), Error::Shape { expected: (4, 1), found: (3, 1), .. }));
    assert!(matches!(refused(Content::default(), Some([1.0, 0.0])), Error::OutOfRange { .. }));
}

/// Left, top, right and lower edge of a text that does not stand upright.
fn extent(node: &Node) -> Option<[f64; 4]> {
    let number = |name| node.attribute(name).and_then(|value| value.parse::<f64>().ok());
    let (x, y, size) = (number("x")?, number("y")?, number("font-size")?);
    let width = text::width(node.text()?, size);
    let left = match node.attribute("text-anchor") {
        None => x,
        Some("middle") => x - width / 2.0,
        _ => x - width,
    };
    Some([left, y - 0.7 * size, left + width, y + 0.1 * size])
}

#[test]
fn texts_stay_on_the_page_and_clear_of_each_other() {
    let tails = [-1e3, -3.0, 1.0, 2.0, 3.0, f64::NAN, 4.0, 2e3];
    let samples: Vec<Sample> = methods().iter().map(|method| sample(&method.key, &tails)).collect();
    let clouds = methods().iter().map(|method| curve(&method.key, Drawn::Points, &tails)).collect();
    let range = Some([-2.5, 3.5]);
    for content in [Content::Curves(clouds), Content::Boxes(samples), Content::Cells(map())] {
        for (layout, count) in [(Layout::Stacked, 2), (Layout::Stacked, 6), (Layout::Beside, 2), (Layout::Beside, 7)] {
            let file = drawn(&Figure { layout, ..figure(vec![panel(content.clone(), range); count]) });
            let document = Document::parse(&file).unwrap();
            let size = document.root_element().attribute("viewBox").unwrap();
            let size: Vec<f64> = size.split(' ').map(|number| number.parse().unwrap()).collect();
            let texts: Vec<(&str, [f64; 4])> =
                document.descendants().filter_map(|node| Some((node.text()?, extent(&node)?))).collect();
            assert!(texts.len() > count);
            for (k, (text, [left, top, right, bottom])) in texts.iter().enumerate() {
                assert!(*left >= 0.0 && *top >= 0.0 && *right <= size[2] && *bottom <= size[3], "{text}");
                for (other, place) in &texts[k + 1..] {
                    let apart = place[0] >= *right || place[2] <= *left || place[1] >= *bottom || place[3] <= *top;
                    assert!(apart, "{text:?} and {other:?}, {layout:?} {count}");
                }
            }
        }
    }
}
