// What shaders share with Rust. Printed by src/engine/wgsl.rs from the layout and the constants beside each
// stage: change those.

// Trucks of a workgroup, and its threads where none are said.
const WORKGROUP: u32 = 64u;
// Threads of a workgroup that writes observations: its memory lets few workgroups in, so each has more threads.
const WRITERS: u32 = 256u;
// Trucks whose rays a workgroup shares, at most.
const TEAM_MAX: u32 = 32u;
// Values in an observation.
const N_VALUES: u32 = 69u;
// Distance sensors on the trailer, left and right alternating, front to rear.
const N_TRAILER_RAYS: u32 = 16u;
// Distance sensors on the tractor, from left 90 deg to right 90 deg.
const N_TRACTOR_RAYS: u32 = 13u;
// Distance sensors in all: the trailer's first, then the tractor's, as the observation has them.
const N_RAYS: u32 = 29u;
// Values of an observation that depend on the waypoint alone: future and current curvature, radius ahead.
const N_PREVIEW: u32 = 18u;
// Values that may be observed beside those.
const N_EXTRAS: u32 = 12u;
// Other vehicles that are observed one by one, at most.
const N_NEAREST: u32 = 6u;
// Values that may be observed of other vehicles.
const N_AROUND: u32 = 42u;
// Poses of a truck that are kept where what is observed is disturbed: the one that is observed, and those of the
// last three steps, the latest first.
const N_POSES: u32 = 4u;
// Cars on a truck's road, at most: slots of a row.
const N_CARS: u32 = 24u;
// Words of the column of cars: four a slot, and what is counted of them all.
const N_CAR_WORDS: u32 = 102u;
// Rows of four words that a route takes in the table of roads: its own, and its roundabout's field.
const ROUTE_ROWS: u32 = 4u;
// Rows of four words that a waypoint's preview takes there.
const PREVIEW_ROWS: u32 = 5u;
// Bit of `BeginRow::what`: the truck begins an episode.
const BEGINS: u32 = 1u;
// Bit: the episode is the first of the truck's stream, not the next one.
const IS_FIRST: u32 = 2u;
// Bit: its route is stated.
const HAS_ROUTE: u32 = 4u;
// Bit: its start is stated.
const HAS_START: u32 = 8u;
// Bit: its start is drawn, but for offset and heading, which are the lane's.
const IS_CENTRED: u32 = 16u;
// Half a turn.
const PI: f32 = 3.1415927f;
// A turn.
const TAU: f32 = 6.2831855f;
// A quarter of a turn.
const FRAC_PI_2: f32 = 1.5707964f;
// An eighth of a turn.
const FRAC_PI_4: f32 = 0.7853982f;
// Quarters of a turn in a radian.
const FRAC_2_PI: f32 = 0.63661975f;
// tan(pi/8): beyond it the arc tangent's polynomial works on the angle's difference from 45 deg.
const STEEP: f32 = 0.41421357f;
// Polynomial of the arc tangent up to pi/8, in the square, highest power first.
const ARC_TANGENT: array<f32, 4> = array<f32, 4>(0.080537446f, -0.13877685f, 0.19977711f, -0.3333295f);
// pi/2 in three parts, the first two short enough for exact products.
const QUARTER: array<f32, 3> = array<f32, 3>(1.5703125f, 0.0004837513f, 7.54979e-8f);
// Polynomial of the sine up to pi/4, in the square, highest power first.
const SINE: array<f32, 3> = array<f32, 3>(-0.00019515296f, 0.008332161f, -0.16666655f);
// Polynomial of the cosine up to pi/4, in the square, highest power first.
const COSINE: array<f32, 3> = array<f32, 3>(2.4433157e-5f, -0.0013887316f, 0.041666646f);
// The smallest divisor.
const TINY: f32 = 1.1754944e-38f;
// Southern half of a cell's western pair where the cell has blocks elsewhere: no stored distance is as small.
const ELSEWHERE: u32 = 32768u;
// Lowest bits of what the northern half says then: the logarithm of the sub-cells a side of its first block.
const LEVEL_MASK: u32 = 7u;
// Shift of the logarithm of the sub-cells a side of a ridge's other two blocks.
const RIDGE_SHIFT: u32 = 3u;
// Shift of a cell's kind.
const KIND_SHIFT: u32 = 6u;
// `Kind::Ridge`.
const RIDGE: u32 = 1u;
// `Kind::Lesser`.
const LESSER: u32 = 2u;
// `Kind::Greater`.
const GREATER: u32 = 3u;
// Cells a side of the tiles that lie together in memory, west to east.
const TILE_COLUMNS: u32 = 4u;
// Cells a side of the tiles that lie together in memory, south to north.
const TILE_ROWS: u32 = 2u;
// What a stored value of 1 means: 0.5 mm. Exact in f32 (m).
const STORED_UNIT: f32 = 0.00048828125f;
// Factor of the linear congruential step that each counter goes through first.
const FACTOR: u32 = 1664525u;
// Addend of that step.
const ADDEND: u32 = 1013904223u;
// Lowest bits of a word that an f32 cannot hold.
const SPARE_BITS: u32 = 8u;
// Unit of the bits above them.
const UNIT: f32 = 1.1920929e-7f;
// Lowest bits of a word that the sum of four such words has no room for in an f32.
const SPARE_BITS_OF_FOUR: u32 = 10u;
// Unit of the sum of the bits above them: four uniform numbers of 0..1 add up to 4.
const UNIT_OF_FOUR: f32 = 2.3841858e-7f;
// Standard deviations in a unit of that sum.
const DEVIATIONS: f32 = 1.7320508f;
// `Draw::Route`.
const DRAW_ROUTE: u32 = 0u;
// `Draw::Pose`.
const DRAW_POSE: u32 = 1u;
// `Draw::Vehicle`.
const DRAW_VEHICLE: u32 = 4294967295u;
// `Draw::Delays`.
const DRAW_DELAYS: u32 = 4294967294u;
// `Draw::Offsets`.
const DRAW_OFFSETS: u32 = 4294967293u;
// `Draw::Noise`.
const DRAW_NOISE: u32 = 4294967292u;
// `Draw::Traffic`.
const DRAW_TRAFFIC: u32 = 4294967291u;
// `Draw::Action`.
const DRAW_ACTION: u32 = 2u;
// Braking at which a truck comes to stand (m/s^2).
const HOLD_BRAKING: f32 = 0.5f;
// Parts of a command's half range in a word.
const HALF_RANGE: f32 = 32767.0f;
// One of them.
const RANGE_PART: f32 = 3.051851e-5f;
// A command of 0 in a word.
const MIDDLE: f32 = 32768.0f;
// Lowest speed that the engine's power is divided by (m/s).
const POWER_SPEED_MIN: f32 = 1.0f;
// Keeps a quotient finite at a standstill (m^2/s^2).
const SPEED_SQUARED_MIN: f32 = 0.01f;
// Least fraction of its wheelbase that a tractor with oversteer steers as if it had.
const WHEELBASE_MIN: f32 = 0.5f;
// Samples taken at once.
const LANES: u32 = 8u;
// Points of a unit sampled first, at most.
const N_FIRST: u32 = 16u;
// Further than any clearance (m).
const FAR: f32 = 340282346638528859811704183484516925440.0f;
// Points of a tractor's centre line sampled first: with its corners as many as are sampled at once.
const N_TRACTOR: u32 = 4u;
// Points of a trailer's centre line sampled first: with its corners twice as many.
const N_TRAILER: u32 = 12u;
// Error of a clearance that is always tolerated (m).
const TOLERANCE: f32 = 0.01f;
// Error that is tolerated as a fraction of the clearance: far from a kerb a centimetre does not matter.
const FRACTION: f32 = 0.5f;
// Most undecided spans: at first 11 and 8 of a trailer, then at most 8 more for each of the 8 halvings from 2.5 m
// to 1 cm.
const N_SPANS: u32 = 96u;
// Index of the noise of the position among an episode's and step's, east and then north: those below are the
// rays'.
const POSITION_NOISE: u32 = 32u;
// Index of the noise of the tractor's heading, and behind it of the trailer's.
const HEADING_NOISE: u32 = 34u;
// The circles at both ends of a step may lie this far apart (m): a kerb thinner than this along the ray can hide
// between them.
const RAY_GAP: f32 = 0.05f;
// A step this short is never taken back (m).
const RAY_SHORT: f32 = 0.25f;
// Closer to a kerb than this, it is taken for straight (m).
const RAY_CLOSE: f32 = 0.15f;
// Distance to a kerb at which a ray has met the kerb (m).
const RAY_MET: f32 = 0.004f;
// Head-on, a ray has met the kerb from this far off: a straight kerb's position is known to a few millimetres then
// (m).
const RAY_MET_HEAD_ON: f32 = 0.02f;
// Slope of a ray 5 deg from grazing; flatter ones are not followed to the last centimetre.
const RAY_GRAZING: f32 = 0.087f;
// Fraction of the longest step that is tried, so that the circles overlap where the field is slightly off.
const CAUTION: f32 = 0.98f;
// Most samples of a ray. A ray along a kerb at the longest range takes fewer.
const SAMPLES_MAX: u32 = 128u;
// Speed that is observed as 1 (m/s).
const SPEED_SCALE: f32 = 27.8f;
// Distance to a waypoint or its crossing line that is observed as 1 (m).
const WAYPOINT_SCALE: f32 = 20.0f;
// Distance to the lane centre that is observed as 1 (m).
const LANE_SCALE: f32 = 10.0f;
// Number of waypoints that angles are taken to.
const N_LOOK_AHEAD: u32 = 5u;
// Waypoints beyond the next one that angles are taken to.
const LOOK_AHEAD: array<u32, 5> = array<u32, 5>(0u, 2u, 5u, 7u, 10u);
// Index of the distances to the next two waypoints.
const DISTANCES_AT: u32 = 1u;
// Index of the distances to their crossing lines.
const CROSSINGS_AT: u32 = 3u;
// Index of the distance to the lane centre.
const LANE_AT: u32 = 5u;
// Index of the angles at the waypoint behind, from those ahead to the truck.
const BEARINGS_AT: u32 = 6u;
// Index of the tractor's headings relative to the lane's ahead.
const HEADINGS_AT: u32 = 11u;
// Index of the trailer's.
const TRAILER_HEADINGS_AT: u32 = 16u;
// Index of the articulation.
const ARTICULATION_AT: u32 = 21u;
// Index of the curvatures of the route.
const CURVATURES_AT: u32 = 22u;
// Number of curvatures.
const N_CURVATURES: u32 = 8u;
// Index of the ranges.
const RANGES_AT: u32 = 30u;
// Index of the radii ahead.
const RADII_AT: u32 = 59u;
// Acceleration that is observed as 1 (m/s^2).
const ACCELERATION_SCALE: f32 = 2.5f;
// Lateral acceleration that is observed as 1 (m/s^2).
const G: f32 = 9.81f;
// Wheelbase that is observed as 1 (m).
const WHEELBASE_SCALE: f32 = 10.0f;
// Roll that is observed as 1 (rad).
const ROLL_SCALE: f32 = 0.15f;
// Roll rate that is observed as 1 (rad/s).
const ROLL_RATE_SCALE: f32 = 0.3f;
// Mass that is observed as 1 (kg).
const MASS_SCALE: f32 = 40000.0f;
// Bits of a state's station below one of decisions.
const FINER_STATION: u32 = 10u;
// The same of a speed.
const FINER_SPEED: u32 = 5u;
// Units of lengths in a metre.
const METRE: f32 = 1024.0f;
// Units of speeds in a m/s.
const PACE: f32 = 1638.4f;
// Larger than every length of a road (2^-10 m).
const BEYOND: i32 = 1048576i;
// No car and no truck that one minds is faster (2^-14 m a step).
const FASTEST: i32 = 20480i;
// An interaction of 1.
const ONE: i32 = 65536i;
// Bits of a ratio of gaps below 1.
const RATIO_BITS: u32 = 14u;
// Interactions are below 16: the hardest braking needs 5.
const MOST_RATIO: u32 = 65535u;
// 1 / (2 sqrt(a b)) = 0.2236 s²/m of an acceleration of 2 m/s² and a braking of 2.5 m/s²: for products of speeds
// in units of 2^-18 m² a step².
const PER_PRODUCT: i32 = 1431i;
// The same for squares of speeds in m²/s² (2^-10).
const PER_SQUARE: i32 = 229i;
// The smallest gap that counts (2^-10 m).
const LEAST_GAP: i32 = 102i;
// A car that stands is this far before what it stops at (2^-10 m).
const STANDS_BEFORE: i32 = 205i;
// The least distance to a line (2^-10 m).
const LEAST_DISTANCE: i32 = 51i;
// The least distance to half of `STANDS_BEFORE` before it (2^-10 m).
const LEAST_LEFT: i32 = 31i;
// A car brakes comfortably where its squared speed is at most so many times the distance: 2 x 2.5 m/s² (m/s²).
const TWICE_BRAKING: i32 = 5i;
// What moves can still stop before a line at 4 m/s²: within an eighth of its squared speed, three bits.
const STOPS_WITHIN: u32 = 3u;
// Braking at most towards a lower speed limit, in units of an interaction: 1.5 x 2 m/s².
const SLOWING: i32 = 98304i;
// Ratio of a speed to the wished one, in units of 2^-15, beyond which a car slows as hard as it does for a limit.
const MOST_PART: u32 = 49152u;
// Hardest braking in units of the largest acceleration: 8 m/s² of 2 m/s².
const HARDEST: i32 = 262144i;
// The hardest braking in the units of a state (2^-19 m a step²).
const HARDEST_OF_STATE: i32 = 41943i;
// How far temperament changes the speed on a free road (1/150 of it for each of its 15 units).
const SPEED_PARTS: i32 = 150i;
// How far it changes headway and lags (1/100 of them for each of its 15 units).
const TIME_PARTS: i32 = 100i;
// Numbers of `Rules`, in words.
const N_RULES: u32 = 7u;
// Index of the time headway among them.
const RULE_HEADWAY: u32 = 0u;
// Index of the gap.
const RULE_GAP: u32 = 1u;
// Index of the first lag.
const RULE_LAGS: u32 = 2u;
// Index of the first lag before traffic that is only passed beside.
const RULE_SOFT_LAGS: u32 = 4u;
// Index of the courtesy.
const RULE_COURTESY: u32 = 6u;
// Distance between samples of a path (m).
const SPACING: f32 = 2.0f;
// Bits of a state's station below the distance between samples.
const SPACING_BITS: u32 = 21u;
// Bits of a station of decisions below the unit of zones.
const UNIT_BITS: u32 = 4u;
// Bits of a station of decisions below the unit of pairs.
const CELL_BITS: u32 = 11u;
// Bits of a zone's ratio below 1.
const ZONE_RATIO_BITS: u32 = 12u;
// Bit of a zone's kind at which its ratio begins.
const ZONE_RATIO: u32 = 2u;
// Bits of a length by which stations along a zone are compared below those of decisions.
const COARSER: u32 = 5u;
// Bit of a network's first word that says that there are tables of large vehicles.
const HAS_LARGE: u32 = 2u;
// Words before the tables of a road.
const NETWORK_HEAD: u32 = 6u;
// Words of a path.
const PATH_WORDS: u32 = 8u;
// Words of a sample.
const SAMPLE_WORDS: u32 = 5u;
// Words of a pair.
const PAIR_WORDS: u32 = 2u;
// Words of a zone.
const ZONE_WORDS: u32 = 3u;
// Words of a source.
const SOURCE_WORDS: u32 = 4u;
// Cars follow each other: code of a zone's kind.
const FOLLOW: u32 = 0u;
// One car at a time.
const CROSS: u32 = 1u;
// Who enters yields.
const SOFT: u32 = 2u;
// Only a vehicle that may need the lanes beside its own yields.
const WIDE: u32 = 3u;
// Bit of a style at which the kind of a large vehicle stands: 0 is a car or a van, 1 a bus, 2 a rigid truck, 3 a
// tractor-trailer.
const LARGE: u32 = 8u;
// Kinds of large vehicles.
const N_LARGE: u32 = 3u;
// Classes of vehicles by the room that they need: cars and vans, vehicles of one unit, tractor-trailers.
const N_CLASSES: u32 = 3u;
// Length of path that a bus takes: in bends its rear lags behind the path, which is longer than its own way (2^-10
// m).
const BUS_LENGTH: i32 = 14336i;
// The same of a rigid truck (2^-10 m).
const RIGID_LENGTH: i32 = 12288i;
// The same of a tractor-trailer (2^-10 m).
const COMBINATION_LENGTH: i32 = 19577i;
// Half the width of a bus and of a rigid truck (m).
const LARGE_HALF_WIDTH: f32 = 1.275f;
// Half the width of a tractor-trailer (m).
const COMBINATION_HALF_WIDTH: f32 = 1.25f;
// Front axle of a bus behind its front (m).
const BUS_HINGE: f32 = 2.7f;
// Front axle of a rigid truck behind its front (m).
const RIGID_HINGE: f32 = 1.4f;
// Kingpin of a tractor-trailer behind its front (m).
const COMBINATION_HINGE: f32 = 4.498f;
// Length of a bus (m).
const BUS_BODY: f32 = 12.0f;
// Length of a rigid truck (m).
const RIGID_BODY: f32 = 10.0f;
// Front of a trailer ahead of its kingpin (m).
const TRAILER_AHEAD: f32 = 2.09f;
// Length of a trailer (m).
const TRAILER_LENGTH: f32 = 13.71f;
// Front axle of a tractor behind its front (m).
const TRACTOR_FRONT_AXLE: f32 = 1.363f;
// Its drive axle behind its front (m).
const TRACTOR_DRIVE_AXLE: f32 = 4.906f;
// Its length (m).
const TRACTOR_LENGTH: f32 = 5.864f;
// How much longer a large vehicle waits for a gap than a car does (1/256 step).
const LAG_OF_LARGE: i32 = 1280i;
// The largest acceleration of a large vehicle: 1.3 m/s² (2^-19 m a step²).
const MOST_OF_LARGE: i32 = 6816i;
// Its speed, in sixteenths of a car's at that place.
const PACE_OF_LARGE: i32 = 13i;
// Words before the tables of large vehicles: how many zones there are.
const LARGE_HEAD: u32 = 1u;
// Words of a line and of where crossed lanes are clear behind it.
const LINE_WORDS: u32 = 2u;
// Words of the trails of a sample.
const TRAIL_WORDS: u32 = 6u;
// Words of the bands of a sample.
const BAND_WORDS: u32 = 3u;
// Pairs of classes of which one is of large vehicles.
const LARGE_PAIRS: u32 = 8u;
// Units of a trail's direction in 1.
const TRAIL_UNITS: f32 = 32767.0f;
// Units of a band in a metre.
const BAND_UNITS: f32 = 1024.0f;
// Arrivals: the step is added.
const ARRIVAL: u32 = 2147483648u;
// Path and style of a car that enters: 16 times the step and the source are added.
const ENTERING: u32 = 2684354560u;
// Kind of the large vehicle that comes next: source, slot and style of the car before it are added.
const NEXT_KIND: u32 = 2952790016u;
// Who of two that stand goes first: the period and both slots are added.
const COIN: u32 = 3221225472u;
// Whether one lets another in: the period and both slots are added.
const COURTESY: u32 = 3489660928u;
// Whether one looks away: the period and its slot are added.
const LAPSE: u32 = 3758096384u;
// Steps for which a coin falls the same way.
const COIN_PERIOD: u32 = 10u;
// Steps for which a car is as courteous to another.
const COURTESY_PERIOD: u32 = 32u;
// Steps for which one looks away.
const LAPSE_PERIOD: u32 = 20u;
// Numbers of slots that differ in a draw.
const SLOTS: u32 = 64u;
// Bits of a style in a draw.
const STYLE_BITS: u32 = 10u;
// Path of a slot without a car.
const NO_PATH: u32 = 1023u;
// Bit of a car's word at which its style begins.
const STYLE: u32 = 10u;
// Bit at which the steps begin for which it has been standing.
const STANDING: u32 = 20u;
// Most steps that are counted.
const MOST_STANDING: u32 = 4095u;
// Bits of a style: temperament in 16 steps.
const TEMPERAMENT: u32 = 15u;
// Lowest of the two bits of the length.
const LENGTH: u32 = 4u;
// Bit of a van.
const VAN: u32 = 64u;
// Bit of a driver who is rude.
const RUDE: u32 = 128u;
// Length of the shortest car (2^-10 m).
const SHORTEST: i32 = 4301i;
// From one length to the next (2^-10 m).
const LONGER: i32 = 307i;
// Length of a van (2^-10 m).
const VAN_LENGTH: i32 = 7168i;
// Half the width of a car (m).
const HALF_WIDTH: f32 = 0.9f;
// Half the width of a van (m).
const VAN_HALF_WIDTH: f32 = 1.05f;
// Part of the length before the front axle, and behind the rear one.
const OVERHANG: f32 = 0.2f;
// Units of a state's station in a metre.
const STATE_METRE: f32 = 1048576.0f;
// Units of its speed in a m/s.
const STATE_SPEED: f32 = 52428.8f;
// Units of its acceleration in a m/s².
const STATE_ACCELERATION: f32 = 5242.8804f;
// Below this speed a car stands: 0.1 m/s (2^-19 m a step).
const STANDS: i32 = 5243i;
// Nothing farther ahead of a car is looked at (2^-10 m).
const SIGHT: i32 = 32768i;
// The same of a car that may come to meet it (2^-10 m).
const SIGHT_OF_OTHERS: i32 = 46080i;
// What may matter of a car begins so far behind its rear (2^-10 m).
const BEHIND: i32 = 512i;
// A zone is left once the rear is so far behind it (2^-10 m).
const LEFT: i32 = 307i;
// Two cars that have it before them agree on who is first from this distance on (2^-10 m).
const AGREED: i32 = 35840i;
// Twice the braking above which a car does not stop for another that is about as near (m/s²).
const GOES_ABOVE: i32 = 7i;
// Least speed in a time to a zone (2^-14 m a step).
const LEAST_SPEED: i32 = 6554i;
// Least wished speed (2^-14 m a step).
const LEAST_WISHED: i32 = 819i;
// Steps after which one that has been standing goes by the coin.
const PATIENT: u32 = 20u;
// Who looks away looks up once he would brake harder than at 3 m/s² (2^-19 m a step²).
const LOOKS_UP: i32 = -15729i;
// Interaction of a car that must let another out of a crossing: it wishes three times the gap.
const LETS_OUT: i32 = 589824i;
// Zones that begin up to here behind the line are those of the entry (2^-10 m).
const OF_ENTRY: i32 = 12288i;
// Least speed in the time to the line (2^-14 m a step).
const LEAST_APPROACH: i32 = 4915i;
// Least speed in the time until a crossing is free (2^-14 m a step).
const LEAST_CROSSING: i32 = 1638i;
// Steps of standing after which a lag would be 0.
const IMPATIENCE: i32 = 100i;
// How many are left of them at least.
const LEAST_PATIENCE: i32 = 30i;
// Time by which a car that crosses ahead must be gone before this one is there (1/256 step).
const GONE_BEFORE: i32 = 1280i;
// A car that follows one slower than this stays off the lanes that it crosses (2^-14 m a step).
const SLOW: i32 = 4915i;
// A car is let in within this distance of its line (2^-10 m).
const LET_IN_WITHIN: i32 = 4096i;
// The same below this speed (2^-14 m a step).
const LET_IN_BELOW: i32 = 6554i;
// Twice the braking with which a car lets another in (m/s²).
const LETS_IN_WITH: i32 = 3i;
// It does so far before the zone (2^-10 m).
const LETS_IN_BEFORE: i32 = 1536i;
// Bits of the backlog for each source.
const BACKLOG_BITS: u32 = 4u;
// Sources of a word of the backlog.
const BACKLOG_SOURCES: u32 = 8u;
// So many cars wait outside at most, and further ones stay away.
const MOST_WAITING: u32 = 15u;
// A car enters with at least so much room before it (2^-10 m).
const ENTRY_ROOM: i32 = 3072i;
// Twice the braking with which it could stop behind the one before it (m/s²).
const STOPS_WITH: i32 = 3i;
// Steps of standing beyond the line after which a car is taken away where there may be large vehicles, of which a
// few can block a full ring for ever.
const STUCK: u32 = 1200u;
// Steps between two decisions of a car; slots take turns.
const DECIDES_EVERY: u32 = 2u;
// Slots of a row that decide in a step.
const N_TURNS: u32 = 12u;
// Words of a car.
const CAR_WORDS: u32 = 4u;
// Word of a row at which the cars begin that wait outside.
const BACKLOG_AT: u32 = 96u;
// Word of the demand that the episode has.
const LEVEL_AT: u32 = 98u;
// Word of the step in which the truck entered.
const ENTERED_AT: u32 = 99u;
// Word of the contact.
const MET_AT: u32 = 100u;
// Word of the cars that slow for the truck.
const HINDERED_AT: u32 = 101u;
// States of a road and a demand.
const N_SNAPSHOTS: u32 = 64u;
// A truck that comes is this far from where cars enter, or two seconds, when they stay away (2^-10 m).
const COMING: i32 = 3072i;
// A truck swings out before its line: it has entered so far before the line of cars (2^-10 m).
const SWINGS_OUT: i32 = 2560i;
// Steps to each of the two times at which it is foreseen.
const STEPS_AHEAD: u32 = 2u;
// How long they are (s).
const STEP_AHEAD: f32 = 0.5f;
// A truck takes longer to pass than a car: so much is added to the lag (1/256 step).
const LAG_OF_TRUCK: i32 = 3840i;
// Samples of a path that are a car's corridor, from the one behind its front on.
const CORRIDOR_SAMPLES: u32 = 16u;
// Room beside a car to what is in its corridor now (m).
const CORRIDOR_ROOM: f32 = 0.7f;
// The same beside its front itself (m).
const ROOM_AT_FRONT: f32 = 0.4f;
// The same to what will be in its corridor (m).
const ROOM_LATER: f32 = 0.5f;
// What is at a sample may begin half a spacing before it (m).
const BEFORE_SAMPLE: f32 = 1.0f;
// A car that can wait does so for what begins so far behind its line (2^-10 m).
const BEHIND_LINE: i32 = 2048i;
// Interaction of the hardest braking, 8 m/s².
const BRAKES_HARDEST: i32 = 327680i;
// That of 3 m/s² at low speed, with which a car slows at most for what will be.
const BRAKES_GENTLY: i32 = 163840i;
// A unit this near to a car's front may be touched soon (m).
const NEAR_UNIT: f32 = 8.0f;
// Steps in which a car foresees its own way.
const CAR_STEPS_AHEAD: i32 = 4i;
// It does so 0.3 m farther (2^-20 m).
const MORE_AHEAD: i32 = 314573i;
// Room that it keeps then (m).
const LEAST_ROOM: f32 = 0.15f;
// Time before a contact at which it is asked where the truck was (s).
const BEFORE_CONTACT: f32 = 1.0f;
// A truck has entered lately if it did so within so many steps.
const LATELY: u32 = 30u;
// The step, plus 1, in which a truck entered that begins an episode beyond its line: not lately, in words that
// wrap.
const ENTERED_BEFORE: u32 = 4294967267u;
// A car has entered lately if it is not farther behind its line than it drives in this time, or than it comes in
// it from standing (2^-10 m).
const FROM_STANDING: i32 = 9216i;
// No part of a car is farther from the sample behind its front, and no corner of a unit from the end of its axis
// (m).
const NEAR_CAR: f32 = 12.0f;
// So much farther those of a large vehicle may be (m).
const LONGER_THAN_CAR: f32 = 12.0f;
// Below this speed a car stands, and hits nobody (2^-14 m a step).
const HITS_NOBODY: i32 = 82i;
// Added to a contact's code where the truck is at fault: more than there are slots and trucks of a group.
const TRUCKS_FAULT: u32 = 64u;
// What a vehicle may brake with for a truck that is in nobody's way (m/s²).
const GENTLE: f32 = 2.0f;
// Room to other vehicles before and behind each unit that a truck begins with (m).
const ROOM_ALONG: f32 = 7.0f;
// Room beside each unit (m).
const ROOM_BESIDE: f32 = 1.0f;
// Twice the braking with which a truck that begins can stop behind a vehicle (m/s²).
const STOPS_BEHIND_WITH: f32 = 3.0f;
// Time that is observed as 1 (s).
const TIME_SCALE: f32 = 10.0f;
// Distance along a path that is observed as 1 (m).
const GAP_SCALE: f32 = 50.0f;
// Speed of a vehicle that is observed as 1 (m/s).
const VEHICLE_SPEED_SCALE: f32 = 15.0f;
// Distance to a unit that is observed as 1 (m).
const ROOM_SCALE: f32 = 20.0f;
// Distance from a unit within which vehicles are observed one by one, and which is observed as 1 (m).
const NEAR_SCALE: f32 = 60.0f;
// Zones that begin so far behind the line are those of the entry (m).
const ENTRY_REACH: f32 = 12.0f;
// Those that begin so far behind it are on the nearest lane (m).
const NEAREST_LANE: f32 = 3.0f;
// Least speed in a time to a zone (m/s).
const LEAST_COMING_SPEED: f32 = 4.0f;
// Twice the braking with which a vehicle still stops before its line (m/s^2).
const STILL_STOPS_WITH: f32 = 8.0f;
// Index of the times until vehicles are at the entry.
const ARRIVAL_AT: u32 = 0u;
// Index of their distances.
const DISTANCE_AT: u32 = 2u;
// Index of the times until they have left it.
const GONE_AT: u32 = 4u;
// Index of the distance from the line.
const LINE_AT: u32 = 6u;
// Index of whether the front is beyond it.
const HAS_ENTERED_AT: u32 = 7u;
// Index of the gap.
const GAP_AT: u32 = 8u;
// Index of the speed beyond the gap.
const GAP_SPEED_AT: u32 = 9u;
// Index of the room of both units.
const ROOM_AT: u32 = 10u;
// Index of whether there are nearest vehicles.
const NEAREST_AT: u32 = 12u;
// Least 1 plus the cosine of an angle that is halved: keeps the quotient finite where a unit has turned round.
const HALVED_MIN: f32 = 1e-6f;
// First word of the fractions of rude drivers in the table of lanes, behind the numbers of the driver model.
const LANES_RUDE: u32 = 7u;
// Word of the distance between waypoints (m).
const LANES_SPACING: u32 = 9u;
// Word of the number of demands, of which each episode draws one.
const LANES_LEVELS: u32 = 10u;
// Word of the probability with which a driver looks away.
const LANES_LAPSES: u32 = 11u;
// First word of the routes.
const LANES_ROUTES: u32 = 12u;
// Words of a route: the first word of its road, its path there, and the station of its beginning (m).
const LANES_ROUTE_WORDS: u32 = 3u;
// Sums in a tally: steps by their end code, then the rewards.
const N_SUMS: u32 = 11u;
// Index of the sum of the rewards.
const REWARD_SUM: u32 = 10u;
// Units that a reward of 1 is counted in.
const REWARD_UNITS: f32 = 256.0f;
// `Autoreset::SameStep`.
const SAME_STEP: u32 = 0u;
// `Autoreset::NextStep`.
const NEXT_STEP: u32 = 1u;
// `Autoreset::Disabled`.
const DISABLED: u32 = 2u;

// Why an episode ended.
const RUNNING: u32 = 0u;
const ARRIVED: u32 = 1u;
const TRACTOR_COLLIDED: u32 = 2u;
const TRAILER_COLLIDED: u32 = 3u;
const ROLLED_OVER: u32 = 4u;
const JACKKNIFED: u32 = 5u;
const STRAYED: u32 = 6u;
const TIMED_OUT: u32 = 7u;
const MET_VEHICLE: u32 = 8u;
const WAS_MET: u32 = 9u;

// What the steer stage asks of a truck for a step: a steer angle and an acceleration.
struct Control {
    // Steer angle asked for (rad).
    steering: f32,
    // Acceleration asked for (m/s^2).
    acceleration: f32,
    // Integral of the speed error (m).
    speed_error_integral: f32,
    // Steer angle asked for in the step before (rad).
    steering_before: f32,
    // Steer angle asked for in the step before that (rad).
    steering_earlier: f32,
    // Target speed (m/s).
    target_speed: f32,
    // Whether the target speed is 0: once the truck stands, the brakes hold it (0 or 1).
    holds: u32,
    // Steer angle asked for three steps before (rad).
    steering_earliest: f32,
    // With a delay of actions: the action of the step before, its index plus 1 or its command in a word; 0 before
    // the first.
    action_before: u32,
    // The action of the step before that, likewise.
    action_earlier: u32,
    // The action of three steps before, likewise.
    action_earliest: u32,
}

// What is asked of a truck for a step where a benchmark's actions are continuous: each in -1..=1.
struct Command {
    // Steer angle over the lock, left positive.
    steering: f32,
    // Where the target speed, or its change, lies from the benchmark's lowest, at -1, to its highest.
    speed: f32,
}

// One tractor and its trailer.
struct Truck {
    // Middle of the drive axle (m).
    position: vec2<f32>,
    // Heading of the tractor, counter-clockwise from +x (rad).
    heading: f32,
    // Heading of the trailer, counter-clockwise from +x (rad).
    trailer_heading: f32,
    // Speed of the drive axle along the tractor's heading (m/s).
    speed: f32,
    // Steer angle of the front axle, left positive (rad).
    steering: f32,
    // Roll angle of the tractor (rad).
    tractor_roll: f32,
    // Roll rate of the tractor (rad/s).
    tractor_roll_rate: f32,
    // Roll angle of the trailer (rad).
    trailer_roll: f32,
    // Roll rate of the trailer (rad/s).
    trailer_roll_rate: f32,
    // Load transfer ratio of the tractor, the largest of the step in magnitude, signed (1).
    tractor_load_transfer_ratio: f32,
    // Load transfer ratio of the trailer, the largest of the step in magnitude, signed (1).
    trailer_load_transfer_ratio: f32,
    // Index of the route in the world.
    route: u32,
    // Index of the episode, counted for each truck from 0.
    episode: u32,
    // Steps taken in this episode.
    steps: u32,
    // Whether the truck's episode has ended and no other has begun, so that no stage changes it (0 or 1).
    held: u32,
    // Acceleration along the tractor's heading (m/s^2).
    acceleration: f32,
    // Curvature that the tractor's path has beyond that of the steer angle, because it turns in late (1/m).
    curvature_lag: f32,
    // Lateral acceleration of the trailer's axle group, to the left (m/s^2).
    lateral_acceleration: f32,
    // Index of the vehicle in the world.
    vehicle: u32,
}

// Where a truck was at the end of a step.
struct Pose {
    // Middle of the drive axle (m).
    position: vec2<f32>,
    // Heading of the tractor (rad).
    heading: f32,
    // Heading of the trailer (rad).
    trailer_heading: f32,
    // Speed of the drive axle along the tractor's heading (m/s).
    speed: f32,
    // Index of the next waypoint to pass on the route.
    waypoint: u32,
}

// How a truck begins its route: fractions of the largest start errors and of half the range of speeds, each in
// -1..=1, its vehicle, and where along the route. Zeros are the first vehicle on the lane centre at the first
// waypoint and the middle of the speeds.
//
// Beyond the first waypoint both units stand as if the truck had followed the lane to there, with the wheels and
// the lean that the bend asks for; the errors move and turn it as a whole. The clock begins: the episode has the
// whole route's time. The start itself is not judged: a truck that touches a kerb there ends with its first step.
struct Start {
    // Fraction of the largest lateral offset, left positive.
    offset: f32,
    // Fraction of the largest heading error, counter-clockwise positive.
    heading: f32,
    // Fraction of half the range of speeds, from its middle.
    speed: f32,
    // Fraction of the route that lies behind, in 0..=1: the truck begins at the nearest waypoint, the last but one
    // at most.
    along: f32,
    // Index of the vehicle in the world.
    vehicle: u32,
}

// The stream of random numbers that all of a truck's are from: routes, starts, loads, disturbances, vehicles,
// random actions. A truck with the stream (seed, env) drives as truck `env` of a batch with that seed.
struct Stream {
    // Seed.
    seed: u32,
    // Index of a truck in a batch of that seed.
    env: u32,
}

// What the caller asks of a truck: whether and how it begins an episode.
struct BeginRow {
    // Start of the episode, where `HAS_START` is set.
    start: Start,
    // Index of the episode's route in the world, where `HAS_ROUTE` is set.
    route: u32,
    // Bits: `BEGINS`, `IS_FIRST`, `HAS_ROUTE`,
    // `HAS_START`, `IS_CENTRED`.
    what: u32,
}

// Distance from a unit's outline to the nearest solid edge, at most 0 where they touch (m).
//
// Contact is exact to 2 cm. Otherwise the value is at least the true distance less the field's error, and at most
// twice the true distance plus 2 cm: far from a kerb fewer points are sampled.
struct Clearance {
    // Clearance of the tractor (m).
    tractor: f32,
    // Clearance of the trailer (m).
    trailer: f32,
}

// How far along its route a truck is.
struct Progress {
    // Distance from the reference point to the lane centre (m).
    lane_distance: f32,
    // Distance from the reference point to the next waypoint (m).
    waypoint_distance: f32,
    // Index of the next waypoint to pass on the route; the route's number of waypoints once all are passed.
    waypoint: u32,
    // Waypoints passed in this step.
    passed: u32,
}

// The physical amounts that the reward weighs.
struct RewardTerms {
    // Waypoints passed in this step.
    waypoints: f32,
    // Distance to the lane centre, limited and scaled to 0..1.
    lane_distance: f32,
    // Depth of the nearer unit in the margin kept from kerbs, from 0 outside it to 1 at a kerb.
    clearance: f32,
    // 1 when the episode failed in this step.
    failure: f32,
}

// One distance sensor, fixed to a unit. A tractor's frame starts at the drive axle, a trailer's at its axle group.
struct Ray {
    // Mount in the unit's frame, x forward, y left (m).
    origin: vec2<f32>,
    // Unit vector in the unit's frame.
    direction: vec2<f32>,
}

// A rectangle fixed to a unit's frame.
struct Body {
    // Front end, ahead of the frame's origin (m).
    front: f32,
    // Rear end, ahead of the frame's origin (negative when behind) (m).
    rear: f32,
    // Half of the width (m).
    half_width: f32,
}

// One unit's roll model, discretised for a sub-step: `next = transition * state + input * lateral acceleration`.
struct Roll {
    // Row-major transition of (roll, roll rate) over one sub-step.
    transition: array<f32, 4>,
    // Change of (roll, roll rate) by a lateral acceleration of 1 m/s^2 held through the sub-step.
    input: array<f32, 2>,
    // Load transfer ratio per m/s^2 of lateral acceleration.
    per_acceleration: f32,
    // Load transfer ratio per rad of roll.
    per_roll: f32,
    // Load transfer ratio per rad/s of roll rate.
    per_roll_rate: f32,
}

// A first-order lag, discretised for a sub-step in which what is asked for is constant. Zeros are no lag.
struct Lag {
    // Fraction of the deviation that is left at the sub-step's end.
    left: f32,
    // Mean of that fraction over the sub-step.
    mean: f32,
}

// The vehicle as the stages need it.
struct Rig {
    // Front axle ahead of the drive axle (m).
    wheelbase: f32,
    // Fifth wheel ahead of the drive axle (m).
    fifth_wheel: f32,
    // Kingpin ahead of the trailer's axle group (m).
    trailer_wheelbase: f32,
    // Slip factor (rad/(m/s^2)).
    slip: f32,
    // Largest steer angle (rad).
    steer_max: f32,
    // Fastest change of the steer angle (rad/s).
    steer_rate: f32,
    // Strongest braking, negative (m/s^2).
    acceleration_min: f32,
    // Strongest drive (m/s^2).
    acceleration_max: f32,
    // Lateral acceleration that the tyres can hold (m/s^2).
    lateral_acceleration_max: f32,
    // Speed control: acceleration per speed error (1/s).
    speed_gain: f32,
    // Speed control: acceleration per integral of the speed error (1/s^2).
    speed_integral_gain: f32,
    // Speed control: speed error beyond which the integral is reset to 0 (m/s).
    speed_integral_band: f32,
    // Speed control: strongest braking it asks for, negative (m/s^2).
    speed_braking: f32,
    // The tractor's outline.
    tractor_body: Body,
    // The trailer's outline.
    trailer_body: Body,
    // The tractor's roll.
    tractor_roll: Roll,
    // The trailer's roll.
    trailer_roll: Roll,
    // Largest shift of a no-slip point by tyre slip (m).
    slip_lever_max: f32,
    // Time constant, per speed, with which the tractor's yaw follows the steer angle; 0 for at once (s/(m/s)).
    yaw_lag: f32,
    // How the acceleration follows what is asked for when that is drive.
    drive_lag: Lag,
    // How the acceleration follows what is asked for when that is braking.
    brake_lag: Lag,
    // Engine power over the mass of the whole truck (W/kg).
    power: f32,
    // Friction ellipse: the lateral grip is that of free rolling times `sqrt(1 - friction_ellipse acceleration²)`;
    // 0 where drive and braking take no lateral grip ((s^2/m)^2).
    friction_ellipse: f32,
    // Lateral acceleration that the road's fall to the right adds to the roll (m/s^2).
    crossfall: f32,
    // Sub-steps from a steer command to the first movement of the wheels.
    steer_delay: u32,
    // Mass of the trailer with its load (kg).
    trailer_mass: f32,
    // Constant lateral acceleration at which the trailer's inner wheels lift, in units of gravity.
    rollover_threshold: f32,
    // Index of its distance sensors among those of all vehicles.
    chassis: u32,
    // Index of vehicle and load, as reports and the clock group them.
    class_index: u32,
    // Increase of each unit's slip with its load transfer ratio: slip times `1 + slip_growth |ratio|`.
    slip_growth: f32,
    // Understeer: increase of the steer angle that a path needs, per lateral acceleration (rad/(m/s^2)).
    understeer: f32,
    // Fraction of the load on the tractor's axles that the trailer puts on the fifth wheel: by it the trailer's
    // load transfer ratio counts in the tractor's.
    fifth_wheel_load: f32,
}

// The vehicle with its distance sensors, as a device has them side by side.
struct VehicleRow {
    // The distance sensors, trailer's first.
    rays: array<Ray, 29>,
    // The vehicle.
    rig: Rig,
}

// One entry of the action table.
struct Action {
    // Steer angle asked for (rad).
    steering: f32,
    // Speed asked for or, with `Params::changes_speed`, by how much the target speed changes (m/s).
    speed: f32,
}

// The weights of the reward's terms and the limits of two of them, by the keys of a benchmark's `[reward]`.
struct Reward {
    // Reward for each waypoint passed.
    waypoint: f32,
    // Reward for the lane-distance term, each step.
    lane_distance: f32,
    // Distance to the lane centre at which that term is 1 (m).
    lane_distance_limit: f32,
    // Reward for the clearance term, each step.
    clearance: f32,
    // Margin kept from kerbs, within which that term counts (m).
    clearance_limit: f32,
    // Reward when the episode fails.
    failure: f32,
    // Reward for each metre that the trailer is on an apron, each step.
    apron: f32,
}

// What the world does to a policy, by the keys of a benchmark's `[disturbances]`. Zeros are nothing.
struct Disturbances {
    // Standard deviation of a distance sensor, each step (m).
    range_noise: f32,
    // Fraction of the rays that find nothing, each step.
    dropped_rays: f32,
    // Largest error of the position in either direction, constant in an episode (m).
    position_offset: f32,
    // Largest error of the headings, constant in an episode (rad).
    heading_offset: f32,
    // Standard deviation of the position in either direction, each step (m).
    position_noise: f32,
    // Standard deviation of each unit's heading, each step (rad).
    heading_noise: f32,
    // Largest error of the route's place in either direction, constant in an episode (m).
    map_offset: f32,
    // Least age of what is observed (steps).
    observation_delay: u32,
    // Number of ages from there on that are drawn from.
    n_observation_delays: u32,
    // Least number of steps by which an action comes late.
    action_delay: u32,
    // Number of such delays from there on that are drawn from.
    n_action_delays: u32,
    // Whether what is observed differs from what is (0 or 1).
    of_observation: u32,
    // Whether actions come late (0 or 1).
    of_action: u32,
}

// Time and limits, shared by all trucks.
struct Params {
    // Time of one sub-step (s).
    substep: f32,
    // Sub-steps in a step.
    n_substeps: u32,
    // Entries of the action table; 0 where actions are continuous, whose table is the ends of their ranges.
    n_actions: u32,
    // Vehicles that an episode draws from.
    n_vehicles: u32,
    // Range of a distance sensor (m).
    sensor_range: f32,
    // Largest lateral offset at the start (m).
    start_offset: f32,
    // Largest heading error at the start (rad).
    start_heading: f32,
    // Middle of the speeds at the start (m/s).
    start_speed: f32,
    // Half of their range (m/s).
    start_speed_range: f32,
    // Largest fraction of the route that lies behind at a drawn start.
    start_along: f32,
    // Lowest target speed (m/s).
    target_speed_min: f32,
    // Highest target speed (m/s).
    target_speed_max: f32,
    // Whether an action changes the target speed by its speed, rather than states it (0 or 1).
    changes_speed: u32,
    // Classes of vehicles.
    n_classes: u32,
    // Extras that are observed, the first ones; the others stay 0.
    n_extras: u32,
    // Distance to the next waypoint beyond which it cannot be passed and the truck has strayed (m).
    stray_distance: f32,
    // Articulation beyond which the truck is jackknifed (rad).
    jackknife_angle: f32,
    // Load transfer ratio from which the truck has rolled over.
    rollover_ratio: f32,
}

// One waypoint of one route.
struct WaypointRow {
    // Position on the lane centre (m).
    position: vec2<f32>,
    // Unit vector along the lane.
    direction: vec2<f32>,
}

// The values of an observation that depend on the next waypoint alone.
struct PreviewRow {
    // Heading of the lane (rad).
    heading: f32,
    // Scaled as observed: 4 future curvatures, 4 current ones, 10 radii ahead.
    values: array<f32, 18>,
}

// One route in the world's table of waypoints.
struct RouteRow {
    // The route's first waypoint in the table.
    first: u32,
    // The route's number of waypoints.
    n_waypoints: u32,
    // The route's roundabout.
    roundabout: u32,
    // Reach of a waypoint's crossing line to the left (m).
    crossing_left: f32,
    // Reach of a waypoint's crossing line to the right (m).
    crossing_right: f32,
}

// One roundabout's field among the cells and blocks of all fields.
struct FieldRow {
    // South-west corner of the grid (m).
    origin: vec2<f32>,
    // Cells in a metre (1/m).
    cells_per_metre: f32,
    // Slope of the distance where it rises by one stored unit across a cell.
    slope: f32,
    // Cells from west to east.
    columns: u32,
    // Cells from south to north.
    rows: u32,
    // Index of its first cell.
    first_cell: u32,
    // Index of the first pair of its blocks.
    first_pair: u32,
}

// Facts that the trucks of a batch share.
struct BatchFacts {
    // Trucks.
    n_envs: u32,
    // Routes to draw from.
    n_routes: u32,
    // Whether each truck runs the route of its own index (0 or 1).
    fixed: u32,
    // What follows the end of an episode: SAME_STEP, NEXT_STEP or DISABLED.
    autoreset: u32,
    // Trucks whose rays a workgroup shares.
    team: u32,
    // Neighbouring trucks that share a road and its vehicles.
    group: u32,
}

// Time and limits.
@group(0) @binding(0) var<uniform> params: Params;
// What the reward weighs.
@group(0) @binding(1) var<uniform> weights: Reward;
// What the world does to a policy.
@group(0) @binding(2) var<uniform> disturbances: Disturbances;
// The vehicles with their distance sensors.
@group(0) @binding(3) var<storage, read> vehicles: array<VehicleRow>;
// The action table.
@group(0) @binding(4) var<storage, read> actions: array<Action>;
// Every route, all waypoints and what is observed at each of them, as common/road.wgsl reads them.
@group(0) @binding(5) var<storage, read> roads: array<vec4<u32>>;
// Cells of all fields, two words each.
@group(0) @binding(6) var<storage, read> cells: array<vec2<u32>>;
// Blocks of distances of all fields; a word is a pair, the southern one in its lower half, in units of STORED_UNIT.
@group(0) @binding(7) var<storage, read> corners: array<u32>;
// Each vehicle's class; then each route's number of waypoints, and each class's steps until it times out; last, among other vehicles, what hindering them weighs.
@group(0) @binding(8) var<storage, read> limits: array<u32>;
// Of other vehicles: the driver model's numbers, for each route the first word of its road and where it runs there, and each road's tables, as traffic/cars.wgsl reads them.
@group(0) @binding(9) var<storage, read> lanes: array<u32>;
// Facts that the trucks of a batch share.
@group(0) @binding(10) var<uniform> batch: BatchFacts;
// Routes that episodes run on: to be drawn from, or one for each truck.
@group(0) @binding(11) var<storage, read> choice: array<u32>;
// The stream of random numbers that each truck draws from, [n_envs].
@group(0) @binding(12) var<storage, read> streams: array<Stream>;
// Which trucks begin an episode when the caller says so, and how, [n_envs].
@group(0) @binding(13) var<storage, read> begins: array<BeginRow>;
// Index into the action table, [n_envs].
@group(0) @binding(14) var<storage, read_write> action: array<u32>;
// Steer angle and acceleration asked of each truck, [n_envs].
@group(0) @binding(15) var<storage, read_write> control: array<Control>;
// The trucks, [n_envs].
@group(0) @binding(16) var<storage, read_write> truck: array<Truck>;
// Distances to the kerbs (m), [n_envs].
@group(0) @binding(17) var<storage, read_write> clearance: array<Clearance>;
// Progress along the routes, [n_envs].
@group(0) @binding(18) var<storage, read_write> progress: array<Progress>;
// Distance sensors (m), [n_envs, 29].
@group(0) @binding(19) var<storage, read_write> ranges: array<f32>;
// The observation before the next action, [n_envs, 69].
@group(0) @binding(20) var<storage, read_write> observation: array<f32>;
// The observation after the last action, another one only where an episode ended, [n_envs, 69].
@group(0) @binding(21) var<storage, read_write> next_observation: array<f32>;
// Codes of `Ended` for the last step, [n_envs].
@group(0) @binding(22) var<storage, read_write> ended: array<u32>;
// Physical amounts that the reward weighs, [n_envs].
@group(0) @binding(23) var<storage, read_write> terms: array<RewardTerms>;
// Rewards of the last step; of a truck that waits for its group, of its own last one, [n_envs].
@group(0) @binding(24) var<storage, read_write> reward: array<f32>;
// What is observed beside the observation before the next action; zeros beyond what the benchmark observes, [n_envs, 12].
@group(0) @binding(25) var<storage, read_write> extras: array<f32>;
// What is observed beside the observation after the last action, [n_envs, 12].
@group(0) @binding(26) var<storage, read_write> next_extras: array<f32>;
// With disturbances: the pose that is observed, and those of the last three steps; zeros without, [n_envs, 4].
@group(0) @binding(27) var<storage, read_write> poses: array<Pose>;
// Commands, where actions are continuous; zeros where they are indices, [n_envs].
@group(0) @binding(28) var<storage, read_write> command: array<Command>;
// The cars on the road of each truck, and what is counted of them: words of a `traffic::Row`, [n_envs, 102].
@group(0) @binding(29) var<storage, read_write> cars: array<u32>;
// What is observed of other vehicles before the next action; zeros where the benchmark observes none, [n_envs, 42].
@group(0) @binding(30) var<storage, read_write> around: array<f32>;
// What is observed of other vehicles after the last action, [n_envs, 42].
@group(0) @binding(31) var<storage, read_write> next_around: array<f32>;
// Sums over all steps, 64 bits each, the lower half first, [N_SUMS, 2].
@group(0) @binding(32) var<storage, read_write> tally: array<atomic<u32>>;
