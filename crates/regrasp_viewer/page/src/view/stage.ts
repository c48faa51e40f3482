// The 3-D view. It draws when something changed, never on its own.

import {
  BackSide, Box3, Color, CustomBlending, DirectionalLight, EdgesGeometry, Group, HemisphereLight, LineBasicMaterial, LineSegments, MathUtils, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, NoToneMapping, OneFactor, OneMinusSrcAlphaFactor, PerspectiveCamera, Quaternion, Raycaster, Scene, Sphere, SphereGeometry, SrcAlphaFactor, Vector2, Vector3, WebGLRenderer, type BufferGeometry,
  type MeshLambertMaterialParameters,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { largestForce } from "../charts/lines";
import { bodiesOf, movedObject, movingHand, placeOf, type Body } from "../bodies";
import { linkPoses } from "../kinematics";
import type { CameraPlace } from "../link";
import { norm, poseFrom, rotationBetween, sub, type Pose } from "../math";
import type { Motion } from "../motion";
import type { HandStory, PieceStory, PoseData, Story } from "../story";
import { fingerColour, type Theme } from "../theme";
import { Contacts } from "./contacts";
import { patterned, type PatternColours } from "./materials";
import { coarse, geometryOf, type Triangles } from "./mesh";

export type Layer = "visual" | "seeThrough" | "ghosts" | "contacts" | "cones" | "forces" | "trace" | "obstacles";

/** Light that a marked body gives off. */
const MARK = 0x2f5d8a;

interface Ghost { group: Group; pose: Pose }

export class Stage {
  readonly canvas: HTMLCanvasElement;
  readonly layers: Record<Layer, boolean> = {
    visual: true, seeThrough: false, ghosts: true, contacts: true, cones: true, forces: true, trace: true, obstacles: true,
  };
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera: PerspectiveCamera;
  private readonly controls: OrbitControls;
  private readonly hand: HandStory;
  /** Of the hand that moves. */
  private readonly links: Group[];
  private readonly object = new Group();
  private readonly obstacles = new Group();
  /** Hands, parts of robots, objects and supports that the plan does not move. */
  private readonly atRest = new Group();
  private readonly hidden = new Set<string>();
  private marked: string | null = null;
  private readonly movingKey: string;
  private time = 0;
  private readonly contacts: Contacts;
  private readonly ghosts: Ghost[] = [];
  /** In tracking, around every fingertip: dark on the moving finger, grey on the one that the object rolls on. */
  private readonly rims: Mesh[] = [];
  private readonly shapes: { mesh: Mesh<BufferGeometry, MeshLambertMaterial>; role: PieceStory["role"]; name: string; body: string }[] = [];
  private readonly handMaterials: MeshLambertMaterial[] = [];
  private readonly hasVisual: boolean;
  private readonly repaint: (() => void)[] = [];
  private readonly pattern: PatternColours = { light: new Color(), dark: new Color(), mark: new Color() };
  private readonly insets: { scene: Scene; canvas: HTMLCanvasElement }[] = [];
  private readonly insetCamera = new PerspectiveCamera(24, 1, 0.01, 10);
  private readonly focus: { points: Vector3[]; sphere: Sphere };
  private readonly software: boolean;
  /** True once somebody placed the camera; until then it frames the hand at every size. */
  private placed = false;
  private ratio = 0;
  private size: [number, number] = [1, 1];
  private sized: [number, number] = [0, 0];
  private movingRatio: number;
  private interval = 16;
  private drawn = -1e9;
  private rough = false;
  private dirty = true;
  private insetsDirty = true;

  /** Throws where there is no WebGL. */
  constructor(private readonly story: Story, private readonly motion: Motion, private readonly theme: Theme, onCamera: () => void) {
    this.software = drawnBySoftware();
    this.hasVisual = story.scene.pieces.some((piece) => piece.role === "visual");
    this.movingRatio = this.software ? 0.75 : Math.min(devicePixelRatio || 1, 2);
    const canvas = document.createElement("canvas");
    // Made here and not by three.js, whose own is see-through: an opaque one is cheaper to lay into the page.
    const context = canvas.getContext("webgl2", { alpha: false, antialias: !this.software, powerPreference: "high-performance" });
    if (!context) throw new Error("no WebGL 2");
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.toneMapping = NoToneMapping;
    this.canvas = this.renderer.domElement;
    this.camera = new PerspectiveCamera(32, 1, 0.005, 20);
    const gravity = story.scene.gravity_in_world;
    if (gravity && norm(gravity) > 1e-9) this.camera.up.set(...gravity).normalize().negate();
    else this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("start", () => { this.placed = true; });
    this.controls.addEventListener("change", () => {
      this.dirty = this.insetsDirty = true;
      onCamera();
    });

    const decoded = new Map<number, Triangles>();
    this.hand = movingHand(story.scene);
    this.movingKey = placeOf({ hand: [story.scene.moving_hand, 0] }).key;
    this.links = this.hand.links.map(() => new Group());
    this.scene.add(...this.links, this.object, this.obstacles, this.atRest);
    const body = this.addPieces(decoded);
    const size = body ? Math.max(...body.half.toArray()) : 0.03;
    this.contacts = new Contacts(this.hand, story.scene.friction, motion, size, largestForce(motion));
    this.object.add(this.contacts.current, this.contacts.trace);
    if (motion.isTracking) this.addRims();
    this.addLights(this.scene);
    if (body) this.addGhosts(body.geometry, body.middle, body.half);
    this.setTime(motion.start);
    this.focus = this.findFocus();
    this.setLayer("visual", true);
    theme.onChange(() => this.paint());
    this.paint();
    this.frame();
  }

  // ---- making ----

  private addPieces(decoded: Map<number, Triangles>): { geometry: BufferGeometry; middle: Vector3; half: Vector3 } | null {
    const { scene } = this.story;
    const bodies = new Map(bodiesOf(scene).map((body) => [body.key, { body, carriers: this.carriersOf(body) }]));
    const groups = new Map<string, PieceStory[]>();
    for (const piece of scene.pieces) {
      const key = JSON.stringify([piece.on, piece.role, piece.is_tip]);
      groups.set(key, [...(groups.get(key) ?? []), piece]);
    }
    let body: { geometry: BufferGeometry; middle: Vector3; half: Vector3 } | null = null;
    for (const pieces of groups.values()) {
      const { on, role, is_tip } = pieces[0];
      const { kind, key, link } = placeOf(on);
      const { body: of, carriers } = bodies.get(key)!;
      const isObstacle = kind === "obstacle";
      const isRobot = kind === "hand" || kind === "robot_part";
      const geometry = geometryOf(pieces, scene.meshes, decoded);
      let material: MeshLambertMaterial;
      if (key === movedObject(scene)) {
        geometry.computeBoundingBox();
        const middle = geometry.boundingBox!.getCenter(new Vector3());
        const half = geometry.boundingBox!.getSize(new Vector3()).multiplyScalar(0.5).max(new Vector3(1e-6, 1e-6, 1e-6));
        material = patterned(middle, half, this.pattern);
        if (!body || role === "visual") body = { geometry, middle, half };
      } else if (isRobot) material = this.linkMaterial(of.moves ? of.links[link].finger : -1, is_tip);
      else material = isObstacle ? this.obstacleMaterial() : this.restingMaterial(kind === "object" ? "objectLight" : "faint");
      const mesh = new Mesh(geometry, material);
      if (isObstacle) mesh.renderOrder = 1;
      const edges = isRobot ? null : this.edges(geometry, isObstacle ? 0.5 : 0.35);
      if (edges) mesh.add(edges);
      carriers[Math.max(link, 0)].add(mesh);
      const ofLink = of.links[link]?.name;
      this.shapes.push({ mesh, role, body: key, name: ofLink === undefined ? of.name : of.moves ? ofLink : `${of.name}/${ofLink}` });
    }
    return body;
  }

  /** What carries the pieces of a body: one group for each of its links, or one for all of it. */
  private carriersOf({ key, kind, moves, links, joints }: Body): Group[] {
    if (moves) return kind === "hand" ? this.links : [this.object];
    if (kind === "obstacle") return [this.obstacles];
    if (kind === "support") return [this.atRest];
    const { objects } = this.story.scene;
    const poses = kind === "object"
      ? objects.filter((_, index) => placeOf({ object: index }).key === key).map((object) => poseFrom(object.world_from_object))
      : linkPoses(links, joints.map((joint) => joint.at_rest));
    const groups = poses.map((pose) => {
      const group = new Group();
      place(group, pose);
      return group;
    });
    this.atRest.add(...groups);
    return groups;
  }

  /** Shells around the tips of which only the far side is drawn: what shows beyond the tip is its outline. */
  private addRims(): void {
    for (const finger of this.hand.fingers) {
      const rim = new Mesh(new SphereGeometry(1.13 * finger.tip_radius, 32, 20), new MeshBasicMaterial({ side: BackSide }));
      rim.position.set(...finger.tip_center_in_link);
      rim.visible = false;
      (this.links[finger.tip_link] ?? this.scene).add(rim);
      this.rims.push(rim);
    }
  }

  private showRims(time: number): void {
    const stretch = this.motion.stretches[this.motion.stretchAt(time)];
    this.rims.forEach((rim, finger) => {
      const moves = stretch?.allMoving.includes(finger) ?? false;
      rim.visible = (moves || finger === stretch?.rolling) && !this.hidden.has(this.movingKey);
      (rim.material as MeshBasicMaterial).color.set(moves ? this.theme.colours.ink : this.theme.colours.muted);
    });
  }

  private linkMaterial(finger: number, isTip: boolean): MeshLambertMaterial {
    const material = new MeshLambertMaterial();
    this.handMaterials.push(material);
    const own = new Color(fingerColour(finger));
    const share = finger < 0 ? 0 : isTip ? 0.9 : 0.4;
    this.repaint.push(() => material.color.set(this.theme.colours.palm).lerp(own, share));
    return material;
  }

  /** Of an object or a support that the plan does not move. */
  private restingMaterial(colour: "objectLight" | "faint"): MeshLambertMaterial {
    const material = new MeshLambertMaterial();
    this.repaint.push(() => material.color.set(this.theme.colours[colour]));
    return material;
  }

  private obstacleMaterial(): MeshLambertMaterial {
    const material = new MeshLambertMaterial({ transparent: true, opacity: 0.3, depthWrite: false });
    this.repaint.push(() => material.color.set(this.theme.colours.muted));
    return material;
  }

  private edges(geometry: BufferGeometry, opacity: number): LineSegments | null {
    if ((geometry.index?.count ?? 0) / 3 > 40000) return null;
    const edges = new EdgesGeometry(geometry, 35);
    if (edges.getAttribute("position").count === 0) return null;
    const material = new LineBasicMaterial({ transparent: true, opacity });
    this.repaint.push(() => material.color.set(this.theme.colours.objectMark));
    return new LineSegments(edges, material);
  }

  private addLights(scene: Scene): void {
    scene.add(new HemisphereLight(0xffffff, 0xc8c6c4, 2));
    const lamp = new DirectionalLight(0xffffff, 1.7);
    lamp.position.copy(this.camera.up).multiplyScalar(2).add(new Vector3(0.8, -1.1, 0.4));
    scene.add(lamp);
  }

  /**
   * Start and goal in place, and each once more in a small view of its own. In place they are painted before everything else
   * (blended, yet in the pass of opaque things), so that they never shine through nor flicker with the object.
   */
  private addGhosts(geometry: BufferGeometry, middle: Vector3, half: Vector3): void {
    const { story } = this;
    const [start, goal] = [story.plan?.start ?? story.asked[0], story.plan?.goal ?? story.asked[story.asked.length - 1]];
    const simple = geometry.index!.count > 6000 ? coarse(geometry, 22) : geometry;
    const put = (data: PoseData | undefined, opacity: number, outline: number): void => {
      if (!data) return;
      const look: MeshLambertMaterialParameters = {
        opacity, depthWrite: false, blending: CustomBlending, blendSrc: SrcAlphaFactor,
        blendDst: OneMinusSrcAlphaFactor, blendSrcAlpha: OneFactor, blendDstAlpha: OneMinusSrcAlphaFactor,
      };
      const shell = new Mesh(simple, patterned(middle, half, this.pattern, look));
      shell.renderOrder = -1;
      const group = new Group().add(shell);
      const edges = this.edges(geometry, outline);
      if (edges) {
        edges.renderOrder = 1;
        group.add(edges);
      }
      const pose = poseFrom(data);
      group.position.set(...pose.position);
      group.quaternion.set(...pose.quat);
      this.scene.add(group);
      this.ghosts.push({ group, pose });
    };
    put(start, 0.14, 0.15);
    put(goal, 0.3, 0.45);
    for (const way of story.asked.slice(1, -1)) put(way, 0.1, 0.15);
    for (const data of [start, goal]) {
      if (!data) continue;
      const scene = new Scene();
      const mesh = new Mesh(geometry, patterned(middle, half, this.pattern));
      const edges = this.edges(geometry, 0.45);
      if (edges) mesh.add(edges);
      mesh.position.copy(middle).negate();
      const turned = new Group().add(mesh);
      turned.quaternion.set(...data.quat_xyzw);
      geometry.computeBoundingSphere();
      turned.scale.setScalar(1 / (geometry.boundingSphere!.radius || 1));
      scene.add(turned);
      this.addLights(scene);
      const canvas = document.createElement("canvas");
      canvas.width = canvas.height = 168;
      this.insets.push({ scene, canvas });
    }
  }

  /** Canvases of the small views: start, goal. */
  get insetCanvases(): HTMLCanvasElement[] {
    return this.insets.map((inset) => inset.canvas);
  }

  /** Corners of the boxes of fingers and object, all along the motion; palm and obstacles count where they are not far larger. */
  private findFocus(): { points: Vector3[]; sphere: Sphere } {
    const near: Box3[] = [];
    const far: Box3[] = [];
    for (let i = 0; i <= 4; i++) {
      this.setTime(this.motion.start + ((this.motion.end - this.motion.start) * i) / 4);
      this.scene.updateMatrixWorld(true);
      this.links.forEach((link, k) => {
        const box = new Box3().setFromObject(link);
        if (!box.isEmpty()) (this.hand.links[k].finger >= 0 ? near : far).push(box);
      });
      for (const child of this.object.children) if (child instanceof Mesh) near.push(new Box3().setFromObject(child));
    }
    for (const ghost of this.ghosts) near.push(new Box3().setFromObject(ghost.group));
    this.setTime(this.motion.start);
    const ball = (boxes: Box3[]) => boxes.reduce((all, box) => all.union(box), new Box3()).getBoundingSphere(new Sphere());
    if (near.length + far.length === 0) return { points: [new Vector3()], sphere: new Sphere(new Vector3(), 0.1) };
    const hand = near.length === 0 || ball([...near, ...far]).radius < 1.5 * ball(near).radius ? [...near, ...far] : near;
    const around = this.obstacles.children.map((child) => new Box3().setFromObject(child));
    const all = ball([...hand, ...around]).radius < 1.6 * ball(hand).radius ? [...hand, ...around] : hand;
    const points = all.flatMap(({ min, max }) => [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
      new Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z)));
    return { points, sphere: ball(all) };
  }

  // ---- showing ----

  private paint(): void {
    const { colours } = this.theme;
    this.scene.background = new Color(colours.stage);
    for (const inset of this.insets) inset.scene.background = new Color(colours.panel);
    this.pattern.light.set(colours.objectLight);
    this.pattern.dark.set(colours.objectDark);
    this.pattern.mark.set(colours.objectMark);
    for (const paint of this.repaint) paint();
    this.dirty = this.insetsDirty = true;
  }

  setTime(time: number): void {
    this.time = time;
    linkPoses(this.hand.links, this.motion.joints(time)).forEach((pose, i) => place(this.links[i], pose));
    const now = this.motion.object(time);
    place(this.object, now);
    this.contacts.show(time);
    this.showRims(time);
    for (const { group, pose } of this.ghosts) {
      const near = norm(sub(pose.position, now.position)) < 5e-4 && norm(rotationBetween(pose.quat, now.quat)) < 0.02;
      group.visible = this.layers.ghosts && !near;
    }
    this.dirty = true;
  }

  setLayer(layer: Layer, shown: boolean): void {
    this.layers[layer] = shown;
    // Each role is complete where there is any piece of it.
    const role = this.layers.visual && this.hasVisual ? "visual" : "collision";
    for (const shape of this.shapes) shape.mesh.visible = shape.role === role && !this.hidden.has(shape.body);
    for (const material of this.handMaterials) {
      material.transparent = this.layers.seeThrough;
      material.opacity = this.layers.seeThrough ? 0.35 : 1;
      material.depthWrite = !this.layers.seeThrough;
      material.needsUpdate = true;
    }
    this.contacts.current.visible = this.layers.contacts;
    this.contacts.setCones(this.layers.cones);
    this.contacts.setForces(this.layers.forces);
    this.contacts.trace.visible = this.layers.trace;
    this.obstacles.visible = this.layers.obstacles;
    this.dirty = true;
  }

  /** Shows or hides a body. */
  setShown(key: string, shown: boolean): void {
    if (shown) this.hidden.delete(key);
    else this.hidden.add(key);
    this.setLayer("visual", this.layers.visual);
    this.showRims(this.time);
  }

  /** Makes a body stand out; none for null. */
  mark(key: string | null): void {
    if (key === this.marked) return;
    this.marked = key;
    for (const { mesh, body } of this.shapes) mesh.material.emissive.set(body === key ? MARK : 0);
    this.dirty = true;
  }

  /** Layers that this story has anything for. */
  has(layer: Layer): boolean {
    const { pieces } = this.story.scene;
    if (layer === "visual") return this.hasVisual && pieces.some((p) => p.role === "collision");
    if (layer === "seeThrough") return pieces.some((p) => "hand" in p.on);
    if (layer === "obstacles") return pieces.some((p) => "obstacle" in p.on);
    if (layer === "forces") return this.motion.hasForces;
    if (layer === "contacts" || layer === "cones" || layer === "trace") return this.motion.holds.some((h) => h.length > 0);
    return this.ghosts.length > 0;
  }

  /** Puts the camera where hand and object fill the view. */
  frame(): void {
    const { points, sphere } = this.focus;
    this.controls.minDistance = sphere.radius * 0.15;
    this.controls.maxDistance = sphere.radius * 30;
    const up = Math.tan(MathUtils.degToRad(this.camera.fov) / 2) * 0.82;
    const side = up * this.camera.aspect;
    const target = sphere.center.clone();
    let distance = sphere.radius * 4;
    // The view's middle and distance such that the outermost points touch its edges; each round nears it.
    for (let round = 0; round < 6; round++) {
      this.look({ azimuth: -55, elevation: 26, distance, target: target.toArray() });
      this.camera.updateMatrixWorld(true);
      const seen = points.map((p) => p.clone().applyMatrix4(this.camera.matrixWorldInverse));
      const bounds = new Box3().setFromPoints(seen.map(({ x, y, z }) => new Vector3(x / -z, y / -z, 0)));
      const middle = bounds.getCenter(new Vector3()).multiplyScalar(distance);
      target.add(new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0).multiplyScalar(middle.x));
      target.add(new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1).multiplyScalar(middle.y));
      const size = bounds.getSize(new Vector3());
      distance *= Math.max(size.x / 2 / side, size.y / 2 / up);
    }
    // Somewhat above the middle: names and small views lie below.
    target.add(new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1).multiplyScalar(-0.07 * up * distance));
    this.look({ azimuth: -55, elevation: 26, distance, target: target.toArray() });
    this.placed = false;
  }

  /** Turns the camera about its target, degrees, and brings it closer by a factor. */
  orbit(azimuth: number, elevation: number, closer: number): void {
    const now = this.cameraPlace();
    const distance = MathUtils.clamp(now.distance / closer, this.controls.minDistance, this.controls.maxDistance);
    this.place({ ...now, azimuth: now.azimuth + azimuth, elevation: now.elevation + elevation, distance });
  }

  /** Name of what is seen at a place of the canvas, given as shares of its width and height, and the key of its body. */
  seenAt(x: number, y: number): { name: string; body: string } | null {
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(2 * x - 1, 1 - 2 * y), this.camera);
    const shown = this.shapes.filter(({ mesh }) => mesh.visible && (mesh.parent?.visible ?? true));
    const hit = ray.intersectObjects(shown.map((shape) => shape.mesh), false)[0];
    return shown.find((shape) => shape.mesh === hit?.object) ?? null;
  }

  place(camera: CameraPlace): void {
    this.placed = true;
    this.look(camera);
  }

  private look({ azimuth, elevation, distance, target }: CameraPlace): void {
    const [a, e] = [MathUtils.degToRad(azimuth), MathUtils.degToRad(Math.min(Math.max(elevation, -89.9), 89.9))];
    const standing = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), this.camera.up);
    const out = new Vector3(Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e)).applyQuaternion(standing);
    this.controls.target.set(...target);
    this.camera.position.copy(out.multiplyScalar(distance)).add(this.controls.target);
    this.controls.update();
    this.dirty = this.insetsDirty = true;
  }

  cameraPlace(): CameraPlace {
    const out = this.camera.position.clone().sub(this.controls.target);
    const distance = out.length();
    const lying = new Quaternion().setFromUnitVectors(this.camera.up, new Vector3(0, 0, 1));
    out.applyQuaternion(lying).normalize();
    return {
      azimuth: MathUtils.radToDeg(Math.atan2(out.y, out.x)),
      elevation: MathUtils.radToDeg(Math.asin(MathUtils.clamp(out.z, -1, 1))),
      distance,
      target: this.controls.target.toArray(),
    };
  }

  resize(width: number, height: number): void {
    if (width < 1 || height < 1) return;
    this.size = [width, height];
    this.setRatio(this.stillRatio());
    this.camera.aspect = width / height;
    this.camera.near = this.focus.sphere.radius * 0.02;
    this.camera.far = this.focus.sphere.radius * 80;
    this.camera.updateProjectionMatrix();
    if (!this.placed) this.frame();
    this.dirty = this.insetsDirty = true;
  }

  /** Pixels of the picture per CSS pixel while nothing moves: where the processor draws, twice as fine smooths edges. */
  private stillRatio(): number {
    return this.software ? 2 : Math.min(devicePixelRatio || 1, 2);
  }

  private setRatio(ratio: number): void {
    if (ratio === this.ratio && this.size[0] === this.sized[0] && this.size[1] === this.sized[1]) return;
    this.ratio = ratio;
    this.sized = this.size;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(...this.size);
  }

  /** Draws if anything changed since the last time; once more and finer when it has been still for a moment. */
  draw(now: number): boolean {
    const settles = this.rough && now - this.drawn > 200;
    if (!this.dirty && !settles) return false;
    const moves = this.dirty && now - this.drawn < 200;
    if (moves) this.pace(now - this.drawn);
    this.rough = moves && this.movingRatio < this.stillRatio();
    this.setRatio(moves ? Math.min(this.movingRatio, this.stillRatio()) : this.stillRatio());
    if (this.insetsDirty) this.drawInsets();
    this.renderer.render(this.scene, this.camera);
    this.dirty = false;
    this.drawn = now;
    return true;
  }

  /** Coarser pictures while moving where drawing takes longer than 24 ms on average. */
  private pace(interval: number): void {
    this.interval += (interval - this.interval) * 0.08;
    if (this.interval < 24 || this.movingRatio <= 0.5) return;
    this.movingRatio = Math.max(0.5, this.movingRatio * 0.85);
    this.interval = 16;
  }

  /** Small views keep the camera's direction; they are copied out, so that playing need not draw them again. */
  private drawInsets(): void {
    this.insetsDirty = false;
    const pixels = Math.min(168, this.canvas.width, this.canvas.height);
    if (pixels < 8) return;
    const out = this.camera.position.clone().sub(this.controls.target).normalize().multiplyScalar(5.6);
    this.insetCamera.up.copy(this.camera.up);
    this.insetCamera.position.copy(out);
    this.insetCamera.lookAt(0, 0, 0);
    const edge = pixels / this.renderer.getPixelRatio();
    this.renderer.setScissorTest(true);
    this.renderer.setScissor(0, 0, edge, edge);
    this.renderer.setViewport(0, 0, edge, edge);
    for (const { scene, canvas } of this.insets) {
      this.renderer.render(scene, this.insetCamera);
      canvas.getContext("2d")?.drawImage(this.canvas, 0, this.canvas.height - pixels, pixels, pixels, 0, 0, canvas.width, canvas.height);
    }
    this.renderer.setScissorTest(false);
    const size = this.canvas;
    this.renderer.setViewport(0, 0, size.width / this.renderer.getPixelRatio(), size.height / this.renderer.getPixelRatio());
  }
}

function place(group: Group, pose: Pose): void {
  group.position.set(...pose.position);
  group.quaternion.set(...pose.quat);
}

/** True where WebGL runs on the processor: smoothing edges costs too much there. Throws where there is no WebGL. */
function drawnBySoftware(): boolean {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) throw new Error("no WebGL 2");
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : gl.getParameter(gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}
