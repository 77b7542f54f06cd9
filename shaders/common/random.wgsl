// Random numbers as a pure function of (seed, env, episode, draw): no generator state, the same bits on every engine.
//
// The mixer is pcg4d of M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering" (JCGT 9(3), 2020): u32 arithmetic
// alone.

// Four random words.
fn words(seed: u32, env: u32, episode: u32, draw: u32) -> vec4<u32> {
    var v = vec4<u32>(seed, env, episode, draw) * FACTOR + ADDEND;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4<u32>(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// A word as a number in [-1, 1): its upper 24 bits, exact in f32.
fn signed_unit(word: u32) -> f32 {
    return f32(word >> SPARE_BITS) * UNIT - 1.0;
}

// Four words as a normal number of mean 0 and standard deviation 1: the sum of four uniform ones, at most 3.5 in
// magnitude. The sum is exact in f32.
fn normal(words: vec4<u32>) -> f32 {
    let parts = words >> vec4<u32>(SPARE_BITS_OF_FOUR);
    return (f32(parts.x + parts.y + parts.z + parts.w) * UNIT_OF_FOUR - 2.0) * DEVIATIONS;
}

// A word as an index below `n`, uniform to within 2^-32: the upper half of their product.
fn index_below(word: u32, n: u32) -> u32 {
    let low = (word & 0xffffu) * (n & 0xffffu);
    let middle = (word >> 16u) * (n & 0xffffu) + (low >> 16u);
    let other = (word & 0xffffu) * (n >> 16u) + (middle & 0xffffu);
    return (word >> 16u) * (n >> 16u) + (middle >> 16u) + (other >> 16u);
}
