//! Whether a policy can drive in a world: its extras and its actions are there.

use offtrack::layout::{Action, ObservedExtras};
use offtrack::world::World;

use crate::error::Error;
use crate::head::Head;
use crate::policy::Policy;

/// Largest relative difference of two entries of an action table that count as equal: f32 rounds at 6e-8.
pub const SAME_ACTION: f32 = 1e-5;

impl Policy {
    /// Whether the policy can drive in `world`.
    ///
    /// # Errors
    ///
    /// Extras that the world does not observe or, for a policy that reads all values, others than the world's; other
    /// vehicles where it observes none; another action table; and commands where the world has actions.
    pub fn check(&self, world: &World) -> Result<(), Error> {
        self.check_extras(world).map_err(|message| Error::contents(&self.name, &message))?;
        self.check_vehicles(world).map_err(|message| Error::contents(&self.name, &message))?;
        self.check_actions(world).map_err(|message| Error::contents(&self.name, &message))
    }

    fn check_extras(&self, world: &World) -> Result<(), String> {
        let listed = |names: &[&str]| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let observed: Vec<&str> = world.observation_layout().extra_names();
        if let Some(values) = &self.values {
            let missing: Vec<&str> = values.extras().filter(|extra| !observed.contains(extra)).collect();
            if missing.is_empty() {
                return Ok(());
            }
            let tracks = [("blind", ObservedExtras::Blind), ("mass", ObservedExtras::Mass)];
            let has_all = |track: &ObservedExtras| missing.iter().all(|extra| track.names().contains(extra));
            let enough = tracks.into_iter().find(|(_, track)| has_all(track)).map_or("oracle", |(name, _)| name);
            return Err(format!(
                "reads {}, which the benchmark does not observe: it has the extras {}; one with the key \
                 observation.extras = {enough:?} is needed",
                listed(&missing),
                listed(&observed),
            ));
        }
        if observed.iter().eq(&self.extras) {
            return Ok(());
        }
        Err(format!(
            "learned with other extras beside the observation: {} here, {} in the benchmark; the key \
             observation.extras must be equal",
            listed(&self.extras.iter().map(String::as_str).collect::<Vec<&str>>()),
            listed(&observed),
        ))
    }

    fn check_vehicles(&self, world: &World) -> Result<(), String> {
        // One that learned on empty roads is a baseline among vehicles: it does not see them.
        if !self.reads_vehicles() || world.observes_vehicles() {
            return Ok(());
        }
        Err("reads what other vehicles do, which the benchmark does not observe; one with [traffic] and \
             observation.vehicles = true is needed"
            .to_owned())
    }

    fn check_actions(&self, world: &World) -> Result<(), String> {
        if world.is_continuous() && self.head == Head::Levels {
            return Err(format!(
                "chooses among {} actions, and the benchmark takes commands (actions.kind = \"continuous\"); a policy \
                 whose head is continuous is needed",
                self.actions.len(),
            ));
        }
        if !world.is_continuous() && self.head != Head::Levels {
            return Err(format!(
                "gives commands between -1 and 1, and the benchmark has a table of {} actions; a policy with the head \
                 {:?} is needed",
                world.actions.len(),
                Head::Levels.name()
            ));
        }
        let near = |a: f32, b: f32| (a - b).abs() <= SAME_ACTION * a.abs().max(1.0);
        let same = |(a, b): (&Action, &Action)| near(a.steering, b.steering) && near(a.speed, b.speed);
        if self.actions.len() == world.actions.len() && self.actions.iter().zip(&world.actions).all(same) {
            return Ok(());
        }
        let (mut here, mut there) = (described(&self.actions), described(&world.actions));
        if here == there
            && let Some(index) = self.actions.iter().zip(&world.actions).position(|pair| !same(pair))
        {
            let action = |actions: &[Action]| format!("action {index} is {}", of_action(&actions[index]));
            (here, there) = (action(&self.actions), action(&world.actions));
            if here == there {
                let exactly = |actions: &[Action]| {
                    let Action { steering, speed } = actions[index];
                    format!("action {index} is {steering:?} rad, {speed:?} m/s")
                };
                (here, there) = (exactly(&self.actions), exactly(&world.actions));
            }
        }
        Err(format!(
            "learned with another action table: {here} here, {there} in the benchmark; a policy that learned with the \
             same actions and the same vehicle lock is needed",
        ))
    }
}

/// An action in words.
fn of_action(action: &Action) -> String {
    format!("{:.1} deg, {:.1} km/h", action.steering.to_degrees(), 3.6 * action.speed)
}

/// An action table in a few words.
fn described(actions: &[Action]) -> String {
    let range = |value: fn(&Action) -> f32| {
        let values = actions.iter().map(value);
        (values.clone().fold(f32::INFINITY, f32::min), values.fold(f32::NEG_INFINITY, f32::max))
    };
    let (right, left) = range(|action| action.steering.to_degrees());
    let (slow, fast) = range(|action| action.speed * 3.6);
    format!("{} actions, {right:.1}..{left:.1} deg, {slow:.1}..{fast:.1} km/h", actions.len())
}
