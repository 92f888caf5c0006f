// Short tones: one is heard when an answer is stored, another when it was refused.
let context = null;

// Browsers allow sound only after the first key or touch.
export function allowSound() {
  context ??= new AudioContext();
  if (context.state === "suspended") context.resume();
}

function tone(frequency, start, seconds) {
  const oscillator = new OscillatorNode(context, { frequency });
  const gain = new GainNode(context, { gain: 0 });
  oscillator.connect(gain).connect(context.destination);
  gain.gain.setValueAtTime(0.12, start);
  gain.gain.exponentialRampToValueAtTime(0.001, start + seconds);
  oscillator.start(start);
  oscillator.stop(start + seconds);
}

const TONES = { success: [660, 990], failure: [440, 330], stored: [660], refused: [180, 180], ask: [520] };

export function play(name) {
  if (!context) return;
  TONES[name].forEach((frequency, index) => tone(frequency, context.currentTime + index * 0.11, 0.16));
}
