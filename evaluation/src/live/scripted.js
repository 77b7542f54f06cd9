// What scripts that drive the page ask of it, those of its tests among them.

class Scripted {
  /** Follows a truck of the first crowd. */
  pickTruck(env) {
    return this.between(() => this.visit.pick(env));
  }

  /** Makes steps of everything that moves, and draws. */
  stepBy(count) {
    return this.between(() => this.frame(count, true));
  }

  takeOver(asked) {
    this.needDevice();
    this.visit.takeOver(asked);
  }

  giveBack() {
    this.visit.giveBack();
  }

  placeOf(road) {
    this.needDevice();
    return this.sites.places.find(({ index }) => index === road);
  }

  /** Shows a point of a road in the middle, the canvas so many metres wide. */
  lookAt(road, x, y, width) {
    const { offset, side } = this.placeOf(road), { camera } = this.stage;
    camera.stay();
    camera.centre = [offset[0] + x, offset[1] + side * y];
    camera.pixel = width / camera.size[0];
    this.draw();
  }

  /** The pixel of the page's canvas at a point of a road. */
  screenOf(road, x, y) {
    const place = this.placeOf(road);
    this.draw();
    return this.stage.pixelOf(place, x, y);
  }

  /** The colour at a pixel of the page's canvas (0 to 255). */
  pixelAt(x, y) {
    this.needDevice();
    return this.stage.colourAt([x, y], this.scene);
  }

  /** A colour of the theme (0 to 255). */
  colour(name) {
    return numbersOf(colours()(name)).map((part) => Math.round(255 * part));
  }
}
