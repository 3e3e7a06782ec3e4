//! Stories as files: every section, table and figure is there, nothing else is fetched.

use serde_json::Value;
use youla_report::data::DrawnMethod;
use youla_report::figure::*;
use youla_report::story::*;
use youla_report::{Story, story_html};

use super::{FIVE_MEGABYTES, embedded};

fn written(name: &str, story: &Story) -> String {
    let page = story_html(story).unwrap();
    std::fs::write(format!("{}/{name}.html", env!("CARGO_TARGET_TMPDIR")), &page).unwrap();
    page
}

fn page_data(page: &str) -> Value {
    let start = "<script type=\"application/json\" id=\"report-data\">";
    serde_json::from_str(page.split_once(start).unwrap().1.split_once("</script>").unwrap().0).unwrap()
}

fn axis(label: &str, unit: &str, range: Option<[f64; 2]>) -> Axis {
    Axis { label: label.into(), unit: unit.into(), range, ..Axis::default() }
}

fn panel(title: &str, y: Axis, content: Content) -> Panel {
    Panel { title: title.into(), x: axis("time", "s", Some([0.4, 0.6])), y, content, ..Panel::default() }
}

fn figure(key: &str, layout: Layout, panels: Vec<Panel>) -> Block {
    let (title, caption) = (format!("Figure {key}"), format!("What {key} shows."));
    Block::Figure(Figure { key: key.into(), title, caption, layout, panels, ..Figure::default() })
}

fn curve(method: &str, drawn: Drawn, samples: usize) -> Curve {
    let (x, y) = (0..samples).map(|k| (k as f64 * 2e-4, 90.0 - 0.3 * (k % 400) as f64)).unzip();
    Curve { method: method.into(), drawn, x, y, ..Curve::default() }
}

/// Two panels of five long lines.
fn record(key: &str) -> Block {
    let methods = [MEASURED, "nominal", "pem", "direct", "hansen"];
    let lines = || Content::Curves(methods.map(|method| curve(method, Drawn::Line, 10_000)).into());
    let displacement = || axis("displacement", "um", None);
    let panels = vec![panel("horizontal", displacement(), lines()), panel("vertical", displacement(), lines())];
    figure(key, Layout::Stacked, panels)
}

fn cloud() -> Block {
    let mut points = curve("pem_multi_start", Drawn::Points, 500);
    points.y[17] = f64::NAN;
    let fit = axis("fit", "%", Some([-20.0, 100.0]));
    figure("cloud", Layout::Stacked, vec![panel("horizontal", fit, Content::Curves(vec![points]))])
}

fn boxes() -> Block {
    let sample = |method: &str| Sample {
        method: method.into(),
        note: "run 2".into(),
        values: vec![81.5, f64::NAN, 83.25, -400.0, 82.0],
    };
    let fit = || axis("fit", "%", Some([-20.0, 100.0]));
    let content = || Content::Boxes(vec![sample("direct"), sample("hansen")]);
    figure("boxes", Layout::Beside, vec![panel("horizontal", fit(), content()), panel("vertical", fit(), content())])
}

fn cells() -> Block {
    let cell = |method: &str, text: &str| Cell {
        method: method.into(),
        strength: 0.5,
        text: text.into(),
        detail: "median of 12 models".into(),
    };
    let map = Cells {
        columns: vec!["0.1".into(), "1".into()],
        rows: vec!["short".into(), "long".into()],
        cells: vec![cell("pem", "-3"), cell("hansen", "+12"), cell("", "0"), cell("hansen_reduced", "+7")],
    };
    figure("cells", Layout::Beside, vec![panel("", axis("length", "", None), Content::Cells(map))])
}

fn table() -> Table {
    let row =
        |method: &str, cells: [&str; 3]| TableRow { method: method.into(), cells: cells.map(String::from).into() };
    Table {
        key: "fits".into(),
        title: "Table 1".into(),
        caption: "Fit in percent.".into(),
        groups: vec![(String::new(), 1), ("A times 0.5".into(), 2)],
        header: vec!["method".into(), "horizontal axis".into(), "vertical axis".into()],
        rows: vec![row("pem", ["prediction error", "48.9", "none"]), row("", ["the paper", "-3.25", "39.5"])],
    }
}

fn story() -> Story {
    let section = |key: &str, blocks| Section {
        key: key.into(),
        title: format!("All about {key}"),
        short: format!("on {key}"),
        blocks,
    };
    Story {
        title: "The gas bearing".into(),
        summary: "What came out.".into(),
        program: "youla 0.2.0".into(),
        methods: vec![
            DrawnMethod::nominal(),
            DrawnMethod::pem(),
            DrawnMethod::pem_multi_start(),
            DrawnMethod::direct(),
            DrawnMethod::hansen(),
            DrawnMethod::hansen_reduced(),
        ],
        sections: vec![
            section(
                "rig",
                vec![Block::Text("A shaft on air.".into()), Block::List(vec!["one disc".into(), "two sensors".into()])],
            ),
            section("study", vec![cloud(), boxes(), cells()]),
            section("experiments", vec![Block::Table(table()), record("record")]),
            section(
                "settings",
                vec![Block::Listing { title: "Settings as TOML".into(), text: "[study]\nmodels = 500".into() }],
            ),
        ],
    }
}

#[test]
fn every_part_of_a_story_is_on_its_page() {
    let page = written("story", &story());
    for part in ["rig", "study", "experiments", "settings"] {
        for text in [
            format!("<a href=\"#{part}\">on {part}</a>"),
            format!("<section id=\"{part}\""),
            format!("<h2 id=\"{part}-title\">All about {part}</h2>"),
        ] {
            assert!(page.contains(&text), "{text} is missing");
        }
    }
    for key in ["cloud", "boxes", "cells", "record"] {
        for text in [
            format!("<figure id=\"{key}\">"),
            format!("data-figure=\"{key}\""),
            format!("What {key} shows."),
            format!("<a href=\"figures/{key}.svg\">SVG</a><a href=\"figures/{key}.csv\">CSV</a>"),
        ] {
            assert!(page.contains(&text), "{text} is missing");
        }
    }
    for text in [
        "<p>A shaft on air.</p>",
        "<li>two sensors</li>",
        "<summary>Settings as TOML</summary>",
        "[study]\nmodels = 500</pre>",
        "<li><span class=\"swatch\" data-swatch=\"pem_multi_start\"></span>PEM, several starts</li>",
    ] {
        assert!(page.contains(text), "{text} is missing");
    }
}

#[test]
fn tables_have_groups_swatches_and_numbers_to_the_right() {
    let page = story_html(&story()).unwrap();
    for text in [
        "<figure class=\"table\" id=\"fits\">",
        "<a href=\"tables/fits.csv\">CSV</a>",
        "<th scope=\"colgroup\" class=\"group\" colspan=\"2\"><span>A times 0.5</span></th>",
        "<th scope=\"col\">method</th><th scope=\"col\" class=\"number\">horizontal axis</th>",
        "<th scope=\"row\"><span class=\"method\"><span class=\"swatch\" data-swatch=\"pem\"></span>prediction error</span></th>",
        "<th scope=\"row\">the paper</th>",
        "<td class=\"number\">48.9</td>",
        "<td class=\"number\">none</td>",
        "<td class=\"number\">\u{2212}3.25</td>",
        "<td class=\"number\">39.5</td>",
        "<strong>Table 1.</strong> Fit in percent.",
    ] {
        assert!(page.contains(text), "{text} is missing");
    }
}

#[test]
fn figures_read_back_from_the_page() {
    let figures = embedded(&story_html(&story()).unwrap());
    assert_eq!(
        figures.iter().map(|figure| figure.key.as_str()).collect::<Vec<_>>(),
        ["cloud", "boxes", "cells", "record"]
    );
    let Content::Curves(curves) = &figures[0].panels[0].content else { panic!("{:?}", figures[0]) };
    assert_eq!((curves[0].y.len(), curves[0].y[16], curves[0].y[17].is_nan()), (500, 85.2, true));
    let Content::Boxes(samples) = &figures[1].panels[1].content else { panic!("{:?}", figures[1]) };
    assert_eq!((samples[1].values[3], samples[1].values[1].is_nan()), (-400.0, true));
    let Block::Figure(map) = cells() else { unreachable!() };
    assert_eq!(figures[2], map);
}

#[test]
fn twelve_long_records_stay_within_five_megabytes() {
    let mut story = story();
    story.sections[1].blocks = (0..12).map(|k| record(&format!("record-{k}"))).collect();
    let page = written("story-long", &story);
    assert!(page.len() < FIVE_MEGABYTES, "{} bytes", page.len());
    assert_eq!(page.matches("minimum and maximum of small groups").count(), 13);
    for figure in embedded(&page) {
        let Content::Curves(curves) = &figure.panels[1].content else { panic!("{figure:?}") };
        for curve in curves {
            let first_view = curve.x.iter().filter(|x| (0.4..=0.6).contains(*x)).count();
            assert_eq!((first_view, curve.x[0], curve.x.last()), (1001, 0.0, Some(&1.9998)));
        }
    }
}

#[test]
fn text_of_a_story_cannot_leave_its_place() {
    let evil = "</script><!--<script>alert(1)</script>\"'>";
    let mut story = story();
    story.title = evil.into();
    story.methods[1].label = evil.into();
    story.sections[0].key = evil.into();
    story.sections[0].blocks.push(Block::Listing { title: evil.into(), text: evil.into() });
    let mut hostile = table();
    (hostile.key, hostile.header[1], hostile.rows[0].method) = (evil.into(), evil.into(), evil.into());
    hostile.rows[0].cells[1] = evil.into();
    story.sections[0].blocks.push(Block::Table(hostile));
    if let Block::Figure(figure) = &mut story.sections[1].blocks[0] {
        (figure.key, figure.caption, figure.panels[0].title) = (evil.into(), evil.into(), evil.into());
    }
    let page = written("story-hostile", &story);
    assert!(!page.contains("alert(1)</script>") && !page.contains("<!--"));
    assert!(!page.split("<script type").next().unwrap().contains("\"'>"), "an attribute ends early");
    assert_eq!(page.matches("</script>").count(), 3);
    assert_eq!(embedded(&page)[0].panels[0].title, evil);
}

#[test]
fn a_story_asks_for_nothing() {
    let page = story_html(&story()).unwrap();
    assert!(page.contains("default-src 'none'"));
    for fetch in ["src=", "@import", "url(http", "fetch(", "XMLHttpRequest", "<link rel=\"stylesheet\"", "href=\"http"]
    {
        assert!(!page.contains(fetch), "{fetch}");
    }
}

#[test]
fn parts_without_a_key_have_no_files() {
    let mut story = Story { sections: vec![Section::default()], ..Story::default() };
    story.sections[0].blocks = vec![Block::Figure(Figure::default()), Block::Table(Table::default())];
    let page = written("story-empty", &story);
    assert!(!page.contains(".svg\"") && !page.contains(".csv\"") && !page.contains("class=\"key\""));
}

#[test]
fn every_role_has_a_colour_on_light_and_dark_paper() {
    let page = story_html(&story()).unwrap();
    let data = page_data(&page);
    let styles = &data["styles"];
    for method in story().methods {
        let role = serde_json::to_value(method.role).unwrap();
        let colour = format!("--{}", role.as_str().unwrap().replace('_', "-"));
        assert_eq!(styles[&method.key]["colour"], *colour);
        assert_eq!(page.matches(&format!(" {colour}: #")).count(), 2, "{colour}");
    }
}
