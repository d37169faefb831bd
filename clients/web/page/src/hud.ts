// SPDX-License-Identifier: MIT
// Text over the picture: scene, connection state and notices. failure_card shows what went wrong.

import type { Client, SessionState } from "@clothstream/client";
import { element, write } from "./panel/dom";

const kNoticeMs = 6000;

export class Hud {
  private readonly state = element("state");
  private readonly notice = element("notice");
  private noticeTimer: number | undefined;

  showState(kind: SessionState["kind"] | "stopped"): void {
    write(this.state, kStates[kind]);
    this.state.dataset["kind"] = kind;
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

const kStates: Record<SessionState["kind"] | "stopped", string> = {
  connecting: "connecting",
  live: "live",
  reconnecting: "reconnecting",
  asking: "not joined",
  failed: "not joined",
  stopped: "stopped",
};
