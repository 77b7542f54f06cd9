// A truck that the visitor drives, by keys or by a pointer. What is asked for goes through the action, so that the
// vehicle's lock, steer rate and acceleration hold.

/** How fast a held key turns the wheels and a released one lets them back (of the lock a second). */
const TURN_RATE = 1.1, RETURN_RATE = 1.8;
/** How fast a held key changes the target speed (m/s^2), and the highest one (m/s). */
const SPEED_RATE = 3, SPEED_MAX = 80 / 3.6;
/** By how much a press of a button changes it (m/s). */
const SPEED_STEP = 5 / 3.6;
/** Keys by what they ask for. */
const DRIVING_KEYS = {
  ArrowLeft: "left", ArrowRight: "right", ArrowUp: "faster", ArrowDown: "slower",
  a: "left", d: "right", w: "faster", s: "slower",
};

class Driving {
  constructor() {
    this.crowd = null;
    this.held = new Set();
    /** Point of the plane that the truck is steered to, from the middle of the picture; null without one (m). */
    this.point = null;
  }

  get isOn() {
    return this.crowd !== null;
  }

  /** Takes over the followed truck of a crowd. */
  takeOver(crowd) {
    this.crowd = crowd;
    this.held.clear();
    this.begin();
  }

  /** Begins with what the truck does. */
  begin() {
    const { truck, control } = this.crowd.row;
    this.episode = truck.episode;
    this.steering = truck.steering;
    this.speed = Math.max(control.target_speed, 0);
    this.ask();
  }

  giveBack() {
    this.crowd?.batch.giveBack();
    this.crowd = this.point = null;
  }

  /** Takes what is asked for as it is: a steer angle (rad) and a target speed (m/s). */
  set({ steering, speed }) {
    Object.assign(this, { steering, speed });
    this.ask();
  }

  /** Changes the target speed (m/s). */
  change(by) {
    this.speed = Math.min(Math.max(this.speed + by, 0), SPEED_MAX);
    this.ask();
  }

  /** A key is pressed or released; true if it is one of these. */
  key(name, isDown) {
    const asked = DRIVING_KEYS[name.length === 1 ? name.toLowerCase() : name];
    if (!this.isOn || !asked) return false;
    if (isDown) this.held.add(asked);
    else this.held.delete(asked);
    return true;
  }

  /** Follows keys and pointer for some seconds. */
  update(seconds) {
    if (!this.isOn) return;
    const { truck } = this.crowd.row, lock = this.crowd.rigOf(truck).steer_max;
    if (truck.episode !== this.episode) this.begin();
    const turn = this.crowd.side * (Number(this.held.has("left")) - Number(this.held.has("right")));
    if (this.point) {
      this.steering = this.towards(this.point);
    } else if (turn !== 0) {
      this.steering += turn * TURN_RATE * lock * seconds;
    } else {
      this.steering -= Math.sign(this.steering) * Math.min(RETURN_RATE * lock * seconds, Math.abs(this.steering));
    }
    this.steering = Math.min(Math.max(this.steering, -lock), lock);
    const faster = Number(this.held.has("faster")) - Number(this.held.has("slower"));
    this.change(faster * SPEED_RATE * seconds);
  }

  /** The steer angle whose circle leads the front axle towards a point (rad). */
  towards(point) {
    const { truck } = this.crowd.row, { wheelbase } = this.crowd.rigOf(truck);
    const [x, y] = this.crowd.picture.sites.onRoad(truck.route, point);
    const front = [Math.cos(truck.heading), Math.sin(truck.heading)].map((part, axis) =>
      truck.position[axis] + wheelbase * part);
    return wrapped(Math.atan2(y - front[1], x - front[0]) - truck.heading);
  }

  ask() {
    const { batch, followed, world, row } = this.crowd;
    const speed = world.facts.changes_speed ? this.speed - row.control.target_speed : this.speed;
    batch.takeOver(followed, { steering: this.steering, speed });
    this.crowd.driven.add(`${followed}/${row.truck.episode}`);
    const left = (50 * this.crowd.side * this.steering) / this.crowd.rigOf(row.truck).steer_max;
    byId("hud-steering").firstElementChild.style.left = `${50 - left}%`;
    byId("hud-speed").textContent = `${decimal(3.6 * this.speed, 0)}${GAP}km/h`;
  }
}
