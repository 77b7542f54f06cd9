// Where the roundabouts of a world lie in the picture: side by side in rows, or one alone.

/** Between two places (m). */
const BETWEEN = 12;

/**
 * Places for the roads that are shown, in rows that together are about as wide to their height as `aspect`. `rows` is
 * what view.wgsl reads: a site for each route, then one for each place. Roads that are not shown lie far away. Those that
 * are driven as their mirror image are mirrored back: their y grows downwards.
 */
function sitesOf(world, shown, aspect) {
  const roads = shown.map((index) => ({ index, ...world.roads[index] }));
  const size = ({ bounds: [x0, y0, x1, y1] }) => [x1 - x0 + BETWEEN, y1 - y0 + BETWEEN];
  let best;
  for (let perRow = 1; perRow <= roads.length; perRow++) {
    const found = inRows(roads, size, perRow), [wide, high] = found.extents;
    const scale = Math.min(aspect / wide, 1 / high);
    if (!best || best.scale < scale) best = { ...found, scale };
  }
  const bytes = new ArrayBuffer(16 * (world.routes.length + roads.length));
  const floats = new Float32Array(bytes), words = new Uint32Array(bytes);
  const put = (row, offset, side, route) => {
    floats.set([...offset, side], 4 * row);
    words[4 * row + 3] = route;
  };
  world.routes.forEach((_, route) => put(route, [1e7, 1e7], 1, route));
  best.places.forEach(({ routes, offset, side }, place) => {
    for (const route of routes) put(route, offset, side, route);
    put(world.routes.length + place, offset, side, routes[0]);
  });
  const sideOf = (route) => floats[4 * route + 2];
  return {
    rows: bytes, nRoutes: world.routes.length, places: best.places, extents: best.extents,
    mostWaypoints: Math.max(...world.routes.map((route) => route.n_waypoints)),
    /** -1 where the road of a route is mirrored back, 1 elsewhere: left and right change places. */
    sideOf,
    /** The point of the picture at a point of a route's road, and the other way round (m). */
    placed: (route, [x, y]) => [floats[4 * route] + x, floats[4 * route + 1] + sideOf(route) * y],
    onRoad: (route, [x, y]) => [x - floats[4 * route], sideOf(route) * (y - floats[4 * route + 1])],
  };
}

/** `perRow` places in each row, from the upper left, each row centred; the middle of all is the origin. */
function inRows(roads, size, perRow) {
  const rows = [];
  for (let first = 0; first < roads.length; first += perRow) rows.push(roads.slice(first, first + perRow));
  const widths = rows.map((row) => row.reduce((sum, road) => sum + size(road)[0], 0));
  const heights = rows.map((row) => Math.max(...row.map((road) => size(road)[1])));
  const extents = [Math.max(...widths), heights.reduce((a, b) => a + b, 0)];
  const places = [];
  let top = extents[1] / 2;
  rows.forEach((row, n) => {
    let left = -widths[n] / 2;
    for (const road of row) {
      const [x0, y0, x1, y1] = road.bounds, wide = size(road)[0], side = road.mirrored ? -1 : 1;
      const offset = [left + wide / 2 - (x0 + x1) / 2, top - heights[n] / 2 - (side * (y0 + y1)) / 2];
      places.push({ ...road, offset, side });
      left += wide;
    }
    top -= heights[n];
  });
  return { places, extents };
}
