// SPDX-License-Identifier: MIT
// Requests to the server as promises.

import type { Answer, Client, SceneRequests, Session } from "@clothstream/client";

// `lost`: the connection ended before the answer, so the server may have carried the request out.
export type Outcome = { ok: true; answer: Answer } | { ok: false; error: string; lost?: true };

const kUploadPeriodMs = 50;

export class Requests {
  private readonly waiting = new Map<bigint, (outcome: Outcome) => void>();

  constructor(private readonly session: () => Session) {}

  // Sends a request. Resolves with the answer, or with the reason why none came.
  ask(send: (requests: SceneRequests) => bigint): Promise<Outcome> {
    const session = this.session();
    if (session.state.kind !== "live") return Promise.resolve({ ok: false, error: "The page is not connected to a scene." });
    const id = send(session.client.requests);
    if (id === 0n) return Promise.resolve({ ok: false, error: "Other requests are still under way. Try again in a moment." });
    session.flush();
    return new Promise((done) => this.waiting.set(id, done));
  }

  // Creates a scene. `progress` receives the uploaded part, 0 to 1.
  async create(scene: Uint8Array, name: string, progress: (part: number) => void): Promise<Outcome> {
    const timer = window.setInterval(() => {
      const session = this.session();
      session.client.update();
      session.flush();
      const upload = session.client.requests.upload();
      if (upload) progress(upload.sent / upload.bytes);
    }, kUploadPeriodMs);
    try {
      return await this.ask((requests) => requests.create(scene, name));
    } finally {
      window.clearInterval(timer);
    }
  }

  answered(client: Client): void {
    const answer = client.requests.answer();
    const done = answer && this.waiting.get(answer.id);
    if (!done) return;
    this.waiting.delete(answer.id);
    done(answer.error === 0 ? { ok: true, answer } : { ok: false, error: answer.errorText });
  }

  // Ends all requests, because the connection to the scene is lost.
  lost(): void {
    for (const done of this.waiting.values()) done({ ok: false, error: "The connection was lost before the server answered.", lost: true });
    this.waiting.clear();
  }
}
