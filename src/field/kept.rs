//! Fields that are kept in a cache, by the outline and cell width that they were baked from.

use bytemuck::{bytes_of, cast_slice};
use glam::Vec2;

use super::Field;
use crate::files::cache::Cache;
use crate::geometry::Outline;

/// Counted up whenever the same outline gives another field, so that older entries are not used.
const FORM: u32 = 1;

impl Field {
    /// What [`Field::bake`] gives, from the cache if it was kept there before; else it is kept now.
    pub fn cached(outline: &Outline, cell: f64, cache: &Cache) -> Field {
        let key = key(outline, cell);
        if let Some(field) = cache.get("field", &key).and_then(|bytes| parsed(&bytes)) {
            return field;
        }
        let field = Field::bake(outline, cell);
        cache.put("field", &key, &field.written());
        field
    }

    /// The field as bytes: origin, cells in a metre, columns, rows, cells, values; little-endian.
    fn written(&self) -> Vec<u8> {
        let Field { origin, cells_per_metre, columns, rows, cells, values } = self;
        let head = [origin.x.to_bits(), origin.y.to_bits(), cells_per_metre.to_bits(), *columns, *rows];
        [&head[..], cells.as_flattened(), values].concat().into_iter().flat_map(u32::to_le_bytes).collect()
    }
}

/// The field that these bytes are; `None` if they are none.
fn parsed(bytes: &[u8]) -> Option<Field> {
    let mut words = bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let [x, y, cells_per_metre, columns, rows] =
        [words.next()?, words.next()?, words.next()?, words.next()?, words.next()?];
    let n_cells = (columns as usize).checked_mul(rows as usize)?;
    let cells: Vec<[u32; 2]> = (0..n_cells).map_while(|_| Some([words.next()?, words.next()?])).collect();
    let values: Vec<u32> = words.collect();
    let whole = cells.len() == n_cells
        && 0 < n_cells
        && 2 <= values.len()
        && cells.iter().all(|&cell| super::pairs(cell).is_none_or(|(_, end)| end <= values.len()));
    let origin = Vec2::new(f32::from_bits(x), f32::from_bits(y));
    whole.then(|| Field { origin, cells_per_metre: f32::from_bits(cells_per_metre), columns, rows, cells, values })
}

/// Everything that a field is computed from.
fn key(outline: &Outline, cell: f64) -> Vec<u8> {
    let mut key = bytes_of(&FORM).to_vec();
    let mut add = |numbers: &[f64]| key.extend_from_slice(cast_slice(numbers));
    add(&[cell]);
    outline.loops.iter().for_each(|curve| add(&curve.numbers()));
    key
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::geometry::Curve;

    #[test]
    fn a_kept_field_is_the_baked_one_and_another_outline_has_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path());
        for radius in [9.0, 9.5] {
            let outline = Outline::new(vec![Curve::circle(DVec2::ZERO, radius)]);
            let baked = Field::bake(&outline, 1.0);
            assert_eq!(Field::cached(&outline, 1.0, &cache), baked);
            assert_eq!(Field::cached(&outline, 1.0, &cache), baked);
            assert_eq!(parsed(&cache.get("field", &key(&outline, 1.0)).unwrap()), Some(baked));
        }
        assert_eq!(folder.path().read_dir().unwrap().count(), 2);
    }

    #[test]
    fn bytes_that_are_no_field_are_refused() {
        let field = Field::bake(&Outline::new(vec![Curve::circle(DVec2::ZERO, 5.0)]), 1.0);
        let bytes = field.written();
        assert_eq!(parsed(&bytes), Some(field.clone()));
        assert_eq!(parsed(&bytes[..16]), None);
        assert_eq!(parsed(&bytes[..bytes.len() - 4]), None);
        assert_eq!(parsed(&Field { rows: field.rows + 900, ..field }.written()), None);
    }
}
