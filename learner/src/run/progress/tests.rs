use std::cell::RefCell;

use super::*;

/// Keeps what it is shown.
impl Display for &RefCell<Vec<Status>> {
    fn show(&mut self, status: &Status) {
        self.borrow_mut().push(status.clone());
    }
    fn warn(&mut self, line: String) {
        panic!("{line}");
    }
    fn close(&mut self) {}
}

#[test]
fn the_end_is_shown_once_with_the_latest_rates_and_again_only_for_another_validation() {
    let place = tempfile::tempdir().unwrap();
    let config = Config::read_with(Path::new("default"), &["steps=100000".to_owned()]).unwrap();
    let metrics = MetricsFile::create(place.path().join("metrics.csv")).unwrap();
    let shown = RefCell::default();
    let mut progress = Progress::new(&config, metrics, Box::new(&shown));
    progress.stepped(100_000);
    progress.updated(50);
    progress.show();
    progress.finish(0.0).unwrap();
    assert_eq!(shown.borrow().len(), 1);
    progress.show_validation(0.5, 0.75);
    progress.finish(0.0).unwrap();
    let shown = shown.borrow();
    let [first, last] = &shown[..] else { panic!("{shown:?}") };
    assert!(0.0 < first.steps_per_second && 0.0 < first.updates_per_second, "{first:?}");
    assert_eq!(*last, Status { validation: Some((0.5, 0.75)), ..first.clone() });
}
