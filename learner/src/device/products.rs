//! Products of matrices in one buffer: what `products.wgsl` makes.

use offtrack::layout::WORKGROUP;
use offtrack::layout::shared::Literal;

offtrack::shared! {
    /// A product of two matrices, of which tiles are made. Places are indices in the buffer.
    pub struct Product {
        /// Its first tile; `NONE` where there is no product.
        pub first: u32,
        /// Rows of the result.
        pub n_rows: u32,
        /// Columns of the result.
        pub n_columns: u32,
        /// Elements of a sum.
        pub n_inner: u32,
        /// Place of the left matrix.
        pub left: u32,
        /// From one of its rows to the next.
        pub left_row: u32,
        /// From one inner index to the next.
        pub left_inner: u32,
        /// Place of the right matrix.
        pub right: u32,
        /// From one inner index to the next.
        pub right_inner: u32,
        /// From one of its columns to the next.
        pub right_column: u32,
        /// Place of the result, row by row.
        pub result: u32,
        /// Place of biases that are added to each row, or `NONE`.
        pub biases: u32,
        /// Sums below 0 become 0 (0 or 1).
        pub is_rectified: u32,
        /// Place of what a rectifier left, or `NONE`: where that is 0 the result is 0 too.
        pub mask: u32,
        /// Place of the sums of the right matrix along the inner index, or `NONE`.
        pub sums: u32,
        /// Fills the row.
        pub unused: u32,
    }
}

/// No place, and no product.
pub(crate) const NONE: u32 = u32::MAX;
/// Side of a tile.
const TILE: u32 = 32;
/// Products of a dispatch at most: a layer of all passes of an update, or two each of those that learn.
pub(crate) const N_PRODUCTS: usize = 6;

impl Product {
    /// No product.
    pub(crate) const NONE: Product = Product {
        first: NONE,
        n_rows: 0,
        n_columns: 0,
        n_inner: 0,
        left: 0,
        left_row: 0,
        left_inner: 0,
        right: 0,
        right_inner: 0,
        right_column: 0,
        result: 0,
        biases: NONE,
        is_rectified: 0,
        mask: NONE,
        sums: NONE,
        unused: 0,
    };

    /// A layer of a network: `rows` of inputs times its weights, and its biases.
    pub(crate) fn layer(rows: [u32; 2], inputs: u32, weights: u32, biases: u32, outputs: [u32; 2]) -> Product {
        let [n_rows, n_inputs] = rows;
        let [result, n_outputs] = outputs;
        Product {
            n_rows,
            n_columns: n_outputs,
            n_inner: n_inputs,
            left: inputs,
            left_row: n_inputs,
            left_inner: 1,
            right: weights,
            right_inner: n_outputs,
            right_column: 1,
            result,
            biases,
            ..Product::NONE
        }
    }

    /// As one dispatch, with the tiles of each behind those of the one before, and its workgroups.
    pub(crate) fn together(each: impl IntoIterator<Item = Product>) -> ([Product; N_PRODUCTS], u32) {
        let mut products = [Product::NONE; N_PRODUCTS];
        let mut groups = 0;
        for (slot, product) in products.iter_mut().zip(each) {
            *slot = Product { first: groups, ..product };
            groups += product.n_rows.div_ceil(TILE) * product.n_columns.div_ceil(TILE);
        }
        (products, groups)
    }
}

/// The constants of the shader.
pub(crate) fn constants() -> String {
    let constants = [("NONE", NONE), ("TILE", TILE), ("N_PRODUCTS", N_PRODUCTS as u32), ("WORKGROUP", WORKGROUP)];
    constants.map(|(name, value)| format!("const {name} = {};\n", value.literal())).concat()
}
