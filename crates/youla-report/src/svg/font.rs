//! The one font of all figures, and how wide its characters are.
//!
//! It stands in each SVG file, so that a figure looks the same everywhere. It is a subset of Source Sans 3 without kerning; see
//! `assets/font`.

use std::sync::OnceLock;

const EMBEDDED: &[u8] = include_bytes!("../../assets/font/figures.woff2");
const WIDTHS: &str = include_str!("../../assets/font/widths.txt");

/// Faces in the order in which they are looked for.
pub(super) const FACES: &str = "'Youla Figures', 'Source Sans 3', Helvetica, Arial, 'Liberation Sans', sans-serif";

/// A style sheet with the font in it.
pub(super) fn embedded() -> &'static str {
    static STYLE: OnceLock<String> = OnceLock::new();
    STYLE.get_or_init(|| {
        let data = base64(EMBEDDED);
        format!("@font-face{{font-family:'Youla Figures';src:url(data:font/woff2;base64,{data}) format('woff2')}}")
    })
}

/// Width of a character over the size of the text; that of a wide one where the font does not have it.
pub(super) fn em(c: char) -> f64 {
    const UNKNOWN: f64 = 0.65;
    static TABLE: OnceLock<Vec<(u32, f64)>> = OnceLock::new();
    let table = TABLE.get_or_init(|| WIDTHS.lines().filter_map(entry).collect());
    let found = table.binary_search_by_key(&u32::from(c), |(code, _)| *code);
    found.map_or(UNKNOWN, |place| table[place].1)
}

fn entry(line: &str) -> Option<(u32, f64)> {
    let (code, width) = line.split_once(' ')?;
    Some((u32::from_str_radix(code, 16).ok()?, width.parse::<f64>().ok()? / 1000.0))
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let four = |three: &[u8]| {
        let bits = (0..3).fold(0, |bits, k| bits << 8 | usize::from(three.get(k).copied().unwrap_or(0)));
        (0..4).map(move |k| (k, bits >> (18 - 6 * k) & 63)).collect::<Vec<_>>()
    };
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        text.extend(
            four(three).iter().map(|&(k, digit)| if k > three.len() { '=' } else { char::from(DIGITS[digit]) }),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_standard() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn widths_are_those_of_the_font() {
        // Widths of Source Sans 3, regular.
        for (c, width) in [('0', 0.497), ('9', 0.497), ('\u{2212}', 0.497), ('W', 0.786), (' ', 0.2)] {
            assert_eq!(em(c), width, "{c}");
        }
        assert!("αβγζµ°×⁻⁹ₙ²≤łčЖ".chars().filter(|c| em(*c) == 0.65).count() <= 1);
        assert_eq!(WIDTHS.lines().filter_map(entry).count(), WIDTHS.lines().count());
        assert!(EMBEDDED.len() < 30_000, "{} bytes", EMBEDDED.len());
    }
}
