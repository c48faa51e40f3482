//! The plan as it is, in another scene.

use super::{Breeder, TaskMutant, log_uniform, one_of, sign};
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape, UnitVector, Vector};
use regrasp_plan::check::robots::motion::RobotStep;
use regrasp_plan::check::violation::ViolationKind::{self as Kind};
use regrasp_robot::{LinkId, Robot};
use regrasp_scene::{Gravity, Obstacle, Scene};
use std::sync::Arc;

impl Breeder<'_> {
    /// The plan in a scene that was changed.
    fn in_scene(&mut self, name: &'static str, expected: &[Kind], change: impl FnOnce(&mut Scene) -> Option<()>) {
        let mut scene = self.scene.clone();
        let changed = change(&mut scene);
        self.push(name, expected, |mutant: &mut TaskMutant, _| {
            mutant.scene = Some(scene);
            changed
        });
    }

    /// The scene with another robot of the same joints and links.
    fn with_robot(&self, change: impl FnOnce(&mut Robot)) -> Scene {
        let mut scene = self.scene.clone();
        let robot = &mut scene.robots[self.query.robot];
        let mut changed = (*robot.robot).clone();
        change(&mut changed);
        robot.robot = Arc::new(changed);
        scene
    }

    pub(super) fn break_world(&mut self) {
        self.break_supports();
        self.break_object();
        self.break_room();
        self.break_robot();
    }

    /// The support on which the object stands in some segment, and where.
    fn stand(&mut self) -> Option<(usize, Pose)> {
        let standing: Vec<(usize, usize)> = self
            .plan
            .segments
            .iter()
            .enumerate()
            .filter_map(|(s, segment)| {
                let holders = self.holders(segment);
                let support = self.scene.supports.iter().position(|support| holders.contains(&support.body.name))?;
                Some((s, support))
            })
            .collect();
        let (s, support) = one_of(self.rng, &standing)?;
        Some((support, Pose::from(&self.plan.segments[s].waypoints[0].world_from_objects[0])))
    }

    fn break_supports(&mut self) {
        let Some((support, pose)) = self.stand() else { return };
        let object = &self.scene.objects[self.query.object];
        let down = log_uniform(self.rng, 0.7e-3, 5e-3);
        self.in_scene("the object 2 mm above the table", &[Kind::Unsupported], |scene| {
            scene.supports[support].body.placed.parent_from_shape.translation.vector.z -= down;
            Some(())
        });
        let up = log_uniform(self.rng, 0.25e-3, 5e-3);
        self.in_scene("the object in the table", &[Kind::Collision], |scene| {
            scene.supports[support].body.placed.parent_from_shape.translation.vector.z += up;
            Some(())
        });
        // A board whose edge is below the centre of mass.
        let center = pose * object.center_of_mass;
        let (angle, short) = (self.rng.uniform(0.0, std::f64::consts::TAU), self.rng.uniform(-5e-3, 1.8e-3));
        let is_level = matches!(self.scene.supports[support].body.placed.shape, Shape::Cuboid { .. });
        self.in_scene("the centre of mass over the edge", &[Kind::Unsupported], |scene| {
            let body = &mut scene.supports[support].body;
            let top = match &body.placed.shape {
                Shape::Cuboid { half_extents } => body.placed.parent_from_shape.translation.z + half_extents.z,
                _ => return None,
            };
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector::z_axis(), angle);
            let half = Vector::new(0.3, 0.3, 0.005);
            let middle = Vector::new(center.x, center.y, top - half.z) - turn * Vector::x() * (half.x - short);
            body.placed.parent_from_shape = Pose::from_parts(middle.into(), turn);
            body.placed.shape = Shape::Cuboid { half_extents: half };
            is_level.then_some(())
        });
        let tilt = log_uniform(self.rng, 2e-3, 0.5);
        self.in_scene("an inclined table", &[Kind::Unsupported], |scene| {
            let at = &mut scene.supports[support].body.placed.parent_from_shape;
            at.rotation = nalgebra::UnitQuaternion::from_scaled_axis(Vector::x() * tilt) * at.rotation;
            Some(())
        });
        self.in_scene("no table", &[Kind::WrongHolder], |scene| {
            scene.supports.remove(support);
            Some(())
        });
    }

    fn break_object(&mut self) {
        let object = self.query.object;
        let force = [Kind::ForceUnbalanced];
        let heavier = 1.0 + log_uniform(self.rng, 1e-4, 2.0);
        self.in_scene("another mass", &force, |scene| {
            scene.objects[object].mass *= heavier;
            Some(())
        });
        let shift = Vector::from(self.rng.direction()) * log_uniform(self.rng, 2e-4, 0.01);
        self.in_scene("another centre of mass", &force, |scene| {
            scene.objects[object].center_of_mass += shift;
            Some(())
        });
        let turn = Vector::new(self.rng.uniform(-1.0, 1.0), self.rng.uniform(-1.0, 1.0), 0.0).normalize()
            * log_uniform(self.rng, 1e-3, 1.0);
        self.in_scene("another gravity", &[Kind::ForceUnbalanced, Kind::Unsupported], |scene| {
            let down = nalgebra::UnitQuaternion::from_scaled_axis(turn) * -Vector::z();
            scene.gravity = Some(Gravity::Direction(UnitVector::new_normalize(down)));
            Some(())
        });
        self.in_scene("gravity of any direction", &[Kind::WrongScene], |scene| {
            scene.gravity = Some(Gravity::Any);
            Some(())
        });
        // The share of friction that the plan needs most.
        let contacts = self.plan.segments.iter().flat_map(|segment| &segment.waypoints).flat_map(|w| &w.contacts);
        let needed = contacts
            .filter_map(|contact| {
                let (force, normal) = (Vector::from(contact.force_in_object?), Vector::from(contact.normal_in_object));
                let pressing = -force.dot(&normal);
                Some((force + normal * pressing).norm() / pressing)
            })
            .fold(0.0, f64::max);
        let margin = self.plan.promises.holding.as_ref().map_or(1.0, |holding| holding.friction_margin);
        let share = self.rng.uniform(0.2, 0.99);
        self.in_scene("another friction", &[Kind::ForceOutsideCone, Kind::ClosureLost], |scene| {
            scene.objects[object].friction = needed * margin * share;
            (needed > 1e-3).then_some(())
        });
    }

    /// Things in the way.
    fn break_room(&mut self) {
        let robot = &self.scene.robots[self.query.robot];
        let steps: Vec<(usize, usize)> = (self.plan.segments.iter().enumerate())
            .flat_map(|(s, segment)| (1..segment.waypoints.len()).map(move |w| (s, w - 1)))
            .collect();
        let carries = self.moving_carries();
        let Some((s, w)) = one_of(self.rng, &steps) else { return };
        let pair = &self.plan.segments[s].waypoints[w..w + 2];
        let (mut joints, mut poses) = (Vec::new(), Vec::new());
        RobotStep::new(&pair[0], &pair[1]).joints_at(self.rng.uniform(0.3, 0.7), &mut joints);
        robot.link_poses(&joints, &mut poses);
        let links: Vec<LinkId> = (0..robot.robot.links.len())
            .map(LinkId)
            .filter(|link| {
                !robot.robot.links[link.0].collision.is_empty() && !robot.coordinates_above(*link).is_empty()
            })
            .collect();
        let thing = |name: &str, at: Point, shape: Shape| Obstacle {
            name: name.into(),
            placed: PlacedShape { parent_from_shape: Pose::translation(at.x, at.y, at.z), shape },
            mesh_body: None,
        };
        if let Some(link) = one_of(self.rng, &links) {
            let own = &robot.robot.links[link.0].collision[0];
            let middle = poses[link.0] * own.parent_from_shape * own.shape.middle();
            let radius = log_uniform(self.rng, 1e-3, 0.02);
            self.in_scene("a link through a lamp between two waypoints", &[Kind::Collision], |scene| {
                scene.obstacles.push(thing("lamp beside the elbow", middle, Shape::Sphere { radius }));
                Some(())
            });
        }
        if let Some(s) = one_of(self.rng, &carries) {
            let waypoints = &self.plan.segments[s].waypoints;
            let pose = Pose::from(&waypoints[self.rng.below(waypoints.len())].world_from_objects[0]);
            let at = match &self.scene.objects[self.query.object].shape {
                Shape::Mesh(mesh) => pose * mesh.vertices()[self.rng.below(mesh.vertices().len())],
                other => pose * other.middle(),
            };
            let half_extents = Vector::new(0.01, 0.01, log_uniform(self.rng, 1e-3, 0.01));
            self.in_scene("the object through a shelf", &[Kind::Collision], |scene| {
                scene.obstacles.push(thing("shelf in the way", at, Shape::Cuboid { half_extents }));
                Some(())
            });
        }
        let others: Vec<usize> = (0..self.scene.objects.len()).filter(|index| *index != self.query.object).collect();
        if let (Some(other), Some(link)) = (one_of(self.rng, &others), one_of(self.rng, &links)) {
            let own = &robot.robot.links[link.0].collision[0];
            let middle = poses[link.0] * own.parent_from_shape * own.shape.middle();
            let mut state = self.state.clone();
            state.world_from_objects[other].translation = nalgebra::Translation3::from(middle.coords);
            self.push("a link through an object at rest", &[Kind::Collision], |mutant, _| {
                mutant.state = Some(state);
                Some(())
            });
        }
        self.add("clearance promised that is not kept", &[Kind::Collision], |plan, rng| {
            plan.promises.clearance = rng.uniform(0.3, 1.0);
            Some(())
        });
    }

    fn break_robot(&mut self) {
        let robot = &self.scene.robots[self.query.robot];
        let fingers: Vec<String> = (robot.layout.coordinates.iter())
            .filter(|coordinate| matches!(coordinate.part, regrasp_robot::Part::Hand(_)))
            .map(|coordinate| coordinate.name.clone())
            .collect();
        let effort = log_uniform(self.rng, 1e-6, 1e-3);
        let weak = self.with_robot(|robot| {
            for joint in robot.joints.iter_mut().filter(|joint| fingers.contains(&joint.name)) {
                if let Some(limits) = &mut joint.limits {
                    limits.effort = Some(effort);
                }
            }
        });
        self.push("fingers too weak", &[Kind::TorqueLimit], |mutant, _| {
            mutant.scene = Some(weak);
            Some(())
        });
        let moved: Vec<(usize, [f64; 2])> = (0..robot.layout.len())
            .map(|k| {
                let values = self.plan.waypoints().map(|waypoint| waypoint.joints[k]);
                (k, values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], q| [a.min(q), b.max(q)]))
            })
            .filter(|(_, [low, high])| high - low > 1e-3)
            .collect();
        if let Some((k, [low, high])) = one_of(self.rng, &moved) {
            let name = robot.layout.coordinates[k].name.clone();
            let (is_upper, inside) = (sign(self.rng) > 0.0, log_uniform(self.rng, 1e-8, 1e-4));
            let scene = self.with_robot(|robot| {
                let joint = robot.joints.iter_mut().find(|joint| joint.name == name).expect("a joint of the robot");
                if let Some(limits) = &mut joint.limits {
                    if is_upper { limits.upper = high - inside } else { limits.lower = low + inside }
                }
            });
            self.push("a joint past its limit", &[Kind::JointLimit], |mutant, _| {
                mutant.scene = Some(scene);
                Some(())
            });
        }
        let followers: Vec<usize> =
            (0..robot.robot.joints.len()).filter(|&joint| robot.robot.joints[joint].coupling.is_some()).collect();
        if let Some(joint) = one_of(self.rng, &followers) {
            let name = robot.robot.joints[joint].name.clone();
            self.add("coupling broken: a follower with values of its own", &[Kind::WrongScene], |plan, rng| {
                let names = &mut plan.robots[0].joint_names;
                let k = rng.below(names.len());
                names[k] = name;
                Some(())
            });
        }
    }
}
