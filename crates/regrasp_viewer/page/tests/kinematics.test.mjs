// Kinematics and motion of the page against other ways to know them: 4 x 4 matrices, and a plan that the planner made.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { load } from "./support.mjs";
import { matricesOf, matrix, poseMatrix, synthetic, tracking } from "./synthetic.mjs";

const { linkPoses } = await load("kinematics");
const { Motion, whoMoves } = await load("motion");
const { planOf } = await load("plan");
const math = await load("math");
const { rotationVectors, anglesAlong } = await load("orientation_path");
const { readLink, writeLink } = await load("link");

/** Numbers in [-1, 1) that are the same every time. */
function numbers(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 31 - 1;
  };
}
const asMatrix = (pose) => poseMatrix({ position: pose.position, quat_xyzw: pose.quat });
const near = (a, b, tolerance) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) <= tolerance, `${x} is not ${b[i]}`));
const sphere = JSON.parse(readFileSync(new URL("stories/sphere_180z.json", import.meta.url), "utf8"));

test("poses of links are those that matrices give", () => {
  const next = numbers(1);
  for (const [shape, fingers] of [["ball", 4], ["box", 5]]) {
    const { scene } = synthetic({ shape, fingers, duration: 2, triangles: 400 });
    const unit = (v) => v.map((x) => x / Math.hypot(...v));
    // A sliding joint, a coupled one, and a base that stands askew: what the hand itself lacks.
    const { links, joints } = scene.hands[0];
    links[0].parent_from_joint = { position: [0.1, -0.2, 0.3], quat_xyzw: unit([0.1, 0.7, -0.3, 0.6]) };
    Object.assign(links[2], { kind: "prismatic", axis: unit([1, 2, -1]) });
    Object.assign(links[3], { joint: 0, multiplier: -0.7, offset: 0.2 });
    for (let round = 0; round < 50; round++) {
      const q = joints.map(() => 2 * next());
      const expected = matricesOf(scene.hands[0], q);
      linkPoses(links, q).forEach((pose, i) => near(asMatrix(pose), expected[i], 1e-12));
    }
  }
});

test("fingertips of a planned motion are on their contacts", () => {
  const motion = new Motion(sphere.plan);
  let seen = 0;
  for (const w of motion.waypoints) {
    const links = linkPoses(sphere.scene.hands[0].links, w.joints);
    w.contacts.forEach((contact, f) => {
      if (contact.mode === "free") return;
      const { tip_link, tip_center_in_link, tip_radius } = sphere.scene.hands[0].fingers[f];
      const centre = contact.point_in_object.map((x, k) => x + tip_radius * contact.normal_in_object[k]);
      near(math.apply(links[tip_link], tip_center_in_link), math.apply(math.poseFrom(w.world_from_object), centre), 5e-4);
      seen++;
    });
  }
  assert.ok(seen > 30, `${seen} contacts`);
});

test("between waypoints the object turns at a constant rate about one axis", () => {
  const next = numbers(2);
  for (let round = 0; round < 200; round++) {
    const quat = () => {
      const q = [next(), next(), next(), next()];
      return q.map((x) => x / Math.hypot(...q));
    };
    const [from, to] = [0, 1].map(() => ({ position: [next(), next(), next()], quat: quat() }));
    const [a, b] = [asMatrix(from), asMatrix(to)];
    // Rotation from one to the other, its axis and angle by trace and skew part.
    const delta = [0, 1, 2].map((r) => [0, 1, 2].map((c) => [0, 1, 2].reduce((s, k) => s + b[4 * r + k] * a[4 * c + k], 0)));
    const angle = Math.acos(Math.min(1, Math.max(-1, (delta[0][0] + delta[1][1] + delta[2][2] - 1) / 2)));
    if (angle > 3.1 || angle < 0.05) continue;
    const axis = [delta[2][1] - delta[1][2], delta[0][2] - delta[2][0], delta[1][0] - delta[0][1]].map((x) => x / (2 * Math.sin(angle)));
    const t = 0.5 + 0.5 * next();
    const expected = matrix.times(matrix.turn(axis, t * angle), [...a.slice(0, 3), 0, ...a.slice(4, 7), 0, ...a.slice(8, 11), 0, 0, 0, 0, 1]);
    from.position.forEach((x, k) => { expected[4 * k + 3] = x + (to.position[k] - x) * t; });
    near(asMatrix(math.interpolatePose(from, to, t)), expected, 1e-8);
  }
});

test("a motion gives its waypoints, and half-way half of everything", () => {
  const { plan } = synthetic({ duration: 6, triangles: 400 });
  const motion = new Motion(plan);
  motion.times.forEach((time, i) => {
    if (motion.times[i + 1] === time) return;
    near(motion.joints(time), motion.waypoints[i].joints, 1e-12);
    const half = (time + (motion.times[i + 1] ?? time)) / 2;
    near(motion.joints(half), motion.waypoints[i].joints.map((q, k) => (q + (motion.waypoints[i + 1] ?? motion.waypoints[i]).joints[k]) / 2), 1e-12);
  });
  assert.deepEqual(motion.joints(-5), motion.waypoints[0].joints);
  assert.deepEqual(motion.joints(1e9), motion.waypoints.at(-1).joints);
});

test("joints follow cubics with the plan's velocities, and the object goes as they do along their chords", () => {
  const motion = new Motion(sphere.plan);
  const h = 1e-8;
  let moving = 0;
  for (let i = 0; i + 1 < motion.times.length; i++) {
    const [from, to] = [motion.waypoints[i], motion.waypoints[i + 1]];
    const span = motion.times[i + 1] - motion.times[i];
    if (span < 1e-3) continue;
    near(motion.joints(motion.times[i + 1] - 1e-12), to.joints, 1e-9);
    from.joints.forEach((_, k) => {
      const rate = (time) => (motion.joints(time + h)[k] - motion.joints(time)[k]) / h;
      near([rate(motion.times[i]), rate(motion.times[i + 1] - h)], [from.joint_velocities[k], to.joint_velocities[k]], 1e-3);
    });
    const chord = to.joints.map((q, k) => q - from.joints[k]);
    const square = chord.reduce((sum, x) => sum + x * x, 0);
    if (square < 1e-12) continue;
    const slopes = [from, to].map((w) => (w.joint_velocities.reduce((sum, v, k) => sum + v * chord[k], 0) * span) / square);
    // The checker refuses others; the numbers of this story are rounded.
    if (slopes.some((slope) => slope < 0 || slope > 3)) continue;
    moving++;
    for (const u of [0.1, 0.35, 0.5, 0.8]) {
      const joints = motion.joints(motion.times[i] + u * span);
      const along = joints.reduce((sum, q, k) => sum + (q - from.joints[k]) * chord[k], 0) / square;
      near([motion.parameter(i, u)], [along], 1e-6);
      const pose = math.interpolatePose(math.poseFrom(from.world_from_object), math.poseFrom(to.world_from_object), along);
      near(motion.object(motion.times[i] + u * span).position, pose.position, 1e-9);
    }
  }
  assert.ok(moving > 20, `${moving} steps`);
});

test("holds cover exactly the time in which a finger is on the object", () => {
  for (const { plan } of [synthetic({ duration: 12, triangles: 400 }), sphere]) {
    const motion = new Motion(plan);
    motion.holds.forEach((holds, f) => {
      for (let i = 0; i + 1 < motion.times.length; i++) {
        const middle = (motion.times[i] + motion.times[i + 1]) / 2;
        if (motion.times[i + 1] - motion.times[i] < 1e-9) continue;
        const on = motion.waypoints[i].contacts[f].mode !== "free" && motion.waypoints[i + 1].contacts[f].mode !== "free";
        const hold = holds.find((h) => h.start <= middle && middle <= h.end);
        assert.equal(hold !== undefined, on);
        assert.equal(motion.contacts(middle)[f].mode !== "free", on);
        if (!hold) continue;
        const span = hold.spans.find((s) => s.start <= middle && middle <= s.end);
        const rolls = [i, i + 1].every((k) => motion.waypoints[k].contacts[f].mode === "rolling");
        assert.equal(span.mode, rolls ? "rolling" : "fixed");
        assert.equal(motion.contacts(middle)[f].mode, span.mode);
      }
    });
  }
});

test("relocations are found from anywhere", () => {
  const motion = new Motion(sphere.plan);
  const starts = motion.stretches.filter((s) => s.kind === "regrasp").map((s) => s.start);
  const visited = [];
  for (let t = motion.start; (t = motion.relocationFrom(t, 1)) < motion.end;) visited.push(t);
  assert.deepEqual(visited, starts);
  assert.equal(motion.relocationFrom(motion.end, -1), starts.at(-1));
  assert.equal(motion.relocationFrom(starts[0], -1), motion.start);
});

test("links are read as they were written, and nonsense is not read", () => {
  const camera = { azimuth: -31.5, elevation: 20.3, distance: 0.4567, target: [0.01, -0.02, 0.0789] };
  assert.deepEqual(readLink(writeLink(3.25, camera)), { time: 3.25, camera });
  for (const hash of ["", "#", "#t=", "#t=abc&cam=1,2,3", "#cam=1,2,0,0,0,0", "#cam=1,2,NaN,0,0,0", "#t=Infinity&cam=,,,,,", "#%%%=&t=1e999"]) {
    assert.deepEqual(readLink(hash), { time: null, camera: null }, hash);
  }
});

test("rotation vectors are continuous, those of the poses, and as long a way as the angles between them", () => {
  const story = synthetic({ duration: 60, triangles: 200 });
  const motion = new Motion(tracking(story).plan);
  const vectors = rotationVectors(motion);
  let sum = 0;
  motion.waypoints.forEach((waypoint, i) => {
    // The same orientation, by matrices.
    const turned = poseMatrix({ position: [0, 0, 0], quat_xyzw: math.fromRotationVector(vectors[i]) });
    near(turned, poseMatrix({ position: [0, 0, 0], quat_xyzw: waypoint.world_from_object.quat_xyzw }), 1e-9);
    if (i === 0) return;
    assert.ok(Math.hypot(...vectors[i].map((x, k) => x - vectors[i - 1][k])) < 0.6, `waypoint ${i} jumps`);
    // All turns are about one axis: the way is as long as the vectors' difference.
    sum += Math.hypot(...vectors[i].map((x, k) => x - vectors[i - 1][k]));
  });
  assert.ok(sum > 2 * Math.PI, "more than a whole turn");
  assert.ok(Math.abs(sum - anglesAlong(motion).at(-1)) < 1e-9, `${sum}`);
});

test("tracking: all fingers that move are named", () => {
  const story = tracking(synthetic({ duration: 12, triangles: 200 }));
  const [first, second] = story.plan.fingers;
  const segments = story.plan.segments.map((segment, i) => (i === 0 ? { ...segment, moving_finger: second, also_moving: [first] } : segment));
  const motion = new Motion({ ...story.plan, segments });
  assert.deepEqual([motion.stretches[0].moving, motion.stretches[0].allMoving], [1, [1, 0]]);
  assert.equal(whoMoves(motion.stretches[0], story.scene.hands[0].fingers), `${second} and ${first} move`);
  const alone = motion.stretches[1];
  assert.deepEqual(alone.allMoving, [alone.moving]);
  assert.equal(whoMoves(alone, story.scene.hands[0].fingers), `${story.plan.fingers[alone.moving]} moves`);
});

test("tracking: modes are those of the way to the next waypoint, and nothing holds still but between segments", () => {
  const plan = tracking(synthetic({ duration: 12, triangles: 200 })).plan;
  const motion = new Motion(plan);
  for (const segment of plan.segments) {
    const [from, to] = [segment.waypoints[0].time, segment.waypoints.at(-1).time];
    const modes = motion.contacts((from + to) / 2).map((contact) => contact.mode);
    const expected = plan.fingers.map((name) => (name === segment.moving_finger || name === segment.rolling_finger ? "rolling" : "sliding"));
    assert.deepEqual(modes, expected);
  }
  for (const holds of motion.holds) assert.equal(holds.length, 1, "no finger leaves the object");
});

test("a plan file of version 3 becomes the plan that it says", () => {
  const plan = { ...synthetic({ shape: "ball", fingers: 4, duration: 12, triangles: 400 }).plan, hand: "right", object: "ball" };
  const { hand, object, joint_names, fingers, segments, ...kept } = plan;
  const file = {
    ...kept,
    hands: [{ name: hand, fingers, joint_names }],
    objects: [object],
    segments: segments.map(({ moving_finger, also_moving, waypoints, ...segment }) => ({
      ...segment,
      ...(moving_finger ? { moving: [moving_finger, ...(also_moving ?? [])] } : {}),
      held_by: { [object]: [hand] },
      waypoints: waypoints.map(({ world_from_object, contacts, ...waypoint }) => ({
        ...waypoint,
        world_from_objects: [world_from_object],
        contacts: contacts.flatMap((contact, i) => (contact.mode === "free" ? [] : [{ ...contact, hand, finger: fingers[i], object }])),
      })),
    })),
  };
  const found = planOf(file);
  assert.deepEqual(found.segments.map((segment) => segment.held_by), segments.map(() => [hand]));
  const [told, made] = [new Motion(plan), new Motion(found)];
  assert.deepEqual(made.stretches, told.stretches);
  assert.ok(told.stretches.some((stretch) => stretch.moving >= 0) && told.stretches.length > 2);
  assert.deepEqual(made.holds, told.holds);
  assert.deepEqual(made.times.map((time) => [made.joints(time), made.object(time)]), told.times.map((time) => [told.joints(time), told.object(time)]));
  assert.equal(planOf(found), found, "a plan stays as it is");
  assert.throws(() => planOf({ ...file, objects: ["ball", "box"] }), /1 and 2/);
});
