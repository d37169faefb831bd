// SPDX-License-Identifier: MIT
// What the page says about a failure: what happened and what to do. Pure; failure_card shows it.

import { ErrorCode, type SessionState } from "@clothstream/client";

// Action of a button of a failure.
export type FailureAction = "connect" | "join" | "default" | "reload" | "view" | "close";

export interface Failure {
  kind: string; // for styles and tests
  title: string;
  text: string; // what happened, and what to do
  steps?: readonly string[];
  said?: string; // words of the server or the browser
  wait?: string; // changes every second
  retryAt?: number | undefined; // time of performance.now() at which the page tries again by itself
  asks?: boolean; // the person gives a code or a token
  locked?: boolean; // not yet
  quiet?: boolean; // the picture stays usable
  actions: readonly { label: string; action: FailureAction }[]; // the first one is the usual one
}

export interface FailureContext {
  now: number; // of performance.now(), ms
  since: number; // time at which the state began, ms
  hasJoined: boolean; // whether this page has been in a scene
  networkDenied: boolean; // the browser does not let the page reach the local network
  longestPauseMs: number | undefined; // longest pause between frames if they come late
}

// A connection that returns sooner needs no words, ms.
const kPatienceMs = 300;
// Time between attempts to join a full scene, ms.
const kFullMs = 10_000;
// Time for which a server takes no more codes (docs/identity.md), ms.
const kLockoutMs = 60_000;

export const kReload = { label: "Reload the page", action: "reload" } as const;
const kJoin = { label: "Join again", action: "join" } as const;
const kDefault = { label: "Join the default scene", action: "default" } as const;

// Undefined if nothing is wrong.
export function failureOf(state: SessionState, context: FailureContext): Failure | undefined {
  switch (state.kind) {
    case "connecting":
      return undefined;
    case "live":
      return context.longestPauseMs === undefined ? undefined : late(context.longestPauseMs);
    case "reconnecting":
      return lost(state, context);
    case "asking":
      return asking(state, context);
    case "failed":
      if (state.cause === "worker") return workerFailed(state.reason);
      if (state.cause === "client") return misunderstood(state.reason);
      if (state.cause === "datagrams") return noDatagrams(state.reason);
      return refused(state.code, state.reason, context);
  }
}

function lost({ reason, attemptAt }: SessionState & { kind: "reconnecting" }, { now, since, hasJoined, networkDenied }: FailureContext): Failure | undefined {
  if (now - since < kPatienceMs) return undefined;
  const gone = Math.floor((now - since) / 1000);
  const next = Math.ceil((attemptAt - now) / 1000);
  const wait = `No connection for ${seconds(gone)}. ${next > 1 ? `Trying again in ${seconds(next)}.` : "Trying again now."}`;
  const actions = [{ label: "Try now", action: "connect" }] as const;
  if (networkDenied)
    return {
      kind: "network-denied",
      title: "The browser may block the local network",
      text:
        "This browser does not let the page reach devices in your local network. Open the settings of this site (left of the " +
        "address), allow access to the local network, and the page connects again.",
      said: reason,
      wait,
      actions,
    };
  return {
    kind: "lost",
    title: hasJoined ? "The connection is lost" : "The server cannot be reached",
    text:
      "The page keeps trying and comes back by itself, without a reload. If it takes long, check that the server runs and " +
      "that this device is in the same network.",
    said: reason,
    wait,
    actions,
  };
}

function asking({ reason, code, wasGiven }: SessionState & { kind: "asking" }, { now, since }: FailureContext): Failure {
  const asks = true;
  if (code === ErrorCode.wrongPairingCode) {
    if (!isLockout(reason))
      return {
        kind: "wrong-code",
        title: "This code is not valid",
        text:
          "Compare it with the newest code that the server or an owner shows: a new code replaces the one before. A code is " +
          "valid for five minutes.",
        said: reason,
        asks,
        actions: [],
      };
    const left = Math.ceil((since + kLockoutMs - now) / 1000);
    return {
      kind: "locked-out",
      title: "Too many wrong codes",
      text: "After five wrong codes the server takes none from your address for a minute. Then give the newest code.",
      said: reason,
      ...(left > 0 ? { wait: `You can try again in ${seconds(left)}.`, locked: true } : { wait: "You can try again now." }),
      asks,
      actions: [],
    };
  }
  if (wasGiven)
    return {
      kind: "token-refused",
      title: "Your access has ended",
      text: "The server no longer takes the token of this browser. Give a new token or a pairing code to come back.",
      said: reason,
      asks,
      actions: [],
    };
  return {
    kind: "asking",
    title: "Who are you?",
    text:
      "This server asks for a pairing code or a token. It shows a code when it starts; an owner makes one in the tab People. " +
      "This browser then remembers you.",
    said: reason,
    asks,
    actions: [],
  };
}

// The server refuses to have this page in the scene.
function refused(code: number, said: string, { since }: FailureContext): Failure {
  switch (code) {
    case ErrorCode.unsupportedVersion:
    case ErrorCode.unsupportedCodec:
      return misunderstood(said);
    case ErrorCode.resourceExhausted: {
      return {
        kind: "full",
        title: "There is no room at the moment",
        text: "The scene or the server has reached a limit. The page joins by itself when there is room; you may also join another scene.",
        said,
        retryAt: since + kFullMs,
        actions: [{ label: "Try now", action: "join" }, kDefault],
      };
    }
    case ErrorCode.notFound:
      return {
        kind: "not-found",
        title: "This scene does not exist",
        text: "It was deleted, has expired without people, or its name is misspelt. Join the default scene, and choose from there.",
        said,
        actions: [kDefault],
      };
    case ErrorCode.removed:
    case ErrorCode.permissionDenied:
      if (isBan(said))
        return {
          kind: "banned",
          title: "An owner has banned you from this scene",
          text: "You cannot join it until an owner lifts the ban. You can join another scene.",
          said,
          actions: [kDefault],
        };
      if (code === ErrorCode.removed)
        return {
          kind: "removed",
          title: "An owner has removed you from this scene",
          text: "You may join again as a new participant, or choose another scene.",
          said,
          actions: [kJoin, kDefault],
        };
      return {
        kind: "not-allowed",
        title: "You may not join this scene",
        text: "Your token does not include it. Choose a scene that it includes, or ask for another token.",
        said,
        actions: [kDefault],
      };
    case ErrorCode.takenOver:
      return {
        kind: "taken-over",
        title: "You are connected elsewhere",
        text: "A newer connection has taken your place. Join again to use this page.",
        said,
        actions: [kJoin],
      };
    default:
      return {
        kind: "refused",
        title: "The server has ended the connection",
        text: "Join again. If this happens every time, reload the page.",
        said,
        actions: [kJoin, kReload],
      };
  }
}

function misunderstood(said: string): Failure {
  return {
    kind: "version",
    title: "Page and server do not understand each other",
    text: "Usually the server was updated while this page was open. Reload the page to get the version that fits.",
    said,
    actions: [kReload],
  };
}

function workerFailed(said: string): Failure {
  return {
    kind: "worker",
    title: "A part of the page has stopped",
    text: "The worker that receives the stream did not start, or has stopped. Reload the page. If that does not help, try another browser.",
    said,
    actions: [kReload],
  };
}

function noDatagrams(said: string): Failure {
  return {
    kind: "no-datagrams",
    title: "Datagrams cannot be opened",
    text: "The address of this page requires them. Remove transport=datagrams from it, or let UDP through to the server, and join again.",
    said,
    actions: [kJoin],
  };
}

function late(longestMs: number): Failure {
  return {
    kind: "late",
    title: "Frames arrive late",
    text:
      "The cloth may stop and jump. Go closer to the Wi-Fi, or choose a lower quality.",
    wait: `The longest pause was ${(longestMs / 1000).toFixed(1)} s.`,
    quiet: true,
    actions: [{ label: "Quality", action: "view" }],
  };
}

// The wire has one code for removed and banned people, and one for all wrong codes; the words tell them apart
// (tests/page/failure.test.mjs reads them from a real server).
const isBan = (said: string) => /\bbanned\b/.test(said);
const isLockout = (said: string) => /try again in a minute/.test(said);

function seconds(count: number): string {
  return count < 120 ? `${count} s` : `${Math.floor(count / 60)} min`;
}
