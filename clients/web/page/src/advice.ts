// SPDX-License-Identifier: MIT
// What the page says where the browser or the device lacks something. Pure; failure_card shows it.

import { kReload, type Failure } from "./failure";

const kClose = { label: "Close", action: "close" } as const;

export const kNoWebGl: Failure = {
  kind: "no-webgl",
  title: "This browser cannot draw the cloth",
  text: "The page needs WebGL 2, which this browser does not provide.",
  steps: [
    "Turn on hardware acceleration in the settings of the browser, and start it again.",
    "Update the browser and the driver of the graphics card.",
    "If that does not help, use another browser or device.",
  ],
  actions: [kReload],
};

export const kGraphicsLost: Failure = {
  kind: "graphics-lost",
  title: "The browser has stopped drawing",
  text: "The graphics processor was reset, or has no memory left. Close other programs that draw, then reload the page. You stay in the scene.",
  actions: [kReload],
};

export const kNoWebAssembly: Failure = {
  kind: "no-webassembly",
  title: "This browser cannot decode the stream",
  text: "The page needs WebAssembly, which this browser does not provide or has switched off.",
  steps: [
    "Allow it for this site if a protected mode has switched it off, such as Lockdown Mode or enhanced security.",
    "Update the browser, or use another one.",
  ],
  actions: [kReload],
};

// A file of the page did not arrive or could not be used. `retryAt` is set if the page loads it again by itself.
export function notLoaded(said: string, retryAt: number | undefined): Failure {
  return {
    kind: "not-loaded",
    title: "The page could not be loaded completely",
    text:
      retryAt === undefined
        ? "A file of the page is missing or cannot be used. Reload the page."
        : "The server did not send a part of the page. The page tries again by itself.",
    said,
    retryAt,
    actions: [kReload],
  };
}

export interface HeadsetSupport {
  isSecure: boolean; // window.isSecureContext
  hasWebXr: boolean; // navigator.xr
  offers: boolean; // a device offers VR or AR
}

// Why the page has no button to enter VR or AR. Undefined if it has one.
export function whyNoHeadset({ isSecure, hasWebXr, offers }: HeadsetSupport): Failure | undefined {
  if (offers) return undefined;
  const rest = { quiet: true, actions: [kClose] } as const;
  if (!isSecure)
    return {
      kind: "insecure",
      title: "VR and AR need a secure page",
      text: "Browsers enter VR only on pages with https. This page came without it; everything else works.",
      steps: kHowToSecure,
      ...rest,
    };
  if (!hasWebXr)
    return {
      kind: "no-webxr",
      title: "This browser has no WebXR",
      text: "Open the page in the browser of a headset, or in a current Chrome or Edge. Phones with iOS have no WebXR.",
      ...rest,
    };
  return {
    kind: "no-device",
    title: "No headset was found",
    text: "Connect a headset and start its software, or open this page in the browser of the headset. The buttons then appear by themselves.",
    ...rest,
  };
}

// Whether the browser seems to be that of a headset, by its name.
export function isHeadsetBrowser(userAgent: string): boolean {
  return /OculusBrowser|Quest|Pico|Wolvic|VIVE|Android XR/i.test(userAgent);
}

export const kHowToSecure: readonly string[] = [
  "Start the server with --tls self. It prints an address with https and its QR code.",
  "Open that address on this device, or scan the code.",
  "The browser warns, because it does not know the certificate. Compare the fingerprint with the printed one, then choose Advanced and continue.",
];
