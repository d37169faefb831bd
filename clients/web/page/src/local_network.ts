// SPDX-License-Identifier: MIT
// Permission of this page to reach the local network, which Chromium asks for since version 142
// (https://wicg.github.io/local-network-access/).

// Names under which versions of Chromium know it. Other browsers know none.
const kNames = ["local-network-access", "local-network", "loopback-network"];

// Calls `changed` with whether the permission is denied, at first and at each change.
export function watchLocalNetwork(changed: (denied: boolean) => void): void {
  // Pages that are not secure never have it, also where they do not need it.
  if (!window.isSecureContext) return;
  const known: PermissionStatus[] = [];
  const report = () => changed(known.some(({ state }) => state === "denied"));
  for (const name of kNames) {
    navigator.permissions
      ?.query({ name: name as PermissionName })
      .then((status) => {
        known.push(status);
        status.addEventListener("change", report);
        if (status.state === "denied") report();
      })
      .catch(() => undefined); // The browser does not know this name.
  }
}
