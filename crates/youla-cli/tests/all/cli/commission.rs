//! `youla commission`: exit codes; the circle itself is tested in its crate.

use crate::common::{empty_folder, youla};
use std::fs;
use std::path::Path;

#[test]
fn nobody_confirms_without_a_terminal() {
    let folder = empty_folder("commission");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/commission");
    fs::copy(example.join("weak.toml"), folder.join("weak.toml")).expect("copied");
    let text = fs::read_to_string(example.join("campaign.toml")).expect("readable");
    let (head, _) = text.split_once("\n[[points]]\nname = \"1250 rpm\"").expect("a second point");
    let one = head.replace("duration = 24.0", "duration = 3.0").replace("image = ", "# image = ");
    fs::write(folder.join("campaign.toml"), one).expect("written");

    let stopped = youla(&folder, &["commission", "campaign.toml", "--out", "out", "--json"]);
    assert_eq!((stopped.code, stopped.stderr.as_str()), (Some(1), ""));
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.join("out/summary.json")).expect("written")).expect("JSON");
    let first = &summary["points"][0];
    assert_eq!((first["status"].as_str(), first["switches"].as_u64()), (Some("stopped"), Some(0)));
    assert_eq!(first["reason"], "the switch was not confirmed");
    assert_eq!((summary["controller"].as_str(), summary["unstable_switches"].as_u64()), (Some("host"), Some(0)));
    assert!(summary["damping"]["predicted"][0].as_f64() > summary["damping"]["before"].as_f64(), "{summary}");

    let missing = youla(&folder, &["commission", "none.toml", "--out", "other"]);
    assert!(missing.code == Some(2) && missing.stderr.contains("none.toml"), "{}", missing.stderr);
}
