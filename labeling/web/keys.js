// Which key does what: letters far apart, remappable, deaf to repeats, modifiers and text fields.

const STORE = "reach-console-keys";

export class Keys {
  constructor(defaults) {
    this.defaults = defaults;
    this.map = { ...defaults, ...read() };
    this.map.stop = defaults.stop; // the stop is never remapped
  }

  // The action of a key event: a name, {digit: n}, or null if the event is none of ours.
  action(event) {
    const stop = event.key === this.map.stop;
    if (stop) return "stop"; // also while typing, also when held down
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return null;
    if (isTextField(event.target)) return null;
    if (/^[0-9]$/.test(event.key)) return { digit: Number(event.key) };
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const found = Object.entries(this.map).find(([, bound]) => bound === key);
    return found ? found[0] : { other: key };
  }

  // Binds an action to a key; says why not, or "".
  bind(action, key) {
    const wanted = key.length === 1 ? key.toLowerCase() : key;
    if (/^[0-9]$/.test(wanted) || ["Escape", "Tab", " ", "x", "Shift", "Control", "Alt", "Meta"].includes(wanted)) {
      return `${name(wanted)} is taken by the page itself`;
    }
    const other = Object.entries(this.map).find(([known, bound]) => bound === wanted && known !== action);
    if (other) return `${name(wanted)} is ${other[0]} already`;
    this.map[action] = wanted;
    localStorage.setItem(STORE, JSON.stringify(this.map));
    return "";
  }

  reset() {
    localStorage.removeItem(STORE);
    this.map = { ...this.defaults };
  }

  label(action) {
    return name(this.map[action]);
  }
}

export function isTextField(element) {
  return element instanceof HTMLInputElement || element instanceof HTMLTextAreaElement
    || element instanceof HTMLSelectElement || Boolean(element?.isContentEditable);
}

function name(key) {
  return { Escape: "Esc", Enter: "Enter", " ": "Space" }[key] ?? key;
}

function read() {
  try {
    return JSON.parse(localStorage.getItem(STORE)) ?? {};
  } catch {
    return {};
  }
}
