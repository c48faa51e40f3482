// Stories made by rule: a palm, fingers of three links, a ball or a box, transfers and relocations. Not a planner: contacts are
// where the rule puts them, joints follow by least squares from a kinematics of its own (4 x 4 matrices), which the tests of
// the page's kinematics compare with. The same arguments give the same story.

const TIP = 0.009;
const PALM_FROM_AXIS = 0.062;
const LINKS = [0.0, 0.045, 0.035];

export const matrix = {
  identity: () => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  times: (a, b) => Array.from({ length: 16 }, (_, i) => {
    const [row, column] = [i >> 2, i & 3];
    return [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * row + k] * b[4 * k + column], 0);
  }),
  /** Rodrigues' formula. */
  turn([x, y, z], angle) {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const v = 1 - c;
    return [c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0, y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0,
      z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0, 0, 0, 0, 1];
  },
  move: ([x, y, z]) => [1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1],
  point: (m, [x, y, z]) => [0, 1, 2].map((r) => m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + m[4 * r + 3]),
};

const unit = (v) => v.map((x) => x / Math.hypot(...v));
const quatOf = (axis, angle) => [...unit(axis).map((x) => x * Math.sin(angle / 2)), Math.cos(angle / 2)];
const still = { position: [0, 0, 0], quat_xyzw: [0, 0, 0, 1] };

/** Links of the hand: per finger a base turned about z, an abduction, two flexions. */
function handOf(nFingers, nameOf) {
  const links = [{ name: nameOf("palm"), parent: -1, kind: "fixed", parent_from_joint: still, axis: [0, 0, 1], joint: -1, multiplier: 1, offset: 0, finger: -1 }];
  const joints = [];
  const fingers = [];
  for (let f = 0; f < nFingers; f++) {
    const angle = (2 * Math.PI * f) / nFingers;
    const bases = [
      { position: [PALM_FROM_AXIS * Math.cos(angle), PALM_FROM_AXIS * Math.sin(angle), 0.02], quat_xyzw: quatOf([0, 0, 1], angle) },
      { position: [0, 0, LINKS[0]], quat_xyzw: [0, 0, 0, 1] },
      { position: [0, 0, LINKS[1]], quat_xyzw: [0, 0, 0, 1] },
    ];
    const axes = [[1, 0, 0], [0, 1, 0], [0, 1, 0]];
    ["abduction", "proximal", "distal"].forEach((part, k) => {
      const name = nameOf(`finger_${f}_${part}`);
      joints.push({ name: nameOf(`finger_${f}_${part}_joint`), at_rest: [0, -0.3, 1.2][k], lower: k === 0 ? -0.8 : -1.9, upper: k === 0 ? 0.8 : 1.9, effort: null });
      links.push({
        name, parent: k === 0 ? 0 : links.length - 1, kind: "revolute", parent_from_joint: bases[k], axis: axes[k], joint: joints.length - 1,
        multiplier: 1, offset: 0, finger: f,
      });
    });
    fingers.push({ name: nameOf(["thumb", "index", "middle", "ring", "little", "sixth"][f] ?? `finger ${f}`), tip_link: links.length - 1, tip_center_in_link: [0, 0, LINKS[2]], tip_radius: TIP });
  }
  return { links, joints, fingers };
}

/** World from link of every link, by matrices. */
export function matricesOf(hand, q) {
  const found = [];
  for (const link of hand.links) {
    const { position, quat_xyzw } = link.parent_from_joint;
    const parent = link.parent < 0 ? matrix.identity() : found[link.parent];
    let m = matrix.times(parent, matrix.times(matrix.move(position), quatMatrix(quat_xyzw)));
    const at = link.joint < 0 ? link.offset : link.multiplier * q[link.joint] + link.offset;
    if (link.kind === "revolute") m = matrix.times(m, matrix.turn(link.axis, at));
    if (link.kind === "prismatic") m = matrix.times(m, matrix.move(link.axis.map((x) => x * at)));
    found.push(m);
  }
  return found;
}

export function quatMatrix([x, y, z, w]) {
  const s = Math.hypot(x, y, z);
  return s === 0 ? matrix.identity() : matrix.turn([x / s, y / s, z / s], 2 * Math.atan2(s, w));
}
export const poseMatrix = ({ position, quat_xyzw }) => matrix.times(matrix.move(position), quatMatrix(quat_xyzw));

/** Joints of finger `f` that bring its tip's middle nearest to `target`: damped least squares on finite differences. */
function reach(hand, q, f, target) {
  const found = [...q];
  const tip = () => {
    const m = matricesOf(hand, found)[hand.fingers[f].tip_link];
    return matrix.point(m, hand.fingers[f].tip_center_in_link);
  };
  for (let round = 0; round < 14; round++) {
    const now = tip();
    const miss = target.map((x, i) => x - now[i]);
    if (Math.hypot(...miss) < 1e-6) break;
    const columns = [0, 1, 2].map((k) => {
      found[3 * f + k] += 1e-5;
      const there = tip();
      found[3 * f + k] -= 1e-5;
      return there.map((x, i) => (x - now[i]) / 1e-5);
    });
    const step = solve3(columns, miss, 1e-7);
    step.forEach((s, k) => {
      const { lower, upper } = hand.joints[3 * f + k];
      found[3 * f + k] = Math.min(Math.max(found[3 * f + k] + Math.max(-0.4, Math.min(0.4, s)), lower), upper);
    });
  }
  return found;
}

/** (J^T J + damping) s = J^T b by Cramer's rule; `j` holds the columns of J. */
function solve3(j, b, damping) {
  const dot = (a, c) => a[0] * c[0] + a[1] * c[1] + a[2] * c[2];
  const a = j.map((r, i) => j.map((c, k) => dot(r, c) + (i === k ? damping : 0)));
  const right = j.map((r) => dot(r, b));
  const det = (m) => m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const whole = det(a);
  return [0, 1, 2].map((k) => det(a.map((row, i) => row.map((x, c) => (c === k ? right[i] : x)))) / whole);
}

// ---- meshes ----

const base64 = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");

function meshStory(points, triangles, smooth) {
  const lower = [0, 1, 2].map((k) => Math.min(...points.map((p) => p[k])));
  const upper = [0, 1, 2].map((k) => Math.max(...points.map((p) => p[k])));
  const values = points.flatMap((p) => p.map((x, k) => Math.round(((x - lower[k]) / (upper[k] - lower[k] || 1)) * 65535)));
  const indices = points.length > 65536 ? Uint32Array.from(triangles.flat()) : Uint16Array.from(triangles.flat());
  return { vertices: base64(Uint16Array.from(values)), lower, upper, triangles: base64(indices), smooth_below: smooth };
}

/** A ball, or a capsule along z where `height` is above 0; 4 rings (rings - 1) triangles or so. */
function round(radius, rings, height = 0) {
  const around = 2 * rings;
  const points = [[0, 0, radius + height]];
  for (let i = 1; i < rings; i++) {
    const angle = (Math.PI * i) / rings;
    for (let k = 0; k < around; k++) {
      const turn = (2 * Math.PI * k) / around;
      const z = radius * Math.cos(angle) + (2 * i <= rings ? height : 0);
      points.push([radius * Math.sin(angle) * Math.cos(turn), radius * Math.sin(angle) * Math.sin(turn), z]);
    }
  }
  points.push([0, 0, -radius]);
  const at = (ring, k) => 1 + (ring - 1) * around + (k % around);
  const triangles = [];
  for (let k = 0; k < around; k++) {
    triangles.push([0, at(1, k), at(1, k + 1)], [points.length - 1, at(rings - 1, k + 1), at(rings - 1, k)]);
    for (let ring = 1; ring + 1 < rings; ring++) {
      triangles.push([at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)], [at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)]);
    }
  }
  return meshStory(points, triangles, 0.7);
}

function box(x, y, z) {
  const points = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z]);
  const quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  return meshStory(points, quads.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]), 0);
}

function disc(radius, height) {
  const n = 40;
  const ring = (z) => Array.from({ length: n }, (_, k) => [radius * Math.cos((2 * Math.PI * k) / n), radius * Math.sin((2 * Math.PI * k) / n), z]);
  const points = [...ring(0), ...ring(-height), [0, 0, 0], [0, 0, -height]];
  const triangles = [];
  for (let k = 0; k < n; k++) {
    const l = (k + 1) % n;
    triangles.push([2 * n, k, l], [2 * n + 1, n + l, n + k], [k, n + k, n + l], [k, n + l, l]);
  }
  return meshStory(points, triangles, 0.5);
}

// ---- the story ----

/**
 * `triangles`: about how many in all; `duration`: seconds; `rolling`, `forces`, `roadmap`, `fails`, `obstacle`: what it has;
 * `nameOf`: every name goes through it.
 */
export function synthetic(options = {}) {
  const { fingers: nFingers = 4, duration = 12, triangles = 6000, shape = "ball", rolling = true, forces = true, roadmap = false, fails = false,
    obstacle = false, rate = 12, nameOf = (name) => name } = options;
  const { links, joints, fingers } = handOf(nFingers, nameOf);
  // A ball of n rings has about 4 n^2 triangles; half of all go to the object, the rest to the links.
  const rings = (share) => Math.max(6, Math.round(Math.sqrt(share / 4)));
  const perLink = rings(triangles / 2 / (3 * nFingers));
  const radius = 0.032;
  const meshes = [
    disc(PALM_FROM_AXIS + 0.014, 0.022), round(TIP, perLink, LINKS[1]), round(TIP * 0.95, perLink, LINKS[2]), round(TIP * 1.1, perLink),
    shape === "ball" ? round(radius, rings(triangles / 2)) : box(radius, radius, radius), box(0.02, 0.02, 0.05),
  ];
  const piece = (on, mesh, is_tip = false, from_mesh = still) => ({ on, role: "collision", mesh, from_mesh, is_tip });
  const pieces = [piece({ hand: [0, 0] }, 0, false, { position: [0, 0, 0.012], quat_xyzw: [0, 0, 0, 1] }), piece({ object: 0 }, 4)];
  links.forEach((link, i) => {
    if (link.joint < 0) return;
    const part = link.joint % 3;
    pieces.push(piece({ hand: [0, i] }, [3, 1, 2][part], part === 2));
  });
  if (obstacle) pieces.push(piece({ obstacle: 0 }, 5, false, { position: [0.13, 0.02, 0.06], quat_xyzw: [0, 0, 0, 1] }));
  const hand = { name: nameOf("hand"), links, joints, fingers };
  const scene = {
    hands: [hand], moving_hand: 0, robot_parts: [], objects: [{ name: nameOf(shape), world_from_object: { position: [0, 0, 0.085], quat_xyzw: [0, 0, 0, 1] } }],
    moved_object: 0, supports: [], obstacles: obstacle ? [nameOf("post")] : [], friction: 0.7, gravity_in_world: [0, 0, -9.80665], meshes, pieces,
  };

  const middle = [0, 0, 0.085];
  const poseAt = (angle) => ({ position: [0.004 * Math.sin(angle), 0, middle[2] + 0.004 * Math.sin(2 * angle)], quat_xyzw: quatOf([0.25, 0.1, 1], angle) });
  const nRounds = Math.max(1, Math.round(duration / 6));
  const turnPerRound = 0.7;
  const total = nRounds * turnPerRound;
  let q = joints.map((_, i) => [0, -0.3, 1.2][i % 3]);
  const contactOf = (f, angle, extra) => {
    // Where the finger stands around the object, in the world, turned back into the object.
    const direction = unit([Math.cos((2 * Math.PI * f) / nFingers), Math.sin((2 * Math.PI * f) / nFingers), 0.12]);
    const back = matrix.turn(unit([0.25, 0.1, 1]), -angle + extra);
    const normal = matrix.point(back, direction);
    const size = shape === "ball" ? radius : radius / Math.max(...normal.map(Math.abs));
    return { point: normal.map((x) => x * size), normal };
  };
  const segments = [];
  let time = 0;
  const state = fingers.map((_, f) => ({ ...contactOf(f, 0, 0), landed: 0 }));
  const waypoint = (angle, modes) => {
    const pose = poseAt(angle);
    const m = poseMatrix(pose);
    fingers.forEach((_, f) => {
      const { point, normal, lift = 0 } = state[f];
      q = reach(hand, q, f, matrix.point(m, point.map((x, k) => x + normal[k] * (TIP + lift))));
    });
    const sway = 3 + Math.sin(2 * time);
    return {
      time, joints: [...q], joint_velocities: q.map(() => 0), world_from_object: pose,
      contacts: modes.map((mode, f) => (mode === "free" ? { mode } : {
        mode, point_in_object: state[f].point, normal_in_object: state[f].normal,
        ...(forces ? { force_in_object: state[f].normal.map((x, k) => -x * (sway + 0.6 * f) + 0.5 * Math.sin(time + k)) } : {}),
      })),
    };
  };
  const share = duration / nRounds;
  for (let r = 0; r < nRounds; r++) {
    const n = Math.max(3, Math.round(share * 0.5 * rate));
    const rolls = rolling && r % 2 === 1;
    const from = r * turnPerRound;
    const waypoints = [];
    const [begin, atStart] = [time, state.map((s) => [...s.point])];
    for (let i = 0; i <= n; i++) {
      time = begin + (share * 0.5 * i) / n;
      if (rolls) fingers.forEach((_, f) => {
        const turned = matrix.point(matrix.turn([0, 0, 1], (-0.18 * i) / n), atStart[f]);
        state[f] = { ...state[f], point: turned, normal: unit(turned) };
      });
      waypoints.push(waypoint(from + (turnPerRound * i) / n, fingers.map(() => (rolls ? "rolling" : "fixed"))));
    }
    segments.push({ kind: "transfer", waypoints });
    const each = (share * 0.5) / nFingers;
    for (let f = 0; f < nFingers; f++) {
      const steps = Math.max(4, Math.round(each * rate));
      const moving = [];
      const landing = contactOf(f, (r + 1) * turnPerRound + turnPerRound * 0.5, 0);
      const old = { ...state[f] };
      const start = time + 0.25 * each;
      for (let i = 0; i <= steps; i++) {
        const u = i / steps;
        time = start + 0.75 * each * u;
        const normal = unit(old.normal.map((x, k) => x + (landing.normal[k] - x) * u));
        const point = old.point.map((x, k) => x + (landing.point[k] - x) * u);
        const size = Math.hypot(...point);
        state[f] = i === 0 ? old : i === steps ? landing : { point: normal.map((x) => x * Math.max(size, radius * 0.98)), normal, lift: 0.016 * Math.sin(Math.PI * u) };
        moving.push(waypoint(from + turnPerRound, fingers.map((_, k) => (k === f && i > 0 && i < steps ? "free" : "fixed"))));
      }
      segments.push({ kind: "regrasp", moving_finger: fingers[f].name, waypoints: moving });
    }
  }
  const all = segments.flatMap((s) => s.waypoints);
  const end = time;
  const pairs = [[nameOf("thumb_distal"), nameOf(shape)], [nameOf("index_proximal"), nameOf("palm")]];
  const plan = {
    format: "regrasp-plan", format_version: 2, tool: "synthetic", task: "in_hand", method: "rule", seed: 7, settings: {},
    joint_names: joints.map((j) => j.name), fingers: fingers.map((f) => f.name), start: poseAt(0), goal: poseAt(total), segments,
    promises: { friction: 0.5, friction_margin: 1.4, required_margin: 0.02, kept_margin: 0.031, torque_scale: radius },
    inputs: [{ role: "scene", name: nameOf("synthetic.toml"), sha256: "0".repeat(64) }],
    statistics: { transfers: nRounds, relocations: nRounds * nFingers },
  };
  const judged = {
    accepted: true, level: "motion", violations: [], required_margin: 0.02, pairs,
    margin: all.map((w) => 0.06 + 0.028 * Math.sin(1.3 * w.time) - (w.contacts.some((c) => c.mode === "free") ? 0.012 : 0)),
    clearance: all.map((w) => 0.0021 + 0.0016 * Math.sin(0.9 * w.time + 1)),
    pair: all.map((w) => (Math.sin(0.9 * w.time) > 0 ? 0 : 1)),
  };
  const graph = () => {
    const nodes = Array.from({ length: 90 }, (_, i) => {
      const component = i < 50 ? 0 : i < 76 ? 1 : i < 84 ? 2 : i - 82;
      const axis = unit([Math.sin(12.9898 * i), Math.sin(78.233 * i + 1), component === 1 ? 2 : Math.sin(37.7 * i + 2)]);
      const angle = component === 1 ? 2.3 + 0.8 * Math.sin(5 * i) : 0.4 + 1.2 * Math.abs(Math.sin(3.1 * i));
      return { quat_xyzw: quatOf(axis, angle), component, grown: i, angle_to_goal: Math.abs(total - angle) };
    });
    const edges = [];
    for (let i = 1; i < 84; i++) {
      const to = nodes.findIndex((n, k) => k < i && n.component === nodes[i].component && (k * 7 + i) % 5 === 0);
      if (to >= 0) edges.push({ nodes: [to, i], kind: i % 3 ? "transfer" : "transfer_regrasp" });
    }
    return { nodes, edges, solution: [] };
  };
  const failure = {
    kind: "out_of_budget", message: "No plan within 200,000 configurations (a budget, not a proof). The object came to 61 degrees of the goal.",
    advice: "more grasps near the goal, a higher friction, or a larger budget (--work 1000000).",
    causes: [
      { reason: nameOf("finger cannot reach the new contact"), count: 25070, share: 0.52 }, { reason: "closure lost while the finger lifts", count: 14945, share: 0.31 },
      { reason: "hand and object collide", count: 5785, share: 0.12 }, { reason: "joint limit", count: 2411, share: 0.05 },
    ],
    nearest_miss: { world_from_object: all[Math.floor(all.length / 2)].world_from_object, joints: all[Math.floor(all.length / 2)].joints, angle_left: 1.06, distance_left: 0.0021 },
  };
  return {
    format: "regrasp-story", version: 2, title: nameOf(`${shape} turned ${Math.round((total * 180) / Math.PI)} degrees`),
    facts: [["Hand", nameOf("palm with fingers")], ["Object", nameOf(shape)], ["Seed", "7"], ["Duration", `${end.toFixed(2)} s`], ["Scene", "0".repeat(64)]],
    scene, asked: [poseAt(0), poseAt(total)], plan: fails ? null : plan, judged: fails ? null : judged, failure: fails ? failure : null,
    roadmap: roadmap ? graph() : null,
  };
}

/** The story with what rests around it: another hand on an arm, another object, a table. */
export function withOthers(story) {
  const { scene } = story;
  const [hand] = scene.hands;
  const at = (x) => ({ position: [x, 0, 0], quat_xyzw: [0, 0, 0, 1] });
  const other = { ...hand, name: "left", links: hand.links.map((link) => (link.parent < 0 ? { ...link, parent_from_joint: at(0.3) } : link)) };
  const elbow = { name: "elbow", parent: -1, kind: "revolute", parent_from_joint: at(0.45), axis: [0, 0, 1], joint: 0, multiplier: 1, offset: 0, finger: -1 };
  const arm = { name: "robot/arm", links: [elbow], joints: [{ name: "elbow_joint", at_rest: 0.5, lower: -1, upper: 1, effort: null }] };
  const box = scene.meshes.length - 1;
  const piece = (on, from_mesh = at(0)) => ({ on, role: "collision", mesh: box, from_mesh, is_tip: false });
  const copies = scene.pieces.filter((p) => "hand" in p.on).map((p) => ({ ...p, on: { hand: [1, p.on.hand[1]] } }));
  return {
    ...story,
    scene: {
      ...scene, hands: [hand, other], robot_parts: [arm], supports: ["table"],
      objects: [...scene.objects, { name: "other object", world_from_object: at(-0.3) }],
      pieces: [...scene.pieces, ...copies, piece({ robot_part: [0, 0] }), piece({ object: 1 }), piece({ support: 0 }, at(0.15))],
    },
  };
}

/** The story as one of finger tracking: its transfers only, in parts in which the fingers take turns to move. Not a planner either. */
export function tracking(story) {
  const plan = story.plan;
  const n = plan.fingers.length;
  const kept = [];
  const segments = [];
  let at = 0;
  for (const segment of plan.segments) {
    const indices = segment.waypoints.map((_, i) => at + i);
    at += segment.waypoints.length;
    if (segment.kind !== "transfer") continue;
    const half = Math.ceil(indices.length / 2);
    for (const part of [indices.slice(0, half), indices.slice(half - 1)]) {
      const moving = segments.length % n;
      const rolling = (moving + 1) % n;
      const modes = plan.fingers.map((_, f) => (f === moving ? "rolling" : f === rolling ? "pure_rolling" : "sliding"));
      const own = part.map((i) => segment.waypoints[i - indices[0]]);
      segments.push({
        kind: "tracking", moving_finger: plan.fingers[moving], rolling_finger: plan.fingers[rolling],
        waypoints: own.map((w) => ({ ...w, contacts: w.contacts.map((c, f) => ({ ...c, mode: modes[f] })) })),
      });
      kept.push(...part);
    }
  }
  const promises = { ...plan.promises, tracking: { goal_tolerance: 0.021, sliding_friction: 0.7 } };
  const { margin, clearance, pair } = story.judged;
  return {
    ...story,
    plan: { ...plan, task: "tracking", method: "tracking", segments, promises, statistics: { transfers: 40, relocations: 0, samples: 41, nodes: 992 } },
    judged: { ...story.judged, margin: kept.map(() => null), clearance: kept.map((i) => clearance[i]), pair: kept.map((i) => pair[i]) },
  };
}
