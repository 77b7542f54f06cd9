//! What trucks share, as the bytes that shaders read: for the engine on a device, and for a page that steps trucks in a
//! browser.

use bytemuck::{bytes_of, cast, cast_slice};

use crate::engine::group::begins_in;
use crate::engine::{Batch, RouteChoice};
use crate::field::{Field, STORED_UNIT};
use crate::layout::buffers::Table;
use crate::layout::shared::constants;
use crate::layout::{
    BatchFacts, FieldRow, N_PREVIEW, PREVIEW_ROWS, PreviewRow, ROUTE_ROWS, Rig, TEAM_MAX, VehicleRow, WaypointRow,
};
use crate::world::{TrafficRoad, World};

/// Workgroups in a row of a dispatch: the most that every device takes.
pub const ROW: u32 = 65_535;
/// Trucks from which on a large device has enough of the largest teams.
pub const MANY: usize = 16_384;
/// Trucks of a team below that.
const FEW: u32 = 8;
/// Rows that a field takes in the table of roads.
const FIELD_ROWS: usize = size_of::<FieldRow>() / size_of::<[u32; 4]>();

constants! {
    /// First word of the fractions of rude drivers in the table of lanes, behind the numbers of the driver model.
    const LANES_RUDE: usize = 7;
    /// Word of the distance between waypoints (m).
    const LANES_SPACING: usize = LANES_RUDE + 2;
    /// Word of the number of demands, of which each episode draws one.
    const LANES_LEVELS: usize = LANES_SPACING + 1;
    /// Word of the probability with which a driver looks away.
    const LANES_LAPSES: usize = LANES_LEVELS + 1;
    /// First word of the routes.
    const LANES_ROUTES: usize = LANES_LAPSES + 1;
    /// Words of a route: the first word of its road, its path there, and the station of its beginning (m).
    const LANES_ROUTE_WORDS: usize = 3;
}

/// The contents of the tables of a world.
#[derive(Debug)]
pub struct Tables<'a> {
    world: &'a World,
    vehicles: Vec<VehicleRow>,
    roads: Vec<[u32; 4]>,
    limits: Vec<u32>,
    // All fields, one after the other.
    cells: Vec<[u32; 2]>,
    corners: Vec<u32>,
    lanes: Vec<u32>,
}

impl<'a> Tables<'a> {
    /// The tables of `world`.
    pub fn new(world: &'a World) -> Tables<'a> {
        let mut fields = Vec::new();
        let (mut cells, mut corners) = (Vec::new(), Vec::new());
        for field in world.all_fields() {
            fields.push(FieldRow {
                origin: field.origin,
                cells_per_metre: field.cells_per_metre,
                slope: field.cells_per_metre * STORED_UNIT,
                columns: field.columns,
                rows: field.rows,
                first_cell: cells.len() as u32,
                first_pair: corners.len() as u32,
            });
            cells.extend(&field.cells);
            corners.extend(&field.values);
        }
        let vehicle = |rig: &Rig| VehicleRow { rays: *world.rays_of(rig), rig: *rig };
        Tables {
            world,
            vehicles: world.rigs.iter().map(vehicle).collect(),
            roads: roads(world, &fields),
            limits: limits(world),
            cells,
            corners,
            lanes: lanes(world),
        }
    }

    /// A table's bytes; `None` of those that belong to a batch.
    pub fn bytes(&self, table: Table) -> Option<&[u8]> {
        Some(match table {
            Table::Params => bytes_of(&self.world.params),
            Table::Weights => bytes_of(&self.world.reward),
            Table::Disturbances => bytes_of(&self.world.disturbances),
            Table::Vehicles => cast_slice(&self.vehicles),
            Table::Actions => cast_slice(&self.world.actions),
            Table::Roads => cast_slice(&self.roads),
            Table::Cells => cast_slice(&self.cells),
            Table::Corners => cast_slice(&self.corners),
            Table::Limits => cast_slice(&self.limits),
            Table::Lanes => cast_slice(&self.lanes),
            Table::Batch | Table::Choice | Table::Streams | Table::Begins => return None,
        })
    }
}

/// Rows of the table of roads: those of the routes, of all waypoints, of their previews, and of the fields of trailers.
/// `common/road.wgsl` reads them.
fn roads(world: &World, fields: &[FieldRow]) -> Vec<[u32; 4]> {
    let (n_routes, n_waypoints) = (world.routes.len(), world.waypoints.len());
    let first_waypoint = n_routes * ROUTE_ROWS;
    let first_preview = first_waypoint + n_waypoints;
    let first_own = first_preview + n_waypoints * PREVIEW_ROWS;
    let (fields, own_fields) = fields.split_at(world.fields.len());
    let mut next_own = (first_own..).step_by(FIELD_ROWS);
    // 0, the first route's own row, where trailers have no field of their own.
    let own_row = |own: &Option<Field>| own.as_ref().and_then(|_| next_own.next()).unwrap_or(0);
    let own_rows: Vec<usize> = world.trailer_fields.iter().map(own_row).collect();
    let mut rows = Vec::with_capacity(first_own + own_fields.len() * FIELD_ROWS);
    for (index, route) in world.routes.iter().enumerate() {
        let (first, crossing) = (route.first as usize, [route.crossing_left, route.crossing_right].map(f32::to_bits));
        rows.push([(first_waypoint + first) as u32, route.n_waypoints, crossing[0], crossing[1]]);
        let roundabout = route.roundabout as usize;
        let [arm, lane] = begins_in(world, index as u32);
        rows.push([
            (first_preview + first * PREVIEW_ROWS) as u32,
            own_rows[roundabout] as u32,
            route.roundabout,
            lane << 16 | arm,
        ]);
        rows.extend(cast::<FieldRow, [[u32; 4]; FIELD_ROWS]>(fields[roundabout]));
    }
    rows.extend(world.waypoints.iter().map(|&waypoint| cast::<WaypointRow, [u32; 4]>(waypoint)));
    for preview in &world.previews {
        let mut words = [[0; 4]; PREVIEW_ROWS];
        words.as_flattened_mut()[..=N_PREVIEW].copy_from_slice(&cast::<PreviewRow, [u32; 1 + N_PREVIEW]>(*preview));
        rows.extend(words);
    }
    own_fields.iter().for_each(|&field| rows.extend(cast::<FieldRow, [[u32; 4]; FIELD_ROWS]>(field)));
    rows
}

/// The class of each vehicle, then what ends an episode on each route; last, among other vehicles, what hindering them
/// weighs, for which judging has no buffer more.
fn limits(world: &World) -> Vec<u32> {
    let mut limits: Vec<u32> = world.rigs.iter().map(|rig| rig.class_index).collect();
    let of_routes = world.step_limits.chunks_exact(world.params.n_classes as usize);
    for (route, step_limits) in world.routes.iter().zip(of_routes) {
        limits.push(route.n_waypoints);
        limits.extend(step_limits);
    }
    limits.extend(world.traffic.iter().map(|traffic| traffic.hindrance.to_bits()));
    limits
}

/// Where other vehicles drive: the numbers of the driver model, for each route the first word of its road and where it
/// runs there, and the words of each road. A single word where there are none, since no buffer is empty.
fn lanes(world: &World) -> Vec<u32> {
    let Some(traffic) = &world.traffic else { return vec![0] };
    let mut lanes = vec![0; LANES_ROUTES];
    lanes[..LANES_RUDE].copy_from_slice(&traffic.rules.words());
    lanes[LANES_RUDE..LANES_SPACING].copy_from_slice(&traffic.rude);
    lanes[LANES_SPACING] = traffic.spacing.to_bits();
    lanes[LANES_LEVELS] = traffic.roads.first().map_or(0, |road| road.levels.len() as u32);
    lanes[LANES_LAPSES] = traffic.rules.lapses;
    let mut first = (LANES_ROUTES + LANES_ROUTE_WORDS * world.routes.len()) as u32;
    let words: Vec<Vec<u32>> = traffic.roads.iter().map(TrafficRoad::words).collect();
    let starts = words.iter().map(|words| {
        first += words.len() as u32;
        first - words.len() as u32
    });
    let starts: Vec<u32> = starts.collect();
    for (route, of) in world.routes.iter().zip(&traffic.routes) {
        lanes.extend([starts[route.roundabout as usize], of.path, of.begins.to_bits()]);
    }
    lanes.extend(words.iter().flatten());
    lanes
}

/// Of each road the first word of its demands in the table of lanes, and the words of each; nothing where there are no
/// vehicles.
pub fn levels(world: &World) -> Vec<(usize, usize)> {
    let Some(traffic) = &world.traffic else { return Vec::new() };
    let mut first = LANES_ROUTES + LANES_ROUTE_WORDS * world.routes.len();
    let of_road = |road: &TrafficRoad| {
        let (n_words, n_of_network) = (road.words().len(), road.network.words().len());
        first += n_words;
        (first + n_of_network - n_words, (n_words - n_of_network) / road.levels.len().max(1))
    };
    traffic.roads.iter().map(of_road).collect()
}

/// Bytes of the tables of a world that grow with it.
pub fn sizes(world: &World) -> [(Table, usize); 6] {
    let of_fields = |bytes: fn(&Field) -> usize| world.all_fields().map(bytes).sum::<usize>();
    let n_own = world.trailer_fields.iter().flatten().count();
    let rows = world.routes.len() * ROUTE_ROWS + world.waypoints.len() * (1 + PREVIEW_ROWS) + n_own * FIELD_ROWS;
    [
        (Table::Cells, of_fields(|field| size_of_val(field.cells.as_slice()))),
        (Table::Corners, of_fields(|field| size_of_val(field.values.as_slice()))),
        (Table::Roads, rows * size_of::<[u32; 4]>()),
        (Table::Limits, size_of_val(limits(world).as_slice())),
        (Table::Lanes, size_of_val(lanes(world).as_slice())),
        (Table::Vehicles, world.rigs.len() * size_of::<VehicleRow>()),
    ]
}

/// Trucks whose rays a workgroup shares. More wait less for each other; with few trucks a large device would have too
/// few workgroups.
pub fn team(n_envs: usize) -> u32 {
    if n_envs < MANY { FEW } else { TEAM_MAX }
}

impl BatchFacts {
    /// Facts of a batch.
    pub fn of(batch: &Batch) -> BatchFacts {
        BatchFacts {
            n_envs: batch.n_envs() as u32,
            n_routes: batch.choice().routes().len() as u32,
            fixed: matches!(batch.choice(), RouteChoice::Fixed(_)).into(),
            autoreset: batch.autoreset() as u32,
            team: team(batch.n_envs()),
            group: batch.group() as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::cache::Loading;
    use crate::scenario::Scenario;

    #[test]
    fn each_demand_of_each_road_is_where_a_host_is_told_to_find_it() {
        let text = Scenario::text_of("attard2023").unwrap() + "\n[traffic]\ndemand = [900, 1500, 2100]\n";
        let mut scenario = Scenario::parse("among", &text, None, &Loading::PLAIN).unwrap();
        scenario.retain(|_, route| route.name == "16m/N-left-2" || route.name == "20m/E-left-3");
        let world = World::bake(&scenario).unwrap();
        let (tables, levels) = (Tables::new(&world), levels(&world));
        let lanes: &[u32] = cast_slice(tables.bytes(Table::Lanes).unwrap());
        let roads = &world.traffic.as_ref().unwrap().roads;
        assert_eq!((roads.len(), levels.len()), (2, 2));
        for (road, (first, n_words)) in roads.iter().zip(levels) {
            let found: Vec<&[u32]> = lanes[first..].chunks_exact(n_words).take(3).collect();
            let expected =
                road.levels.iter().map(|level| [&level.demand.words()[..], cast_slice(&level.snapshots)].concat());
            assert_eq!(found, expected.collect::<Vec<_>>());
        }
    }
}
