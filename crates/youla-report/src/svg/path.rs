//! Paths of a drawing and the numbers in them, in hundredths of a point.

use std::fmt::Write;

/// A path, written by differences of rounded places, so that rounding does not add up.
#[derive(Debug, Default)]
pub(super) struct Path {
    data: String,
    at: (i64, i64),
    start: (i64, i64),
}

impl Path {
    /// The path as text.
    pub(super) fn data(&self) -> &str {
        &self.data
    }

    /// Starts a new piece.
    pub(super) fn move_to(&mut self, point: (f64, f64)) {
        self.at = rounded(point);
        self.start = self.at;
        self.put('M', self.at);
    }

    /// Draws on; a step that rounds to nothing is left out.
    pub(super) fn line_to(&mut self, point: (f64, f64)) {
        let to = rounded(point);
        let step = (to.0 - self.at.0, to.1 - self.at.1);
        if step != (0, 0) {
            self.put('l', step);
            self.at = to;
        }
    }

    /// Closes the piece.
    pub(super) fn close(&mut self) {
        self.data.push('z');
        self.at = self.start;
    }

    /// A closed polygon.
    pub(super) fn polygon(&mut self, points: impl IntoIterator<Item = (f64, f64)>) {
        let mut points = points.into_iter();
        if let Some(first) = points.next() {
            self.move_to(first);
            points.for_each(|point| self.line_to(point));
            self.close();
        }
    }

    /// A circle.
    pub(super) fn circle(&mut self, (x, y): (f64, f64), radius: f64) {
        self.move_to((x - radius, y));
        let r = number(hundredths(radius));
        let d = number(2 * hundredths(radius));
        // Writing to a string does not fail.
        let _ = write!(self.data, "a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0-{d} 0z");
    }

    fn put(&mut self, command: char, (x, y): (i64, i64)) {
        self.data.push(command);
        self.data.push_str(&number(x));
        if y >= 0 {
            self.data.push(' ');
        }
        self.data.push_str(&number(y));
    }
}

fn rounded((x, y): (f64, f64)) -> (i64, i64) {
    (hundredths(x), hundredths(y))
}

pub(super) fn hundredths(value: f64) -> i64 {
    (value * 100.0).round() as i64
}

pub(super) fn place(value: f64) -> String {
    number(hundredths(value))
}

/// A number of hundredths without zeros at its end.
pub(super) fn number(hundredths: i64) -> String {
    let sign = if hundredths < 0 { "-" } else { "" };
    let (whole, rest) = (hundredths.unsigned_abs() / 100, hundredths.unsigned_abs() % 100);
    match (rest, rest % 10) {
        (0, _) => format!("{sign}{whole}"),
        (_, 0) => format!("{sign}{whole}.{}", rest / 10),
        _ => format!("{sign}{whole}.{rest:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [(0.0, "0"), (-0.004, "0"), (1.5, "1.5"), (-0.05, "-0.05"), (12.0, "12")] {
            assert_eq!(place(value), text);
        }
    }

    #[test]
    fn rounding_does_not_add_up_along_a_path() {
        let mut path = Path::default();
        path.move_to((0.0, 0.0));
        (1..=1000).for_each(|k| path.line_to((k as f64 * 0.013, 1.0)));
        assert_eq!(path.at, (1300, 100));
    }
}
