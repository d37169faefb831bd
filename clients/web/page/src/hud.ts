// SPDX-License-Identifier: MIT
// Text over the picture: connection state, figures of the stream, participants, errors and notices.

import { Roles, type Client, type SessionState } from "@clothstream/client";

const kNoticeMs = 6000;

export function element<Type extends HTMLElement>(id: string): Type {
  const found = document.getElementById(id);
  if (!found) throw new Error(`The page has no element '${id}'`);
  return found as Type;
}

export class Hud {
  private readonly state = element("state");
  private readonly banner = element("banner");
  private readonly bannerText = element("banner-text");
  private readonly retry = element<HTMLButtonElement>("retry");
  private readonly notice = element("notice");
  private readonly figures = new Map(
    ["fps", "kbit", "bits", "round-trip", "dropped", "vertices"].map((name) => [name, element(`figure-${name}`)]),
  );
  private noticeTimer: number | undefined;

  constructor(retry: () => void) {
    this.retry.addEventListener("click", retry);
  }

  // Call when the state changes, and regularly to update the countdown.
  showState(state: SessionState): void {
    let label: string = state.kind;
    let text = "";
    if (state.kind === "reconnecting") {
      const seconds = Math.max(0, Math.ceil((state.attemptAt - performance.now()) / 1000));
      label = seconds > 1 ? `reconnecting in ${seconds} s` : "reconnecting";
      text = `${state.reason} ${seconds > 1 ? `Trying again in ${seconds} s.` : "Reconnecting."}`;
    } else if (state.kind === "failed") {
      text = state.reason;
    }
    write(this.state, label);
    this.state.dataset["kind"] = state.kind;
    write(this.bannerText, text);
    this.banner.hidden = text === "";
    write(this.retry, state.kind === "failed" ? "Join the default scene" : "Try now");
  }

  // Shows an error from which the page cannot recover.
  showFatal(text: string): void {
    write(this.state, "stopped");
    this.state.dataset["kind"] = "failed";
    write(this.bannerText, text);
    this.banner.hidden = false;
    this.retry.hidden = true;
  }

  showNotice(text: string): void {
    write(this.notice, text);
    this.notice.hidden = false;
    window.clearTimeout(this.noticeTimer);
    this.noticeTimer = window.setTimeout(() => (this.notice.hidden = true), kNoticeMs);
  }

  showScene(client: Client): void {
    write(element("scene-name"), client.sceneName);
    write(element("device"), client.deviceName);
    document.title = `${client.sceneName} - ClothStream`;
  }

  // Disconnected participants stay in the list during their reconnect grace.
  showParticipants(client: Client): void {
    const items = client.people.participants().map(({ name, role, away, self }) => {
      const item = document.createElement("li");
      const who = document.createElement("span");
      who.textContent = self ? `${name} (you)` : name;
      const what = document.createElement("span");
      what.textContent = away ? "disconnected" : (Roles.get(role) ?? `role ${role}`);
      item.append(who, what);
      item.classList.toggle("away", away);
      return item;
    });
    element("participants").replaceChildren(...items);
  }

  showFigures(client: Client): void {
    const statistics = client.frames.statistics();
    const fps = statistics.framesPerSecond.toFixed(0);
    this.figure("fps", client.frames.divisor > 1 ? `${fps} of ${client.frames.streamRate}, overloaded` : fps);
    this.figure("kbit", statistics.kbitPerSecond.toFixed(0));
    this.figure("bits", statistics.bitsPerVertex.toFixed(1));
    this.figure("round-trip", `${statistics.roundTripMs.toFixed(1)} ms`);
    this.figure("dropped", String(statistics.dropped));
    this.figure("vertices", client.frames.vertexCount.toLocaleString("en"));
  }

  private figure(name: string, value: string): void {
    write(this.figures.get(name)!, value);
  }
}

// Writes only changed text, so that screen readers do not repeat it.
export function write(target: HTMLElement, text: string): void {
  if (target.textContent !== text) target.textContent = text;
}
