// The time of a replay: the play button and the scrubber of the page, and what both do.

class Clock {
  /** Frames are `step` seconds apart. `show` is called with each new one; `rate` says how fast it plays. */
  constructor(step, show, rate = () => 1) {
    Object.assign(this, { step, show, rate, frame: 0, last: 0, playing: false });
    /** Calls back for the next picture. */
    this.onFrame = (callback) => requestAnimationFrame(callback);
    byId("play").addEventListener("click", () => this.play(!this.playing));
    byId("scrub").addEventListener("input", (event) => { this.play(false); this.seek(Number(event.target.value)); });
  }

  /** Goes to a frame of something else, whose last one is `last`. */
  open(last, frame) {
    this.last = last;
    byId("scrub").max = last;
    this.seek(frame);
  }

  /** Goes to a frame, between two as well. */
  seek(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.last);
    byId("scrub").value = this.frame;
    byId("scrub").setAttribute("aria-valuetext", `${decimal(this.frame * this.step, 1)} s`);
    byId("clock").textContent = `${decimal(this.frame * this.step, 1)} / ${decimal(this.last * this.step, 1)}${GAP}s`;
    this.show();
  }

  /** Some frames forwards or back, from a whole frame. */
  move(frames) {
    this.play(false);
    this.seek(Math.round(this.frame) + frames);
  }

  play(playing) {
    // At the end, playing starts again.
    if (playing && this.last <= this.frame) this.seek(0);
    this.playing = playing;
    showPlaying(byId("play"), playing);
    let before = performance.now();
    const turn = (this.turn = {});
    const tick = () => {
      // Another press has begun another loop.
      if (!this.playing || turn !== this.turn) return;
      const now = performance.now(), passed = (now - before) / 1000;
      before = now;
      this.seek(this.frame + (passed * this.rate()) / this.step);
      if (this.last <= this.frame) this.play(false);
      else this.onFrame(tick);
    };
    if (playing) this.onFrame(tick);
  }
}
