// Plans as the page reads them: one hand moves one object. Made of plan files of version 3, whose lists have one entry each.

import type { FileSegment, FileWaypoint } from "../../../../schema/plan";
import type { FilePlan, Plan, Segment, Waypoint } from "./story";

/** The plan in a plan file. A plan that is one already stays as it is. */
export function planOf(file: FilePlan | Plan): Plan {
  if (!("hands" in file)) return file;
  const { hands, objects, segments, ...kept } = file;
  const [hand, object] = [hands[0], objects[0]];
  if (hands.length !== 1 || objects.length !== 1) {
    throw new Error(`This page shows plans in which one hand moves one object; this plan has ${hands.length} and ${objects.length}.`);
  }
  const waypoint = ({ world_from_objects, contacts, ...rest }: FileWaypoint): Waypoint => ({
    ...rest,
    world_from_object: world_from_objects[0],
    contacts: hand.fingers.map((finger) => contacts.find((contact) => contact.finger === finger) ?? { mode: "free" }),
  });
  const segment = ({ moving, held_by, waypoints, ...rest }: FileSegment): Segment => ({
    ...rest,
    ...(moving?.length ? { moving_finger: moving[0], also_moving: moving.slice(1) } : {}),
    held_by: held_by[object] ?? [],
    waypoints: waypoints.map(waypoint),
  });
  return { ...kept, hand: hand.name, object, joint_names: hand.joint_names, fingers: hand.fingers, segments: segments.map(segment) };
}
