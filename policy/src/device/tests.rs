use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use offtrack::gpu;
use offtrack::layout::buffers::Access;
use offtrack::layout::random::{signed_unit, words};
use offtrack::layout::{Action, N_AROUND, N_EXTRAS, N_VALUES, Truck};
use offtrack::scenario::{Scenario, Split};
use offtrack::simulator::{Engine, RouteChoice, Simulator};
use offtrack::wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use offtrack::wgpu::naga::{AddressSpace, front::wgsl as parser};

use super::*;
use crate::{Normalisation, Selection};

/// The simulator's tests have it too.
#[cfg(target_os = "linux")]
#[path = "../../../tests/simulator/machine_code/null_device.rs"]
mod null_device;

/// Outputs that lie nearer together than this may fall otherwise: some devices do not fuse multiply-adds.
const TIE: f32 = 1e-4;

fn device() -> &'static gpu::Device {
    static DEVICE: OnceLock<gpu::Device> = OnceLock::new();
    DEVICE.get_or_init(|| gpu::Device::open(None).unwrap_or_else(|error| panic!("{error}")))
}

fn world_of(benchmark: &str) -> (Arc<World>, RouteChoice) {
    let scenario = Scenario::named(benchmark).unwrap();
    let routes = RouteChoice::Drawn(scenario.split(Split::Test).to_vec());
    (Arc::new(World::bake(&scenario).unwrap()), routes)
}

/// Trucks on the device, and a policy of theirs.
struct Drive {
    simulator: Simulator,
    policy: Policy,
    on_device: DevicePolicy,
}

/// What trucks observed, and what the device chose for them.
struct Acted {
    observations: Vec<[f32; N_VALUES]>,
    extras: Vec<[f32; N_EXTRAS]>,
    around: Vec<[f32; N_AROUND]>,
    trucks: Vec<Truck>,
    actions: Vec<u32>,
}

impl Drive {
    fn new(benchmark: &str, policy: Policy, n_envs: usize, choice: Choice) -> Drive {
        let (world, routes) = world_of(benchmark);
        let engine = Engine::Gpu { device: device().clone(), columns: gpu::Columns::new() };
        let on_device = DevicePolicy::new(device(), &policy, &world, choice).unwrap();
        Drive { simulator: Simulator::on(engine, world, n_envs, 1, routes).unwrap(), policy, on_device }
    }

    /// Lets the policy act, without a step.
    fn act(&mut self) -> Acted {
        let batch = self.simulator.on_device().unwrap();
        let mut encoder = device().device.create_command_encoder(&Default::default());
        self.on_device.add(&mut encoder, batch);
        batch.stepped();
        device().queue.submit([encoder.finish()]);
        let batch = self.simulator.batch();
        Acted {
            observations: batch.observation.clone(),
            extras: batch.extras.clone(),
            around: batch.around.clone(),
            trucks: batch.truck.clone(),
            actions: batch.action.clone(),
        }
    }

    /// Steps by the policy and compares each choice with the processor's: every action taken, and how many differ.
    fn compare(&mut self, reference: &Policy, n_steps: usize) -> (BTreeSet<u32>, usize) {
        let (mut taken, mut n_others) = (BTreeSet::new(), 0);
        for _ in 0..n_steps {
            let Acted { observations, extras, around, actions, .. } = self.act();
            let logits = reference.logits_among(&observations, &extras, &around);
            for (row, &action) in logits.chunks_exact(reference.actions.len()).zip(&actions) {
                let largest = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                n_others += usize::from(row[action as usize] < largest - TIE);
                taken.insert(action);
            }
            self.simulator.step(&actions).unwrap();
        }
        (taken, n_others)
    }
}

/// A policy for attard2023 with such layers.
fn drawn(hidden: &[usize], activation: Activation) -> Policy {
    with_layers(Policy::shipped("attard2023").unwrap(), hidden, activation)
}

/// The policy with other layers, of numbers drawn from He's uniform distribution.
fn with_layers(policy: Policy, hidden: &[usize], activation: Activation) -> Policy {
    let sizes = [&[policy.normalisation.mean.len()], hidden, &[policy.actions.len()]].concat();
    let layer = |(index, ends): (usize, &[usize])| {
        let limit = (6.0 / ends[0] as f32).sqrt();
        let number = |at: usize, of: u32| signed_unit(words(3, at as u32, index as u32, of)[0]);
        Layer {
            weights: (0..ends[0] * ends[1]).map(|at| limit * number(at, 0)).collect(),
            biases: (0..ends[1]).map(|at| 0.1 * number(at, 1)).collect(),
        }
    };
    Policy { layers: sizes.windows(2).enumerate().map(layer).collect(), activation, ..policy }
}

#[test]
fn shipped_policies_choose_on_a_device_what_they_choose_on_the_processor() {
    for (name, least) in [("attard2023", 5), ("laden2026", 10), ("transfer2026", 10)] {
        let policy = Policy::shipped(name).unwrap();
        let mut drive = Drive::new(name, policy.clone(), 100, Choice::Best);
        let (taken, n_others) = drive.compare(&policy, 50);
        println!("{name}: {n_others} other actions of 5,000, {} of {} taken", taken.len(), policy.actions.len());
        assert!(n_others == 0 && least <= taken.len(), "{name}: {n_others} others, {taken:?}");
        let mut wrong = policy.clone();
        wrong.layers[1].weights.iter_mut().step_by(2).for_each(|weight| *weight *= 1.02);
        assert!(0 < drive.compare(&wrong, 50).1, "{name}: weights that are off by a fiftieth must show");
    }
}

#[test]
fn a_policy_that_observes_vehicles_chooses_on_a_device_what_it_chooses_on_the_processor() {
    let world = world_of("traffic2026").0;
    let policy = Policy {
        vehicles: true,
        actions: world.actions.clone(),
        normalisation: Normalisation::none(N_VALUES + N_AROUND),
        ..Policy::shipped("attard2023").unwrap()
    };
    let policy = with_layers(policy, &[64, 64], Activation::Relu);
    let mut drive = Drive::new("traffic2026", policy.clone(), 100, Choice::Best);
    let (taken, n_others) = drive.compare(&policy, 30);
    assert!(n_others == 0 && 4 < taken.len(), "{n_others} others, {taken:?}");
    let mut wrong = policy.clone();
    // What it makes of the vehicles alone.
    wrong.layers[0].weights[64 * N_VALUES..].iter_mut().step_by(2).for_each(|weight| *weight *= 1.1);
    assert!(0 < drive.compare(&wrong, 30).1, "weights of vehicles that are off by a tenth must show");
}

/// A network with the actions of a benchmark that reads these values alone, each normalised in another way.
fn reading(benchmark: &str, names: &[&str]) -> Policy {
    let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
    let values = Selection::of(&names).unwrap();
    let n = values.indices().len();
    let number = |at: usize| signed_unit(words(4, at as u32, 0, 0)[0]);
    let normalisation = Normalisation {
        mean: (0..n).map(|at| 0.3 * number(at)).collect(),
        factor: (0..n).map(|at| 2.0 + number(n + at)).collect(),
    };
    let actions = world_of(benchmark).0.actions.clone();
    let policy = Policy { values: Some(values), normalisation, actions, ..Policy::shipped("attard2023").unwrap() };
    with_layers(policy, &[48], Activation::Relu)
}

#[test]
fn a_policy_that_reads_values_by_name_in_its_own_order_chooses_on_a_device_what_it_does_on_the_processor() {
    let cases = [
        ("laden2026", ["target_speed", "tractor_range", "bearing[3]", "steering"]),
        ("traffic2026", ["vehicle_left", "tractor_range", "bearing[3]", "tractor_room"]),
    ];
    for (benchmark, mut names) in cases {
        let policy = reading(benchmark, &names);
        let mut drive = Drive::new(benchmark, policy.clone(), 100, Choice::Best);
        let (taken, n_others) = drive.compare(&policy, 20);
        assert!(n_others == 0 && 1 < taken.len(), "{benchmark}: {n_others} others, {taken:?}");
        names.swap(0, 3);
        assert!(0 < drive.compare(&reading(benchmark, &names), 20).1, "{benchmark}: another order must show");
    }
}

#[test]
fn networks_of_every_shape_of_a_workgroup_and_either_activation_choose_as_on_the_processor() {
    let mut all = BTreeSet::new();
    for activation in Activation::ALL {
        for hidden in [&[][..], &[256, 256], &[1, 7, 3], &[301, 64], &[512, 512, 1024], &[1023]] {
            let policy = drawn(hidden, activation);
            // The last workgroup is not full.
            let mut drive = Drive::new("attard2023", policy.clone(), 37, Choice::Best);
            let (mut taken, n_others) = drive.compare(&policy, 8);
            assert_eq!(n_others, 0, "{hidden:?}");
            all.append(&mut taken);
            let other = Policy { activation: Activation::ALL[1 - activation as usize], ..policy.clone() };
            assert!(hidden.is_empty() || hidden[0] == 1 || 0 < drive.compare(&other, 8).1, "{hidden:?}");
        }
    }
    assert!(5 < all.len(), "{all:?}");
}

#[test]
fn sampled_actions_are_those_of_seed_truck_episode_and_step_and_have_their_probabilities() {
    // Outputs near each other, so that many actions are likely.
    let mut policy = drawn(&[64], Activation::Relu);
    policy.layers[1].weights.iter_mut().for_each(|weight| *weight *= 0.2);
    let mut drive = Drive::new("attard2023", policy, 500, Choice::Sampled { seed: 9 });
    let (mut expected, mut found) = ([0.0f64; 9], [0.0f64; 9]);
    for _ in 0..8 {
        let Acted { observations, trucks, actions, .. } = drive.act();
        let logits = drive.policy.logits(&observations);
        for (env, row) in logits.chunks_exact(9).enumerate() {
            let most = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let sum: f32 = row.iter().map(|logit| (logit - most).exp()).sum();
            let drawn = crate::drawn(9, env as u32, &trucks[env]);
            let below = |n: usize| row[..n].iter().map(|logit| (logit - most).exp() / sum).sum::<f32>();
            let action = actions[env] as usize;
            assert!(below(action) - TIE <= drawn && drawn <= below(action + 1) + TIE, "{env}: {action}, {drawn}");
            found[action] += 1.0;
            row.iter().zip(&mut expected).for_each(|(logit, n)| *n += f64::from((logit - most).exp() / sum));
        }
        drive.simulator.step(&actions).unwrap();
    }
    for (found, expected) in found.into_iter().zip(expected) {
        // Four standard deviations of a count.
        assert!((found - expected).abs() < 4.0 * expected.sqrt(), "{found} {expected}");
    }
    assert!(expected.iter().filter(|n| 100.0 < **n).count() > 4, "{expected:?}");
}

/// What is wrong with a policy.
type Change = fn(&mut Policy);

fn refusal(policy: &Policy, benchmark: &str) -> String {
    let refused = DevicePolicy::new(device(), policy, &world_of(benchmark).0, Choice::Best);
    refused.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn a_policy_that_is_too_wide_or_cannot_drive_is_refused_by_name() {
    let said = refusal(&Policy { name: "wide".into(), ..drawn(&[64, 1025], Activation::Relu) }, "attard2023");
    let expected = "wide: is a policy too wide for a device: actor.1 has 1025 outputs, at most 1024 fit";
    assert!(said.starts_with(expected) && said.ends_with("let it drive on the processor"), "{said}");
    let good = Policy::shipped("attard2023").unwrap();
    assert!(refusal(&good, "laden2026").contains("learned with other extras"));
    let other = Policy { actions: vec![Action { steering: 0.0, speed: 1.0 }; 9], ..good.clone() };
    assert!(refusal(&other, "attard2023").contains("learned with another action table"));
    let changed = |change: Change| {
        let mut policy = good.clone();
        change(&mut policy);
        refusal(&policy, "attard2023")
    };
    let cases: [(Change, &str); 7] = [
        (|policy| policy.frames.n = 2, "(shipped): is a policy with a memory or commands: a device"),
        (|policy| policy.layers[1].weights[7] = f32::NAN, "actor.1.weight[7] is NaN; every number must be finite"),
        (|policy| policy.normalisation.mean[2] = f32::INFINITY, "observation.mean[2] is inf"),
        (|policy| policy.layers[0].weights.fill(3e38), "the outputs of actor.0 may reach"),
        (|policy| policy.layers[2].weights.truncate(2303), "actor.2 has 2303 weights for 9 outputs"),
        (|policy| drop(policy.layers.remove(0)), "is a policy of another shape: actor.0.weight is [256, 256]"),
        (|policy| policy.normalisation = Normalisation::none(70), "observation.mean is [70]"),
    ];
    for (change, expected) in cases {
        let said = changed(change);
        assert!(said.contains(expected), "{said}: {expected}");
    }
}

#[test]
fn the_kernel_keeps_within_what_every_device_offers() {
    for (shape, reads_vehicles) in SHAPES.into_iter().flat_map(|shape| [(shape, false), (shape, true)]) {
        let source = source(shape, reads_vehicles);
        let module = parser::parse_str(&source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).unwrap();
        let used = info.get_entry_point(0);
        let mut names = Vec::new();
        for (handle, variable) in module.global_variables.iter().filter(|(handle, _)| !used[*handle].is_empty()) {
            if variable.space == AddressSpace::WorkGroup {
                let size = module.types[variable.ty].inner.size(module.to_ctx());
                assert_eq!((size, used[handle].is_empty()), (shape.memory(), false));
            } else {
                names.push(variable.name.as_deref().unwrap());
            }
        }
        // Bound to what it names, of which 8 may be storage buffers; 16 KB and 256 threads a workgroup.
        let known = || buffers(reads_vehicles);
        assert_eq!(names, known().map(|(name, ..)| name).collect::<Vec<&str>>());
        let storage = known().filter(|(_, access, ..)| *access != Access::Uniform).count();
        assert!(storage <= 8 && shape.memory() == 16 << 10 && shape.threads() <= 256, "{shape:?}");
        assert_eq!(module.entry_points[0].workgroup_size, [shape.threads(), 1, 1]);
    }
    assert_eq!(size_of::<LayerRow>() % 16, 0, "a row of a uniform table");
}

/// Checks the machine code of a shape for a card; `test` is the name of the test that asks.
#[cfg(target_os = "linux")]
fn check_machine_code(test: &str, shape: Shape, reads_vehicles: bool) {
    let stated = [null_device::stated("act", 96, shape.memory(), 0)];
    null_device::check(&format!("device::tests::{test}"), &source(shape, reads_vehicles), &stated);
}

#[cfg(target_os = "linux")]
#[test]
fn the_kernel_of_narrow_networks_spills_nothing_on_a_card() {
    check_machine_code("the_kernel_of_narrow_networks_spills_nothing_on_a_card", SHAPES[0], false);
}

#[cfg(target_os = "linux")]
#[test]
fn the_kernel_of_wide_networks_spills_nothing_on_a_card() {
    check_machine_code("the_kernel_of_wide_networks_spills_nothing_on_a_card", SHAPES[1], false);
}

#[cfg(target_os = "linux")]
#[test]
fn the_kernel_of_the_widest_networks_spills_nothing_on_a_card() {
    check_machine_code("the_kernel_of_the_widest_networks_spills_nothing_on_a_card", SHAPES[2], false);
}

#[cfg(target_os = "linux")]
#[test]
fn the_kernel_of_policies_that_observe_vehicles_spills_nothing_on_a_card() {
    check_machine_code("the_kernel_of_policies_that_observe_vehicles_spills_nothing_on_a_card", SHAPES[0], true);
}
