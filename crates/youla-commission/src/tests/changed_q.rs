//! A campaign whose files were changed after it.

use super::{Campaign, ErrorKind, Place};
use std::path::Path;

/// A Q that is not stable, beside the evidence of the one that was verified.
pub(super) fn is_refused(place: &Place, campaign: &Campaign) {
    let folder = place.0.join("out/0 rpm");
    let (q_file, point_file) = (folder.join("q.json"), folder.join("point.json"));
    let edit = |path: &Path, change: &dyn Fn(&mut serde_json::Value)| {
        let mut value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        change(&mut value);
        std::fs::write(path, value.to_string()).unwrap();
    };
    std::fs::remove_file(place.0.join("out/q_table.json")).unwrap();
    edit(&q_file, &|q| q["q"]["a"][0][0] = 5.0.into());
    let refused = place.run(campaign, "out", true).0.unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::BadInput);
    assert!(refused.to_string().contains("q.json: this is not the Q that was verified"), "{refused}");
    // With a checksum that fits, the evidence does not.
    let checksum = crate::record::checksum_of(&q_file).unwrap();
    edit(&point_file, &|point| point["q_checksum"] = checksum.into());
    let refused = place.run(campaign, "out", true).0.unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::BadInput);
    assert!(refused.to_string().contains("between.json: "), "{refused}");
    assert!(!place.0.join("out/q_table.json").exists());
}
