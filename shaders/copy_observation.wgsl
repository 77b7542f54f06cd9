// Copies the observation after the action to the observation before the next action.
//
// The reset stage then replaces it where another episode begins.

@compute @workgroup_size(WORKGROUP)
fn copy_observation(thread: Thread) {
    let value = index_of(thread);
    if !is_driving(value / N_VALUES) { return; }
    observation[value] = next_observation[value];
    let env = value / N_VALUES;
    let extra = value % N_VALUES;
    if extra < N_EXTRAS {
        extras[env * N_EXTRAS + extra] = next_extras[env * N_EXTRAS + extra];
    }
}
