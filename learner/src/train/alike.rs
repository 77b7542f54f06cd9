//! What must agree between the benchmark that a policy is trained on and one that it is chosen or evaluated on: what
//! the policy drives, and how it observes.
//!
//! Roads, start errors, reward and ends of episodes may differ, and so may what `[draw]` varies: training begins from
//! wider errors and with less grip than an evaluation.

use bytemuck::bytes_of;
use offtrack::files::reader::shown;
use offtrack::layout::Rig;
use offtrack::map::Gutter;
use offtrack::scenario::Scenario;

/// What of `other` is not as in `trained`: a key, or words, with both values where they are short. None where a policy
/// that was trained in the one drives and observes the same in the other.
pub(super) fn difference(trained: &Scenario, other: &Scenario) -> Option<String> {
    let differing = |what: &str, value: fn(&Scenario) -> String| {
        let [value, expected] = [other, trained].map(value);
        (value != expected).then(|| format!("{what} ({value} in place of {expected})"))
    };
    needed(trained, other)
        .or_else(|| differing("time.step and time.substeps", |of| format!("{} s, {}", shown(of.step), of.n_substeps)))
        .or_else(|| differing("actions.speeds_kmh", speeds))
        .or_else(|| differing("sensors.range", |of| format!("{} m", shown(of.sensor_range))))
        .or_else(|| differing("routes.spacing", |of| format!("{} m", shown(of.spacing))))
        .or_else(|| differing("gutter", gutter))
        .or_else(|| vehicles(trained, other))
}

/// The part of [`difference`] without which a policy cannot drive at all.
pub(super) fn needed(trained: &Scenario, other: &Scenario) -> Option<String> {
    if other.action_kind != trained.action_kind || other.actions() != trained.actions() {
        return Some("actions and vehicle lock".to_owned());
    }
    if other.observes_vehicles != trained.observes_vehicles {
        return Some("observation.vehicles".to_owned());
    }
    (other.extras != trained.extras).then(|| "observation.extras".to_owned())
}

/// The lowest and the highest target speed, and whether actions change it.
fn speeds(scenario: &Scenario) -> String {
    let [slowest, fastest] = scenario.speed_range().map(|speed| shown(3.6 * speed));
    let how = if scenario.speed_changes.is_empty() { "" } else { " by changes" };
    format!("{slowest} to {fastest} km/h{how}")
}

fn gutter(scenario: &Scenario) -> String {
    if scenario.gutter == Gutter::Solid { "solid" } else { "drivable" }.to_owned()
}

/// A vehicle with a load that `other` has and `trained` does not, as their files have them.
fn vehicles(trained: &Scenario, other: &Scenario) -> Option<String> {
    let rigs = |of: &Scenario| {
        let rigs = of.typical_rigs((of.step / f64::from(of.n_substeps)) as f32).into_iter();
        // Indices into the tables of its own world.
        rigs.map(|rig| Rig { chassis: 0, class_index: 0, ..rig }).collect::<Vec<Rig>>()
    };
    let known = rigs(trained);
    let unknown = rigs(other).iter().position(|rig| !known.iter().any(|known| bytes_of(known) == bytes_of(rig)));
    let sensors = |of: &Scenario| match &of.fleet {
        None => vec![of.vehicle.rays()],
        Some(fleet) => fleet.members.iter().map(|member| member.vehicle.rays()).collect(),
    };
    let known = sensors(trained);
    if sensors(other).iter().any(|rays| !known.contains(rays)) && unknown.is_none() {
        return Some("sensors of the vehicle".to_owned());
    }
    let class = other.classes().into_iter().nth(unknown?)?;
    let kind = if class.vehicle.is_empty() { String::new() } else { format!("{}, ", class.vehicle) };
    Some(format!("vehicle and load ({kind}{})", class.load))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is then different, and how to make it so.
    type Change = (&'static str, fn(&mut Scenario));

    #[test]
    fn what_shipped_training_files_name_is_alike_whatever_the_roads_rewards_and_ranges() {
        let named = |name: &str| Scenario::named(name).unwrap();
        for (trained, others) in [
            ("attard2023-training", &["attard2023", "attard2023-full", "maps2026"][..]),
            ("random2026-training", &["attard2023", "random2026"]),
            ("random2026-as-run-training", &["attard2023-as-run", "random2026-as-run"]),
            ("laden2026-training", &["laden2026", "laden2026-random", "laden2026-odd"]),
            ("transfer2026-training", &["transfer2026", "transfer2026-random", "transfer2026-held-out"]),
            ("transfer2026-refinement", &["transfer2026", "transfer2026-random"]),
            ("transfer2026-refinement-home", &["transfer2026", "transfer2026-random"]),
            ("transfer2026-refinement-any-slip", &["transfer2026", "transfer2026-random", "transfer2026-no-slip"]),
            ("laden2026-50-training", &["laden2026-50", "laden2026-50-random"]),
            ("traffic2026-training", &["traffic2026", "traffic2026-random"]),
            (
                "traffic2026-refinement",
                &["traffic2026", "traffic2026-random", "traffic2026-laden", "traffic2026-large"],
            ),
        ] {
            let scenario = named(trained);
            for other in others {
                assert_eq!(difference(&scenario, &named(other)), None, "{trained}, {other}");
            }
        }
    }

    #[test]
    fn whatever_a_policy_drives_or_observes_otherwise_is_a_difference() {
        let trained = Scenario::named("attard2023").unwrap();
        let changes: [Change; 11] = [
            ("actions and vehicle lock", |of| of.steer_levels[0] = -0.7),
            ("actions and vehicle lock", |of| of.steer_max = Some(0.5)),
            ("observation.extras", |of| of.extras = offtrack::layout::ObservedExtras::Mass),
            ("observation.vehicles", |of| of.observes_vehicles = true),
            ("time.step and time.substeps (0.2 s, 2 in place of 0.1 s, 2)", |of| of.step = 0.2),
            ("sensors.range (10 m in place of 20 m)", |of| of.sensor_range = 10.0),
            ("routes.spacing (1 m in place of 2 m)", |of| of.spacing = 1.0),
            ("gutter (solid in place of drivable)", |of| of.gutter = Gutter::Solid),
            ("vehicle and load (half)", |of| of.load = "half".to_owned()),
            // The lock stays the same, and so do the actions.
            ("vehicle and load (empty)", |of| of.vehicle.trailer.wheelbase += 1.0),
            ("sensors of the vehicle", |of| of.vehicle.sensors.trailer_last -= 0.5),
        ];
        for (expected, change) in changes {
            let mut other = trained.clone();
            change(&mut other);
            assert_eq!(difference(&trained, &other).as_deref(), Some(expected));
            assert_eq!(difference(&trained, &trained), None);
        }
        let mut american = trained.clone();
        american.vehicle = offtrack::vehicle::Vehicle::find("us_wb62").unwrap();
        assert!(difference(&trained, &american).is_some());
    }
}
