//! The order in which the CPU works on the trucks of a batch: those on one road after each other.
//!
//! A road's field and waypoints are then read from memory once for many trucks. The order is renewed now and then,
//! since trucks change their roads with their episodes; no result depends on it. Each block of neighbouring trucks has
//! an order of its own, so that a thread that works on it has its rows to itself.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use crate::layout::Truck;
use crate::world::World;

/// Blocks that a thread takes on average: one that is held up leaves some to the others.
const BLOCKS_A_THREAD: usize = 4;
/// Trucks on a road in a block from which on most of what a truck reads of the road has been read before it.
const TRUCKS_A_ROAD: usize = 32;
/// Trucks on a road in a block at least, if it is to be larger for their sake.
const TRUCKS_A_ROAD_MIN: usize = 8;
/// Trucks of a block at least: fewer cost more to hand out than to step.
const BLOCK_MIN: usize = 16;
/// Uses until the order is renewed.
const USES: u32 = 16;

/// A truck's place in the order.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
pub(crate) struct Place {
    /// Index of its road in the world.
    road: u32,
    /// Index of the truck in its block.
    pub index: u32,
}

/// The places of all trucks: blocks of neighbouring trucks, each in the order of their roads.
#[derive(Debug, Clone)]
pub(super) struct Order {
    places: Vec<Place>,
    /// Trucks of a block; 0 before the first use.
    block: usize,
    /// Uses since the order was renewed.
    uses: u32,
    /// Neighbouring trucks on one road, which stay in one block and beside each other.
    group: usize,
}

impl Order {
    /// An order in the memory of these places, of which each `group` neighbours are on one road.
    pub(super) fn new(places: Vec<Place>, group: usize) -> Order {
        Order { places, block: 0, uses: 0, group }
    }

    /// Renews the order where it is due; returns the number of trucks of a block.
    pub(super) fn renewed(&mut self, world: &World, trucks: &[Truck]) -> usize {
        let block = block_of(self.places.len(), world.fields.len(), rayon::current_num_threads());
        let block = block.next_multiple_of(self.group);
        if self.block == block && self.uses < USES {
            self.uses += 1;
            return block;
        }
        (self.block, self.uses) = (block, 0);
        self.places.par_chunks_mut(block).zip(trucks.par_chunks(block)).for_each(|(places, trucks)| {
            for (index, (place, truck)) in places.iter_mut().zip(trucks).enumerate() {
                *place = Place { road: world.routes[truck.route as usize].roundabout, index: index as u32 };
            }
            places.sort_unstable();
        });
        block
    }

    /// Has the order renewed before its next use.
    pub(super) fn outdate(&mut self) {
        self.uses = USES;
    }

    /// The places, a block each.
    pub(super) fn blocks(&mut self) -> impl IndexedParallelIterator<Item = &mut [Place]> {
        self.places.par_chunks_mut(self.block)
    }
}

/// Trucks of a block: a part of what a thread has to do, or all of it where so many roads are to be shared.
fn block_of(n_envs: usize, n_roads: usize, n_threads: usize) -> usize {
    let (whole, part) = (n_envs.div_ceil(n_threads), n_envs.div_ceil(BLOCKS_A_THREAD * n_threads));
    let shares = TRUCKS_A_ROAD_MIN * n_roads <= whole;
    let block = if shares { (TRUCKS_A_ROAD * n_roads).clamp(part, whole) } else { part };
    block.max(BLOCK_MIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    #[test]
    fn blocks_are_large_where_many_roads_are_shared_and_small_where_few_are_or_none_can_be() {
        assert_eq!(block_of(16_384, 256, 2), 8_192);
        assert_eq!(block_of(65_536, 256, 2), 8_192);
        assert_eq!(block_of(16_384, 5, 2), 2_048);
        assert_eq!(block_of(1_024, 256, 2), 128);
        assert_eq!(block_of(3, 256, 2), BLOCK_MIN);
    }

    /// Trucks on routes that change their roads from one truck to the next.
    fn trucks(world: &World, n: usize, shift: usize) -> Vec<Truck> {
        let route = |index: usize| (31 * index + shift) as u32 % world.routes.len() as u32;
        (0..n).map(|index| Truck { route: route(index), ..Truck::default() }).collect()
    }

    #[test]
    fn a_block_has_each_of_its_trucks_once_in_the_order_of_their_roads_and_follows_them_to_others() {
        let world = World::bake(&Scenario::named("attard2023-full").unwrap()).unwrap();
        for n_envs in [1, 15, 64, 1000] {
            let mut order = Order::new(bytemuck::zeroed_vec(n_envs), 1);
            let (before, after) = (trucks(&world, n_envs, 0), trucks(&world, n_envs, 50));
            let roads = |order: &mut Order, trucks: &[Truck]| {
                let block = order.renewed(&world, trucks);
                let mut n_blocks = 0;
                for (places, trucks) in order.places.chunks(block).zip(trucks.chunks(block)) {
                    let mut indices: Vec<u32> = places.iter().map(|place| place.index).collect();
                    indices.sort_unstable();
                    assert!(indices.iter().copied().eq(0..trucks.len() as u32));
                    assert!(places.is_sorted());
                    n_blocks += 1;
                }
                assert_eq!(n_blocks, n_envs.div_ceil(block));
                order.places.iter().map(|place| place.road).collect::<Vec<u32>>()
            };
            let first = roads(&mut order, &before);
            // The trucks have other roads: the order stays for a while, then it is theirs.
            let uses = (1..).find(|_| roads(&mut order, &after) != first || n_envs == 1).unwrap_or_default();
            assert!(n_envs == 1 || uses == USES + 1, "{uses}");
            let mut fresh = Order::new(bytemuck::zeroed_vec(n_envs), 1);
            assert!(n_envs == 1 || roads(&mut fresh, &after) == roads(&mut order, &after));
            order.outdate();
            assert_eq!(roads(&mut order, &before), first);
        }
    }
}
