// Pictures and the embedded Rerun view, which lives on another site and may take the keyboard.

import { byId, text } from "/draw.js";

const OVERLAY = "overlay"; // the picture of the pose that was found; any other shows how to place

// The same server under its other name: a page of another site gets a process of its own.
function viewerOrigin() {
  const host = location.hostname === "127.0.0.1" ? "localhost" : location.hostname;
  return `${location.protocol}//${host}:${location.port}`;
}

export class Stage {
  // onKey(key) for keys pressed inside the embedded view.
  constructor(link, onKey) {
    this.link = link;
    this.loaded = { placing: {}, overlay: {}, recording: {} }; // what was asked for, and what came
    this.frameAddress = null;
    window.addEventListener("message", (event) => {
      const frame = byId("viewer").contentWindow;
      const ours = event.source === frame && event.origin === viewerOrigin();
      if (ours && typeof event.data?.key === "string") onKey(event.data.key);
    });
    byId("viewer").addEventListener("load", () => { if (document.activeElement === byId("viewer")) byId("viewer").blur(); });
  }

  draw(view, trial) {
    this.view = view;
    this.trial = trial;
    const candidates = this.candidates(view, trial);
    const chosen = candidates.find((name) => this.ready(name));
    for (const id of ["placing", "overlay"]) byId(id).hidden = chosen !== id;
    byId("viewer").hidden = chosen !== "recording";
    if (chosen === "recording") this.point(this.loaded.recording.came);
    byId("stage-empty").hidden = Boolean(chosen);
    text("stage-empty", this.missing(view, candidates));
  }

  // Why the stage is empty.
  missing(view, candidates) {
    if (view.practice) return "Practice has no pictures: nothing lies on the table.";
    const awaited = candidates.find((name) => !this.loaded[name].gone);
    if (!candidates.length) return "The view of the trial appears here.";
    return awaited ? `The ${awaited === "recording" ? awaited : "picture"} is drawn …` : "There is nothing to look at.";
  }

  // What may fill the stage now, the best first.
  candidates(view, trial) {
    if (!trial) return [];
    const pictures = trial.pictures ?? [];
    const how = pictures.some((name) => name !== OVERLAY) ? ["placing"] : [];
    const overlay = pictures.includes(OVERLAY) ? ["overlay"] : [];
    const recording = view.recordings ? ["recording"] : [];
    if (view.mode === "review") return recording;
    switch (trial.phase) {
      case "PLACE_OBJECT": return how;
      case "AWAITING_LABEL": return [...recording, ...overlay, ...how];
      default: return [...overlay, ...how];
    }
  }

  // True if it can be shown; if it is not there yet, it is fetched, and drawn when it came.
  ready(name) {
    const slot = this.loaded[name];
    // A picture that came stays while others of its take arrive: only the take makes it old.
    const key = `${this.trial.trial_id}/${this.trial.take}`;
    if (slot.key !== key) {
      Object.assign(slot, { key, came: null, gone: false });
      this.fetch(name, slot, key);
    }
    return Boolean(slot.came);
  }

  async fetch(name, slot, key) {
    const { trial } = this;
    const came = name === "recording" ? await this.recording(trial) : await this.picture(name, trial);
    if (slot.key !== key) return; // another trial is on the stage by now
    slot.came = came;
    slot.gone = !came;
    this.draw(this.view, this.trial);
  }

  async picture(id, trial) {
    const name = id === OVERLAY ? OVERLAY : trial.pictures.find((other) => other !== OVERLAY);
    const path = `/api/pictures/${encodeURIComponent(trial.trial_id)}/${trial.take}/${encodeURIComponent(name)}`;
    const source = await this.link.picture(path).catch(() => null);
    const image = byId(id).querySelector("img");
    if (image.src.startsWith("blob:")) URL.revokeObjectURL(image.src);
    image.src = source ?? "data:,";
    if (id !== OVERLAY) byId(id).querySelector("figcaption").textContent = name;
    return source;
  }

  async recording(trial) {
    const answer = await this.link.post("/api/recordings", { trial_id: trial.trial_id }).catch(() => null);
    if (!answer?.ok) return null;
    const { path } = await answer.json();
    return `url=${encodeURIComponent(viewerOrigin() + path)}`;
  }

  point(query) {
    if (this.frameAddress === query) return; // a hidden view keeps its stream
    this.frameAddress = query;
    byId("viewer").src = `${viewerOrigin()}/viewer/?${query}`;
  }
}
