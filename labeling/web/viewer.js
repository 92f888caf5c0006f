// The Rerun viewer alone on its page; keys that are the operator's go on to the console.
/* global wasm_bindgen */

const status = document.getElementById("status");
// The console is the same server under its other name; nobody else may embed this page.
const consoleOrigin = `${location.protocol}//${location.hostname === "localhost" ? "127.0.0.1" : location.hostname}:${location.port}`;

window.addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  event.stopImmediatePropagation();
  event.preventDefault();
  window.parent.postMessage({ key: event.key }, consoleOrigin);
}, { capture: true });

try {
  await wasm_bindgen({ module_or_path: "/viewer/re_viewer_bg.wasm" });
  const handle = new wasm_bindgen.WebHandle({
    url: new URLSearchParams(location.search).getAll("url"),
    hide_welcome_screen: true,
    panel_state_overrides: { top: "Hidden", blueprint: "Hidden", selection: "Hidden", time: "Collapsed" },
    enable_history: false,
    persist: false,
    render_backend: "webgl",
  });
  await handle.start(document.getElementById("canvas"));
  status.remove();
  document.body.dataset.started = "true";
} catch (error) {
  status.textContent = `The view cannot be shown here: ${error.message ?? error}. Everything else works without it.`;
}
