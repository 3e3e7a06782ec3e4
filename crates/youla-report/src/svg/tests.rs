//! Files as they come out, read as XML.

use roxmltree::{Document, Node};

use super::*;
use crate::figure::{Area, Axis, Cell, Cells, Curve, Drawn, Guide, Layout, MEASURED, Sample};

fn methods() -> Vec<DrawnMethod> {
    vec![DrawnMethod::nominal(), DrawnMethod::pem(), DrawnMethod::direct(), DrawnMethod::hansen()]
}

fn axis(label: &str, unit: &str, range: Option<[f64; 2]>) -> Axis {
    Axis { label: label.into(), unit: unit.into(), range, ..Axis::default() }
}

fn curve(method: &str, drawn: Drawn, y: &[f64]) -> Curve {
    let x = (0..y.len()).map(|k| k as f64).collect();
    Curve { method: method.into(), drawn, x, y: y.to_vec(), ..Curve::default() }
}

fn panel(content: Content, range: Option<[f64; 2]>) -> Panel {
    let (x, y) = (axis("time", "s", None), axis("position", "um", range));
    Panel { title: "horizontal".into(), x, y, content, ..Panel::default() }
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
        Error::Method(youla::Error::Shape { expected: (1, 1), found: (2, 1), .. })
    ));
    let mut cells = map();
    cells.cells.pop();
    assert!(matches!(
        refused(Content::Cells(cells), None),
        Error::Method(youla::Error::Shape { expected: (4, 1), found: (3, 1), .. })
    ));
    assert!(matches!(refused(Content::default(), Some([1.0, 0.0])), Error::Method(youla::Error::OutOfRange { .. })));
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

/// Places of round marks.
fn centres(node: &Node) -> Vec<[f64; 2]> {
    let number = |text: &str| text.parse::<f64>().unwrap();
    let place = |piece: &str| {
        let (start, _) = piece.split_once('a').unwrap();
        let (x, y) = start.split_once(' ').unwrap();
        [number(x) + curves::LARGE, number(y)]
    };
    node.attribute("d").unwrap().split('M').skip(1).map(place).collect()
}

#[test]
fn equal_axes_have_one_scale_in_every_size() {
    let marks = Curve { x: vec![0.0, 1.0, 0.0], ..curve("hansen", Drawn::Marks, &[0.0, 0.0, 1.0]) };
    let equal = Panel { equal: true, ..panel(Content::Curves(vec![marks]), None) };
    for (width_cm, height_cm) in [(17.0, None), (8.5, None), (8.5, Some(5.0)), (6.0, Some(12.0))] {
        let print = Print { width_cm, height_cm, embed_font: false };
        let file = svg_for(&figure(vec![equal.clone()]), &methods(), &print).unwrap();
        let document = Document::parse(&file).unwrap();
        let found = centres(&shapes(&document, "hansen", "marks")[0]);
        let (across, up) = (found[1][0] - found[0][0], found[0][1] - found[2][1]);
        assert!(across > 20.0 && (across - up).abs() < 0.03, "{across} {up} at {width_cm} x {height_cm:?}");
    }
}

#[test]
fn figures_have_the_size_that_is_asked_for_and_their_font() {
    let content = || Content::Curves(vec![curve("hansen", Drawn::Line, &[1.0, 2.0, 3.0])]);
    let three = || figure((0..3).map(|_| panel(content(), None)).collect());
    for (width_cm, height_cm) in [(17.0, Some(20.0)), (8.5, Some(9.0)), (12.25, Some(30.0))] {
        let print = Print { width_cm, height_cm, ..Print::default() };
        let file = svg_for(&three(), &methods(), &print).unwrap();
        let document = Document::parse(&file).unwrap();
        let size =
            |name| document.root_element().attribute(name).unwrap().trim_end_matches("mm").parse::<f64>().unwrap();
        assert_eq!((size("width"), size("height")), (10.0 * width_cm, 10.0 * height_cm.unwrap()));
        assert!(file.contains("@font-face{font-family:'Youla Figures';src:url(data:font/woff2;base64,d09GMg"));
        let sizes: Vec<_> = document.descendants().filter_map(|node| node.attribute("font-size")).collect();
        assert!(!sizes.is_empty() && sizes.iter().all(|size| ["9", "8"].contains(size)), "{sizes:?}");
    }
    let refused = |width_cm, height_cm| {
        svg_for(&three(), &methods(), &Print { width_cm, height_cm, ..Print::default() }).unwrap_err()
    };
    for (width, height) in [(3.0, None), (f64::NAN, None), (17.0, Some(3.0)), (17.0, Some(f64::INFINITY))] {
        assert!(matches!(refused(width, height), Error::Method(youla::Error::OutOfRange { .. })), "{width} {height:?}");
    }
}

#[test]
fn areas_shades_and_lines_stand_behind_the_curves() {
    let region = Area {
        method: "hansen".into(),
        note: "95 %".into(),
        x: vec![0.0, 1.0, 2.0, 3.0, 4.0],
        low: vec![0.0, f64::NAN, 0.5, 0.0, f64::NAN],
        high: vec![1.0, 1.5, f64::NAN, 3.0, 4.0],
    };
    let guide = Guide { x: vec![1.0; 2], y: vec![0.0, 3.0], label: "level".into(), at: [1.0, 2.0], ..Guide::default() };
    let curves = Content::Curves(vec![curve("hansen", Drawn::Line, &[0.5, 1.0, 1.5, 2.0, 2.5])]);
    let drawn_panel = Panel {
        regions: vec![region],
        guides: vec![guide],
        shades: vec![[2.0, 9.0], [5.0, 4.0]],
        ..panel(curves, Some([-1.0, 3.5]))
    };
    let file = drawn(&figure(vec![drawn_panel.clone()]));
    let document = Document::parse(&file).unwrap();
    assert_eq!(pieces(&shapes(&document, "hansen", "region")[0]), 2);
    assert!(texts(&document).contains(&"level") && texts(&document).contains(&"Hansen G(S), 95 %"));
    assert_eq!(document.descendants().filter(|node| node.attribute("fill") == Some("#eef2f6")).count(), 1);
    let places = |kind: &str| file.find(&format!("data-kind=\"{kind}\"")).unwrap();
    assert!(places("region") < places("line"));
    let mut short = drawn_panel;
    short.regions[0].low.pop();
    assert!(matches!(
        svg(&figure(vec![short]), &methods()),
        Err(Error::Method(youla::Error::Shape { expected: (5, 1), found: (4, 1), .. }))
    ));
}
