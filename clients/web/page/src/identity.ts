// SPDX-License-Identifier: MIT
// How this page proves who it is: takes a pairing code or a token, keeps the token, and shows codes to owners.

import { Roles, type Client, type PairingCode, type Proof, type TokenStore } from "@clothstream/client";
import { element, write } from "./panel/dom";

// A browser may refuse to store anything. The page then asks for a code again, and a reload joins as a new participant.
function storeIn(storage: () => Storage, key: string): TokenStore {
  return {
    kept() {
      try {
        return storage().getItem(key) ?? "";
      } catch {
        return "";
      }
    },
    keep(token) {
      try {
        if (token) storage().setItem(key, token);
        else storage().removeItem(key);
      } catch {
        // Nothing is kept.
      }
    },
  };
}

// Token that pairing has given for this server.
export const browserTokens = storeIn(() => window.localStorage, "clothstream.token");
// Place in the scene of a tab that reloads.
export const tabPlaces = storeIn(() => window.sessionStorage, "clothstream.place");

// Proof in typed text: six digits are a code, anything else is a token.
export function proofIn(text: string): Proof {
  const typed = text.replace(/\s+/g, "");
  return /^\d{6}$/.test(typed) ? { code: typed } : { token: typed };
}

// Takes a code or a token from the form that failure_card shows.
export function listenToProof(given: (proof: Proof) => void): void {
  const input = element<HTMLInputElement>("proof-input");
  element<HTMLFormElement>("proof").addEventListener("submit", (event) => {
    event.preventDefault();
    if (input.value.trim() === "" || element<HTMLButtonElement>("proof-send").disabled) return;
    const proof = proofIn(input.value);
    input.value = "";
    given(proof);
  });
}

// Whether the server makes codes for a client with this token (docs/identity.md): one with the role owner that is not
// for one scene. An owner of a scene may have a token with another role.
function makesCodes(token: string): boolean {
  try {
    const payload = token.split(".")[1] ?? "";
    const claims = JSON.parse(atob(payload.replaceAll("-", "+").replaceAll("_", "/"))) as { role?: unknown; scene?: unknown };
    return claims.role === "owner" && !claims.scene;
  } catch {
    return false;
  }
}

// Button with which an owner makes a pairing code, and the newest code.
export class PairingPanel {
  private readonly button = element<HTMLButtonElement>("pairing");
  private readonly code = element("pairing-code");
  private timer: number | undefined;

  constructor(asked: () => void) {
    this.button.addEventListener("click", asked);
  }

  showFor(client: Client): void {
    this.button.hidden = !makesCodes(client.token);
    if (this.button.hidden) this.code.hidden = true;
  }

  showCode({ code, role, validSeconds }: PairingCode): void {
    const minutes = Math.round(validSeconds / 60);
    write(this.code, `${code.slice(0, 3)} ${code.slice(3)} makes a ${Roles.get(role) ?? "client"}, for ${minutes} minutes`);
    this.code.hidden = false;
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => (this.code.hidden = true), 1000 * validSeconds);
  }
}
