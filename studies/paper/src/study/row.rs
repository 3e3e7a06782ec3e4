//! One line of a results file: one nominal model by one method, with a check of its own.

use super::method::StudyMethod;
use hmac_sha256::Hash;

/// What became of an identification.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// A stable model.
    Stable,
    /// An unstable model.
    Unstable,
    /// No model; the reason is beside.
    Refused,
    /// No loop: no weight of the command stabilises nominal model and plant with the margin.
    NoController,
}

impl RowStatus {
    const ALL: [(RowStatus, &'static str); 4] = [
        (RowStatus::Stable, "stable"),
        (RowStatus::Unstable, "unstable"),
        (RowStatus::Refused, "refused"),
        (RowStatus::NoController, "no-controller"),
    ];

    /// The status with this word.
    fn of_word(word: &str) -> Option<RowStatus> {
        RowStatus::ALL.iter().find(|(_, known)| *known == word).map(|(status, _)| *status)
    }

    fn word(self) -> &'static str {
        RowStatus::ALL.iter().find(|(status, _)| *status == self).map_or("", |(_, word)| word)
    }
}

/// The result of one method on one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRow {
    /// Number of the loop, from 0.
    pub item: usize,
    /// Degradation of the nominal model, eq. (27).
    pub theta: f64,
    /// Output noise, um rms.
    pub noise: f64,
    /// Weight of the command in the design of the controller, per V^2.
    pub command_weight: f64,
    /// Peak of the output sensitivity with the nominal model.
    pub peak_nominal: f64,
    /// Peak of the output sensitivity with the true plant.
    pub peak_plant: f64,
    /// The method.
    pub method: StudyMethod,
    /// What became of it.
    pub status: RowStatus,
    /// Fit (26) on the noise-free record, percent, horizontal and vertical; NaN without a model, minus infinity where the
    /// model's output leaves the range of the numbers.
    pub fit: [f64; 2],
    /// Steps of a search.
    pub steps: Option<usize>,
    /// Why there is no model, or what was done to one.
    pub note: String,
}

impl StudyRow {
    /// The first line of a results file.
    pub const HEADER: &str = "item,theta,noise_um,command_weight,peak_nominal,peak_plant,method,status,\
                              fit_horizontal,fit_vertical,steps,note,check";

    /// The fit of the worse axis.
    pub fn worse_fit(&self) -> f64 {
        self.fit[0].min(self.fit[1])
    }

    /// The line of the file, without its end. Numbers are written such that they read back bit by bit; `check` is the
    /// beginning of the SHA-256 of what is before it.
    pub fn line(&self) -> String {
        let text = format!(
            "{},{},{},{},{},{},{},{},{},{},{},{}",
            self.item,
            self.theta,
            self.noise,
            self.command_weight,
            self.peak_nominal,
            self.peak_plant,
            self.method.key(),
            self.status.word(),
            self.fit[0],
            self.fit[1],
            self.steps.map_or_else(String::new, |steps| steps.to_string()),
            in_one_field(&self.note),
        );
        checked(text)
    }

    /// Reads a line; `None` where it is damaged.
    pub fn parse(line: &str) -> Option<StudyRow> {
        let fields: Vec<&str> = unchecked(line)?.split(',').collect();
        let [item, theta, noise, weight, peak_nominal, peak_plant, method, status, h, v, steps, note] =
            fields.as_slice().try_into().ok()?;
        Some(StudyRow {
            item: str::parse(item).ok()?,
            theta: str::parse(theta).ok()?,
            noise: str::parse(noise).ok()?,
            command_weight: str::parse(weight).ok()?,
            peak_nominal: str::parse(peak_nominal).ok()?,
            peak_plant: str::parse(peak_plant).ok()?,
            method: StudyMethod::of_key(method)?,
            status: RowStatus::of_word(status)?,
            fit: [str::parse(h).ok()?, str::parse(v).ok()?],
            steps: if steps.is_empty() { None } else { Some(str::parse(steps).ok()?) },
            note: str::to_owned(note),
        })
    }
}

/// A note without what would end its field.
fn in_one_field(note: &str) -> String {
    note.chars().map(|c| if c == ',' || c.is_control() { ';' } else { c }).collect()
}

/// A line with its check behind it.
fn checked(text: String) -> String {
    let check = check(&text);
    format!("{text},{check}")
}

/// What is before the check, where that is right.
fn unchecked(line: &str) -> Option<&str> {
    let (text, found) = line.rsplit_once(',')?;
    (check(text) == found).then_some(text)
}

fn check(text: &str) -> String {
    Hash::hash(text.as_bytes()).iter().take(4).map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> StudyRow {
        StudyRow {
            item: 7,
            theta: 0.1 + 0.2,
            noise: 0.2,
            command_weight: 1e9,
            peak_nominal: 1.5,
            peak_plant: f64::INFINITY,
            method: StudyMethod::Pem,
            status: RowStatus::Unstable,
            fit: [f64::NEG_INFINITY, -1.0 / 3.0],
            steps: Some(25),
            note: "a, b\nc".into(),
        }
    }

    #[test]
    fn a_line_reads_back_bit_by_bit() {
        let expected = StudyRow { note: "a; b;c".into(), ..row() };
        assert_eq!(StudyRow::parse(&row().line()), Some(expected));
        assert_eq!(row().line().split(',').count(), StudyRow::HEADER.split(',').count());
    }

    #[test]
    fn any_change_of_a_character_is_seen() {
        let line = row().line();
        for at in 0..line.len() {
            let mut bytes = line.clone().into_bytes();
            bytes[at] = if bytes[at] == b'7' { b'8' } else { b'7' };
            assert_eq!(StudyRow::parse(&String::from_utf8(bytes).unwrap()), None, "character {at}");
            assert_eq!(StudyRow::parse(&line[..at]), None);
        }
    }
}
