// The plan as functions of time. Everything here is computed from the plan's waypoints.

import { movingHand } from "./bodies";
import type { Contact, Plan, Segment, Story, Waypoint } from "./story";
import { clamp, interpolatePose, lerp, norm, poseFrom, sub, unit, type Pose, type Vec3 } from "./math";

export interface Stretch {
  kind: Segment["kind"];
  /** Index of the finger that moves, of several the first, -1 in transfers. */
  moving: number;
  /** Indices of all fingers that move. */
  allMoving: number[];
  /** In tracking, index of the finger that the object rolls on; else -1. */
  rolling: number;
  /** First and last waypoint, in the order of all waypoints. */
  first: number;
  last: number;
  start: number;
  end: number;
}

/** Who moves in a stretch, in words. */
export function whoMoves(stretch: Stretch, fingers: { name: string }[]): string {
  const names = stretch.allMoving.map((finger) => fingers[finger]?.name);
  return `${names.join(" and ")} ${names.length > 1 ? "move" : "moves"}`;
}

/** A finger on the object from landing to lifting off. */
export interface Hold {
  finger: number;
  start: number;
  end: number;
  /** Parts of it, each of one mode; they touch. */
  spans: { start: number; end: number; mode: Holding }[];
  /** Where the contact is on the object: one point while it stays, more while it rolls or slides. */
  path: { time: number; point: Vec3; normal: Vec3 }[];
}

/** What a finger that touches the object does: stays, rolls (or twists), slides (and may roll and twist). */
export type Holding = "fixed" | "rolling" | "sliding";

export interface ContactNow {
  mode: Holding | "free";
  point: Vec3;
  normal: Vec3;
  force: Vec3 | null;
}

const FREE: ContactNow = { mode: "free", point: [0, 0, 0], normal: [0, 0, 1], force: null };

/** Joints that move less than this, all together, rest. */
const RESTS = 1e-9;

/** The cubic from 0 with these change and slopes at both ends, at `u` in [0, 1]. */
function cubic(change: number, first: number, last: number, u: number): number {
  return u * (first + u * (3 * change - 2 * first - last + u * (first + last - 2 * change)));
}

const holds = (contact: Contact | undefined): boolean => contact !== undefined && contact.mode !== "free";

export class Motion {
  /** True for plans of finger tracking. */
  readonly isTracking: boolean;
  readonly waypoints: Waypoint[] = [];
  readonly times: number[] = [];
  /** Index of the segment of every waypoint. */
  private readonly segmentOf: number[] = [];
  readonly stretches: Stretch[] = [];
  readonly nFingers: number;
  readonly start: number;
  readonly end: number;
  readonly hasForces: boolean;
  readonly holds: Hold[][];

  constructor(plan: Plan) {
    this.nFingers = plan.fingers.length;
    this.isTracking = plan.segments.some((segment) => segment.kind === "tracking");
    for (const segment of plan.segments) {
      const names = segment.kind === "transfer" ? [] : [segment.moving_finger ?? "", ...(segment.also_moving ?? [])];
      const allMoving = names.map((name) => plan.fingers.indexOf(name)).filter((finger) => finger >= 0);
      const first = this.waypoints.length;
      for (const waypoint of segment.waypoints) {
        this.segmentOf.push(this.stretches.length);
        this.waypoints.push(waypoint);
        this.times.push(waypoint.time);
      }
      const last = this.waypoints.length - 1;
      this.stretches.push({
        kind: segment.kind,
        moving: allMoving[0] ?? -1,
        allMoving,
        rolling: segment.kind === "tracking" ? plan.fingers.indexOf(segment.rolling_finger ?? "") : -1,
        first,
        last,
        start: this.times[first],
        end: this.times[last],
      });
    }
    this.start = this.times[0] ?? 0;
    this.end = this.times[this.times.length - 1] ?? 0;
    this.hasForces = this.waypoints.some((w) => w.contacts.some((c) => c.force_in_object));
    this.holds = Array.from({ length: this.nFingers }, (_, finger) => this.holdsOf(finger));
  }

  /** The waypoint at or before `time`, and how far it is from there to the next one, in [0, 1). */
  moment(time: number): { index: number; u: number } {
    let low = 0;
    let high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    const next = this.times[low + 1];
    const span = next === undefined ? 0 : next - this.times[low];
    return { index: low, u: span > 0 ? clamp((time - this.times[low]) / span, 0, 1) : 0 };
  }

  /** Joints on the cubics through positions and velocities of the waypoints before and after. */
  joints(time: number): number[] {
    const { index, u } = this.moment(time);
    const [from, to] = [this.waypoints[index], this.waypoints[index + 1]];
    if (to === undefined || u === 0) return from.joints;
    const span = this.times[index + 1] - this.times[index];
    return from.joints.map((q, i) => q + cubic(to.joints[i] - q, from.joint_velocities[i] * span, to.joint_velocities[i] * span, u));
  }

  /**
   * The parameter of object, contacts and forces, in [0, 1], a share `u` of the time after waypoint `index`. At both ends it is
   * as fast as the joints are along their chord; where they rest it is linear.
   */
  parameter(index: number, u: number): number {
    const [from, to] = [this.waypoints[index], this.waypoints[index + 1]];
    if (to === undefined || u === 0) return 0;
    const span = this.times[index + 1] - this.times[index];
    let [square, first, last] = [0, 0, 0];
    from.joints.forEach((q, i) => {
      const change = to.joints[i] - q;
      square += change * change;
      first += change * from.joint_velocities[i] * span;
      last += change * to.joint_velocities[i] * span;
    });
    if (square <= RESTS * RESTS) return u;
    return clamp(cubic(1, clamp(first / square, 0, 3), clamp(last / square, 0, 3), u), 0, 1);
  }

  object(time: number): Pose {
    const { index, u } = this.moment(time);
    const from = poseFrom(this.waypoints[index].world_from_object);
    const next = this.waypoints[index + 1];
    if (next === undefined || u === 0) return from;
    return interpolatePose(from, poseFrom(next.world_from_object), this.parameter(index, u));
  }

  contacts(time: number): ContactNow[] {
    const { index, u } = this.moment(time);
    const now = this.waypoints[index].contacts;
    const next = this.waypoints[index + 1]?.contacts;
    const t = this.parameter(index, u);
    return now.map((from, finger) => {
      const to = u === 0 ? from : next?.[finger];
      if (to === undefined || !holds(from) || !holds(to)) return FREE;
      const pointFrom = from.point_in_object ?? [0, 0, 0];
      const normalFrom = from.normal_in_object ?? [0, 0, 1];
      const forces = from.force_in_object && to.force_in_object;
      return {
        mode: this.holding(index, from, to),
        point: lerp(pointFrom, to.point_in_object ?? pointFrom, t),
        normal: unit(lerp(normalFrom, to.normal_in_object ?? normalFrom, t)),
        force: forces ? lerp(from.force_in_object!, to.force_in_object!, t) : null,
      };
    });
  }

  /** What a finger that touches at waypoint `index` and the next one does in between. */
  private holding(index: number, from: Contact, to: Contact): Holding {
    const segment = this.segmentOf[index];
    if (this.stretches[segment].kind !== "tracking") return from.mode === "rolling" && to.mode === "rolling" ? "rolling" : "fixed";
    // Between two segments everything rests.
    if (this.segmentOf[index + 1] !== segment || from.mode === "fixed") return "fixed";
    return from.mode === "sliding" || from.mode === "pure_sliding" ? "sliding" : "rolling";
  }

  /** Index of the stretch that `time` is in; between two, the earlier. */
  stretchAt(time: number): number {
    let found = 0;
    this.stretches.forEach((stretch, i) => {
      if (stretch.start <= time + 1e-9) found = i;
    });
    return found;
  }

  /**
   * Start of the next or previous relocation seen from `time`, in tracking of the next or previous stretch with other moving
   * fingers; the start or end of the plan where there is none.
   */
  relocationFrom(time: number, step: 1 | -1): number {
    const begins = (s: Stretch, i: number) => s.kind === "regrasp" || (s.kind === "tracking" && i > 0 && String(this.stretches[i - 1].allMoving) !== String(s.allMoving));
    const starts = this.stretches.filter(begins).map((s) => s.start);
    if (step > 0) return starts.find((t) => t > time + 1e-6) ?? this.end;
    return starts.reverse().find((t) => t < time - 1e-6) ?? this.start;
  }

  /** How often a finger lands on a contact. One that lifts off and stays free is no relocation. */
  get nRelocations(): number {
    const lands = (s: Stretch) => s.kind === "regrasp" && holds(this.waypoints[s.last]?.contacts[s.moving]);
    return this.stretches.filter(lands).length;
  }

  private holdsOf(finger: number): Hold[] {
    const found: Hold[] = [];
    let open: Hold | null = null;
    const close = () => {
      if (open && open.end > open.start) found.push(open);
      open = null;
    };
    for (let i = 0; i + 1 < this.waypoints.length; i++) {
      const from = this.waypoints[i].contacts[finger];
      const to = this.waypoints[i + 1].contacts[finger];
      if (!holds(from) || !holds(to)) {
        close();
        continue;
      }
      const [start, end] = [this.times[i], this.times[i + 1]];
      const mode = this.holding(i, from, to);
      const put = (contact: Contact, time: number, hold: Hold) => {
        const point = contact.point_in_object ?? [0, 0, 0];
        const before = hold.path[hold.path.length - 1];
        if (before && norm(sub(before.point, point)) < 1e-6) return;
        hold.path.push({ time, point, normal: contact.normal_in_object ?? [0, 0, 1] });
      };
      open ??= { finger, start, end, spans: [], path: [] };
      const hold: Hold = open;
      put(from, start, hold);
      put(to, end, hold);
      hold.end = end;
      const span = hold.spans[hold.spans.length - 1];
      if (span && span.mode === mode) span.end = end;
      else if (end > start) hold.spans.push({ start, end, mode });
    }
    close();
    return found;
  }
}

/** A plan of one moment: the nearest miss of a failure, or the start, for the 3-D view. */
export function still(story: Story): Plan {
  const miss = story.failure?.nearest_miss ?? null;
  const object = miss?.world_from_object ?? story.asked[0] ?? { position: [0, 0, 0], quat_xyzw: [0, 0, 0, 1] };
  const hand = movingHand(story.scene);
  const joints = miss?.joints ?? hand.joints.map((joint) => joint.at_rest);
  const goal = story.asked[story.asked.length - 1] ?? object;
  return {
    task: "in_hand",
    method: "",
    seed: 0,
    hand: hand.name,
    object: story.scene.objects[story.scene.moved_object]?.name ?? "",
    joint_names: hand.joints.map((j) => j.name),
    fingers: hand.fingers.map((f) => f.name),
    start: story.asked[0] ?? object,
    goal,
    segments: [{
      kind: "transfer",
      waypoints: [{
        time: 0,
        joints,
        joint_velocities: joints.map(() => 0),
        world_from_object: object,
        contacts: hand.fingers.map(() => ({ mode: "free" as const })),
      }],
    }],
    promises: { friction: story.scene.friction, friction_margin: 1, required_margin: 0, kept_margin: 0, torque_scale: 1 },
    inputs: [],
    statistics: { transfers: 0, relocations: 0 },
  };
}
