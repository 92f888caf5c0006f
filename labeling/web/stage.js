// Pictures and the embedded Rerun view, which lives on another site and may take the keyboard.

import { byId } from "/draw.js";

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
    this.shown = { placing: null, overlay: null, viewer: null };
    window.addEventListener("message", (event) => {
      const frame = byId("viewer").contentWindow;
      const ours = event.source === frame && event.origin === viewerOrigin();
      if (ours && typeof event.data?.key === "string") onKey(event.data.key);
    });
    byId("viewer").addEventListener("load", () => { if (document.activeElement === byId("viewer")) byId("viewer").blur(); });
  }

  draw(view, trial) {
    const pictures = trial?.pictures ?? [];
    const howTo = pictures.find((name) => name !== OVERLAY);
    const placing = Boolean(howTo) && trial?.phase === "PLACE_OBJECT" && view.mode === "run";
    this.picture("placing", howTo, trial, placing);
    if (view.mode === "review") {
      this.recording(trial);
    } else {
      const overlaid = pictures.includes(OVERLAY);
      const found = overlaid && ["REGISTER", "CONFIRM_POSE"].includes(trial?.phase);
      this.viewer(view.live_view && !found && !placing ? `url=${encodeURIComponent(view.live_view)}` : null);
      this.picture("overlay", OVERLAY, trial, overlaid && !placing && (found || !view.live_view));
    }
    byId("stage-empty").hidden = ["viewer", "overlay", "placing"].some((id) => !byId(id).hidden);
  }

  async picture(id, name, trial, wanted) {
    const figure = byId(id);
    const address = wanted ? `/api/pictures/${encodeURIComponent(trial.trial_id)}/${trial.take}/${encodeURIComponent(name)}` : null;
    const version = wanted ? `${address}?${trial.phase}` : null; // a picture may be drawn anew per phase
    figure.hidden = !wanted;
    if (this.shown[id] === version) return;
    this.shown[id] = version;
    const source = address ? await this.link.picture(address) : null;
    if (this.shown[id] !== version) return;
    const image = figure.querySelector("img");
    if (image.src.startsWith("blob:")) URL.revokeObjectURL(image.src);
    image.src = source ?? "data:,";
    figure.hidden = !source;
  }

  viewer(query) {
    const frame = byId("viewer");
    frame.hidden = !query;
    if (!query || this.shown.viewer === query) return; // a hidden view keeps its stream
    this.shown.viewer = query;
    frame.src = `${viewerOrigin()}/viewer/?${query}`;
  }

  async recording(trial) {
    const id = trial?.trial_id ?? null;
    if (this.shown.recording === id) return;
    this.shown.recording = id;
    const answer = id ? await this.link.post("/api/recordings", { trial_id: id }) : null;
    if (this.shown.recording !== id) return;
    const path = answer?.ok ? (await answer.json()).path : null;
    this.viewer(path ? `url=${encodeURIComponent(viewerOrigin() + path)}` : null);
    byId("stage-empty").hidden = Boolean(path);
    byId("stage-empty").textContent = "There is no recording of this trial to look at.";
  }
}
