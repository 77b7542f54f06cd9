// A value of a truck's observation behind the first: of its extras and, behind those, of other vehicles.
fn beside(env: u32, value: u32) -> f32 {
    let n_extras = facts.n_values - N_VALUES - N_AROUND;
    if value < n_extras { return extras[env * N_EXTRAS + value]; }
    return around[env * N_AROUND + value - n_extras];
}
