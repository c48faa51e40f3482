// What is drawn on the object: contacts of now with normal, friction cone and force, and the trace of all contacts.

import {
  BufferAttribute, BufferGeometry, CircleGeometry, Color, ConeGeometry, CylinderGeometry, DoubleSide, GreaterDepth, Group, InstancedMesh,
  Matrix4, Mesh, MeshBasicMaterial, OctahedronGeometry, Quaternion, RingGeometry, Vector3,
} from "three";
import { add, cross, norm, scale, sub, unit, type Vec3 } from "../math";
import type { ContactNow, Hold, Motion } from "../motion";
import type { SceneStory } from "../story";
import { fingerColour } from "../theme";

const Z = new Vector3(0, 0, 1);
const Y = new Vector3(0, 1, 0);

/** A mesh, and the same faintly where something stands before it. */
function seenThrough(geometry: BufferGeometry, colour: string): Group {
  const front = new Mesh(geometry, new MeshBasicMaterial({ color: colour, side: DoubleSide }));
  const behind = new Mesh(geometry, new MeshBasicMaterial({
    color: colour, side: DoubleSide, transparent: true, opacity: 0.3, depthFunc: GreaterDepth, depthWrite: false,
  }));
  behind.renderOrder = 3;
  return new Group().add(front, behind);
}

class FingerContact {
  readonly group = new Group();
  readonly cone: Group;
  readonly arrow: Group;
  private readonly disc: Group;
  private readonly ring: Group;
  private readonly shaft: Group;
  private readonly head: Group;

  constructor(colour: string, size: number, reach: number, friction: number) {
    this.disc = seenThrough(new CircleGeometry(size, 20), colour);
    this.ring = seenThrough(new RingGeometry(size * 0.55, size * 1.15, 24), colour);
    const needle = new CylinderGeometry(size * 0.12, size * 0.12, reach, 6).rotateX(Math.PI / 2).translate(0, 0, reach / 2);
    const normal = seenThrough(needle, colour);
    this.disc.position.z = this.ring.position.z = size * 0.06;

    const wall = new ConeGeometry(friction * reach, reach, 32, 1, true).rotateX(-Math.PI / 2).translate(0, 0, reach / 2);
    const rim = new RingGeometry(friction * reach * 0.975, friction * reach, 40).translate(0, 0, reach);
    const veil = new MeshBasicMaterial({ color: colour, side: DoubleSide, transparent: true, opacity: 0.2, depthWrite: false });
    const cone = new Mesh(wall, veil);
    cone.renderOrder = 2;
    this.cone = new Group().add(cone, new Mesh(rim, new MeshBasicMaterial({ color: colour, side: DoubleSide })));

    this.shaft = seenThrough(new CylinderGeometry(size * 0.24, size * 0.24, 1, 8).translate(0, -0.5, 0), colour);
    this.head = seenThrough(new ConeGeometry(size * 0.7, size * 1.6, 12).translate(0, -size * 0.8, 0), colour);
    this.arrow = new Group().add(this.shaft, this.head);
    this.group.add(this.disc, this.ring, normal, this.cone);
  }

  show(contact: ContactNow, forceLength: number): void {
    this.group.visible = contact.mode !== "free";
    this.arrow.visible = this.group.visible && contact.force !== null;
    if (!this.group.visible) return;
    this.group.position.set(...contact.point);
    this.group.quaternion.setFromUnitVectors(Z, new Vector3(...contact.normal));
    this.disc.visible = contact.mode === "fixed";
    this.ring.visible = contact.mode === "rolling";
    if (!contact.force) return;
    const length = norm(contact.force) * forceLength;
    this.arrow.visible = length > 1e-9;
    this.arrow.position.set(...contact.point);
    this.arrow.quaternion.setFromUnitVectors(Y, new Vector3(...unit(contact.force)));
    this.shaft.scale.set(1, Math.max(length, 1e-6), 1);
  }
}

export class Contacts {
  readonly current = new Group();
  readonly trace: Group;
  private readonly fingers: FingerContact[];
  private forcesShown = true;

  /** `objectSize`: half the largest side of the object, metres; `largestForce`: newtons, 0 without forces. */
  constructor(scene: SceneStory, private readonly motion: Motion, objectSize: number, private readonly largestForce: number) {
    this.fingers = scene.fingers.map((finger, i) => {
      const reach = Math.max(2.1 * finger.tip_radius, 0.45 * objectSize);
      const made = new FingerContact(fingerColour(i), 0.085 * objectSize, reach, Math.max(scene.friction, 1e-3));
      this.current.add(made.group, made.arrow);
      return made;
    });
    this.forceReach = 1.3 * objectSize;
    this.trace = traceOf(motion, objectSize);
  }

  private readonly forceReach: number;

  setCones(shown: boolean): void {
    for (const finger of this.fingers) finger.cone.visible = shown;
  }

  setForces(shown: boolean): void {
    this.forcesShown = shown;
  }

  show(time: number): void {
    const forceLength = this.largestForce > 0 ? this.forceReach / this.largestForce : 0;
    this.motion.contacts(time).forEach((contact, i) => {
      this.fingers[i]?.show(this.forcesShown ? contact : { ...contact, force: null }, forceLength);
    });
  }
}

const MOST_DOTS = 600;

/** Placements as dots, rolling as ribbons, relocations as dotted arcs from contact to contact. */
function traceOf(motion: Motion, size: number): Group {
  const trace = new Group();
  const width = 0.022 * size;
  motion.holds.forEach((holds, finger) => {
    const colour = new Color(fingerColour(finger));
    const material = new MeshBasicMaterial({ color: colour, side: DoubleSide });
    const places: { at: Vec3; normal: Vec3; radius: number }[] = [];
    holds.forEach((hold, i) => {
      const [first, last] = [hold.path[0], hold.path[hold.path.length - 1]];
      places.push({ at: first.point, normal: first.normal, radius: 2 * width });
      if (last !== first) {
        trace.add(new Mesh(ribbon(hold, width), material));
        places.push({ at: last.point, normal: last.normal, radius: 1.4 * width });
      }
      const next = holds[i + 1];
      if (next) for (const at of arc(last, next.path[0], size)) places.push({ at, normal: [0, 0, 0], radius: 0.55 * width });
    });
    const discs = places.filter((p) => norm(p.normal) > 0);
    const dots = places.filter((p) => norm(p.normal) === 0).slice(0, MOST_DOTS);
    trace.add(copies(new CircleGeometry(1, 14), material, discs, 0.008 * size), copies(new OctahedronGeometry(1), material, dots, 0));
  });
  return trace;
}

function copies(geometry: BufferGeometry, material: MeshBasicMaterial, places: { at: Vec3; normal: Vec3; radius: number }[], lift: number): InstancedMesh {
  const mesh = new InstancedMesh(geometry, material, places.length);
  places.forEach(({ at, normal, radius }, i) => {
    const turn = norm(normal) > 0 ? new Quaternion().setFromUnitVectors(Z, new Vector3(...normal)) : new Quaternion();
    const place = new Vector3(...add(at, scale(normal, lift)));
    mesh.setMatrixAt(i, new Matrix4().compose(place, turn, new Vector3(radius, radius, radius)));
  });
  return mesh;
}

function ribbon(hold: Hold, width: number): BufferGeometry {
  const points: number[] = [];
  const index: number[] = [];
  hold.path.forEach(({ point, normal }, i) => {
    const before = hold.path[Math.max(i - 1, 0)].point;
    const after = hold.path[Math.min(i + 1, hold.path.length - 1)].point;
    const side = scale(unit(cross(normal, sub(after, before))), width / 2);
    const lifted = add(point, scale(normal, 0.35 * width));
    points.push(...add(lifted, side), ...sub(lifted, side));
    if (i > 0) index.push(2 * i - 2, 2 * i - 1, 2 * i, 2 * i, 2 * i - 1, 2 * i + 1);
  });
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  geometry.setIndex(index);
  return geometry;
}

/** Points of an arc over the surface from one contact to the next. */
function arc(from: { point: Vec3; normal: Vec3 }, to: { point: Vec3; normal: Vec3 }, size: number): Vec3[] {
  const span = norm(sub(to.point, from.point));
  if (span < 0.03 * size) return [];
  const n = Math.max(4, Math.min(24, Math.round(span / (0.07 * size))));
  const lift = 0.1 * size + 0.5 * span;
  const handles = [from.point, add(from.point, scale(from.normal, lift)), add(to.point, scale(to.normal, lift)), to.point];
  const found: Vec3[] = [];
  for (let i = 1; i < n; i++) {
    const t = i / n;
    const weights = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t ** 3];
    found.push(weights.reduce<Vec3>((sum, w, k) => add(sum, scale(handles[k], w)), [0, 0, 0]));
  }
  return found;
}

