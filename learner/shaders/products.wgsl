// Products of matrices: the passes of the networks forward and back. A workgroup makes a tile of one product; a thread
// four by four sums of it, each a chain of fused multiply-adds in the order of the inner index. Structs, bindings and
// constants are printed from learner/src/sac/device/kernels.rs.

// Side of a tile in vectors, and from one inner index to the next in workgroup memory: one more, so that threads beside
// each other write to banks of their own.
const SIDE: u32 = TILE / 4u;
const PITCH: u32 = SIDE + 1u;

var<workgroup> left: array<vec4<f32>, TILE * PITCH>;
var<workgroup> right: array<vec4<f32>, TILE * PITCH>;

@compute @workgroup_size(WORKGROUP)
fn multiply(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let tile = group.y * groups.x + group.x;
    var which = 0u;
    for (var n = 1u; n < N_PRODUCTS; n++) {
        if products[n].first <= tile { which = n; }
    }
    let product = products[which];
    let n_columns = (product.n_columns + TILE - 1u) / TILE;
    let row = (tile - product.first) / n_columns * TILE;
    let column = (tile - product.first) % n_columns * TILE;
    if product.n_rows <= row { return; }
    // Neighbouring threads read neighbours: along the inner index, or along rows and columns.
    let left_along = product.left_inner == 1u;
    let right_along = product.right_inner == 1u;
    let thread_row = local / SIDE;
    let thread_column = local % SIDE;
    var a = vec4<f32>();
    var b = vec4<f32>();
    var c = vec4<f32>();
    var d = vec4<f32>();
    var sums = vec4<f32>();
    for (var inner = 0u; inner < product.n_inner; inner += TILE) {
        for (var n = local; n < TILE * SIDE; n += WORKGROUP) {
            let across = vec2<u32>(n % SIDE, n / SIDE);
            let along = vec2<u32>(n / TILE, n % TILE);
            let l = select(across, along, left_along);
            let r = select(across, along, right_along);
            left[l.y * PITCH + l.x] = read_left(product, row + 4u * l.x, inner + l.y);
            right[r.y * PITCH + r.x] = read_right(product, column + 4u * r.x, inner + r.y);
        }
        workgroupBarrier();
        for (var n = 0u; n < TILE; n++) {
            let factors = left[n * PITCH + thread_row];
            let values = right[n * PITCH + thread_column];
            a = fma(vec4<f32>(factors.x), values, a);
            b = fma(vec4<f32>(factors.y), values, b);
            c = fma(vec4<f32>(factors.z), values, c);
            d = fma(vec4<f32>(factors.w), values, d);
            sums += values;
        }
        workgroupBarrier();
    }
    let first = row + 4u * thread_row;
    let own = column + 4u * thread_column;
    write(product, first, own, a);
    write(product, first + 1u, own, b);
    write(product, first + 2u, own, c);
    write(product, first + 3u, own, d);
    if product.sums != NONE && first == 0u {
        for (var n = 0u; n < 4u; n++) {
            if own + n < product.n_columns { memory[product.sums + own + n] = sums[n]; }
        }
    }
}

// Four rows of the left matrix at an inner index; 0 outside.
fn read_left(product: Product, row: u32, inner: u32) -> vec4<f32> {
    if product.n_inner <= inner { return vec4<f32>(); }
    let at = product.left + row * product.left_row + inner * product.left_inner;
    return four(at, product.left_row, product.n_rows - min(row, product.n_rows));
}

// Four columns of the right matrix at an inner index; 0 outside.
fn read_right(product: Product, column: u32, inner: u32) -> vec4<f32> {
    if product.n_inner <= inner { return vec4<f32>(); }
    let at = product.right + inner * product.right_inner + column * product.right_column;
    return four(at, product.right_column, product.n_columns - min(column, product.n_columns));
}

// Four numbers of which each stands `apart` from the one before; 0 where there are fewer.
fn four(at: u32, apart: u32, n: u32) -> vec4<f32> {
    if 4u <= n { return vec4<f32>(memory[at], memory[at + apart], memory[at + 2u * apart], memory[at + 3u * apart]); }
    var found = vec4<f32>();
    if 0u < n { found.x = memory[at]; }
    if 1u < n { found.y = memory[at + apart]; }
    if 2u < n { found.z = memory[at + 2u * apart]; }
    return found;
}

// Writes four sums of a row: with biases, rectified, or nothing of them where a rectifier was shut.
fn write(product: Product, row: u32, column: u32, sums: vec4<f32>) {
    if product.n_rows <= row { return; }
    for (var n = 0u; n < 4u; n++) {
        if column + n < product.n_columns {
            let at = row * product.n_columns + column + n;
            var value = sums[n];
            if product.biases != NONE { value += memory[product.biases + column + n]; }
            if product.is_rectified == 1u { value = max(value, 0.0); }
            if product.mask != NONE && memory[product.mask + at] <= 0.0 { value = 0.0; }
            memory[product.result + at] = value;
        }
    }
}
