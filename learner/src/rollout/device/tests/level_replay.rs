//! Level replay on a device.

use super::*;

#[test]
fn routes_are_drawn_anew_by_the_episodes_that_ended_on_them_and_so_after_a_checkpoint() {
    let (world, routes) = training();
    let config = config(&["level_replay.fraction=0.5", "level_replay.rate=0.2"]);
    let gpu = least();
    let new =
        || DeviceRollout::<N_VALUES>::with_seeds(&gpu, &config, &world, routes.clone(), None, seeds(&config)).unwrap();
    let list = |rollout: &DeviceRollout<N_VALUES>| rollout.simulator().batch().choice().routes().to_vec();
    let mut rollout = new();
    let mut replay = LevelReplay::new(config.level_replay.unwrap(), routes.clone());
    let key = |end: &RouteEnd| (end.route, end.ended as u32);
    for interval in 0..3 {
        let mut ends = Vec::new();
        for step in 0..100 {
            assert_eq!(list(&rollout), replay.list(), "interval {interval}, step {step}");
            let before: Vec<u32> = rollout.simulator().batch().truck.iter().map(|truck| truck.route).collect();
            rollout.step_at_random().unwrap();
            let codes = &rollout.simulator().batch().ended;
            let codes = codes.iter().map(|&code| Ended::from_code(code).unwrap());
            let all = before.into_iter().zip(codes).map(|(route, ended)| RouteEnd { route, ended });
            ends.extend(all.filter(|end| end.ended != Ended::Running));
        }
        assert!(100 < ends.len(), "{} episodes ended", ends.len());
        ends.sort_by_key(key);
        assert_eq!(rollout.take_route_ends(), ends);
        let earlier = replay.list().to_vec();
        for ends in ends.chunk_by(|one, other| one.route == other.route) {
            replay.count_unordered(ends[0].route, ends);
        }
        replay.renew();
        assert_ne!(replay.list(), earlier);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.safetensors");
    let mut columns = Columns::default();
    rollout.save(&mut columns);
    columns.write(&path, String::new(), 0).unwrap();
    let mut resumed = new();
    let begins = |rollout: &DeviceRollout<N_VALUES>| rollout.simulator().batch().truck.clone();
    let earlier = [begins(&resumed), begins(&rollout)];
    resumed.restore(&Stored::read(&path).unwrap(), 1).unwrap();
    assert_eq!(list(&resumed), replay.list());
    // Neither the run's first episodes nor those of the checkpoint.
    assert!(
        earlier.iter().flatten().all(|truck| begins(&resumed).iter().all(|other| other.position != truck.position))
    );
}
