// The bodies of a scene in one list, each with a key, a name, links and joints.

import type { Carrier, HandStory, JointStory, LinkStory, SceneStory } from "./story";

export type BodyKind = "hand" | "robot_part" | "object" | "support" | "obstacle";

export interface Body {
  /** Kind and index: names of bodies of two kinds may be the same. */
  key: string;
  kind: BodyKind;
  name: string;
  /** True for the hand and the object that the plan moves. */
  moves: boolean;
  links: LinkStory[];
  joints: JointStory[];
}

/** The hand that the plan moves. */
export const movingHand = (scene: SceneStory): HandStory => scene.hands[scene.moving_hand];

const keyOf = (kind: BodyKind, index: number): string => `${kind} ${index}`;

/** Key of the object that the plan moves. */
export const movedObject = (scene: SceneStory): string => keyOf("object", scene.moved_object);

/** All bodies, what the plan moves first. */
export function bodiesOf(scene: SceneStory): Body[] {
  const rigid = { links: [], joints: [] };
  const list = (kind: BodyKind, bodies: (Pick<Body, "name"> & Partial<Body>)[], moving = -1): Body[] =>
    bodies.map(({ name, links, joints }, index) => (
      { ...rigid, key: keyOf(kind, index), kind, name, moves: index === moving, ...(links && joints ? { links, joints } : {}) }));
  const named = (names: string[]) => names.map((name) => ({ name }));
  const all = [
    ...list("hand", scene.hands, scene.moving_hand),
    ...list("object", scene.objects, scene.moved_object),
    ...list("robot_part", scene.robot_parts),
    ...list("support", named(scene.supports)),
    ...list("obstacle", named(scene.obstacles)),
  ];
  return [...all.filter((body) => body.moves), ...all.filter((body) => !body.moves)];
}

/** The key of the body that a piece is of, and the link that carries it; -1 where the body has none. */
export function placeOf(on: Carrier): { kind: BodyKind; key: string; link: number } {
  const [kind, where] = Object.entries(on)[0] as [BodyKind, number | [number, number]];
  const [index, link] = typeof where === "number" ? [where, -1] : where;
  return { kind, key: keyOf(kind, index), link };
}
