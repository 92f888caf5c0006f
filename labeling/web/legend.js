// The keys as the page shows them: on every button, and in the dialog that changes them.

import { byId, element } from "/draw.js";

export function drawLegend(keys) {
  document.querySelectorAll("kbd[data-key]").forEach((cap) => { cap.textContent = keys.label(cap.dataset.key); });
}

// The dialog's table; `refuse` tells why a key cannot be taken.
export function drawKeyTable(keys, refuse) {
  const rows = Object.keys(keys.defaults).filter((action) => action !== "stop").map((action) => {
    const button = element("button", { type: "button", textContent: keys.label(action) });
    button.addEventListener("click", () => {
      button.textContent = "press a key …";
      byId("keys").addEventListener("keydown", (event) => {
        event.preventDefault();
        const problem = event.key === "Escape" ? "" : keys.bind(action, event.key);
        if (problem) refuse(problem);
        drawLegend(keys);
        drawKeyTable(keys, refuse);
      }, { once: true });
    });
    return element("tr", {}, element("td", { textContent: action }), element("td", {}, button));
  });
  byId("key-table").replaceChildren(...rows);
}
