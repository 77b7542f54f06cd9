use super::super::certificate::beam::Pass;
use super::super::episode::tests::episode;
use super::super::failures::Example;
use super::super::groups::Groups;
use super::super::possible::Possible;
use super::super::report::{Episode, MANY_ROUTES};
use super::*;

fn cause(index: usize) -> Cause {
    let example = Example {
        index: 0,
        route: "40m/SW-right-1".to_owned(),
        episode: 0,
        start: [0.0; 2],
        ended: "strayed",
        steps: 9,
        position: [0.0; 2],
    };
    Cause {
        cause: format!("trailer on kerb {index}"),
        episodes: 20 - index,
        share: 0.1,
        possible: Some(index),
        example,
    }
}

/// A report with the widest figures that an evaluation gives.
fn report() -> Report {
    let mut episodes = vec![episode(Ended::Arrived); 692];
    episodes.extend([episode(Ended::TractorCollided), episode(Ended::TrailerCollided), episode(Ended::TimedOut)]);
    let summary = Summary::of(episodes.iter(), 0.1).unwrap();
    let route = |own_lane_suffices| RouteReport {
        name: "40m/SW-right-1".to_owned(),
        own_lane_suffices,
        island_radius: Some(20.0),
        summary: summary.clone(),
    };
    let group = |name: &str| vec![Group { name: name.to_owned(), routes: 2, summary: summary.clone() }];
    Report {
        benchmark: "attard2023".to_owned(),
        split: "test",
        policy: "random".to_owned(),
        seed: 0,
        engine: "cpu".to_owned(),
        summary: summary.clone(),
        own_lane_suffices: Some(summary.clone()),
        needs_deviation: Some(summary.clone()),
        certified: Some(summary.clone()),
        possible: Some(Possible {
            summary: Some(summary.clone()),
            searched: 2,
            found: 1,
            env_steps: 1_234_567,
            passes: vec![Pass { width: 512, hold: 3 }],
            island_radius: Vec::new(),
            lane: Vec::new(),
            demand: Vec::new(),
        }),
        avoidable: None,
        failures: (0..CAUSES + 2).map(cause).collect(),
        classes: Vec::new(),
        groups: Groups {
            island_radius: group("22 m and more"),
            lane: group("right"),
            exit: group("1"),
            roundabout: group("40m"),
            demand: group("900 veh/h"),
        },
        routes: vec![route(true), route(false)],
    }
}

#[test]
fn a_table_is_no_wider_than_the_terminal() {
    let widest = |width: usize| report().table(width).lines().map(|line| line.chars().count()).max().unwrap();
    for width in [40, 60, 79, 80, 100, 120, 200] {
        assert!(widest(width) <= width, "{width}: {}\n{}", widest(width), report().table(width));
    }
    // Narrower than that, routes and their success stay all the same.
    assert!(report().table(10).contains("692/695"));
}

#[test]
fn a_table_of_100_columns_has_every_figure_and_a_narrower_one_names_what_it_leaves_out() {
    let (whole, narrow) = (report().table(100), report().table(80));
    assert!(!whole.contains("Left out") && whole.contains("time"), "{whole}");
    assert!(narrow.contains("Left out for want of width:") && narrow.contains("time s."), "{narrow}");
}

#[test]
fn every_heading_is_explained_below_the_table() {
    let legend = legend(1000);
    let table = report().table(100);
    for column in &ALL[1..] {
        let word =
            column.head.iter().flat_map(|head| head.split(' ')).find(|word| 1 < word.len() && *word != "95").unwrap();
        assert!(legend.contains(word), "{word}");
    }
    assert!(
        table.contains("own: a truck whose front axle follows") && table.contains("load transfer ratio"),
        "{table}"
    );
}

#[test]
fn failures_are_counted_below_their_line() {
    assert!(report().table(100).contains("  not arrived: 1 timed out, 1 tractor collided, 1 trailer collided\n"));
}

#[test]
fn the_interval_over_routes_stands_below_a_line_of_several_routes() {
    let mut report = report();
    (report.summary.success_low_over_routes, report.summary.success_high_over_routes) = (Some(0.567), Some(0.861));
    let table = report.table(100);
    assert_eq!(table.matches("  95 % over routes: 56.7..86.1\n").count(), 1, "{table}");
    (report.summary.success_low_over_routes, report.summary.success_high_over_routes) = (Some(1.0), Some(1.0));
    assert!(!report.table(100).contains("  95 % over routes"));
}

#[test]
fn the_commonest_causes_of_failures_are_told_and_the_others_counted() {
    let table = report().table(1000);
    assert!(
        table.contains("Not arrived, by cause: 20 trailer on kerb 0 (0 from a possible start), 19 trailer on kerb 1 "),
        "{table}"
    );
    assert!(table.contains("13 trailer on kerb 7 (7 from a possible start), 23 for 2 other causes.\n"), "{table}");
}

#[test]
fn the_time_outside_the_own_lane_is_told() {
    let expected = "Outside its own lane for 25.0 % of an episode that arrived, where the own lane suffices 25.0 %.\n";
    assert!(report().table(100).contains(expected));
}

#[test]
fn the_use_of_aprons_is_told_where_there_are_any() {
    let mut report = report();
    assert!(!report.table(100).contains("apron"));
    (report.summary.on_apron, report.summary.on_apron_max) = (Some(0.25), Some(0.876));
    let expected = "On an apron with a wheel of the trailer in 25.0 % of the episodes, up to 0.88 m.\n";
    assert!(report.table(100).contains(expected));
}

#[test]
fn the_searches_for_possible_starts_are_told_below_the_sums() {
    let table = report().table(100);
    assert!(table.lines().any(|line| line.starts_with("possible ") && line.contains("692/695")), "{table}");
    assert!(
        table.contains("possible: the episodes that arrived and those whose own start a search completed, 1 of the 2"),
        "{table}"
    );
}

/// A report on many routes on as many roundabouts, of which every `one_in`th failed once.
fn large_report(one_in: usize) -> Report {
    let summary = |fails: bool| {
        let ends = [Ended::Arrived, if fails { Ended::TrailerCollided } else { Ended::Arrived }];
        let episodes: Vec<Episode> = ends.into_iter().map(episode).collect();
        Summary::of(episodes.iter(), 0.1).unwrap()
    };
    let fails = |index: usize| summary(index.is_multiple_of(one_in));
    let route = |index: usize| RouteReport {
        name: format!("wide/7/{index}/SW-right-1"),
        own_lane_suffices: true,
        island_radius: Some(20.0),
        summary: fails(index),
    };
    let mut report = report();
    report.routes = (0..2 * MANY_ROUTES).map(route).collect();
    let roundabout = |index: usize| Group { name: format!("wide/7/{index}"), routes: 1, summary: fails(index) };
    report.groups.roundabout = (0..2 * MANY_ROUTES).map(roundabout).collect();
    report
}

#[test]
fn of_many_routes_the_table_has_the_groups_and_the_worst_routes_and_says_how_many_more_there_are() {
    let table = large_report(5).table(100);
    for line in ["island 22 m and more", "lane right", "exit 1", "wide/7/0 ", "wide/7/95/SW-right-1"] {
        assert!(table.lines().any(|found| found.starts_with(line)), "{line}: {table}");
    }
    assert!(!table.contains("wide/7/1/SW") && !table.contains("wide/7/100/SW"), "{table}");
    assert_eq!(table.matches("SW-right-1").count(), WORST);
    assert!(
        table.contains("The worst 20 of 40 routes with a failure, of 200; --json and --html have all.\n"),
        "{table}"
    );
    assert!(table.lines().all(|line| line.chars().count() <= 100), "{table}");
}

#[test]
fn where_few_or_none_of_many_routes_failed_the_table_says_that_all_others_arrived() {
    let table = large_report(50).table(100);
    assert!(table.contains("On the other 196 of 200 routes every episode arrived.\n"), "{table}");
    let mut report = large_report(50);
    report.routes.retain(|route| route.summary.success == 1.0);
    assert!(report.table(100).contains("All 196 routes: every episode arrived.\n"));
}
