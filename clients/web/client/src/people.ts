// SPDX-License-Identifier: MIT
// Participants of the scene, and codes by which others join.

import { CS_PAIRING_CODE_VERSION, CS_PARTICIPANT_VERSION, cs_pairing_code, cs_participant } from "./layout";
import type { CoreHandle } from "./handle";
import type { PairingCode, Participant } from "./types";

export class People {
  constructor(private readonly handle: CoreHandle) {}

  // Requests a code by which others become participants. ClientEvent.pairingCode or ClientEvent.error follows.
  createPairingCode(): void {
    this.handle.core.exports.cs_create_pairing_code(this.handle.pointer, 0);
  }
  // The newest code.
  pairingCode(): PairingCode | undefined {
    if (this.handle.core.exports.cs_get_pairing_code(this.handle.pointer, this.handle.prepared(CS_PAIRING_CODE_VERSION)) === 0) return undefined;
    const view = this.handle.core.view();
    return {
      code: this.handle.core.text(view.getUint32(this.handle.scratch + cs_pairing_code.code, true)),
      role: view.getUint32(this.handle.scratch + cs_pairing_code.role, true),
      validSeconds: view.getUint32(this.handle.scratch + cs_pairing_code.valid_s, true),
    };
  }

  // Participants of the scene, in the order in which they joined.
  participants(): Participant[] {
    const own = this.handle.core.exports.cs_participant_id(this.handle.pointer);
    const count = this.handle.core.exports.cs_participant_count(this.handle.pointer);
    return this.handle.list(count, CS_PARTICIPANT_VERSION, this.handle.core.exports.cs_get_participant, (view, at) => {
      const id = view.getBigUint64(at + cs_participant.id, true);
      const program = this.handle.core.text(view.getUint32(at + cs_participant.client_name, true));
      return {
        id,
        name: this.handle.core.text(view.getUint32(at + cs_participant.name, true)) || program || "unnamed",
        role: view.getUint32(at + cs_participant.role, true),
        away: view.getInt32(at + cs_participant.away, true) !== 0,
        self: id === own,
        body: this.handle.core.text(this.handle.core.exports.cs_body_of(this.handle.pointer, id)),
      };
    });
  }

  // Id of this participant; 0 before it has joined.
  get own(): bigint {
    return this.handle.core.exports.cs_participant_id(this.handle.pointer);
  }
  // Key of Roles.
  get role(): number {
    return this.handle.core.exports.cs_get_role(this.handle.pointer);
  }

  // Requests of owners. On failure ClientEvent.error follows.
  setRole(participant: bigint, role: number): void {
    this.handle.core.exports.cs_set_role(this.handle.pointer, participant, role);
  }
  remove(participant: bigint): void {
    this.handle.core.exports.cs_remove_participant(this.handle.pointer, participant);
  }
  // Removes the participant, whose token no longer admits anybody to the scene.
  ban(participant: bigint): void {
    this.handle.core.exports.cs_ban_participant(this.handle.pointer, participant);
  }
}
