// A training run: a slider through the policies that it kept, by which the crowd drives. One watches it learn.

class Learned {
  constructor(app) {
    const { run } = app.live.facts;
    /** The policies in their order, the last one that which the run left; `kept` says when, and is null of that. */
    this.all = run?.policies ?? [];
    this.app = app;
    for (const { policy, kept } of this.all) {
      app.policies[policy].name = kept === null ? run.name : `${run.name}, ${short(kept.env_steps)} steps`;
    }
    byId("learned").max = Math.max(this.all.length - 1, 0);
    byId("learned").value = byId("learned").max;
    byId("learned").addEventListener("input", () => {
      this.say();
      // Of the places that a drag has gone through while a policy was taken, the last one counts.
      app.attempt(() => app.driveBy(this.here.policy));
    });
  }

  /** What the slider points at. */
  get here() {
    return this.all[Number(byId("learned").value)];
  }

  /** The index of the policy that the run left; null without a run. */
  get last() {
    return this.all.at(-1)?.policy ?? null;
  }

  /** Whether a policy is one of the run's that is neither pointed at nor drives: it is not listed beside the others. */
  hides(index) {
    const { policy, second } = this.app.chosen;
    const isOfRun = this.all.some((one) => one.policy === index);
    return isOfRun && ![this.here.policy, policy, second].includes(index);
  }

  /** Shows the slider where the run's policies can drive, at the one that does. */
  show() {
    const { app } = this, driving = this.all.findIndex(({ policy }) => policy === app.chosen.policy);
    byId("learned-part").hidden = this.all.length === 0 || !app.canDrive(this.last, app.chosen.world);
    if (this.all.length === 0) return;
    if (0 <= driving) byId("learned").value = driving;
    this.say();
  }

  say() {
    const text = learnedWords(this.here);
    byId("learned-words").textContent = text;
    byId("learned").setAttribute("aria-valuetext", text);
  }
}

/** When a policy was kept, and its success. */
function learnedWords({ kept }) {
  if (kept === null) return "the policy that the run left";
  const { env_steps: steps, seconds, validation } = kept;
  const time = seconds < 60 ? `${decimal(seconds, 0)}${GAP}s` : `${decimal(seconds / 60, 1)}${GAP}min`;
  const success = validation === null ? "" : `; ${percent(validation)} in validation`;
  return `${short(steps)} steps, ${time}${success}`;
}
