// SPDX-License-Identifier: MIT
// Shows the address of this server for other devices, with its QR code and the fingerprint of its key.

import { element, write } from "./panel/dom";

// Stays hidden if other devices cannot reach the server, or another server delivers this page.
export async function showAddress(): Promise<void> {
  const answer = await fetch("address.json").catch(() => undefined);
  if (!answer?.ok) return;
  // Another server may answer with a page.
  const shown = (await answer.json().catch(() => undefined)) as { address?: string; fingerprint?: string } | undefined;
  const { address, fingerprint } = shown ?? {};
  if (!address) return;
  const link = element<HTMLAnchorElement>("share-address");
  link.href = address;
  write(link, address);
  element<HTMLImageElement>("share-code").src = "address.svg";
  const key = element("share-key");
  write(key, `The browser warns of an unknown certificate. Its public key must have this SHA-256 fingerprint: ${fingerprint}`);
  key.hidden = !fingerprint;
  element("share").hidden = false;
  element("share-none").hidden = true;
}
