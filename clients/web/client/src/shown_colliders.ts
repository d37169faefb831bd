// SPDX-License-Identifier: MIT
// Colliders that are read for each drawn frame. Objects are used again, so that drawn frames allocate nothing for them.

import { CS_COLLIDER_VERSION, cs_collider } from "./layout";
import { readFloats, vec3, type CoreHandle } from "./handle";
import { kHeadId, type Collider, type Quaternion, type Vec3 } from "./types";

// Colliders of participants have their id as name.
const kHeadName = String(kHeadId);

type Mutable<Type> = { -readonly [Key in keyof Type]: Type[Key] };
interface KeptCollider extends Omit<Collider, "position" | "orientation" | "size"> {
  position: Mutable<Vec3>;
  orientation: Mutable<Quaternion>;
  size: Mutable<Vec3>;
  idWords: readonly [number, number]; // participantId, lower half first
}

type Getter = (client: number, index: number, out: number) => number;

export function readCollider(handle: CoreHandle, view: DataView, at: number, index: number): KeptCollider {
  const name = handle.core.text(view.getUint32(at + cs_collider.name, true));
  const participantId = view.getBigUint64(at + cs_collider.participant_id, true);
  return {
    index,
    name,
    shape: view.getUint32(at + cs_collider.shape, true),
    position: vec3(view, at + cs_collider.position),
    orientation: readFloats(view, at + cs_collider.orientation, [0, 0, 0, 0]),
    radius: view.getFloat32(at + cs_collider.radius, true),
    topRadius: view.getFloat32(at + cs_collider.top_radius, true),
    length: view.getFloat32(at + cs_collider.length, true),
    size: vec3(view, at + cs_collider.size),
    participantId,
    idWords: [view.getUint32(at + cs_collider.participant_id, true), view.getUint32(at + cs_collider.participant_id + 4, true)],
    isHead: isHead(participantId, name),
    yields: view.getInt32(at + cs_collider.yields, true) !== 0,
  };
}

const isHead = (participantId: bigint, name: string) => participantId !== 0n && name === kHeadName;

export class ShownColliders {
  private readonly kept: KeptCollider[] = [];
  private readonly list: KeptCollider[] = [];

  constructor(private readonly handle: CoreHandle) {}

  // The list and its objects are valid until the next call.
  read(count: number, get: Getter): readonly Collider[] {
    const { core, pointer } = this.handle;
    const scratch = this.handle.prepared(CS_COLLIDER_VERSION);
    let found = 0;
    for (let index = 0; index < count; ++index) {
      if (get(pointer, index, scratch) === 0) continue;
      const view = core.view();
      const collider = this.kept[found];
      if (collider) this.update(collider, view, scratch, index);
      else this.kept.push(readCollider(this.handle, view, scratch, index));
      this.list[found] = this.kept[found]!;
      ++found;
    }
    // Only a change of the length reallocates the list.
    if (this.list.length !== found) this.list.length = found;
    return this.list;
  }

  private update(collider: KeptCollider, view: DataView, at: number, index: number): void {
    collider.index = index;
    const name = view.getUint32(at + cs_collider.name, true);
    if (!this.handle.core.holds(name, collider.name)) collider.name = this.handle.core.text(name);
    collider.shape = view.getUint32(at + cs_collider.shape, true);
    readFloats(view, at + cs_collider.position, collider.position);
    readFloats(view, at + cs_collider.orientation, collider.orientation);
    collider.radius = view.getFloat32(at + cs_collider.radius, true);
    collider.topRadius = view.getFloat32(at + cs_collider.top_radius, true);
    collider.length = view.getFloat32(at + cs_collider.length, true);
    readFloats(view, at + cs_collider.size, collider.size);
    this.updateId(collider, view, at + cs_collider.participant_id);
    collider.isHead = isHead(collider.participantId, collider.name);
    collider.yields = view.getInt32(at + cs_collider.yields, true) !== 0;
  }

  // Each bigint that is read is a new object, so it is read only after a change.
  private updateId(collider: KeptCollider, view: DataView, at: number): void {
    const low = view.getUint32(at, true);
    const high = view.getUint32(at + 4, true);
    if (collider.idWords[0] === low && collider.idWords[1] === high) return;
    collider.idWords = [low, high];
    collider.participantId = view.getBigUint64(at, true);
  }
}
