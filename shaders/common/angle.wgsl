// Angles in plain f32 arithmetic, so that every engine can compute the same bits.

// `angle` wrapped into (-pi, pi], for an angle within a few turns of it.
fn wrapped(angle: f32) -> f32 {
    let turned = angle - TAU * round(angle * (1.0 / TAU));
    return select(turned, turned + TAU, turned <= -PI);
}

// Angle of (x, y) from the x axis in (-pi, pi], 0 for the origin; within 4e-7 of the true one.
//
// S. Moshier's Cephes polynomial for the arc tangent. Library functions of different engines differ by more than its
// error.
fn arc_tangent(y: f32, x: f32) -> f32 {
    let small = min(abs(x), abs(y));
    let large = max(abs(x), abs(y));
    let ratio = small / max(large, TINY);
    let steep = STEEP < ratio;
    let reduced = select(ratio, (ratio - 1.0) / (ratio + 1.0), steep);
    let square = reduced * reduced;
    let series = ((ARC_TANGENT[0] * square + ARC_TANGENT[1]) * square + ARC_TANGENT[2]) * square + ARC_TANGENT[3];
    let octant = series * square * reduced + reduced + select(0.0, FRAC_PI_4, steep);
    let quadrant = select(octant, FRAC_PI_2 - octant, abs(x) < abs(y));
    let half = select(quadrant, PI - quadrant, x < 0.0);
    return select(half, -half, y < 0.0);
}

// Sine and cosine in plain arithmetic, within 1.2e-7 of the true ones for an angle within a few turns of 0.
//
// S. Moshier's Cephes polynomials for an eighth of a turn. A graphics driver may optimise the CPU's addition of a large
// number away, so this rounds explicitly.
fn sin_cos(angle: f32) -> vec2<f32> {
    let count = round(angle * FRAC_2_PI);
    let quarter = u32(i32(count));
    let rest = ((angle - count * QUARTER[0]) - count * QUARTER[1]) - count * QUARTER[2];
    let square = rest * rest;
    let sine = ((SINE[0] * square + SINE[1]) * square + SINE[2]) * square * rest + rest;
    let cosine = ((COSINE[0] * square + COSINE[1]) * square + COSINE[2]) * square * square - 0.5 * square + 1.0;
    let turned = select(vec2<f32>(sine, cosine), vec2<f32>(cosine, -sine), (quarter & 1u) == 1u);
    return select(turned, -turned, (quarter & 2u) == 2u);
}

// Unit vector at `angle` from the x axis.
fn direction(angle: f32) -> vec2<f32> {
    return sin_cos(angle).yx;
}

// `v` turned by a quarter to the left.
fn perpendicular(v: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(-v.y, v.x);
}

// `v` turned by the angle of the unit vector `by`.
fn rotated(by: vec2<f32>, v: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(by.x * v.x - by.y * v.y, by.y * v.x + by.x * v.y);
}
