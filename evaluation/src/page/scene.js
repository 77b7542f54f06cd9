// One frame of an episode from above: kerbs, route, both axles' paths, sensors, the truck.
//
// Everything is drawn in metres, x east and y north; widths of lines are in pixels and divided by the scale.

/** Margin around the map, and width of a close-up [m]. */
const MARGIN = 9, CLOSE_UP = 46;

const lineOf = (points, closed) => {
  const path = new Path2D();
  points.forEach(([x, y], index) => (index === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
  if (closed) path.closePath();
  return path;
};

/** The parts of the picture that are constant over an episode. */
function sceneOf(page, episode) {
  const { ground, columns } = page, route = ground.routes[episode.route], map = ground.maps[route.roundabout];
  const road = new Path2D(), lanes = new Path2D();
  for (const loop of map.drivable) road.addPath(lineOf(pointsOf(loop), true));
  for (const lane of map.lanes) lanes.addPath(lineOf(pointsOf(lane), false));
  const centreLine = pointsOf(route.centre_line);
  const poses = Array.from({ length: episode.n_frames }, (_, frame) => instant(page, episode, frame));
  const seen = [...centreLine, ...poses.flatMap((pose) => [[pose.x, pose.y], [pose.trailerX, pose.trailerY]])];
  const ends = (axis) => [Math.min(...seen.map((point) => point[axis])), Math.max(...seen.map((point) => point[axis]))];
  return {
    road, lanes, route: lineOf(centreLine, false), bounds: [ends(0), ends(1)], rig: episode.rig, ended: episode.ended, last: episode.n_frames - 1,
    tractorPath: poses.map((pose) => [pose.x, pose.y]), trailerPath: poses.map((pose) => [pose.trailerX, pose.trailerY]), columns, others: othersOf(page, episode),
  };
}

/** Shows what the colours of a scene mean. */
function showSceneKeys({ others }) {
  const keys = [["kerb", "kerb"], ["route", "route's lane centre"], ["tractor", "tractor, path of its drive axle"],
    ["trailer", "trailer, path of its axles"], ["ray", "distance sensors"]];
  const ofVehicles = [["car", "car"], ["van", "van or larger"], ["brakes", "brakes"], ["rude", "edge of who is rude"]];
  byId("scene-legend").replaceChildren(...lineKeys(others === null ? keys : [...keys, ...ofVehicles]));
}

/** Middle [m] and scale [pixels a metre] of the view. */
function viewOf(scene, now, width, height, follow) {
  if (follow) return { x: (now.x + now.trailerX) / 2, y: (now.y + now.trailerY) / 2, scale: Math.min(width, height) / CLOSE_UP };
  const [[west, east], [south, north]] = scene.bounds;
  const scale = Math.min(width / (east - west + 2 * MARGIN), height / (north - south + 2 * MARGIN));
  return { x: (west + east) / 2, y: (south + north) / 2, scale };
}

/** Runs `draw` in the coordinates of a unit. */
function within(context, x, y, heading, draw) {
  context.save();
  context.translate(x, y);
  context.rotate(heading);
  draw();
  context.restore();
}

function body(context, { front, rear, half_width }, colour, collided, pixel, colourOf) {
  context.beginPath();
  context.roundRect(rear, -half_width, front - rear, 2 * half_width, 0.25);
  context.fillStyle = colour;
  context.fill();
  context.lineWidth = (collided ? 3.5 : 1) * pixel;
  context.strokeStyle = collided ? colourOf("end-tractor_collided") : colourOf("panel");
  context.stroke();
}

function wheel(context, x, y, angle, colour) {
  within(context, x, y, angle, () => {
    context.fillStyle = colour;
    context.fillRect(-0.5, -0.17, 1, 0.34);
  });
}

function drawTruck(context, { rig, ended }, now, pixel, colourOf, atEnd) {
  within(context, now.trailerX, now.trailerY, now.trailerHeading, () => {
    const hit = atEnd && (ended === "trailer_collided" || ended === "rolled_over");
    body(context, rig.trailer_body, colourOf("trailer"), hit, pixel, colourOf);
    for (const side of [-1, 1]) wheel(context, 0, side * (rig.trailer_body.half_width - 0.25), 0, colourOf("ink"));
  });
  within(context, now.x, now.y, now.heading, () => {
    const hit = atEnd && (ended === "tractor_collided" || ended === "rolled_over");
    context.globalAlpha = 0.94;
    body(context, rig.tractor_body, colourOf("tractor"), hit, pixel, colourOf);
    context.globalAlpha = 1;
    for (const side of [-1, 1]) {
      wheel(context, 0, side * (rig.tractor_body.half_width - 0.25), 0, colourOf("ink"));
      wheel(context, rig.wheelbase, side * (rig.tractor_body.half_width - 0.2), now.steering, colourOf("ink"));
    }
    context.beginPath();
    context.arc(rig.fifth_wheel, 0, 0.28, 0, 2 * Math.PI);
    context.fillStyle = colourOf("panel");
    context.fill();
  });
}

/** Other vehicles: brake lights at the rear, an edge around who is rude. */
function drawOthers(context, others, pixel, colourOf) {
  for (const { x, y, heading, length, width, brakes, rude } of others) {
    within(context, x, y, heading, () => {
      context.beginPath();
      context.roundRect(-length / 2, -width / 2, length, width, 0.3);
      context.fillStyle = colourOf(length < 6 && width < 2.3 ? "car" : "van");
      context.fill();
      context.lineWidth = (rude ? 2.5 : 1) * pixel;
      context.strokeStyle = colourOf(rude ? "rude" : "panel");
      context.stroke();
      context.fillStyle = colourOf("panel");
      context.globalAlpha = 0.7;
      context.fillRect(0.14 * length, -0.4 * width, 0.12 * length, 0.8 * width);
      context.globalAlpha = 1;
      if (!brakes) return;
      context.fillStyle = colourOf("brakes");
      for (const side of [-1, 1]) context.fillRect(-length / 2, side * 0.36 * width - 0.25, 0.45, 0.5);
    });
  }
}

function drawRays(context, rig, now, pixel, colourOf) {
  const units = [[rig.trailer_rays, now.trailerX, now.trailerY, now.trailerHeading], [rig.tractor_rays, now.x, now.y, now.heading]];
  context.strokeStyle = context.fillStyle = colourOf("ray");
  context.lineWidth = pixel;
  let ray = 0;
  for (const [rays, x, y, heading] of units) {
    within(context, x, y, heading, () => {
      for (const [ox, oy, dx, dy] of rays) {
        const range = now.ranges[ray++];
        context.globalAlpha = 0.75;
        context.beginPath();
        context.moveTo(ox, oy);
        context.lineTo(ox + range * dx, oy + range * dy);
        context.stroke();
        if (range < 0.995 * rig.sensor_range) {
          context.globalAlpha = 1;
          context.beginPath();
          context.arc(ox + range * dx, oy + range * dy, 2 * pixel, 0, 2 * Math.PI);
          context.fill();
        }
      }
    });
  }
  context.globalAlpha = 1;
}

function drawPaths(context, scene, frame, now, pixel, colourOf) {
  const paths = [[scene.tractorPath, "tractor", [now.x, now.y]], [scene.trailerPath, "trailer", [now.trailerX, now.trailerY]]];
  for (const [points, name, here] of paths) {
    context.strokeStyle = colourOf(name);
    context.globalAlpha = 0.45;
    context.lineWidth = 1.5 * pixel;
    context.stroke(lineOf(points, false));
    context.globalAlpha = 1;
    context.lineWidth = 2 * pixel;
    context.stroke(lineOf([...points.slice(0, Math.floor(frame) + 1), here], false));
  }
}

/** Ten metres, in the lower left corner, in pixels. */
function drawScale(context, height, scale, colourOf) {
  const length = 10 * scale;
  context.strokeStyle = context.fillStyle = colourOf("ink");
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(14, height - 20);
  context.lineTo(14, height - 14);
  context.lineTo(14 + length, height - 14);
  context.lineTo(14 + length, height - 20);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.fillText("10" + GAP + "m", 14, height - 25);
}

/** Draws `frame` of an episode on the canvas, which takes the size that it has on the screen. */
function drawScene(canvas, scene, now, frame, { rays, follow }) {
  const colourOf = colours(), density = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const [across, down] = [Math.round(width * density), Math.round(height * density)];
  if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
  const context = canvas.getContext("2d"), view = viewOf(scene, now, width, height, follow), pixel = 1 / view.scale;
  context.setTransform(density, 0, 0, density, 0, 0);
  context.fillStyle = colourOf("solid");
  context.fillRect(0, 0, width, height);
  context.save();
  context.translate(width / 2, height / 2);
  context.scale(view.scale, -view.scale);
  context.translate(-view.x, -view.y);
  context.lineJoin = context.lineCap = "round";
  context.fillStyle = colourOf("road");
  context.fill(scene.road, "evenodd");
  context.strokeStyle = colourOf("lane");
  context.lineWidth = pixel;
  context.setLineDash([6 * pixel, 6 * pixel]);
  context.stroke(scene.lanes);
  context.setLineDash([]);
  context.strokeStyle = colourOf("kerb");
  context.lineWidth = 1.6 * pixel;
  context.stroke(scene.road);
  context.strokeStyle = colourOf("route");
  context.lineWidth = 3 * pixel;
  context.stroke(scene.route);
  drawPaths(context, scene, frame, now, pixel, colourOf);
  drawOthers(context, othersAt(scene.others, frame), pixel, colourOf);
  if (rays) drawRays(context, scene.rig, now, pixel, colourOf);
  drawTruck(context, scene, now, pixel, colourOf, frame >= scene.last - 1e-6);
  context.restore();
  drawScale(context, height, view.scale, colourOf);
}
