//! SVG as pixels, and with its texts as outlines, by the font of the figures alone: the fonts of the system do not matter.

use crate::output::Failure;
use resvg::usvg::{Options, Tree, WriteOptions};
use resvg::{render, tiny_skia};
use std::path::Path;
use youla_report::FIGURE_FONT;

const FAMILY: &str = "Youla Figures";
/// About 800 MB of memory.
const MOST_PIXELS: f64 = 2e8;

/// Draws an SVG file with this many pixels per inch.
pub(crate) fn drawn(svg: &str, dpi: u32) -> Result<Vec<u8>, Failure> {
    let tree = tree(svg, dpi as f32).ok_or_else(|| broken("it cannot be read"))?;
    let (width, height) = (tree.size().width().round(), tree.size().height().round());
    let pixels = f64::from(width) * f64::from(height);
    if pixels > MOST_PIXELS {
        let (what, must) = ("the number of pixels of a figure".into(), "at most 2e8");
        return Err(youla::Error::OutOfRange { what, value: pixels, must }.into());
    }
    let mut pixmap = tiny_skia::Pixmap::new(width as u32, height as u32).ok_or_else(|| broken("it has no size"))?;
    pixmap.fill(tiny_skia::Color::WHITE);
    let scale = (width / tree.size().width(), height / tree.size().height());
    render(&tree, tiny_skia::Transform::from_scale(scale.0, scale.1), &mut pixmap.as_mut());
    encoded(&pixmap, dpi).map_err(|error| broken(&error.to_string()))
}

/// The same drawing with its texts as outlines.
pub(crate) fn outlined(svg: &str) -> Result<String, Failure> {
    // The unit of SVG, which is what a length without one means.
    let tree = tree(svg, 96.0).ok_or_else(|| broken("it cannot be read"))?;
    let options = WriteOptions { coordinates_precision: 3, transforms_precision: 5, ..WriteOptions::default() };
    Ok(tree.to_string(&options))
}

fn tree(svg: &str, dpi: f32) -> Option<Tree> {
    let mut options = Options { dpi, font_family: FAMILY.into(), ..Options::default() };
    options.fontdb_mut().load_font_data(FIGURE_FONT.to_vec());
    Tree::from_str(svg, &options).ok()
}

/// As opaque colours, with the size on paper.
fn encoded(pixmap: &tiny_skia::Pixmap, dpi: u32) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixmap.width(), pixmap.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let per_metre = (f64::from(dpi) / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }));
    let mut writer = encoder.write_header()?;
    let colours: Vec<u8> = pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    writer.write_image_data(&colours)?;
    writer.finish()?;
    Ok(bytes)
}

fn broken(problem: &str) -> Failure {
    Failure::io(Path::new("a figure"), std::io::Error::other(problem.to_owned()))
}
