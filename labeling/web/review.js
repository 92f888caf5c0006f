// Choosing recorded trials to label again: a filter, a list, and which one is on the stage.

import { byId, element, trialItem } from "/draw.js";

const LOOK_MS = 400; // a second press meant for the trial before is over by then

export class Review {
  constructor(link, onChange) {
    this.link = link;
    this.onChange = onChange;
    this.trials = [];
    this.place = 0;
    this.foundBy = null;
    this.version = -1;
    this.asked = 0; // the newest question to the server: an older answer is old news
    this.came = { trial: null, at: -Infinity }; // what is on the stage, and since when
    byId("filter").addEventListener("change", (event) => {
      if (event.target instanceof HTMLSelectElement) event.target.blur(); // else it keeps the keys
      this.place = 0;
      this.load();
    });
    byId("filter").addEventListener("keydown", (event) => { if (event.key === "Enter") event.target.blur(); });
    byId("filter").addEventListener("submit", (event) => event.preventDefault());
  }

  chosen() {
    return this.trials[this.place] ?? null;
  }

  // True for a moment after a trial came up: a press then was meant for the one before it.
  justCame() {
    return performance.now() - this.came.at < LOOK_MS;
  }

  notice() {
    const trial = this.chosen()?.trial_id ?? null;
    if (trial === this.came.trial) return;
    this.came = { trial, at: performance.now() };
    setTimeout(this.onChange, LOOK_MS + 1);
  }

  refresh(view) {
    byId("review").hidden = false;
    // A list of successes would show a second operator the first one's verdicts.
    for (const choice of byId("filter").querySelectorAll("[data-tells-verdicts]")) {
      choice.hidden = choice.control.disabled = view.second;
    }
    if (this.version === view.version) return;
    this.version = view.version;
    this.load();
  }

  async load() {
    const wanted = new URLSearchParams();
    for (const [name, value] of new FormData(byId("filter"))) if (value) wanted.set(name, value);
    const asked = ++this.asked;
    const found = await this.link.json(`/api/review?${wanted}`).catch(() => null);
    if (!found || asked !== this.asked) return;
    const kept = this.chosen()?.trial_id;
    this.trials = found.trials;
    this.foundBy = found.found_by;
    const again = this.trials.findIndex((trial) => trial.trial_id === kept);
    this.place = again >= 0 ? again : Math.min(this.place, Math.max(this.trials.length - 1, 0));
    options("object", found.objects);
    options("disagrees_with", found.models);
    byId("unblind").hidden = !this.foundBy;
    this.draw();
    this.onChange();
  }

  // After a verdict: the following trial, unless the verdict took this one out of the list.
  next() {
    this.place = Math.min(this.place + 1, Math.max(this.trials.length - 1, 0));
    this.draw();
  }

  // Back to a trial whose verdict was just taken back, if the filter still lists it.
  goTo(trialId) {
    const place = this.trials.findIndex((trial) => trial.trial_id === trialId);
    if (place >= 0) this.place = place;
    this.draw();
  }

  key(key) {
    const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[key];
    if (!step) return;
    this.place = Math.min(Math.max(this.place + step, 0), Math.max(this.trials.length - 1, 0));
    this.draw();
    this.onChange();
  }

  draw() {
    this.notice();
    const items = this.trials.map((trial, index) => trialItem(trial, index === this.place, () => {
      this.place = index;
      this.draw();
      this.onChange();
    }));
    byId("review-list").replaceChildren(...items);
    byId("review-list").querySelector(".chosen")?.scrollIntoView({ block: "nearest" });
  }
}

function options(name, values) {
  const select = byId("filter").elements[name];
  const have = select.value;
  select.replaceChildren(element("option", { value: "", textContent: "any" }), ...values.map((value) => element("option", { value, textContent: value })));
  select.value = have;
}
