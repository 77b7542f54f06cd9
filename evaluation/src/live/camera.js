// Which part of the plane the picture shows: moved by pointers, the wheel and keys, or along with a truck.

/** Widths of the picture, and of a close-up of a truck (m). */
const NARROWEST = 6, WIDEST = 4000, TRUCK_WIDTH = 64;

class Camera {
  constructor() {
    this.centre = [0, 0];
    /** Metres of a pixel of the page. */
    this.pixel = 0.5;
    /** Whether `centre` is the distance from the followed truck. */
    this.goesAlong = false;
    /** Whether it shows everything. */
    this.isFitted = true;
    this.size = [1, 1];
  }

  /** Shows a rectangle of these extents (m) around the origin, with room above and below it (pixels). */
  fit(extents, above, below) {
    this.goesAlong = false;
    this.isFitted = true;
    this.pixel = Math.max(extents[0] / this.size[0], extents[1] / Math.max(this.size[1] - above - below, 1));
    this.centre = [0, ((above - below) / 2) * this.pixel];
  }

  /** Goes along with the followed truck, near enough to see its wheels. */
  follow() {
    this.isFitted = false;
    this.goesAlong = true;
    this.centre = [0, 0];
    this.pixel = TRUCK_WIDTH / Math.min(...this.size);
  }

  /** Goes along with nothing. */
  stay() {
    this.isFitted = this.goesAlong = false;
  }

  /** Half of the extents (m). */
  get half() {
    return this.size.map((pixels) => (pixels * this.pixel) / 2);
  }

  /** The point under a pixel of the picture, from the picture's middle (m). */
  fromMiddle([x, y]) {
    return [(x - this.size[0] / 2) * this.pixel, (this.size[1] / 2 - y) * this.pixel];
  }

  /** Moves the picture by pixels. */
  move(right, down) {
    this.isFitted = false;
    this.centre = [this.centre[0] - right * this.pixel, this.centre[1] + down * this.pixel];
  }

  /** Zooms by a factor: the point under the pixel stays, unless the picture goes along with a truck. */
  zoom(factor, at = this.size.map((pixels) => pixels / 2)) {
    this.isFitted = false;
    const most = WIDEST / this.size[0], least = NARROWEST / this.size[0];
    const before = this.fromMiddle(at);
    this.pixel = Math.min(Math.max(this.pixel / factor, least), most);
    if (this.goesAlong) return;
    const after = this.fromMiddle(at);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
  }
}

/** A pointer that goes no farther than this from where it came down clicks (pixels): a finger is no mouse. */
const slackOf = ({ pointerType }) => (pointerType === "touch" ? 12 : 4);

/** Listens to pointers and the wheel on the picture. `visit` says what a click and a drag mean. */
function listenToPointers(canvas, visit) {
  const held = new Map();
  let begun = null, isDrag = false, apart = 0;
  const at = (event) => [event.offsetX, event.offsetY];
  const distance = () => {
    const [a, b] = [...held.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, at(event));
    // Two fingers click nothing, also when one is lifted before the other.
    [begun, isDrag] = [at(event), 1 < held.size];
    if (held.size === 2) apart = distance();
    visit.pointAt(at(event), held.size);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    const now = at(event), [right, down] = [now[0] - before[0], now[1] - before[1]];
    held.set(event.pointerId, now);
    isDrag ||= slackOf(event) < Math.hypot(now[0] - begun[0], now[1] - begun[1]);
    if (held.size === 2) {
      const wide = distance(), [a, b] = [...held.values()];
      if (0 < apart) visit.zoom(wide / apart, visit.inPane([(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]).at);
      apart = wide;
      // The middle between them moves half as far as one of them.
      visit.pan(right / 2, down / 2);
    } else if (visit.isSteering()) {
      visit.pointAt(now, 1);
    } else if (isDrag) {
      visit.pan(right, down);
    }
  });
  const release = (event) => {
    if (!held.delete(event.pointerId)) return;
    visit.pointAt(null, 0);
    const isClick = event.type === "pointerup" && !isDrag && held.size === 0 && !visit.isSteering();
    if (isClick) visit.click(at(event), event.pointerType === "touch" ? FINGER_REACH : REACH);
  };
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, release);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    visit.zoom(1.0015 ** -event.deltaY, visit.inPane(at(event)).at);
  }, { passive: false });
}
