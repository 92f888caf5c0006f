// The page's only way to the server: a stream of views in, commands out, nothing queued.

const SILENCE_MS = 1700; // three missed ticks: the connection counts as lost
const RETRY_MS = 400;
const ALIVE_MS = 1500;
const ANSWER_MS = 3000;

export class Link {
  // onView(view) for every new view; onEnd() when the session has ended in order; onHealth(alive)
  // whenever the connection is lost or back.
  constructor(token, { onView, onEnd, onHealth }) {
    this.headers = { Authorization: `Bearer ${token}` };
    this.onView = onView;
    this.onEnd = onEnd;
    this.onHealth = onHealth;
    this.tick = null;
    this.heard = -Infinity;
    this.alive = false;
    this.problem = "";
  }

  start() {
    this.follow();
    setInterval(() => this.judge(), 200);
    setInterval(() => { if (this.alive) this.post("/api/alive", {}).catch(() => {}); }, ALIVE_MS);
  }

  judge() {
    const alive = performance.now() - this.heard < SILENCE_MS;
    if (alive !== this.alive) {
      this.alive = alive;
      this.onHealth(alive);
    }
  }

  async follow() {
    for (;;) {
      const cut = new AbortController();
      const watchdog = setInterval(() => {
        if (performance.now() - Math.max(this.heard, begun) > 2 * SILENCE_MS) cut.abort();
      }, 500);
      const begun = performance.now();
      try {
        await this.listen(cut.signal);
      } catch (error) {
        this.problem = String(error.message ?? error);
      }
      clearInterval(watchdog);
      this.judge();
      await new Promise((done) => setTimeout(done, RETRY_MS));
    }
  }

  async listen(signal) {
    const answer = await fetch("/api/stream", { headers: this.headers, signal, cache: "no-store" });
    if (answer.status === 401) throw new Error("this page's link has a wrong or old token: open the printed link");
    if (!answer.ok) throw new Error(`the server answers ${answer.status}`);
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      rest += value;
      const messages = rest.split("\n\n");
      rest = messages.pop();
      messages.forEach((message) => this.receive(message));
    }
  }

  receive(message) {
    const fields = Object.fromEntries(message.split("\n").map((line) => line.split(/: (.*)/s, 2)));
    const data = JSON.parse(fields.data);
    this.tick = data.tick;
    this.heard = performance.now();
    this.problem = "";
    this.judge();
    if (fields.event === "state") this.onView(data);
    if (fields.event === "end") this.onEnd();
  }

  post(path, body, signal) {
    const headers = { ...this.headers, "Content-Type": "application/json" };
    return fetch(path, { method: "POST", headers, body: JSON.stringify(body), signal, cache: "no-store" });
  }

  // The server's answer, or {status: "unconfirmed"} if there is none: then only the next view tells.
  async send(command) {
    const body = { id: crypto.randomUUID(), t_client: Date.now() / 1000, tick: this.tick, ...command };
    try {
      const answer = await this.post("/api/commands", body, AbortSignal.timeout(ANSWER_MS));
      const content = await answer.json();
      if (!answer.ok) return { status: "rejected", message: explain(content.detail), id: body.id };
      return { ...content, id: body.id };
    } catch {
      return { status: "unconfirmed", id: body.id };
    }
  }

  async json(path) {
    const answer = await fetch(path, { headers: this.headers, cache: "no-store" });
    if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
    return answer.json();
  }

  // A picture as an address the page may show; null if there is none.
  async picture(path) {
    const answer = await fetch(path, { headers: this.headers });
    return answer.ok ? URL.createObjectURL(await answer.blob()) : null;
  }
}

function explain(detail) {
  return Array.isArray(detail) ? detail.map((item) => item.msg).join("; ") : String(detail);
}
