// SPDX-License-Identifier: MIT
// Requests about the server's scenes. A function that returns an id sends a request; its answer
// comes with ClientEvent.answer. 0n: the request could not be sent, because the page is not in a scene or many wait.

import { CS_ANSWER_VERSION, CS_BAN_VERSION, CS_SCENE_SUMMARY_VERSION, cs_answer, cs_ban, cs_scene_summary } from "./layout";
import type { CoreHandle } from "./handle";

// Scene in the list of the server (cs_scene_summary).
export interface SceneSummary {
  name: string;
  description: string;
  vertexCount: number;
  clothCount: number;
  participants: number;
  maxParticipants: number;
  running: boolean;
  paused: boolean;
  created: boolean; // a client made it; only then it can be deleted
  recorded: boolean;
  isRecording: boolean;
}

export interface Answer {
  id: bigint;
  error: number; // ErrorCode of session.proto; 0 if the request succeeded
  errorText: string;
  name: string; // of the scene or file
  bytes: number; // of the file that a recording has written
  repairs: string; // what was repaired in the mesh of a new scene, one sentence a line
}

export interface Ban {
  subject: string;
  displayName: string;
}

export class SceneRequests {
  constructor(private readonly handle: CoreHandle) {}

  private get core() {
    return this.handle.core;
  }
  private get scratch() {
    return this.handle.scratch;
  }

  // The newest list of scenes.
  scenes(): SceneSummary[] {
    const { exports } = this.core;
    return this.handle.list(exports.cs_scene_count(this.handle.pointer), CS_SCENE_SUMMARY_VERSION, exports.cs_get_scene, (view, at) => {
      const count = (offset: number) => view.getUint32(at + offset, true);
      const flag = (offset: number) => view.getInt32(at + offset, true) !== 0;
      return {
        name: this.core.text(count(cs_scene_summary.name)),
        description: this.core.text(count(cs_scene_summary.description)),
        vertexCount: count(cs_scene_summary.vertex_count),
        clothCount: count(cs_scene_summary.cloth_count),
        participants: count(cs_scene_summary.participants),
        maxParticipants: count(cs_scene_summary.max_participants),
        running: flag(cs_scene_summary.running),
        paused: flag(cs_scene_summary.paused),
        created: flag(cs_scene_summary.created),
        recorded: flag(cs_scene_summary.recorded),
        isRecording: flag(cs_scene_summary.is_recording),
      };
    });
  }

  // The newest answer.
  answer(): Answer | undefined {
    if (this.core.exports.cs_get_answer(this.handle.pointer, this.handle.prepared(CS_ANSWER_VERSION)) === 0) return undefined;
    const view = this.core.view();
    return {
      id: view.getBigUint64(this.scratch + cs_answer.request_id, true),
      error: view.getUint32(this.scratch + cs_answer.error, true),
      errorText: this.core.text(view.getUint32(this.scratch + cs_answer.error_text, true)),
      name: this.core.text(view.getUint32(this.scratch + cs_answer.name, true)),
      bytes: Number(view.getBigUint64(this.scratch + cs_answer.bytes, true)),
      repairs: this.core.text(view.getUint32(this.scratch + cs_answer.repairs, true)),
    };
  }

  // Creates a scene from a serialised Scene; see sceneBytes().
  create(scene: Uint8Array, name: string): bigint {
    const { exports } = this.core;
    const bytes = this.core.allocate(scene.length);
    this.core.bytes(bytes, scene.length).set(scene);
    try {
      return this.core.with([name], (text) => exports.cs_create_scene(this.handle.pointer, bytes, scene.length, text!, 0));
    } finally {
      exports.free(bytes);
    }
  }

  // Progress of create(); undefined if no upload is under way.
  upload(): { sent: number; bytes: number } | undefined {
    if (this.core.exports.cs_get_upload(this.handle.pointer, this.scratch, this.scratch + 8) === 0) return undefined;
    const view = this.core.view();
    return { sent: Number(view.getBigUint64(this.scratch, true)), bytes: Number(view.getBigUint64(this.scratch + 8, true)) };
  }

  // An empty `scene` is the joined one.
  delete(scene: string): bigint {
    return this.core.with([scene], (name) => this.core.exports.cs_delete_scene(this.handle.pointer, name!));
  }
  reset(scene: string): bigint {
    return this.core.with([scene], (name) => this.core.exports.cs_reset_scene(this.handle.pointer, name!));
  }
  pause(scene: string, paused: boolean): bigint {
    return this.core.with([scene], (name) => this.core.exports.cs_pause_scene(this.handle.pointer, name!, paused ? 1 : 0));
  }
  // An empty `file` lets the server choose the name.
  startRecording(scene: string, file: string): bigint {
    return this.core.with([scene, file], (name, path) => this.core.exports.cs_start_recording(this.handle.pointer, name!, path!));
  }
  stopRecording(scene: string): bigint {
    return this.core.with([scene], (name) => this.core.exports.cs_stop_recording(this.handle.pointer, name!));
  }
  listBans(scene: string): bigint {
    return this.core.with([scene], (name) => this.core.exports.cs_list_bans(this.handle.pointer, name!));
  }
  liftBan(scene: string, subject: string): bigint {
    return this.core.with([scene, subject], (name, whom) => this.core.exports.cs_lift_ban(this.handle.pointer, name!, whom!));
  }

  // The newest answer to listBans().
  bans(): Ban[] {
    const { exports } = this.core;
    return this.handle.list(exports.cs_ban_count(this.handle.pointer), CS_BAN_VERSION, exports.cs_get_ban, (view, at) => ({
      subject: this.core.text(view.getUint32(at + cs_ban.subject, true)),
      displayName: this.core.text(view.getUint32(at + cs_ban.display_name, true)),
    }));
  }
}
