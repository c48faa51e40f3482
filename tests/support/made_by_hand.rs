//! Plans of pick and place that are made without a planner: one arm carries a dumbbell over a table, or two arms hand it over. The
//! robot is the bundled one with its arms side by side and wrists that turn a little farther.

use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion};
use regrasp_geometry::{Pose, Vector};
use regrasp_plan::plan::{ContactMode, PoseData};
use regrasp_plan::robot_plan::{
    HoldingPromises, RobotContact, RobotPlan, RobotSegment, RobotSegmentKind as Kind, RobotWaypoint,
};
use regrasp_robot::{LoadOptions, Manipulator, Part};
use regrasp_scene::{LoadedScene, PickAndPlaceQuery, load_scene_text};
use std::collections::BTreeMap;
use std::path::Path;

/// A scene on disk, what it asks, and a plan that does it.
pub struct MadeByHand {
    /// The files.
    pub _folder: tempfile::TempDir,
    /// The scene.
    pub loaded: LoadedScene,
    /// Its task.
    pub query: PickAndPlaceQuery,
    /// The plan.
    pub plan: RobotPlan,
}

/// How far the bar stands from the torso's axis, in metres, and the torso's angles at start and goal.
const REACH: f64 = 0.59;
const TURNS: [f64; 2] = [-0.4, 0.4];
const TABLE_TOP: f64 = 0.42;
/// Half the size of the dumbbell, and where its two blocks are along y; a strip below joins them.
const HALF: [f64; 3] = [0.02, 0.12, 0.03];
const MIDDLES: [f64; 2] = [-0.1, 0.1];
const MASS: f64 = 0.06;
/// Height of a hand's base above the middle of the bar: in the grasp, and before it.
const DEPTH: f64 = 0.09;
const ABOVE: f64 = 0.16;
const LIFT: f64 = 0.1;
/// Radius of the balls at the fingertips, and how far they open.
const TIP: f64 = 0.005;
const OPENING: f64 = 0.015;
/// Squeeze of fingers across the dumbbell and along it, in newtons.
const SQUEEZE: [f64; 2] = [4.0, 6.0];
const GRAVITY: f64 = 9.80665;
const STEP: f64 = 1e-4;

fn assets() -> std::path::PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets")).to_owned()
}

fn bar_at(turn: f64, above_table: f64) -> Pose {
    let at = Vector::new(REACH * turn.cos(), REACH * turn.sin(), TABLE_TOP + HALF[2] + above_table);
    Pose::from_parts(at.into(), UnitQuaternion::from_axis_angle(&Vector::z_axis(), turn))
}

fn scene_text() -> String {
    let pose = |pose: &Pose| {
        let (p, q) = (pose.translation.vector, pose.rotation.coords);
        format!("position = [{}, {}, {}]\nquat_xyzw = [{}, {}, {}, {}]", p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    };
    let [start, goal] = TURNS.map(|turn| pose(&bar_at(turn, 0.0)));
    let goal = goal.replace('\n', ", ");
    format!(
        "format = \"regrasp-scene\"\nformat_version = 2\n[robot]\nfile = \"robot.toml\"\n\
         [[objects]]\nname = \"bar\"\nmesh = {{ file = \"bar.obj\" }}\nmass = {MASS}\nfriction = 0.8\n{start}\n\
         [[supports]]\nname = \"table\"\nbox = {{ size = [0.5, 1.6, 0.02] }}\nposition = [0.6, 0.0, {}]\n\
         [[obstacles]]\nname = \"lamp\"\ncylinder = {{ radius = 0.02, length = 0.7 }}\nposition = [0.2, 0.6, 0.66]\n\
         [[tasks]]\ntask = \"pick_and_place\"\ngoal = {{ {goal} }}\n",
        TABLE_TOP - 0.01,
    )
}

/// The dumbbell as a mesh file: all faces between full and empty cells of a grid.
fn mesh_text() -> String {
    let [x, y, z] =
        [[-0.02, -0.008, 0.008, 0.02].to_vec(), [-0.12, -0.08, 0.08, 0.12].to_vec(), [-0.03, -0.01, 0.03].to_vec()];
    let is_full = |cell: [i32; 3]| {
        let is_inside = (0..3).all(|k| cell[k] >= 0 && cell[k] < [3, 3, 2][k]);
        is_inside && (cell[1] != 1 || (cell[0] == 1 && cell[2] == 0))
    };
    let mut text = String::new();
    for k in 0..48 {
        text.push_str(&format!("v {} {} {}\n", x[k / 12], y[k / 3 % 4], z[k % 3]));
    }
    let number = |at: [i32; 3]| at[0] * 12 + at[1] * 3 + at[2] + 1;
    for index in 0..18 {
        let cell = [index / 6, index / 2 % 3, index % 2];
        for (axis, side) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)] {
            let mut beside = cell;
            beside[axis] += side;
            if !is_full(cell) || is_full(beside) {
                continue;
            }
            let (a, b) = if side > 0 { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
            let corner = |i: i32, j: i32| {
                let mut at = cell;
                at[axis] += (side + 1) / 2;
                (at[a], at[b]) = (at[a] + i, at[b] + j);
                number(at)
            };
            let [p, q, r, s] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            text.push_str(&format!("f {p} {q} {r}\nf {p} {r} {s}\n"));
        }
    }
    text
}

/// The scene, on disk.
pub fn scene_of_bar() -> (tempfile::TempDir, LoadedScene) {
    let folder = tempfile::tempdir().unwrap();
    let body = std::fs::read_to_string(assets().join("robots/two_arms/body.urdf")).unwrap();
    let body = body
        .replace("xyz=\"0 -0.25 0.1\"", "xyz=\"0.12 -0.1 0.1\"")
        .replace("xyz=\"0 0.25 0.1\"", "xyz=\"0.12 0.1 0.1\"")
        .replace("lower=\"-3\" upper=\"3\"", "lower=\"-3.2\" upper=\"3.2\"");
    std::fs::write(folder.path().join("body.urdf"), body).unwrap();
    let robot = std::fs::read_to_string(assets().join("robots/two_arms/robot.toml")).unwrap();
    let hand = assets().join("hands/wide_four_finger/hand.toml");
    let robot = robot.replace("../../hands/wide_four_finger/hand.toml", hand.to_str().unwrap());
    std::fs::write(folder.path().join("robot.toml"), robot).unwrap();
    std::fs::write(folder.path().join("bar.obj"), mesh_text()).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene_text()).unwrap();
    let loaded = load_scene_text(&path, scene_text().into_bytes(), &LoadOptions::default());
    (folder, loaded.unwrap_or_else(|error| panic!("{error}")))
}

/// One arm takes the bar, carries it and puts it down.
pub fn one_arm() -> MadeByHand {
    Maker::new().make(|maker| {
        maker.pick(0);
        maker.carry(0, 1);
        maker.place(0, 1);
    })
}

/// The right hand takes the bar, the left one takes it over and puts it down.
pub fn hand_over() -> MadeByHand {
    Maker::new().make(|maker| {
        maker.pick(0);
        maker.give(0, 1);
        maker.carry(1, 1);
        maker.place(1, 1);
    })
}

struct Maker {
    folder: tempfile::TempDir,
    loaded: LoadedScene,
    query: PickAndPlaceQuery,
    plan: RobotPlan,
    now: f64,
    joints: Vec<f64>,
    bar: Pose,
    /// By hand: where the object is in the frame of its base while it holds.
    held: [Option<Pose>; 2],
}

/// A finger's contact on the bar.
#[derive(Clone)]
struct Touch {
    finger: String,
    point: Vector,
    normal: Vector,
}

impl Maker {
    fn new() -> Self {
        let (folder, loaded) = scene_of_bar();
        let mut query = loaded.task().query(0).as_pick_and_place().expect("a task of pick and place").clone();
        let mut plan = RobotPlan::answering_pick_and_place(&loaded.scene, &query);
        plan.method = "by hand".into();
        plan.promises.clearance = 0.5e-3;
        plan.promises.holding = Some(HoldingPromises {
            contact_tolerance: 0.3e-3,
            friction_margin: 1.5,
            required_margin: 0.01,
            torque_scale: loaded.scene.objects[0].radius,
            normal_force: [0.1, 20.0],
        });
        let joints = loaded.scene.robots[0].layout.rest();
        let mut maker = Maker {
            folder,
            loaded,
            query: query.clone(),
            plan,
            now: 0.0,
            joints,
            bar: bar_at(TURNS[0], 0.0),
            held: [None; 2],
        };
        for hand in 0..2 {
            maker.joints = maker.fingers(hand, &maker.arm(hand, 0.0, &maker.joints), OPENING);
            maker.joints = maker.arm(hand, ABOVE, &maker.joints);
        }
        query.start.clone_from(&maker.joints);
        query.end.clone_from(&maker.joints);
        maker.query = query;
        maker
    }

    fn make(mut self, steps: impl FnOnce(&mut Maker)) -> MadeByHand {
        steps(&mut self);
        MadeByHand { _folder: self.folder, loaded: self.loaded, query: self.query, plan: self.plan }
    }

    fn robot(&self) -> &Manipulator {
        &self.loaded.scene.robots[0]
    }

    fn joint(&self, hand: usize, name: &str) -> usize {
        let side = ["right", "left"][hand];
        self.robot().layout.index_of(&format!("{side}_{name}")).expect("a joint of the robot")
    }

    /// The arm with its hand above the bar's place, as much higher than in the grasp.
    fn arm(&self, hand: usize, above: f64, joints: &[f64]) -> Vec<f64> {
        let (along, up) = (REACH - 0.12 - 0.17, TABLE_TOP + HALF[2] + DEPTH + above - 0.7);
        let bend = ((along * along + up * up) / (2.0 * 0.25 * 0.25) - 1.0).acos();
        let shoulder = (-up).atan2(along) - 0.5 * bend;
        let mut joints = joints.to_vec();
        joints[self.joint(hand, "shoulder")] = shoulder;
        joints[self.joint(hand, "elbow")] = bend;
        joints[self.joint(hand, "wrist_pitch")] = -shoulder - bend;
        joints[self.joint(hand, "wrist_roll")] = std::f64::consts::PI;
        joints
    }

    fn poses(&self, joints: &[f64]) -> Vec<Pose> {
        let mut poses = Vec::new();
        self.robot().link_poses(joints, &mut poses);
        poses
    }

    fn base(&self, hand: usize, joints: &[f64]) -> Pose {
        self.poses(joints)[self.robot().hands[hand].hand.base.0]
    }

    /// Contacts of a hand on the four sides of its block.
    fn touches(&self, hand: usize) -> Vec<Touch> {
        let places = [("east", 1.0, 0.0), ("north", 0.0, 1.0), ("west", -1.0, 0.0), ("south", 0.0, -1.0)];
        // The hand looks down, so that its y is the object's -y.
        let touch = |(finger, x, y): (&str, f64, f64)| Touch {
            finger: finger.into(),
            point: Vector::new(x * HALF[0], MIDDLES[hand] - y * HALF[0], 0.0),
            normal: Vector::new(x, -y, 0.0),
        };
        places.into_iter().map(touch).collect()
    }

    /// The fingers of a hand as far from their contacts as `opening`, by Newton's method. The bar is under the hand.
    fn fingers(&self, hand: usize, joints: &[f64], opening: f64) -> Vec<f64> {
        // Where the bar is when the hand grasps it, in the frame of the hand's base: it looks down.
        let turn = UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI);
        let base_from_bar = Pose::from_parts(Vector::new(0.0, MIDDLES[hand], DEPTH).into(), turn);
        let (robot, mut joints) = (self.robot(), joints.to_vec());
        let mut first = robot.layout.range(Part::Hand(hand)).start;
        for (finger, touch) in robot.hands[hand].hand.fingers.iter().zip(self.touches(hand)) {
            assert_eq!(finger.name, touch.finger);
            let target = base_from_bar * regrasp_geometry::Point::from(touch.point + touch.normal * (TIP + opening));
            let tip = |joints: &[f64]| {
                let poses = self.poses(joints);
                let base = poses[robot.hands[hand].hand.base.0];
                (base.inverse() * poses[finger.tip.link.0]).translation.vector
            };
            for _ in 0..60 {
                let off = target.coords - tip(&joints);
                let slope = |k: usize| {
                    let mut moved = joints.clone();
                    moved[first + k] += 1e-7;
                    (tip(&moved) - tip(&joints)) / 1e-7
                };
                let jacobian = Matrix3::from_columns(&[slope(0), slope(1), slope(2)]);
                let change = jacobian.try_inverse().expect("the finger can move everywhere") * off;
                let change = change * (0.3 / change.norm().max(0.3));
                (0..3).for_each(|k| joints[first + k] += change[k]);
            }
            assert!((target.coords - tip(&joints)).norm() < 1e-9, "{} does not reach", finger.name);
            first += 3;
        }
        joints
    }

    fn name(&self, hand: usize) -> String {
        ["right", "left"][hand].into()
    }

    /// The object's centre of mass, in its frame.
    fn center(&self) -> Vector {
        self.loaded.scene.objects[0].center_of_mass.coords
    }

    /// Forces of a hand that give `share` of force and moment about the centre of mass, in the object frame, beside a squeeze.
    fn forces(&self, hand: usize, force: &Vector, moment: &Vector) -> Vec<Vector> {
        let touches = self.touches(hand);
        let mut stacked = DVector::zeros(3 * touches.len());
        let mut map = DMatrix::zeros(6, 3 * touches.len());
        for (i, touch) in touches.iter().enumerate() {
            let squeeze = if touch.normal.x == 0.0 { SQUEEZE[1] } else { SQUEEZE[0] };
            let cross = (touch.point - self.center()).cross_matrix();
            for k in 0..3 {
                stacked[3 * i + k] = -touch.normal[k] * squeeze;
                map[(k, 3 * i + k)] = 1.0;
                (0..3).for_each(|row| map[(3 + row, 3 * i + k)] = cross[(row, k)] / 0.05);
            }
        }
        let scaled = moment / 0.05;
        let wanted = DVector::from_iterator(6, force.iter().chain(scaled.iter()).copied());
        let gram = (&map * map.transpose()).try_inverse().expect("four contacts hold");
        let stacked = &stacked + map.transpose() * (gram * (wanted - &map * &stacked));
        (0..touches.len()).map(|i| Vector::new(stacked[3 * i], stacked[3 * i + 1], stacked[3 * i + 2])).collect()
    }

    /// Entries of hands, each with its share of what the object needs to have the acceleration.
    fn contacts(&self, shares: &[(usize, f64)], bar: &Pose, acceleration: &Vector) -> Vec<RobotContact> {
        let mass = self.loaded.scene.objects[0].mass;
        let needed = bar.rotation.inverse() * ((acceleration + Vector::z() * GRAVITY) * mass);
        let mut contacts = Vec::new();
        for &(hand, share) in shares {
            let forces = self.forces(hand, &(needed * share), &Vector::zeros());
            for (touch, force) in self.touches(hand).into_iter().zip(forces) {
                contacts.push(RobotContact {
                    hand: self.name(hand),
                    finger: touch.finger,
                    object: "bar".into(),
                    mode: ContactMode::Fixed,
                    point_in_object: touch.point.into(),
                    normal_in_object: touch.normal.into(),
                    force_in_object: Some(force.into()),
                    torsion: None,
                });
            }
        }
        contacts
    }

    /// Goes through joint vectors, resting at each; `shares` at the first and at the last waypoint.
    fn go(&mut self, kind: Kind, holders: &[&str], corners: &[Vec<f64>], shares: [&[(usize, f64)]; 2]) {
        const PIECES: usize = 4;
        let carrier = match (kind, holders) {
            (Kind::Carry, [one]) => ["right", "left"].iter().position(|name| name == one),
            _ => None,
        };
        let bar_of = |maker: &Maker, joints: &[f64]| match carrier {
            Some(hand) => maker.base(hand, joints) * maker.held[hand].expect("the hand holds"),
            None => maker.bar,
        };
        let mut knots = vec![(self.now, self.joints.clone(), vec![0.0; self.joints.len()])];
        let mut at = self.joints.clone();
        for corner in corners {
            let way: Vec<f64> = corner.iter().zip(&at).map(|(to, from)| to - from).collect();
            let longest = way.iter().map(|way| way.abs()).fold(0.0, f64::max);
            let span = (1.5 * longest / 0.8).max(0.2);
            for piece in 1..=PIECES {
                let u = piece as f64 / PIECES as f64;
                let (share, slope) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / span);
                let is_last = piece == PIECES;
                let joints = match is_last {
                    true => corner.clone(),
                    false => at.iter().zip(&way).map(|(from, way)| from + share * way).collect(),
                };
                let rates = way.iter().map(|way| if is_last { 0.0 } else { slope * way }).collect();
                knots.push((self.now + u * span, joints, rates));
            }
            self.now += span;
            at.clone_from(corner);
        }
        let n = knots.len();
        let mut waypoints = Vec::new();
        for (w, (time, joints, rates)) in knots.iter().enumerate() {
            let bar = bar_of(self, joints);
            let mut acceleration = Vector::zeros();
            if carrier.is_some() {
                // One-sided second differences on both sides; at the ends one side rests.
                for (other, inner) in [(w.checked_sub(1), -1.0), (Some(w + 1).filter(|w| *w < n), 1.0)] {
                    let Some(other) = other else { continue };
                    let (from, to) = if inner < 0.0 { (&knots[other], &knots[w]) } else { (&knots[w], &knots[other]) };
                    let place = |k: f64| {
                        let time = time + inner * k * STEP;
                        (bar_of(self, &along(from, to, time)) * regrasp_geometry::Point::from(self.center())).coords
                    };
                    let second = place(0.0) * 2.0 - place(1.0) * 5.0 + place(2.0) * 4.0 - place(3.0);
                    acceleration += second * (0.5 / (STEP * STEP));
                }
            }
            let u = w as f64 / (n - 1) as f64;
            let shares: Vec<(usize, f64)> = (shares[0].iter().zip(shares[1]))
                .map(|(first, last)| (first.0, first.1 * (1.0 - u) + last.1 * u))
                .collect();
            waypoints.push(RobotWaypoint {
                time: *time,
                joints: joints.clone(),
                joint_velocities: rates.clone(),
                world_from_objects: vec![PoseData::from(&bar)],
                contacts: self.contacts(&shares, &bar, &acceleration),
            });
        }
        self.bar = bar_of(self, &at);
        self.joints = at;
        let holders = holders.iter().map(|name| (*name).to_owned()).collect();
        let held_by = BTreeMap::from([("bar".to_owned(), holders)]);
        self.plan.segments.push(RobotSegment { kind, held_by, in_hand: None, waypoints });
    }

    fn rest(&mut self, holders: &[&str], shares: [&[(usize, f64)]; 2]) {
        let here = self.joints.clone();
        self.go(Kind::Carry, holders, &[here], shares);
    }

    /// Heights between two, for the hand's way up or down.
    fn heights(&self, hand: usize, from: f64, to: f64) -> Vec<Vec<f64>> {
        const N: usize = 6;
        let mut at = self.joints.clone();
        let mut ways = Vec::new();
        for k in 1..=N {
            at = self.arm(hand, from + (to - from) * k as f64 / N as f64, &at);
            ways.push(at.clone());
        }
        ways
    }

    fn turned(&self, turn: f64) -> Vec<f64> {
        let mut joints = self.joints.clone();
        joints[self.robot().layout.index_of("torso_yaw").expect("a torso")] = turn;
        joints
    }

    fn take(&mut self, hand: usize) {
        self.held[hand] = Some(self.base(hand, &self.joints).inverse() * self.bar);
    }

    fn pick(&mut self, hand: usize) {
        let name = self.name(hand);
        let there = self.turned(TURNS[0]);
        self.go(Kind::Transit, &["table"], &[there], [&[], &[]]);
        let down = self.heights(hand, ABOVE, 0.0);
        self.go(Kind::Approach, &["table"], &down, [&[], &[]]);
        let closed = self.fingers(hand, &self.joints, 0.0);
        self.go(Kind::Grasp, &["table"], &[closed], [&[], &[]]);
        self.take(hand);
        self.rest(&["table", &name], [&[(hand, 0.0)], &[(hand, 1.0)]]);
        let up = self.heights(hand, 0.0, LIFT);
        self.go(Kind::Carry, &[&name], &up, [&[(hand, 1.0)], &[(hand, 1.0)]]);
    }

    fn carry(&mut self, hand: usize, to: usize) {
        let (name, there) = (self.name(hand), self.turned(TURNS[to]));
        self.go(Kind::Carry, &[&name], &[there], [&[(hand, 1.0)], &[(hand, 1.0)]]);
    }

    fn give(&mut self, from: usize, to: usize) {
        let (giver, taker) = (self.name(from), self.name(to));
        let one: &[(usize, f64)] = &[(from, 1.0)];
        let down = self.heights(to, ABOVE, LIFT);
        self.go(Kind::Approach, &[&giver], &down, [one, one]);
        let closed = self.fingers(to, &self.joints, 0.0);
        self.go(Kind::Grasp, &[&giver], &[closed], [one, one]);
        self.take(to);
        self.rest(&[&giver, &taker], [&[(from, 1.0), (to, 0.0)], &[(from, 0.0), (to, 1.0)]]);
        self.let_go(from, &taker, LIFT, &[(to, 1.0)]);
    }

    fn let_go(&mut self, hand: usize, stays: &str, height: f64, shares: &[(usize, f64)]) {
        self.held[hand] = None;
        let open = self.fingers(hand, &self.joints, OPENING);
        self.go(Kind::Release, &[stays], &[open], [shares, shares]);
        let up = self.heights(hand, height, ABOVE);
        self.go(Kind::Retreat, &[stays], &up, [shares, shares]);
    }

    fn place(&mut self, hand: usize, at: usize) {
        let name = self.name(hand);
        let down = self.heights(hand, LIFT, 0.0);
        self.go(Kind::Carry, &[&name], &down, [&[(hand, 1.0)], &[(hand, 1.0)]]);
        let goal = bar_at(TURNS[at], 0.0);
        assert!((self.bar.translation.vector - goal.translation.vector).norm() < 1e-9);
        self.rest(&[&name, "table"], [&[(hand, 1.0)], &[(hand, 0.0)]]);
        self.let_go(hand, "table", 0.0, &[]);
        let home = self.turned(0.0);
        self.go(Kind::Transit, &["table"], &[home], [&[], &[]]);
    }
}

type Knot = (f64, Vec<f64>, Vec<f64>);

/// Joints on the cubic between two knots.
fn along(from: &Knot, to: &Knot, time: f64) -> Vec<f64> {
    let span = to.0 - from.0;
    let u = (time - from.0) / span;
    let (a, b) = (u * u * (3.0 - 2.0 * u), span * u * (1.0 - u) * (1.0 - u));
    let c = span * u * u * (u - 1.0);
    (0..from.1.len()).map(|k| from.1[k] + a * (to.1[k] - from.1[k]) + b * from.2[k] + c * to.2[k]).collect()
}
