// A value of a truck's observation behind the first: of its extras.
fn beside(env: u32, value: u32) -> f32 {
    return extras[env * N_EXTRAS + value];
}
