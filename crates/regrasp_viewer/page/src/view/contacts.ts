// What is drawn on the object: contacts of now with normal, friction cone and force, and the trace of all contacts.

import {
  BufferAttribute, BufferGeometry, CircleGeometry, Color, ConeGeometry, CylinderGeometry, DoubleSide, Float32BufferAttribute, GreaterDepth, Group,
  InstancedMesh, Matrix4, Mesh, MeshBasicMaterial, Points, PointsMaterial, Quaternion, RingGeometry, Vector3, type MeshBasicMaterialParameters,
} from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { add, cross, norm, scale, sub, unit, type Vec3 } from "../math";
import type { Hold, Motion } from "../motion";
import type { HandStory } from "../story";
import { fingerColour } from "../theme";

const Y = new Vector3(0, 1, 0);
const Z = new Vector3(0, 0, 1);
const NOWHERE = new Matrix4().makeScale(0, 0, 0);

/** One part of the marks, once per finger, drawn in one go. */
class Part {
  readonly mesh: InstancedMesh;

  constructor(geometry: BufferGeometry, nFingers: number, look: MeshBasicMaterialParameters, renderOrder = 0) {
    this.mesh = new InstancedMesh(geometry, new MeshBasicMaterial({ side: DoubleSide, ...look }), nFingers);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = renderOrder;
    for (let i = 0; i < nFingers; i++) this.mesh.setColorAt(i, new Color(fingerColour(i)));
  }

  put(finger: number, where: Matrix4 | null): void {
    this.mesh.setMatrixAt(finger, where ?? NOWHERE);
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}

/** Parts with the same geometry twice: as it is, and faintly where something stands before it. */
function seenThrough(geometry: BufferGeometry, nFingers: number): Part[] {
  const behind = { transparent: true, opacity: 0.3, depthFunc: GreaterDepth, depthWrite: false } as const;
  return [new Part(geometry, nFingers, {}), new Part(geometry, nFingers, behind, 3)];
}

/** A cone with its point at the origin that opens along z, veiled, with a clear rim. */
function coneGeometry(reach: number, friction: number): BufferGeometry {
  const wall = new ConeGeometry(friction * reach, reach, 32, 1, true).rotateX(-Math.PI / 2).translate(0, 0, reach / 2);
  const rim = new RingGeometry(friction * reach * 0.975, friction * reach, 40).translate(0, 0, reach);
  for (const [geometry, opacity] of [[wall, 0.2], [rim, 0.95]] as [BufferGeometry, number][]) {
    const n = geometry.getAttribute("position").count;
    geometry.setAttribute("color", new Float32BufferAttribute(Array.from({ length: n }, () => [1, 1, 1, opacity]).flat(), 4));
  }
  return mergeGeometries([wall, rim])!;
}

export class Contacts {
  readonly current = new Group();
  readonly trace: Group;
  private readonly discs: Part[];
  private readonly rings: Part[];
  private readonly brokenRings: Part[];
  private readonly normals: Part;
  private readonly cones: Part[];
  private readonly shafts: Part[];
  private readonly heads: Part[];
  private readonly forceReach: number;
  private forcesShown = true;

  /** `objectSize`: half the largest side of the object, metres; `largestForce`: newtons, 0 without forces. */
  constructor({ fingers }: HandStory, friction: number, private readonly motion: Motion, objectSize: number, private readonly largestForce: number) {
    const n = fingers.length;
    const size = 0.085 * objectSize;
    const reaches = fingers.map((finger) => Math.max(2.1 * finger.tip_radius, 0.45 * objectSize));
    const reach = Math.max(...reaches, 0.45 * objectSize);
    this.forceReach = 1.3 * objectSize;
    this.discs = seenThrough(new CircleGeometry(size, 20).translate(0, 0, size * 0.06), n);
    this.rings = seenThrough(new RingGeometry(size * 0.55, size * 1.15, 24).translate(0, 0, size * 0.06), n);
    const arc = (from: number) => new RingGeometry(size * 0.55, size * 1.15, 8, 1, from, Math.PI / 3).translate(0, 0, size * 0.06);
    this.brokenRings = seenThrough(mergeGeometries([0, 1, 2].map((k) => arc((k * 2 * Math.PI) / 3)))!, n);
    this.normals = new Part(new CylinderGeometry(size * 0.12, size * 0.12, reach, 6, 1, true).rotateX(Math.PI / 2).translate(0, 0, reach / 2), n, {});
    const veil = { transparent: true, depthWrite: false, vertexColors: true };
    this.cones = [new Part(coneGeometry(reach, Math.max(friction, 1e-3)), n, veil, 2)];
    this.shafts = seenThrough(new CylinderGeometry(size * 0.24, size * 0.24, 1, 8, 1, true).translate(0, -0.5, 0), n);
    this.heads = seenThrough(new ConeGeometry(size * 0.7, size * 1.6, 12).translate(0, -size * 0.8, 0), n);
    for (const part of [...this.discs, ...this.rings, ...this.brokenRings, this.normals, ...this.cones, ...this.shafts, ...this.heads]) this.current.add(part.mesh);
    this.trace = traceOf(motion, objectSize);
  }

  setCones(shown: boolean): void {
    for (const cone of this.cones) cone.mesh.visible = shown;
  }

  setForces(shown: boolean): void {
    this.forcesShown = shown;
    for (const part of [...this.shafts, ...this.heads]) part.mesh.visible = shown && this.largestForce > 0;
  }

  show(time: number): void {
    let [fixed, rolling, sliding] = [false, false, false];
    this.motion.contacts(time).forEach(({ mode, point, normal, force }, i) => {
      const at = new Vector3(...point);
      const turned = new Quaternion().setFromUnitVectors(Z, new Vector3(...normal));
      const here = mode === "free" ? null : new Matrix4().compose(at, turned, new Vector3(1, 1, 1));
      fixed ||= mode === "fixed";
      rolling ||= mode === "rolling";
      sliding ||= mode === "sliding";
      for (const part of this.discs) part.put(i, mode === "fixed" ? here : null);
      for (const part of this.rings) part.put(i, mode === "rolling" ? here : null);
      for (const part of this.brokenRings) part.put(i, mode === "sliding" ? here : null);
      this.normals.put(i, here);
      for (const part of this.cones) part.put(i, here);
      const length = force && this.largestForce > 0 ? (norm(force) / this.largestForce) * this.forceReach : 0;
      const along = force && length > 1e-9 && this.forcesShown ? new Quaternion().setFromUnitVectors(Y, new Vector3(...unit(force))) : null;
      for (const part of this.heads) part.put(i, along && new Matrix4().compose(at, along, new Vector3(1, 1, 1)));
      for (const part of this.shafts) part.put(i, along && new Matrix4().compose(at, along, new Vector3(1, length, 1)));
    });
    for (const part of this.discs) part.mesh.visible = fixed;
    for (const part of this.rings) part.mesh.visible = rolling;
    for (const part of this.brokenRings) part.mesh.visible = sliding;
  }
}

const MOST_ARCS = 200;

/** Placements as dots, rolling and sliding as ribbons, relocations as dotted arcs from contact to contact. */
function traceOf(motion: Motion, size: number): Group {
  const trace = new Group();
  const width = 0.022 * size;
  const surfaces: BufferGeometry[] = [];
  const dots: BufferGeometry[] = [];
  motion.holds.forEach((holds, finger) => {
    const colour = new Color(fingerColour(finger));
    holds.forEach((hold, i) => {
      const [first, last] = [hold.path[0], hold.path[hold.path.length - 1]];
      surfaces.push(painted(disc(first, 2 * width), colour));
      if (last !== first) surfaces.push(painted(ribbon(hold, width), colour), painted(disc(last, 1.4 * width), colour));
      const next = holds[i + 1];
      const way = next ? arc(last, next.path[0], size) : [];
      if (way.length > 0 && dots.length < MOST_ARCS) {
        dots.push(painted(new BufferGeometry().setAttribute("position", new Float32BufferAttribute(way.flat(), 3)), colour));
      }
    });
  });
  if (surfaces.length > 0) trace.add(new Mesh(mergeGeometries(surfaces)!, new MeshBasicMaterial({ vertexColors: true, side: DoubleSide })));
  if (dots.length > 0) trace.add(new Points(mergeGeometries(dots)!, new PointsMaterial({ vertexColors: true, size: 4 * width })));
  return trace;
}

function painted(geometry: BufferGeometry, colour: Color): BufferGeometry {
  const n = geometry.getAttribute("position").count;
  return geometry.setAttribute("color", new Float32BufferAttribute(Array.from({ length: n }, () => colour.toArray()).flat(), 3));
}

function disc({ point, normal }: { point: Vec3; normal: Vec3 }, radius: number): BufferGeometry {
  const turned = new Quaternion().setFromUnitVectors(Z, new Vector3(...normal));
  const flat = new CircleGeometry(radius, 12).applyQuaternion(turned).translate(...add(point, scale(normal, 0.12 * radius)));
  flat.deleteAttribute("normal");
  flat.deleteAttribute("uv");
  return flat;
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

