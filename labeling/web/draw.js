// Draws a view into the page. Text only ever enters as text, never as markup.

export const byId = (id) => document.getElementById(id);

export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// Builds a box's children anew only when their content has changed: a finger that is down on one of
// them would otherwise press a button that is no longer there.
const drawn = new WeakMap();

export function redraw(box, content, build) {
  const key = JSON.stringify(content);
  if (drawn.get(box) === key) return;
  drawn.set(box, key);
  box.replaceChildren(...build());
}

const words = (value) => String(value ?? "").replaceAll("_", " ");
const show = (id, visible) => { byId(id).hidden = !visible; };

// The same words again would cost the browser a new layout.
export function text(id, value) {
  const shown = byId(id);
  if (shown.textContent !== String(value)) shown.textContent = value;
}

const BANNERS = {
  READY: () => ["Getting ready", "The session's next trial comes up."],
  PLACE_OBJECT: (trial) => [`Place: ${words(trial.object)}`, trial.placed ? "Placed; the robot takes over."
    : `${trial.again_because ? `Once more (${words(trial.again_because)}). ` : ""}Put it down${trial.pictures.length ? " as in the picture" : ""}, hands away, then confirm.`],
  CAPTURE: () => ["Looking", "The camera takes a depth image."],
  REGISTER: () => ["Finding the object", "The mesh is fitted to the image."],
  CONFIRM_POSE: (trial) => ["Which pose is right?", `${1 + (trial.info.rivals ?? []).length} poses explain the image equally well.`],
  EXECUTE: () => ["The robot moves", "Keep clear. Watch whether the object is held."],
  AWAITING_LABEL: (trial) => ["Was it stably lifted?", trial.recovered ? "This record was saved after a crash; label it if you saw it, else redo." : "Clear of the table by 50 mm and still held after 1 s."],
  REVIEW: () => ["Nothing to look at", "No executed trial fits this filter."],
  RESET: () => ["Going home", "The robot opens its jaws and leaves the table."],
  PAUSED: () => ["Paused", "Nothing new starts until you resume."],
  STOPPED: () => ["STOPPED", "Nothing moves until the stop is cleared."],
  ENDED: () => ["The session has ended", ""],
  LOST: () => ["Connection lost", ""],
};

export function drawSession(view, alive) {
  text("title", view.title);
  text("operator", view.operator);
  show("badge-practice", view.practice);
  show("badge-simulated", view.simulated);
  const { counts } = view;
  text("count-labelled", counts.labelled);
  text("count-planned", counts.planned);
  text("count-unlabelled", counts.unlabelled);
  text("count-again", `${counts.redone} / ${counts.voided}`);
  text("count-skipped", counts.skipped);
  const lifted = Object.values(view.success).reduce((sum, [good]) => sum + good, 0);
  text("count-success", view.mode === "run" && counts.labelled ? `${Math.round((100 * lifted) / counts.labelled)} %` : "–");
  show("stop", view.mode === "run");
  text("count-disk", view.disk_left === null ? "–" : view.disk_left > 9999 ? "> 9999" : view.disk_left);
  byId("disk").classList.toggle("low", view.disk_low);
  byId("progress").firstElementChild.style.width = `${(100 * counts.labelled) / Math.max(counts.planned, 1)}%`;
  for (const name of ["robot", "camera"]) {
    const light = view.lights[name];
    const health = !alive ? "bad" : light ? (light.ok ? "good" : "bad") : "unknown";
    byId(`light-${name}`).dataset.light = health;
    byId(`light-${name}`).title = !alive ? "not known: the connection is lost" : light?.text ?? "";
  }
  byId("light-connection").dataset.light = alive ? "good" : "bad";
  drawSuccess(view.success);
}

export function drawTime(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  const pad = (value) => String(value).padStart(2, "0");
  text("count-time", `${Math.floor(whole / 3600)}:${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)}`);
}

function drawSuccess(success) {
  redraw(byId("success").tBodies[0], success, () => Object.entries(success).map(([name, [good, all]]) => element("tr", {},
    element("td", {}, words(name), bar(good / Math.max(all, 1))),
    element("td", {}, all ? `${good} of ${all}` : "–"))));
}

function bar(share) {
  const filled = element("span");
  filled.style.width = `${100 * share}%`;
  return element("div", { className: "bar" }, filled);
}

// `again`: the past trial whose label is given again, null if there is none.
export function drawBanner(state, view, problem, again) {
  document.body.dataset.state = state;
  document.body.dataset.target = again ? "relabel" : "";
  const [title, more] = again ? againBanner(again, view) : stateBanner(state, view, problem);
  text("banner-title", title);
  text("banner-text", more);
  show("clear-stop", state === "STOPPED");
  show("cancel-target", again && view.mode === "run");
}

function stateBanner(state, view, problem) {
  if (state === "HELD") return ["The station holds", Object.values(view.holds).join("; ")];
  const [title, more] = BANNERS[state](view?.trial ?? {});
  if (state === "LOST") return [title, problem || "Keys do nothing until it is back. The robot finishes its motion and holds."];
  if (state === "STOPPED" || state === "PAUSED") return [title, [more, ...Object.values(view.holds)].join(" ")];
  return [title, view?.paused && state === "AWAITING_LABEL" ? `${more} (The session is paused.)` : more];
}

function againBanner(trial, view) {
  if (view.second) return [`Trial ${trial.number}: was it stably lifted?`, trial.label ? `You said ${describeLabel(trial.label)}.` : "You have not judged it yet."];
  return [`Label trial ${trial.number} again: ${words(trial.object)}`, trial.label ? `It says ${describeLabel(trial.label)}.` : "It has no label now."];
}

export function drawTrial(trial, of, state) {
  text("trial-number", trial?.number ?? "–");
  text("trial-of", of);
  text("trial-take", trial && trial.take > 1 ? `, take ${trial.take}` : "");
  text("trial-object", words(trial?.object ?? "–"));
  text("trial-pose", trial && trial.stable_pose !== null ? `resting pose ${trial.stable_pose}` : "");
  const steps = [...byId("steps").children];
  const phase = trial?.phase === "CONFIRM_POSE" ? "REGISTER" : trial?.phase;
  const now = steps.findIndex((step) => step.dataset.phase === phase);
  steps.forEach((step, index) => {
    step.classList.toggle("past", index < now);
    step.classList.toggle("now", index === now && state !== "LOST");
  });
  drawRegistration(trial?.phase === "PLACE_OBJECT" ? null : trial?.info?.registration);
}

function drawRegistration(registration) {
  show("registration", Boolean(registration));
  if (!registration) return;
  redraw(byId("registration-numbers"), registration, () => Object.entries(registration).flatMap(([name, value]) => [
    element("dt", { textContent: words(name) }),
    element("dd", {
      textContent: typeof value === "number" ? value.toPrecision(3) : words(Array.isArray(value) ? value.join(", ") || "none" : value),
      className: value === true && name === "ambiguous" ? "poor" : "",
    })]));
}

export function describeLabel(label) {
  if (!label) return "unlabeled";
  const rotated = label.rotated ? ", rotated" : "";
  return label.outcome === "success" ? `success${rotated}` : `failure: ${words(label.reason)}`;
}

export function trialItem(trial, chosen, onChoose) {
  const scores = trial.scores && Object.keys(trial.scores).length
    ? element("small", { textContent: Object.entries(trial.scores).map(([model, value]) => `${model} ${value.toFixed(2)}`).join("  ") })
    : "";
  const mark = element("span", { className: "mark", textContent: trial.status === "skipped" ? "skipped" : describeLabel(trial.label) });
  const button = element("button", { type: "button" },
    element("span", {}, `${trial.number} ${words(trial.object)}`, scores), mark);
  button.addEventListener("click", () => { button.blur(); onChoose(trial); });
  const outcome = trial.status === "skipped" ? "skipped" : trial.label?.outcome ?? "unlabelled";
  const item = element("li", { className: outcome }, button);
  button.classList.toggle("chosen", chosen);
  return item;
}

let receiptTimer = 0;
const still = matchMedia("(prefers-reduced-motion: reduce)");

export function receipt(kind, message, seconds = 2.2) {
  const output = byId("receipt");
  output.dataset.kind = kind;
  output.textContent = message;
  if (kind === "stored") byId("last-stored").textContent = `✓ ${message}`;
  clearTimeout(receiptTimer);
  receiptTimer = setTimeout(() => { output.dataset.kind = "none"; }, seconds * 1000);
  const frame = byId("flash");
  frame.dataset.kind = kind;
  frame.animate({ opacity: [1, 0] }, still.matches ? 1 : 600); // asks for no layout of the page
}
