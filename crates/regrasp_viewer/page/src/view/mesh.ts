// Geometry of the story as buffers: decoded, moved into its frame, with normals shared below `smooth_below`.

import { BufferAttribute, BufferGeometry } from "three";
import type { MeshStory, PieceStory } from "../story";
import { apply, poseFrom, type Vec3 } from "../math";

export interface Triangles {
  /** x y z per vertex. */
  points: Float32Array;
  /** Three per triangle. */
  corners: Uint32Array;
}

function bytes(base64: string): Uint8Array {
  const text = atob(base64);
  const found = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) found[i] = text.charCodeAt(i);
  return found;
}

export function decode(mesh: MeshStory): Triangles {
  const raw = bytes(mesh.vertices);
  const view = new DataView(raw.buffer);
  const n = raw.length >> 1;
  const points = new Float32Array(n);
  for (let i = 0; i < n; i++) {
    const axis = i % 3;
    points[i] = mesh.lower[axis] + ((mesh.upper[axis] - mesh.lower[axis]) * view.getUint16(2 * i, true)) / 65535;
  }
  const indices = bytes(mesh.triangles);
  const width = n / 3 <= 65536 ? 2 : 4;
  const at = new DataView(indices.buffer);
  const corners = new Uint32Array(indices.length / width);
  for (let i = 0; i < corners.length; i++) corners[i] = width === 2 ? at.getUint16(2 * i, true) : at.getUint32(4 * i, true);
  return { points, corners };
}

/** Normal of every corner: mean of the faces around its vertex that turn by less than `smoothBelow` from its own face. */
function cornerNormals({ points, corners }: Triangles, smoothBelow: number): Float32Array {
  const n = corners.length / 3;
  const face = new Float32Array(3 * n);
  const weight = new Float32Array(n);
  for (let t = 0; t < n; t++) {
    const [a, b, c] = [3 * corners[3 * t], 3 * corners[3 * t + 1], 3 * corners[3 * t + 2]];
    const [ux, uy, uz] = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
    const [vx, vy, vz] = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(x, y, z);
    weight[t] = length;
    if (length > 0) face.set([x / length, y / length, z / length], 3 * t);
  }
  const normals = new Float32Array(3 * corners.length);
  const around: number[][] = [];
  corners.forEach((vertex, corner) => (around[vertex] ??= []).push((corner / 3) | 0));
  const least = Math.cos(smoothBelow);
  corners.forEach((vertex, corner) => {
    const own = 3 * ((corner / 3) | 0);
    let [x, y, z] = [0, 0, 0];
    for (const t of smoothBelow > 0 ? around[vertex] : [own / 3]) {
      const other = 3 * t;
      const cosine = face[own] * face[other] + face[own + 1] * face[other + 1] + face[own + 2] * face[other + 2];
      if (other !== own && cosine < least) continue;
      x += face[other] * weight[t];
      y += face[other + 1] * weight[t];
      z += face[other + 2] * weight[t];
    }
    const length = Math.hypot(x, y, z) || 1;
    normals.set([x / length, y / length, z / length], 3 * corner);
  });
  return normals;
}

/** One geometry of several pieces, in the frame that they move with. */
export function geometryOf(pieces: PieceStory[], meshes: MeshStory[], decoded: Map<number, Triangles>): BufferGeometry {
  const positions: number[] = [];
  const normals: number[] = [];
  const index: number[] = [];
  for (const piece of pieces) {
    const mesh = meshes[piece.mesh];
    let triangles = decoded.get(piece.mesh);
    if (!triangles) decoded.set(piece.mesh, (triangles = decode(mesh)));
    const frame = poseFrom(piece.from_mesh);
    const turn = { position: [0, 0, 0] as Vec3, quat: frame.quat };
    const corner = cornerNormals(triangles, mesh.smooth_below);
    const known = new Map<string, number>();
    triangles.corners.forEach((vertex, i) => {
      const normal: Vec3 = [corner[3 * i], corner[3 * i + 1], corner[3 * i + 2]];
      const key = `${vertex}/${normal.map((x) => Math.round(x * 100)).join("/")}`;
      let at = known.get(key);
      if (at === undefined) {
        at = positions.length / 3;
        known.set(key, at);
        const { points } = triangles!;
        positions.push(...apply(frame, [points[3 * vertex], points[3 * vertex + 1], points[3 * vertex + 2]]));
        normals.push(...apply(turn, normal));
      }
      index.push(at);
    });
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(normals), 3));
  geometry.setIndex(new BufferAttribute(positions.length / 3 > 65535 ? new Uint32Array(index) : new Uint16Array(index), 1));
  return geometry;
}

/**
 * A coarser copy for ghosts: vertices that share a cell of a grid of `cells` per longest side become one, those of different
 * sides of an edge apart.
 */
export function coarse(geometry: BufferGeometry, cells: number): BufferGeometry {
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox!;
  const cell = Math.max(max.x - min.x, max.y - min.y, max.z - min.z) / cells || 1;
  const [from, normal, index] = [geometry.getAttribute("position"), geometry.getAttribute("normal"), geometry.index!];
  const known = new Map<string, number>();
  const sums: number[][] = [];
  const merged: number[] = [];
  for (let i = 0; i < from.count; i++) {
    const point = [from.getX(i), from.getY(i), from.getZ(i)];
    const turned = [normal.getX(i), normal.getY(i), normal.getZ(i)];
    const key = [...point.map((x, k) => Math.round((x - [min.x, min.y, min.z][k]) / cell)), ...turned.map((x) => Math.round(1.4 * x))].join("/");
    let at = known.get(key);
    if (at === undefined) {
      known.set(key, (at = sums.length));
      sums.push([0, 0, 0, 0, 0, 0, 0]);
    }
    [...point, ...turned, 1].forEach((x, k) => { sums[at!][k] += x; });
    merged.push(at);
  }
  const corners: number[] = [];
  for (let t = 0; t < index.count; t += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => merged[index.getX(t + k)]);
    if (a !== b && b !== c && c !== a) corners.push(a, b, c);
  }
  const made = new BufferGeometry();
  made.setAttribute("position", new BufferAttribute(new Float32Array(sums.flatMap(([x, y, z, , , , n]) => [x / n, y / n, z / n])), 3));
  made.setAttribute("normal", new BufferAttribute(new Float32Array(sums.flatMap(([, , , x, y, z]) => {
    const length = Math.hypot(x, y, z) || 1;
    return [x / length, y / length, z / length];
  })), 3));
  made.setIndex(corners);
  return made;
}
