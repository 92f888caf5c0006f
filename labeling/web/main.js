// The console's page: takes in views, turns keys and buttons into actions, and draws.

import { About } from "/about.js";
import { Actions } from "/actions.js";
import { drawActions, drawChoices } from "/buttons.js";
import { byId, drawBanner, drawSession, drawTime, drawTrial, redraw, trialItem } from "/draw.js";
import { Commands, refuse } from "/commands.js";
import { Keys, isTextField } from "/keys.js";
import { drawKeyTable, drawLegend } from "/legend.js";
import { Link } from "/link.js";
import { Review } from "/review.js";
import { allowSound, play } from "/sound.js";
import { Stage } from "/stage.js";

const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? sessionStorage.getItem("token") ?? "";
sessionStorage.setItem("token", token);
history.replaceState(null, "", "/"); // the token stays out of screenshots and bookmarks

const page = {
  view: null,
  viewAt: 0,
  terms: null,
  keys: null,
  rotated: false,
  choosing: null, // "reason", "cause", "skip" or "earlier": what the next digit answers
  relabel: null, // trial_id of a past trial the verdict keys are about
};

const link = new Link(token, { onView, onEnd, onHealth: () => draw() });
const commands = new Commands(link, {
  onChange: () => draw(),
  onStored: (command) => actions.settled(command),
  telling: (said) => `${page.view?.practice ? "practice" : "stored"}: ${said}`,
});
const stage = new Stage(link, onForwardedKey);
const review = new Review(link, () => draw());
const about = new About(page, review);
const actions = new Actions(page, about, review, (command, said) => commands.send(command, said), () => draw());

function effectiveState() {
  if (!page.view || !link.alive) return page.view?.state === "ENDED" ? "ENDED" : "LOST";
  return page.view.state;
}

// ---- keys and buttons -----------------------------------------------------------------------

function onKey(event) {
  if (document.querySelector("dialog[open]") && event.key !== "Escape") return;
  const action = page.keys?.action(event) ?? (event.key === "Escape" ? "stop" : null);
  if (event.target instanceof HTMLButtonElement && (event.key === " " || event.key === "Enter") && !event.target.closest("dialog")) {
    event.preventDefault(); // a button that kept the focus never turns space into a second press
  }
  if (!action) return;
  if (!action.other) event.preventDefault();
  if (action === "stop" && event.repeat) return;
  actions.perform(action);
}

// The embedded view took the keyboard: its page sends the keys on.
function onForwardedKey(key) {
  onKey({ key, repeat: false, target: document.body, preventDefault() {} });
}

function wire() {
  document.addEventListener("keydown", onKey);
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (!button.closest("dialog")) button.blur();
    if (button.dataset.action) actions.perform(button.dataset.action);
  });
  // Only a keyboard's key up activates a focused button: keydown was handled above.
  document.addEventListener("keyup", (event) => {
    if (event.key === " " && event.target instanceof HTMLButtonElement && !event.target.closest("dialog")) event.preventDefault();
  });
  byId("note").addEventListener("keydown", (event) => {
    if (event.key === "Enter") byId("note").blur();
  });
  byId("store-note").addEventListener("click", () => actions.storeNote());
  byId("cancel-target").addEventListener("click", () => actions.leave());
  byId("clear-stop").addEventListener("click", () => byId("confirm-clear").showModal());
  byId("confirm-clear").addEventListener("close", (event) => {
    const yes = event.target.returnValue === "yes";
    event.target.returnValue = ""; // Escape leaves the last answer standing
    if (yes) actions.clearStop();
  });
  byId("open-keys").addEventListener("click", () => { drawKeyTable(page.keys, refuse); byId("keys").showModal(); });
  byId("keys-default").addEventListener("click", () => { page.keys.reset(); drawLegend(page.keys); });
  setInterval(() => {
    const elapsed = page.view?.elapsed;
    if (elapsed != null && page.view.mode === "run" && page.view.state !== "ENDED") drawTime(elapsed + (performance.now() - page.viewAt) / 1000);
  }, 500);
}

// ---- drawing --------------------------------------------------------------------------------

// A past trial whose label is given again: its recording and name, not the present trial's.
function shownAgain(trial) {
  return { ...trial, stable_pose: null, phase: "AWAITING_LABEL", pictures: [] };
}

function onEnd() {
  if (page.view) page.view.state = "ENDED";
  draw();
}

function onView(view) {
  const asked = page.view?.trial?.phase;
  page.view = view;
  page.viewAt = performance.now();
  commands.resolve(view);
  if (view.trial?.phase === "AWAITING_LABEL" && asked && asked !== "AWAITING_LABEL") play("ask");
  if (page.relabel && !view.history.some((item) => item.trial_id === page.relabel)) page.relabel = null;
  if (view.mode === "review") review.refresh(view);
  draw();
}

// Views come in bursts: the page is painted once a frame, so that a key is never behind a queue.
let painting = 0;

function draw() {
  about.dropForeignChoices();
  painting ||= requestAnimationFrame(paint);
}

function paint() {
  painting = 0;
  const { view } = page;
  const state = effectiveState();
  byId("unconfirmed").hidden = !commands.pending?.unconfirmed;
  if (!view) return drawBanner(state, null, link.problem, null);
  drawSession(view, link.alive);
  const target = about.target();
  const past = target?.kind === "relabel" && view.mode === "run";
  const trial = view.mode === "review" ? review.chosen() : past ? shownAgain(target) : view.trial;
  const again = (view.mode === "review" || past) && !["LOST", "STOPPED"].includes(state) ? target : null;
  drawBanner(state, view, link.problem, again);
  drawTrial(trial, view.of, state);
  const usable = link.alive && !commands.pending;
  drawActions(page, state, target, usable, usable && !review.justCame());
  drawChoices(page, actions.choices(), usable, allowSound);
  redraw(byId("history"), [view.history, page.relabel], () => view.history.map((item) => (
    trialItem(item, item.trial_id === page.relabel, (chosen) => {
      if (chosen.status !== "skipped") page.relabel = chosen.trial_id;
      draw();
    }))));
  for (const id of ["past", "by-object", "steps", "disk", "time", "light-robot", "light-camera"]) {
    byId(id).hidden = view.mode === "review";
  }
  stage.draw(view, trial);
}

// ---- start ----------------------------------------------------------------------------------

wire();
draw();
link.start();
for (;;) {
  try {
    page.terms = await link.json("/api/terms");
    break;
  } catch (error) {
    link.problem ||= String(error.message);
    await new Promise((done) => setTimeout(done, 500));
  }
}
page.keys = new Keys(page.terms.keys);
byId("rule").textContent = page.terms.rule;
drawLegend(page.keys);
draw();
window.focus();
document.body.dataset.ready = "true";
if (isTextField(document.activeElement)) document.activeElement.blur();
