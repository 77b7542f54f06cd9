use super::*;
use rand::SeedableRng;
use rand::rngs::SmallRng;

const GAMMA: f32 = 0.9;

/// The history of one truck: each step's reward and end. Step `t` is observed as `t`, and leads to `1000 + t`.
type History = Vec<(f32, Ended)>;

/// Two trucks whose episodes end at different steps in different ways.
fn histories(n_steps: usize) -> [History; 2] {
    let of = |period: usize, offset: usize| -> History {
        let ends = [Ended::Arrived, Ended::TimedOut, Ended::TrailerCollided, Ended::TimedOut];
        let end = |step: usize| if step % period == period - 1 { ends[step / period % 4] } else { Ended::Running };
        (0..n_steps).map(|step| ((step * 7 + offset) as f32 % 5.0 - 2.0, end(step))).collect()
    };
    [of(5, 0), of(7, 3)]
}

/// With and without priorities.
const SETTINGS: [Option<config::Priority>; 2] = [None, Some(config::Priority { exponent: 0.6, correction: 0.4 })];

fn filled(
    histories: &[History; 2],
    n_steps: usize,
    capacity: usize,
    priority: Option<config::Priority>,
) -> ReplayBuffer<2> {
    let mut buffer = ReplayBuffer::new(2, n_steps, &config::ReplayBuffer { capacity, warmup: 1, priority });
    for (step, (first, second)) in histories[0].iter().zip(&histories[1]).enumerate() {
        let of = |value: usize| [0, 1].map(|env| [value as f32, env as f32]);
        buffer.append(Rows {
            observation: &of(step),
            action: &[step as u32, step as u32 + 1],
            reward: &[first.0, second.0],
            ended: &[first.1 as u32, second.1 as u32],
            next_observation: &of(1000 + step),
        });
    }
    buffer
}

/// The n-step return as its definition reads, from one truck's whole history: (reward, discount, observed next).
fn reference(history: &History, start: usize, n_steps: usize) -> (f32, f32, Option<f32>) {
    let mut reward = 0.0;
    for n in 0..n_steps {
        let (step_reward, ended) = history[start + n];
        reward += GAMMA.powi(n as i32) * step_reward;
        if ended.terminated() {
            return (reward, 0.0, None);
        }
        if ended.truncated() {
            return (reward, GAMMA.powi(n as i32 + 1), Some((1000 + start + n) as f32));
        }
    }
    (reward, GAMMA.powi(n_steps as i32), Some((start + n_steps) as f32))
}

fn check(buffer: &ReplayBuffer<2>, histories: &[History; 2], n_steps: usize) -> Vec<usize> {
    let sample = buffer.sample(4000, GAMMA, &mut SmallRng::seed_from_u64(1));
    let mut starts = Vec::new();
    for row in 0..4000 {
        let [step, env] = sample.observation[row].map(|value| value as usize);
        let (reward, discount, next) = reference(&histories[env], step, n_steps);
        assert_eq!(sample.action[row] as usize, step + env);
        // Two orders of multiplying up to five factors.
        assert!((sample.reward[row] - reward).abs() < 1e-5, "step {step} of {env}");
        assert!((sample.discount[row] - discount).abs() < 1e-6, "step {step} of {env}");
        if let Some(next) = next {
            assert_eq!(sample.next_observation[row], [next, env as f32], "step {step} of {env}");
        }
        starts.push(step);
    }
    starts.sort_unstable();
    starts.dedup();
    starts
}

#[test]
fn returns_over_several_steps_equal_their_definition() {
    let histories = histories(60);
    for n_steps in [1, 2, 5] {
        for priority in SETTINGS {
            let starts = check(&filled(&histories, n_steps, 200, priority), &histories, n_steps);
            assert_eq!(
                starts,
                (0..60 - n_steps).collect::<Vec<_>>(),
                "every step that enough others follow can be sampled"
            );
        }
    }
}

#[test]
fn a_full_ring_holds_the_latest_steps_alone() {
    let histories = histories(103);
    for priority in SETTINGS {
        let buffer = filled(&histories, 3, 40, priority);
        assert_eq!(buffer.n_transitions(), 40);
        // 20 slots, the last three of which nothing follows far enough.
        assert_eq!(check(&buffer, &histories, 3), (83..100).collect::<Vec<_>>());
    }
}

#[test]
fn a_replaced_truncation_leaves_nothing_behind() {
    let histories = histories(1000);
    let buffer = filled(&histories, 3, 40, None);
    let held = buffer.after.iter().filter(|&&after| after == After::Truncated).count();
    assert!(0 < held);
    assert_eq!(buffer.truncated.len(), held);
}

#[test]
fn only_a_step_that_enough_others_follow_can_be_sampled() {
    let histories = histories(4);
    assert!(filled(&histories, 3, 40, None).can_sample());
    assert!(!filled(&histories, 4, 40, None).can_sample());
}

#[test]
fn the_same_seed_gives_the_same_sample() {
    let buffer = filled(&histories(60), 3, 200, None);
    let draw = |seed| buffer.sample(50, GAMMA, &mut SmallRng::seed_from_u64(seed));
    assert_eq!(draw(4), draw(4));
    assert_ne!(draw(4), draw(5));
}

#[test]
fn a_transition_with_a_large_td_error_is_sampled_more_often_and_weighs_less() {
    let mut buffer = filled(&histories(60), 3, 200, SETTINGS[1]);
    let all = buffer.sample(4000, GAMMA, &mut SmallRng::seed_from_u64(1));
    assert!(all.weight.iter().all(|weight| (weight - 1.0).abs() < 1e-6), "new transitions are equal");
    let errors: Vec<f32> = all.row.iter().map(|&row| if row == 10 { 8.0 } else { 0.5 }).collect();
    buffer.set_td_errors(&all.row, &errors);
    let again = buffer.sample(4000, GAMMA, &mut SmallRng::seed_from_u64(2));
    let of = |wanted: bool| again.row.iter().zip(&again.weight).filter(move |&(&row, _)| (row == 10) == wanted);
    // 114 transitions: 16^0.6 = 5.28 of 118.28 of the sum; sampling is stratified.
    assert!((of(true).count() as f64 - 4000.0 * 5.28 / 118.28).abs() < 20.0, "{}", of(true).count());
    // 5.28^-0.4 of the weight of the others, whose weight is the largest.
    assert!(of(false).all(|(_, weight)| (weight - 1.0).abs() < 1e-5));
    assert!(of(true).all(|(_, weight)| (weight - 0.514).abs() < 1e-3));
}
