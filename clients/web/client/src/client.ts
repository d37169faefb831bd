// SPDX-License-Identifier: MIT
// One client of the core, or a mirror of it (core.h): messages in and out, and what it knows of the scene.

import {
  CS_CLIENT_OPTIONS_VERSION,
  CS_DATAGRAM_ANSWER_VERSION,
  CS_DATAGRAM_OFFER_VERSION,
  CS_DECODED_VERSION,
  cs_client_options,
  cs_datagram_answer,
  cs_datagram_offer,
  cs_decoded,
} from "./layout";
import { CoreHandle, nowUs } from "./handle";
import { Frames } from "./frames";
import { Input } from "./input";
import { Parameters } from "./parameters";
import { People } from "./people";
import { PlaybackControl } from "./playback";
import { SceneRequests } from "./scene_requests";
import type { DatagramAnswer, DatagramOffer } from "./session_description";
import { Settings } from "./cloth_settings";
import { ClientState, type Identity } from "./types";
import { CoreBuffer, type CoreModule } from "./wasm";
import { Wearing } from "./wearing";

// Result of decoding in the client that a mirror follows (cs_decoding).
export enum Decoding {
  done = 0,
  refused = 1,
  skipped = 2,
}

// Frame that the client of a mirror has decoded, without its values.
export interface DecodedFrame {
  hasNormals: boolean;
  hash: bigint;
  decodeMs: number;
}

export class Client {
  readonly frames: Frames;
  readonly input: Input;
  readonly parameters: Parameters;
  readonly people: People;
  readonly playback: PlaybackControl;
  readonly requests: SceneRequests;
  readonly settings: Settings;
  readonly wearing: Wearing;
  private readonly handle: CoreHandle;
  private readonly inbox: CoreBuffer<Uint8Array>;
  private readonly decoded: CoreBuffer<Float32Array>;

  // An empty `scene` means the server's default scene. `program` names the program.
  constructor(
    private readonly core: CoreModule,
    kind: "whole" | "mirror",
    scene: string,
    program: string,
    { name, role }: Identity,
  ) {
    const { cs_create, cs_create_mirror } = core.exports;
    const options = core.allocate(cs_client_options.sizeof);
    const pointer = core.with([scene, program, name], (where, what, who) => {
      const view = core.view();
      view.setUint32(options + cs_client_options.version, CS_CLIENT_OPTIONS_VERSION, true);
      view.setUint32(options + cs_client_options.role, role, true);
      view.setUint32(options + cs_client_options.scene, where!, true);
      view.setUint32(options + cs_client_options.client_name, what!, true);
      view.setUint32(options + cs_client_options.display_name, who!, true);
      return kind === "mirror" ? cs_create_mirror(options) : cs_create(options);
    });
    core.exports.free(options);
    if (pointer === 0) throw new Error("The client core has no memory left for another client");
    this.handle = new CoreHandle(core, pointer);
    this.inbox = new CoreBuffer(core, (pointer, count) => core.bytes(pointer, count));
    this.decoded = new CoreBuffer(core, (pointer, count) => core.floats(pointer, count));
    this.frames = new Frames(this.handle);
    this.input = new Input(this.handle);
    this.parameters = new Parameters(this.handle);
    this.people = new People(this.handle);
    this.playback = new PlaybackControl(this.handle);
    this.requests = new SceneRequests(this.handle);
    this.settings = new Settings(this.handle);
    this.wearing = new Wearing(this.handle);
  }

  destroy(): void {
    this.input.destroy();
    this.inbox.free();
    this.decoded.free();
    this.handle.destroy();
  }

  // Token or code that the next connection sends before Hello; a newer call replaces an older one. "" means none.
  setToken(token: string): void {
    this.core.with([token], (text) => this.core.exports.cs_set_token(this.handle.pointer, text!));
  }
  setPairingCode(code: string): void {
    this.core.with([code], (text) => this.core.exports.cs_set_pairing_code(this.handle.pointer, text!));
  }
  // Sends a new token of the same subject on the current connection, which then lasts longer. Returns false before the
  // client has joined.
  renewToken(token: string): boolean {
    return this.core.with([token], (text) => this.core.exports.cs_renew_token(this.handle.pointer, text!)) !== 0;
  }
  // Token in use: that of setToken, or of the server after pairing.
  get token(): string {
    return this.core.text(this.core.exports.cs_token(this.handle.pointer));
  }

  // Returns as the participant of an earlier client, with its resume token; "" means none. Call it on a client and on its
  // mirror, before connecting. Texts that are no resume token are ignored.
  setResumeToken(token: string): void {
    this.core.with([token], (text) => this.core.exports.cs_set_resume_token(this.handle.pointer, text!));
  }
  // Text with which a later client returns as this participant; "" before the first Welcome.
  get resumeToken(): string {
    return this.core.text(this.core.exports.cs_resume_token(this.handle.pointer));
  }

  // Best quality that the server sends from the next connection on, 0 (finest) to 3.
  want(quality: number): void {
    this.core.exports.cs_want(this.handle.pointer, quality);
  }

  // Handles one ServerMessage that arrived at a time (microseconds). Returns ClientEvent bits.
  receive(message: Uint8Array, arrivedUs: bigint): number {
    return this.core.exports.cs_receive(this.handle.pointer, this.inbox.write(message), message.byteLength, arrivedUs);
  }

  // Like receive(), for a mirror. The message is the first `bytes` of the array. `values` are those of the frame, 3 floats
  // per vertex: positions, then normals if it has them.
  receiveDecoded(message: Uint8Array, bytes: number, decoding: Decoding, frame: DecodedFrame | undefined, values: Float32Array, arrivedUs: bigint): number {
    const { exports } = this.core;
    const { scratch, pointer } = this.handle;
    const copy = this.inbox.write(message);
    const positions = frame ? this.decoded.write(values) : 0;
    const vertices = frame ? values.length / (frame.hasNormals ? 6 : 3) : 0;
    const view = this.core.view();
    view.setUint32(scratch + cs_decoded.version, CS_DECODED_VERSION, true);
    view.setUint32(scratch + cs_decoded.decoding, decoding, true);
    view.setUint32(scratch + cs_decoded.positions, positions, true);
    view.setUint32(scratch + cs_decoded.normals, frame?.hasNormals ? positions + 12 * vertices : 0, true);
    view.setUint32(scratch + cs_decoded.vertex_count, vertices, true);
    view.setBigUint64(scratch + cs_decoded.reconstruction_hash, frame?.hash ?? 0n, true);
    view.setFloat64(scratch + cs_decoded.decode_ms, frame?.decodeMs ?? 0, true);
    return exports.cs_receive_decoded(pointer, copy, bytes, scratch, arrivedUs);
  }

  // Starts a connection. The next outgoing message is Hello, except of a mirror.
  connecting(atUs: bigint): void {
    this.core.exports.cs_connecting(this.handle.pointer, atUs);
  }

  // Ends a connection that was lost or could not be opened.
  disconnected(atUs: bigint): void {
    this.core.exports.cs_disconnected(this.handle.pointer, atUs);
  }

  // Time to drop the current connection, if any, and to open a new one, in milliseconds of the clock of the calls.
  get connectAtMs(): number {
    return Number(BigInt.asUintN(64, this.core.exports.cs_connect_at(this.handle.pointer))) / 1000;
  }

  // Whether the program opens connections at connectServer. Call it on a client and on its mirror, before connecting.
  followRedirects(on: boolean): void {
    this.core.exports.cs_follow_redirects(this.handle.pointer, on ? 1 : 0);
  }
  // DNS name of the server for the next connection; "" means the host of the program's URL.
  get connectServer(): string {
    return this.core.text(this.core.exports.cs_connect_server(this.handle.pointer));
  }
  // DNS name of the server to which the scene moves soon (ClientEvent.moving); "" if there is none.
  get nextServer(): string {
    return this.core.text(this.core.exports.cs_next_server(this.handle.pointer));
  }

  // Offers datagrams of a data channel on the present connection, right after Hello. ClientEvent.datagrams follows. Returns
  // false if the offer is not valid.
  offerDatagrams({ ufrag, password, fingerprint }: DatagramOffer): boolean {
    const { core, handle } = this;
    return core.with([ufrag, password], (name, secret) => {
      const offer = handle.prepared(CS_DATAGRAM_OFFER_VERSION);
      const view = core.view();
      view.setUint32(offer + cs_datagram_offer.ufrag, name!, true);
      view.setUint32(offer + cs_datagram_offer.password, secret!, true);
      core.bytes(offer + cs_datagram_offer.fingerprint, fingerprint.length).set(fingerprint);
      view.setInt32(offer + cs_datagram_offer.sctp, 1, true);
      return core.exports.cs_offer_datagrams(handle.pointer, offer) !== 0;
    });
  }

  // The server's answer. Undefined before ClientEvent.datagrams on the present connection.
  datagramAnswer(): DatagramAnswer | undefined {
    const { core, handle } = this;
    const at = handle.prepared(CS_DATAGRAM_ANSWER_VERSION);
    if (core.exports.cs_get_datagram_answer(handle.pointer, at) === 0) return undefined;
    const view = core.view();
    const text = (offset: number) => core.text(view.getUint32(at + offset, true));
    const count = view.getUint32(at + cs_datagram_answer.addresses, true);
    return {
      ufrag: text(cs_datagram_answer.ufrag),
      password: text(cs_datagram_answer.password),
      fingerprint: core.bytes(at + cs_datagram_answer.fingerprint, 32).slice(),
      addresses: Array.from({ length: count }, (_, index) => core.text(core.exports.cs_datagram_address(handle.pointer, index))),
      port: view.getUint32(at + cs_datagram_answer.port, true),
    };
  }

  // Sends pings and runs timers. Call at least ten times per second.
  update(atUs: bigint = nowUs()): void {
    this.core.exports.cs_update(this.handle.pointer, atUs);
  }

  // Copy of the next ClientMessage to send.
  nextOutgoing(): Uint8Array<ArrayBuffer> | undefined {
    const { scratch, pointer } = this.handle;
    const message = this.core.exports.cs_next_outgoing(pointer, scratch);
    if (message === 0) return undefined;
    return this.core.bytes(message, this.core.view().getUint32(scratch, true)).slice();
  }

  get state(): ClientState {
    return this.core.exports.cs_get_state(this.handle.pointer);
  }
  get errorCode(): number {
    return this.core.exports.cs_error_code(this.handle.pointer);
  }
  get errorText(): string {
    return this.core.text(this.core.exports.cs_error_text(this.handle.pointer));
  }
  get noticeText(): string {
    return this.core.text(this.core.exports.cs_notice_text(this.handle.pointer));
  }
  // Name and version of the server's program; "" before Welcome.
  get serverName(): string {
    return this.core.text(this.core.exports.cs_server_name(this.handle.pointer));
  }
  get deviceName(): string {
    return this.core.text(this.core.exports.cs_device_name(this.handle.pointer));
  }
  get sceneName(): string {
    return this.core.text(this.core.exports.cs_scene_name(this.handle.pointer));
  }

  // Requests the list of the server's scenes. ClientEvent.scenes follows; see requests.scenes().
  listScenes(): void {
    this.core.exports.cs_list_scenes(this.handle.pointer);
  }
}
