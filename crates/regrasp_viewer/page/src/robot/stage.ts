// The 3-D view of a robot. It draws when something changed, never on its own.

import {
  Box3, BufferGeometry, Color, DirectionalLight, EdgesGeometry, Group, HemisphereLight, Line, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial,
  NoToneMapping, PerspectiveCamera, Quaternion, Scene, Sphere, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Pose } from "../math";
import { poseFrom } from "../math";
import type { ReplayBody, ReplayKind, RobotReplay } from "../robot_file";
import type { PieceStory } from "../story";
import type { Theme } from "../theme";
import { geometryOf, type Triangles } from "../view/mesh";
import { Poses } from "./poses";

const COLOURS: Partial<Record<ReplayKind, string>> = { hand: "#6b7683", tip: "#0072b2", object: "#e69f00", resting: "#d8c48a" };
/** Points of the path of an object. */
const PATH = 240;

export class RobotStage {
  readonly canvas: HTMLCanvasElement;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(32, 1, 0.01, 50);
  private readonly controls: OrbitControls;
  private readonly poses: Poses;
  private readonly moving: { group: Group; column: number }[] = [];
  private readonly focus = new Sphere();
  private dirty = true;

  /** Throws where there is no WebGL. */
  constructor(private readonly replay: RobotReplay, private readonly theme: Theme) {
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("webgl2", { alpha: false, antialias: true });
    if (!context) throw new Error("no WebGL 2");
    this.poses = new Poses(replay);
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.toneMapping = NoToneMapping;
    this.canvas = canvas;
    this.camera.up.set(...replay.up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => { this.dirty = true; });
    const decoded = new Map<number, Triangles>();
    for (const body of replay.bodies) this.add(body, decoded);
    this.addPaths();
    this.scene.add(new HemisphereLight(0xffffff, 0xc8c6c4, 2));
    const lamp = new DirectionalLight(0xffffff, 1.7);
    lamp.position.copy(this.camera.up).multiplyScalar(2).add(new Vector3(0.8, -1.1, 0.4));
    this.scene.add(lamp);
    theme.onChange(() => this.paint());
    this.paint();
    this.findFocus();
    this.frame();
  }

  private add(body: ReplayBody, decoded: Map<number, Triangles>): void {
    const pieces = body.pieces.map((piece) => ({ mesh: piece.mesh, from_mesh: piece.from_mesh }) as PieceStory);
    const isAround = body.kind === "support" || body.kind === "obstacle";
    const material = new MeshLambertMaterial(body.kind === "obstacle" ? { transparent: true, opacity: 0.35, depthWrite: false } : {});
    material.color = new Color(COLOURS[body.kind] ?? (isAround ? "#b5a492" : "#9aa3ad"));
    const geometry = geometryOf(pieces, this.replay.meshes, decoded);
    const group = new Group().add(new Mesh(geometry, material));
    if (isAround || body.kind === "object" || body.kind === "resting") {
      const edges = new EdgesGeometry(geometry, 35);
      group.add(new LineSegments(edges, new LineBasicMaterial({ color: "#6d5f48", transparent: true, opacity: 0.4 })));
    }
    place(group, poseFrom(body.pose));
    this.scene.add(group);
    if (body.column !== null) this.moving.push({ group, column: body.column });
  }

  /** The ways of the objects that move. */
  private addPaths(): void {
    const { times, bodies } = this.replay;
    const [start, end] = [times[0], times[times.length - 1]];
    const places = Array.from({ length: PATH + 1 }, (_, k) => this.poses.at(start + ((end - start) * k) / PATH));
    for (const body of bodies) {
      if (body.kind !== "object" || body.column === null) continue;
      const points = places.map((poses) => new Vector3(...poses[body.column!].position));
      this.scene.add(new Line(new BufferGeometry().setFromPoints(points), new LineBasicMaterial({ color: "#d55e00" })));
    }
  }

  private findFocus(): void {
    const box = new Box3();
    const { times } = this.replay;
    for (let k = 0; k <= 6; k++) {
      this.setTime(times[0] + ((times[times.length - 1] - times[0]) * k) / 6);
      this.scene.updateMatrixWorld(true);
      for (const { group } of this.moving) box.expandByObject(group);
    }
    this.setTime(times[0]);
    if (box.isEmpty()) box.set(new Vector3(-0.5, -0.5, -0.5), new Vector3(0.5, 0.5, 0.5));
    box.getBoundingSphere(this.focus);
  }

  private paint(): void {
    this.scene.background = new Color(this.theme.colours.stage);
    this.dirty = true;
  }

  setTime(time: number): void {
    const poses = this.poses.at(time);
    for (const { group, column } of this.moving) place(group, poses[column]);
    this.dirty = true;
  }

  /** Everything that moves, from the right, in front and above. */
  frame(): void {
    const standing = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), this.camera.up);
    const out = new Vector3(0.75, -0.5, 0.42).normalize().applyQuaternion(standing);
    const narrow = Math.min(1, this.camera.aspect);
    const distance = this.focus.radius / Math.sin((this.camera.fov * Math.PI) / 360) / narrow;
    this.controls.target.copy(this.focus.center);
    this.camera.position.copy(out.multiplyScalar(0.92 * distance)).add(this.focus.center);
    this.controls.update();
    this.dirty = true;
  }

  resize(width: number, height: number): void {
    if (width < 1 || height < 1) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** Draws if anything changed since the last time. */
  draw(): void {
    if (!this.dirty) return;
    this.renderer.render(this.scene, this.camera);
    this.dirty = false;
  }
}

function place(group: Group, pose: Pose): void {
  group.position.set(...pose.position);
  group.quaternion.set(...pose.quat);
}
