//! Straight ways in the joints for fingers that relocate. The search leads a tip over the surface in short steps, each to the joints nearest to
//! the ones before. A finger with more joints than a tip needs wavers on such a way, and stops at every step: by measurement on a cube in the
//! Allegro hand tips moved at 0.04 m/s where 0.1 were allowed.

use super::air::{ends_of, in_air};
use super::{Foothold, joint_line, tip_clearance};
use crate::model::Model;
use crate::timing::limits;
use crate::workspace::{TipMode, Workspace};
use regrasp_geometry::Pose;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Cosine of the angle between two steps of the joints above which a finger passes from the one to the other without a stop, about.
const SMOOTH: f64 = 0.9;

/// The relocation of `finger` along `path`, its joints after those of `from`, with straight lines in the joints where they are shorter in time and
/// clear; the same where none is found. What comes before the tip has left its contact, and after it is over the next, stays. Everything else is
/// where `workspace` has it; the finger is left anywhere.
pub fn straightened(
    workspace: &mut Workspace,
    world_from_object: &Pose,
    finger: usize,
    (from, to): (Foothold, Foothold),
    path: &[Coordinates],
) -> Vec<Coordinates> {
    let model = workspace.model;
    let whole: Vec<Coordinates> = std::iter::once(from.joints).chain(path).cloned().collect();
    let ends = ends_of(model, finger, world_from_object, [from.contact, to.contact], &whole);
    let air = in_air(model, finger, &ends, &whole);
    let (first, last) = (*air.start(), *air.end());
    if first + 1 >= last {
        return path.to_vec();
    }
    let height = [(&ends[0], first), (&ends[1], last)].into_iter().filter_map(|(end, k)| {
        let tip = model.fingers[finger].ik.tip(&whole[k]);
        end.as_ref().map(|end| end.height(&tip))
    });
    let height = height.fold(model.settings.lift_heights.first().copied().unwrap_or(0.0), f64::min);
    let mode = TipMode::Away { finger, clearance: tip_clearance(model, height) };
    let speeds = Speeds::of(model, finger);
    let mut straight = whole[1..=first].to_vec();
    let mut here = first;
    while here < last {
        let (there, line) = farthest(workspace, (finger, &speeds), &whole, (here, last), mode);
        straight.extend(line);
        here = there;
    }
    straight.extend_from_slice(&whole[last + 1..]);
    straight
}

/// From the joints `here` of `path` as far as a straight line leads that is clear and takes no longer, with what lies between: to the last, half as
/// far, a quarter. The next step of the path itself where none does.
fn farthest(
    workspace: &mut Workspace,
    (finger, speeds): (usize, &Speeds),
    path: &[Coordinates],
    (here, last): (usize, usize),
    mode: TipMode,
) -> (usize, Vec<Coordinates>) {
    let model = workspace.model;
    let mut there = last;
    while there > here + 1 {
        workspace.set_finger(finger, &path[here]);
        let mut line = Vec::new();
        if joint_line(workspace, finger, &path[here], &path[there], mode, &mut line) {
            let straight = std::iter::once(&path[here]).chain(&line);
            if speeds.seconds(model, straight) <= speeds.seconds(model, &path[here..=there]) {
                return (there, line);
            }
        }
        there = here + (there - here) / 2;
    }
    (here + 1, vec![path[here + 1].clone()])
}

/// How fast a finger may go.
struct Speeds {
    finger: usize,
    joint_velocities: Vec<f64>,
    joint_acceleration: f64,
    tip_speed: f64,
}

impl Speeds {
    fn of(model: &Model, finger: usize) -> Self {
        let n_before: usize = model.fingers[..finger].iter().map(|other| other.ik.chain().n_coordinates()).sum();
        let n = model.fingers[finger].ik.chain().n_coordinates();
        let speed = &model.settings.speed;
        Speeds {
            finger,
            joint_velocities: limits(model).joint_velocities[n_before..n_before + n].to_vec(),
            joint_acceleration: speed.joint_acceleration,
            tip_speed: speed.largest_speed,
        }
    }

    /// About how long the finger takes along `path`, in seconds, from rest to rest: with a stop wherever it turns.
    fn seconds<'p>(&self, model: &Model, path: impl IntoIterator<Item = &'p Coordinates>) -> f64 {
        let ik = &model.fingers[self.finger].ik;
        let mut path = path.into_iter();
        let Some(mut joints) = path.next() else { return 0.0 };
        let mut before: Option<Coordinates> = None;
        let (mut total, mut joint_ways, mut tip_way) = (0.0, joints.iter().map(|_| 0.0).collect::<Coordinates>(), 0.0);
        for next in path {
            let step: Coordinates = joints.iter().zip(next).map(|(a, b)| b - a).collect();
            if before.as_ref().is_some_and(|before| cosine(before, &step) < SMOOTH) {
                total += self.seconds_of_line(&joint_ways, tip_way);
                joint_ways.fill(0.0);
                tip_way = 0.0;
            }
            joint_ways.iter_mut().zip(&step).for_each(|(way, change)| *way += change.abs());
            tip_way += (ik.tip(next) - ik.tip(joints)).norm();
            (joints, before) = (next, Some(step));
        }
        total + self.seconds_of_line(&joint_ways, tip_way)
    }

    fn seconds_of_line(&self, joint_ways: &[f64], tip_way: f64) -> f64 {
        let of_joint = |(way, velocity): (&f64, &f64)| {
            let ramp = velocity / self.joint_acceleration;
            match *way < velocity * ramp {
                true => 2.0 * (way / self.joint_acceleration).sqrt(),
                false => way / velocity + ramp,
            }
        };
        joint_ways.iter().zip(&self.joint_velocities).map(of_joint).fold(tip_way / self.tip_speed, f64::max)
    }
}

/// Cosine of the angle between two steps of the joints; one where there is none.
fn cosine(a: &Coordinates, b: &Coordinates) -> f64 {
    let dot = |a: &Coordinates, b: &Coordinates| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    if lengths > 0.0 { dot(a, b) / lengths } else { 1.0 }
}
