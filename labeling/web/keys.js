// Which key does what: letters far apart, remappable, deaf to repeats, modifiers and text fields.

// A cookie, because the console's port, and with it its store, may change with every session.
const STORE = "reach-console-keys";
const YEAR_S = 365 * 24 * 3600;

export class Keys {
  constructor(defaults) {
    this.defaults = defaults;
    this.map = merged(defaults, read());
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
    if (/^[0-9]$/.test(wanted) || ["Escape", "Tab", " ", "x", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Shift", "Control", "Alt", "Meta"].includes(wanted)) {
      return `${name(wanted)} is taken by the page itself`;
    }
    const other = Object.entries(this.map).find(([known, bound]) => bound === wanted && known !== action);
    if (other) return `${name(wanted)} is ${other[0]} already`;
    this.map[action] = wanted;
    write(this.map);
    return "";
  }

  reset() {
    write({});
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

// The defaults with what was remapped; nothing of it if a key would mean two things by now.
function merged(defaults, stored) {
  const kept = Object.entries(stored).filter(([action, key]) => action in defaults && typeof key === "string");
  const map = { ...defaults, ...Object.fromEntries(kept), stop: defaults.stop }; // the stop is never remapped
  return new Set(Object.values(map)).size === Object.keys(map).length ? map : { ...defaults };
}

function read() {
  const found = document.cookie.split("; ").find((part) => part.startsWith(`${STORE}=`));
  try {
    return JSON.parse(decodeURIComponent(found.slice(STORE.length + 1))) ?? {};
  } catch {
    return {};
  }
}

function write(map) {
  document.cookie = `${STORE}=${encodeURIComponent(JSON.stringify(map))}; max-age=${YEAR_S}; path=/; SameSite=Strict`;
}
