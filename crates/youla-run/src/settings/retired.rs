//! Keys of earlier versions with their tables, and what to write instead.

use toml::de::{DeTable, DeValue};

/// Tables that held the key, the key (with a dot where it was a table and is none now), and what to do instead.
const RETIRED: [(&str, &str, &str); 23] = [
    ("", "stabilisation deviation", "it was removed; leave the table out"),
    ("hansen direct", "uncertainty", "the intervals are those of the recommended model; leave the table out"),
    ("data", "time_tolerance", "a time step may deviate by 0.1 % of the sample time; leave the key out"),
    ("nominal", "bearing", "give the matrices of the model in [nominal.state_space]"),
    ("nominal controller", "mat_file", "write `model_file`"),
    ("factors", "construction", "the program chooses the construction of the factors; leave the key out"),
    ("factors", "output_noise", "it belonged to construction = \"shifted\"; leave the key out"),
    ("hansen direct", "weight", "write `method`"),
    ("hansen direct", "factorisation", "the program chooses it by the condition of the data; leave the key out"),
    ("hansen direct", "scaling", "channels are scaled by their rms; leave the key out"),
    ("hansen direct", "initial_state", "that of each experiment is estimated; leave the key out"),
    ("certificate redesign", "band", "500 models are drawn with a fixed seed; leave the key out"),
    ("certificate", "gain_error", "a gain error of 5 % is tried; leave the key out"),
    ("certificate", "saturation", "a limit of 90 % of the largest u is tried; leave the key out"),
    ("frequency_response", "overlap", "windows overlap by half; leave the key out"),
    ("frequency_response", "points", "curves have 400 points and more at lightly damped modes; leave the key out"),
    ("redesign", "small_gain", "the small-gain product may reach 0.9; leave the key out"),
    ("redesign", "output_noise", "the observer assumes a covariance ratio of 0.1; leave the key out"),
    ("reduction", "minimality", "Hankel singular values below 1e-12 of the largest count as zero; leave the key out"),
    ("reduction", "output_scale input_scale", "the program chooses the scales of the channels; leave the key out"),
    ("grey_box", "start_from_initial", "the initial values are always a second start; leave the key out"),
    ("grey_box", "pem", "write its `noise` and `delays` in [grey_box]; the program chooses the rest of it"),
    ("grey_box", "intervals", "their level is 95 %; the program tests the colour of the residuals"),
];

/// The first key of an earlier version: its position, and a sentence. The top level of the text is the table `at` of run.toml.
pub(super) fn retired(text: &str, at: &str) -> Option<(usize, String)> {
    search(DeTable::parse(text).ok()?.get_ref(), at)
}

fn search(table: &DeTable<'_>, at: &str) -> Option<(usize, String)> {
    table.iter().find_map(|(key, value)| {
        let name = key.get_ref();
        if let Some(instead) = instead(at, name, value.get_ref()) {
            let of = if at.is_empty() { "the top level".to_owned() } else { format!("[{at}]") };
            return Some((key.span().start, format!("`{name}` is no longer a key of {of}: {instead}")));
        }
        let DeValue::Table(inner) = value.get_ref() else { return None };
        search(inner, &if at.is_empty() { name.to_string() } else { format!("{at}.{name}") })
    })
}

fn instead(at: &str, name: &str, value: &DeValue<'_>) -> Option<&'static str> {
    let named = |keys: &str| {
        keys.split(' ').any(|key| match key.strip_suffix('.') {
            Some(key) => key == name && matches!(value, DeValue::Table(_)),
            None => key == name,
        })
    };
    let (.., instead) = RETIRED.iter().find(|(tables, keys, _)| tables.split(' ').any(|t| t == at) && named(keys))?;
    Some(*instead)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_retired_key_is_refused() {
        for (tables, keys, instead) in RETIRED {
            for (table, key) in tables.split(' ').flat_map(|t| keys.split(' ').map(move |k| (t, k))) {
                let header = if table.is_empty() { String::new() } else { format!("[{table}]\n") };
                let text = format!("{header}{} = {{}}\n", key.trim_end_matches('.'));
                let (start, sentence) = retired(&text, "").unwrap();
                assert!(start == header.len() && sentence.ends_with(instead), "{text}{sentence}");
            }
        }
        assert!(retired("weight = 1", "direct").is_some());
    }
}
