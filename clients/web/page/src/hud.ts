// SPDX-License-Identifier: MIT
// Text over the picture: scene, connection state, errors and notices.

import type { Client, SessionState } from "@clothstream/client";
import { element, write } from "./panel/dom";

const kNoticeMs = 6000;

export class Hud {
  private readonly state = element("state");
  private readonly banner = element("banner");
  private readonly bannerText = element("banner-text");
  private readonly retry = element<HTMLButtonElement>("retry");
  private readonly notice = element("notice");
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
    document.title = `${client.sceneName} - ClothStream`;
  }
}
