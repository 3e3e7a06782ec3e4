//! What a results folder holds.

use super::small::whole;
use std::fs;
use youla_paper::study::{PaperSettings, StudyMethod, StudyRow};

#[test]
fn no_model_is_lost() {
    for (file, loops) in [("study.csv", 5), ("crossover.csv", 4)] {
        let text = fs::read_to_string(whole().join(file)).expect("readable");
        let rows: Vec<StudyRow> = text.lines().skip(1).map(|line| StudyRow::parse(line).expect("a row")).collect();
        for method in PaperSettings::shipped().compared() {
            let items: Vec<usize> = rows.iter().filter(|r| r.method == method).map(|r| r.item).collect();
            assert_eq!(items, (0..loops).collect::<Vec<_>>(), "{file}, {method:?}");
        }
        assert!(!rows.iter().any(|r| r.method != StudyMethod::Nominal && r.fit[0] > 100.0), "{file}");
    }
}

#[test]
fn every_figure_is_there_three_times() {
    let page = fs::read_to_string(whole().join("report.html")).expect("readable");
    for figure in 4..=10 {
        let key = format!("figure-{figure}");
        for ending in ["svg", "csv"] {
            let file = format!("figures/{key}.{ending}");
            assert!(fs::metadata(whole().join(&file)).is_ok_and(|m| m.len() > 100), "{file}");
            assert!(page.contains(&file), "{file}");
        }
    }
    assert!(page.contains("Table 1") && !page.contains("http://") && page.len() < 5_000_000);
}
