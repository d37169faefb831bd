// SPDX-License-Identifier: MIT
// Sessions of VR and AR: which the browser offers, entering and leaving, frame rate and foveation.

import type * as THREE from "three";
import { kDetections } from "./detected_surfaces";

export type Mode = "immersive-vr" | "immersive-ar";

export interface ImmersionListener {
  entered?(mode: Mode, session: XRSession): void;
  left?(): void;
  // The user takes the headset off, or puts it on again.
  visibilityChanged?(visible: boolean): void;
}

const kFoveation = 0.5; // 0 (none) to 1

export class Immersion {
  session: XRSession | undefined;
  mode: Mode | undefined;

  constructor(
    private readonly renderer: THREE.WebGLRenderer,
    private readonly listener: ImmersionListener,
  ) {
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local-floor");
  }

  // Modes that this browser and device offer. Empty without WebXR, and on pages that are not secure.
  static async offered(): Promise<Mode[]> {
    const { xr } = navigator;
    if (!xr) return [];
    const modes: Mode[] = ["immersive-vr", "immersive-ar"];
    const offers = await Promise.all(modes.map((mode) => xr.isSessionSupported(mode).catch(() => false)));
    return modes.filter((_, index) => offers[index]);
  }

  // Starts a session, and ends the one before it. Call on a gesture of the user. Throws what the browser says if it
  // refuses. `rate` is the frame rate that suits the stream, in Hz. `detects`: the session may detect the surfaces of the
  // real room (AR only).
  async enter(mode: Mode, rate: number, detects = false): Promise<void> {
    const { xr } = navigator;
    if (!xr) throw new Error("This browser has no WebXR");
    await this.leave();
    const session = await xr.requestSession(mode, options(mode, detects));
    // Another press may have started one meanwhile.
    if (this.session) return session.end();
    this.session = session;
    this.mode = mode;
    session.addEventListener("end", () => this.ended(session));
    session.addEventListener("visibilitychange", () => this.listener.visibilityChanged?.(session.visibilityState !== "hidden"));
    try {
      await this.renderer.xr.setSession(session);
    } catch (error) {
      await session.end().catch(() => undefined);
      throw error;
    }
    // The user may have left meanwhile.
    if (this.session !== session) return;
    this.listener.entered?.(mode, session);
    this.renderer.xr.setFoveation(kFoveation);
    const chosen = chooseRate(session.supportedFrameRates, rate);
    // A device may refuse, for example to save its battery.
    if (chosen !== undefined) await session.updateTargetFrameRate(chosen).catch(() => undefined);
  }

  async leave(): Promise<void> {
    await this.session?.end().catch(() => undefined);
  }

  private ended(session: XRSession): void {
    if (this.session !== session) return;
    this.session = undefined;
    this.mode = undefined;
    this.listener.left?.();
  }
}

function options(mode: Mode, detects: boolean): XRSessionInit {
  const optional = ["local-floor", "hand-tracking", "body-tracking", "layers"];
  if (mode === "immersive-vr") return { optionalFeatures: optional };
  return {
    optionalFeatures: [...optional, "hit-test", "anchors", "depth-sensing", ...(detects ? kDetections : [])],
    depthSensing: { usagePreference: ["gpu-optimized"], dataFormatPreference: ["luminance-alpha", "float32"] },
  } as XRSessionInit;
}

// The lowest offered rate that is not below the stream's, or else the highest one. Play-out interpolates to any rate, so
// a higher one would only take power. Undefined if the device offers no choice.
export function chooseRate(offered: Float32Array | undefined, streamRate: number): number | undefined {
  if (!offered || offered.length === 0) return undefined;
  const rates = [...offered].sort((a, b) => a - b);
  return rates.find((rate) => rate >= streamRate - 0.5) ?? rates.at(-1);
}
