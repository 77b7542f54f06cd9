use super::*;
use crate::scenario::Scenario;

fn member(name: &str, share: f64, loads: &[(&str, f64)]) -> Member {
    let vehicle = Vehicle::named(name).unwrap();
    Member {
        name: name.to_owned(),
        vehicle,
        share,
        loads: loads.iter().map(|&(load, share)| (load.to_owned(), share)).collect(),
        drawn: true,
    }
}

fn fleet(draw: Ranges) -> Fleet {
    let members = Vec::from([
        member("daf_xf", 2.0, &[("empty", 1.0), ("laden", 1.0)]),
        member("eu_4x2_13m6", 1.0, &[("laden", 1.0)]),
    ]);
    Fleet { members, draw, n_vehicles: 300 }
}

fn counts(fleet: &Fleet) -> Vec<usize> {
    let table = fleet.table();
    (0..fleet.classes().len()).map(|class| table.iter().filter(|entry| entry.class == class).count()).collect()
}

#[test]
fn a_table_has_every_class_by_its_share() {
    assert_eq!(counts(&fleet(Ranges { slip: Some([0.9, 1.1]), ..Ranges::default() })), [100, 100, 100]);
    // Without ranges three rows give the shares.
    assert_eq!(counts(&fleet(Ranges::default())), [1, 1, 1]);
    let names: Vec<String> =
        fleet(Ranges::default()).classes().into_iter().map(|class| class.vehicle + " " + &class.load).collect();
    assert_eq!(names, ["daf_xf empty", "daf_xf laden", "eu_4x2_13m6 laden"]);
}

#[test]
fn a_row_lies_in_every_range_and_another_range_does_not_shift_it() {
    let ranges = Ranges {
        trailer_wheelbase: Some([-0.5, 0.4]),
        friction: Some([0.6, 1.1]),
        drive_lag: Some([0.3, 0.6]),
        ..Ranges::default()
    };
    let table = fleet(ranges.clone()).table();
    let lengths: Vec<f64> = table.iter().map(|entry| entry.vehicle.trailer.wheelbase).collect();
    let of_daf = &lengths[..200];
    assert!(of_daf.iter().all(|length| (7.256..=8.156).contains(length)));
    let mean = of_daf.iter().sum::<f64>() / 200.0;
    assert!((mean - 7.706).abs() < 0.06, "{mean}");
    for entry in &table {
        let Vehicle { tractor, trailer, model, .. } = &entry.vehicle;
        assert!((0.42..=0.77).contains(&tractor.friction) && (0.3..=0.6).contains(&model.drive_lag));
        // The overhang keeps its length.
        let overhang = if entry.class < 2 { 11.62 - 7.756 } else { 12.0 - 7.7 };
        assert!((trailer.kingpin_to_rear - trailer.wheelbase - overhang).abs() < 1e-9);
    }
    let more = fleet(Ranges { brake_lag: Some([0.2, 0.5]), ..ranges }).table();
    assert!(
        table
            .iter()
            .zip(&more)
            .all(|(a, b)| a.vehicle.trailer == b.vehicle.trailer && a.vehicle.tractor == b.vehicle.tractor)
    );
}

#[test]
fn trucks_that_are_not_drawn_are_as_their_file_has_them() {
    let draw = Ranges { trailer_wheelbase: Some([0.1, 0.4]), drive_lag: Some([0.3, 0.6]), ..Ranges::default() };
    let all = fleet(draw);
    let mut some = all.clone();
    some.members[1].drawn = false;
    for (entry, other) in some.table().iter().zip(all.table()) {
        assert_eq!(entry.class, other.class);
        if entry.class == 2 {
            let mut of_file = Vehicle::named("eu_4x2_13m6").unwrap();
            of_file.loads.retain(|load, _| load == "laden");
            assert_eq!(entry.vehicle, of_file);
            assert_ne!(entry.vehicle, other.vehicle);
        } else {
            assert_eq!(entry.vehicle, other.vehicle);
        }
    }
}

#[test]
fn a_part_of_the_classes_is_a_benchmark_of_its_own() {
    let mut scenario = Scenario::named("attard2023").unwrap();
    scenario.fleet = Some(fleet(Ranges::default()));
    let laden = scenario.with_classes(|class| class.load == "laden").unwrap();
    assert_eq!((laden.classes().len(), laden.load.as_str()), (2, "laden"));
    assert!(scenario.with_classes(|class| class.load == "feathers").is_none());
    // A load that is never drawn stands for none.
    scenario.fleet.as_mut().unwrap().members[0].loads.insert("empty".into(), 0.0);
    assert_eq!(scenario.with_classes(|_| true).unwrap().load, "laden");
    let one = Scenario::named("attard2023").unwrap();
    assert!(
        one.with_classes(|class| class.load == "empty").is_some()
            && one.with_classes(|class| class.load == "laden").is_none()
    );
}
