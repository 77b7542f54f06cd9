// Angles and places of a truck, in numbers and in words.

/** An angle in [-pi, pi]. */
const wrapped = (angle) => Math.atan2(Math.sin(angle), Math.cos(angle));
const toDegrees = (angle) => (180 * angle) / Math.PI;

/** A steer angle in words (deg). */
const turnWords = (angle) => `${degrees(Math.abs(angle), 1)} ${angle < 0 ? "right" : "left"}`;

/** Middle of the trailer's axles, from that of the drive axle (m). */
const trailerMiddle = (rig, position, heading, trailerHeading) => [Math.cos, Math.sin].map((along, axis) =>
  position[axis] + rig.fifth_wheel * along(heading) - rig.trailer_wheelbase * along(trailerHeading));
