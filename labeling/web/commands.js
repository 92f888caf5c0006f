// One command at a time, what became of it, and how the operator is told.

import { receipt } from "/draw.js";
import { play } from "/sound.js";

const SLOW_MS = 120;

export function refuse(message, seconds = 4) {
  receipt("refused", message, seconds);
  play("refused");
}

export class Commands {
  // onChange() when a command left or was answered; onStored(command) once it is on the disk;
  // telling(said) are the words of a receipt.
  constructor(link, { onChange, onStored, telling }) {
    this.link = link;
    this.onChange = onChange;
    this.onStored = onStored;
    this.telling = telling;
    this.pending = null; // the command without an answer yet; a stop never waits in line
  }

  // `said` tells the operator, in words, what was stored.
  async send(command, said) {
    const stop = command.kind === "stop";
    if (!this.link.alive && !stop) return refuse("no connection: nothing was sent");
    if (this.pending && !stop) return refuse("the last command has no answer yet");
    const pending = { ...command, id: crypto.randomUUID() };
    if (!stop) this.pending = pending;
    // Drawn only if the answer takes its time: the browser would put that frame before the answer.
    const slow = setTimeout(() => this.onChange(), SLOW_MS);
    const answer = await this.link.send(pending);
    clearTimeout(slow);
    if (answer.status !== "unconfirmed") return this.settle(answer, pending, said);
    if (stop) refuse("THE STOP WAS NOT CONFIRMED: use the hardware stop", 10);
    else this.pending = { ...pending, unconfirmed: true, said };
    return this.onChange();
  }

  settle(answer, command, said) {
    if (this.pending?.id === command.id) this.pending = null;
    if (answer.status === "stored" || answer.status === "duplicate") {
      receipt("stored", answer.message || this.telling(said), answer.message ? 10 : 2.2);
      play(command.value?.outcome ?? "stored");
      this.onStored(command);
    } else {
      refuse(`not stored: ${answer.message || answer.status}`);
    }
    this.onChange();
  }

  // A view arrived after a command without an answer: it tells what became of it. A command that
  // is not in it will never be stored: by now it is older than the server takes.
  resolve(view) {
    if (!this.pending?.unconfirmed) return;
    const stored = view.recent_commands.includes(this.pending.id);
    const lost = { status: "rejected", message: "the connection was lost before it arrived; press again" };
    this.settle(stored ? { status: "stored" } : lost, this.pending, this.pending.said);
  }
}
