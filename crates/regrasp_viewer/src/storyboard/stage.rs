//! What stands before the camera.

use super::key_frames::KeyFrame;
use super::marks;
use crate::palette;
use crate::render::model::{linear, mixed};
use crate::render::shade::Layer;
use crate::render::{Paint, PlacedSurface, Surface};
use crate::story::tessellate::Triangles;
use crate::story::{Carrier, JointStory, LinkStory, MeshStory, PieceStory, Role, SceneStory, pack, world_from_links};
use crate::timeline;
use regrasp_geometry::{Point, Pose, UnitVector, Vector};
use regrasp_plan::Plan;
use std::sync::Arc;

/// Colours of the object's x, y and z axes.
pub const AXIS_COLORS: [&str; 3] = ["#b2182b", "#1b7837", "#2166ac"];
const LINK: &str = "#d9dbde";
const PALM: &str = "#c3c7cc";
const OBSTACLE: &str = "#8f98a3";
const SUPPORT: &str = "#b9b2a6";
const OBJECT_TONES: [&str; 2] = ["#e9d3ae", "#c9a678"];
/// Bodies for outlines: links have their own numbers, from `FIRST_LINK` on.
const OBJECT_BODY: u32 = 0;
const OBSTACLE_BODY: u32 = 1;
const MARK_BODY: u32 = 100;
const FIRST_LINK: u32 = 1000;

/// Obstacles nearer than this, in radii of the object, are shown whole.
const NEAR: f64 = 5.0;

/// Unit vector along an axis.
pub fn unit(axis: usize) -> Vector {
    Vector::ith(axis, 1.0)
}

/// A piece with its surface made.
struct Prop {
    from_mesh: Pose,
    surface: Arc<Surface>,
    paint: Paint,
    body: u32,
}

impl Prop {
    fn placed(&self, world_from_carrier: &Pose) -> PlacedSurface {
        PlacedSurface {
            world_from_surface: world_from_carrier * self.from_mesh,
            surface: Arc::clone(&self.surface),
            paint: self.paint.clone(),
            body: self.body,
        }
    }
}

/// Where bodies stand that the plan does not move: poses in the world.
struct Resting {
    hands: Vec<Vec<Pose>>,
    robot_parts: Vec<Vec<Pose>>,
    objects: Vec<Pose>,
}

impl Resting {
    fn of(scene: &SceneStory) -> Self {
        let posed = |links: &[LinkStory], joints: &[JointStory]| {
            world_from_links(links, &joints.iter().map(|joint| joint.at_rest).collect::<Vec<_>>())
        };
        Resting {
            hands: scene.hands.iter().map(|hand| posed(&hand.links, &hand.joints)).collect(),
            robot_parts: scene.robot_parts.iter().map(|part| posed(&part.links, &part.joints)).collect(),
            objects: scene.objects.iter().map(|object| Pose::from(&object.world_from_object)).collect(),
        }
    }

    fn world_from(&self, on: Carrier) -> Pose {
        let pose = match on {
            Carrier::Hand(hand, link) => self.hands.get(hand).and_then(|links| links.get(link)),
            Carrier::RobotPart(part, link) => self.robot_parts.get(part).and_then(|links| links.get(link)),
            Carrier::Object(object) => self.objects.get(object),
            Carrier::Support(_) | Carrier::Obstacle(_) => None,
        };
        pose.copied().unwrap_or_else(Pose::identity)
    }
}

/// Hand, object and obstacles with their surfaces made once.
pub struct Stage<'s> {
    scene: &'s SceneStory,
    links: Vec<(usize, Prop)>,
    /// For every piece of `links`, whether it belongs to a finger.
    is_finger: Vec<bool>,
    object: Vec<Prop>,
    obstacles: Vec<PlacedSurface>,
    /// Hands, parts of robots, objects and supports that the plan does not move, placed in the world.
    at_rest: Vec<PlacedSurface>,
    resting: Resting,
    /// Middle of the object's bounds, in its frame.
    object_center: Point,
    /// Largest distance of a point of the object from there, in metres.
    pub object_radius: f64,
    object_at_start: Pose,
    /// Largest contact force in the plan, in newtons.
    largest_force: f64,
    friction: f64,
}

/// Which surfaces are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// What things look like.
    Visuals,
    /// What planner and checker keep apart.
    CollisionShapes,
}

impl<'s> Stage<'s> {
    /// Makes all surfaces: of what things look like, or (where `shown` says so, or where that is not known) of what planner and
    /// checker keep apart. Err with a message when a mesh cannot be read, or there is no object.
    pub fn new(scene: &'s SceneStory, plan: &Plan, shown: Shown) -> Result<Self, String> {
        let has_visuals = scene.pieces.iter().any(|piece| piece.role == Role::Visual);
        let role = if has_visuals && shown == Shown::Visuals { Role::Visual } else { Role::Collision };
        let meshes: Vec<Option<Triangles>> = scene.meshes.iter().map(triangles_of).collect();
        let mesh = |piece: &PieceStory| {
            let found = meshes.get(piece.mesh).and_then(Option::as_ref);
            found.ok_or_else(|| format!("the mesh of {} cannot be read", scene.name_of(piece.on).unwrap_or_default()))
        };
        let pieces: Vec<&PieceStory> = scene.pieces.iter().filter(|piece| piece.role == role).collect();
        let mut corners = Vec::new();
        for piece in pieces.iter().filter(|piece| scene.is_moved_object(piece.on)) {
            let from_mesh = Pose::from(&piece.from_mesh);
            corners.extend(mesh(piece)?.vertices.iter().map(|v| from_mesh * v));
        }
        let first = *corners.first().ok_or("the scene has no object")?;
        let (low, high) = corners.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        let object_center = nalgebra::center(&low, &high);
        let object_radius = corners.iter().map(|p| (p - object_center).norm()).fold(1e-6, f64::max);
        let steps = timeline::steps(plan);
        let contacts = steps.iter().flat_map(|step| &step.waypoint.contacts);
        let forces = contacts.filter_map(|contact| contact.force_in_object).map(Vector::from);
        let mut stage = Stage {
            scene,
            links: Vec::new(),
            is_finger: Vec::new(),
            object: Vec::new(),
            obstacles: Vec::new(),
            at_rest: Vec::new(),
            resting: Resting::of(scene),
            object_center,
            object_radius,
            object_at_start: Pose::from(&plan.start),
            largest_force: forces.map(|force| force.norm()).fold(0.0, f64::max),
            friction: plan.promises.friction,
        };
        let mut surfaces: Vec<Option<Arc<Surface>>> = vec![None; scene.meshes.len()];
        for piece in pieces {
            let triangles = mesh(piece)?;
            let surface = surfaces[piece.mesh].get_or_insert_with(|| Arc::new(Surface::of(triangles)));
            stage.put(piece, Arc::clone(surface));
        }
        Ok(stage)
    }

    fn put(&mut self, piece: &PieceStory, surface: Arc<Surface>) {
        let scene = self.scene;
        let from_mesh = Pose::from(&piece.from_mesh);
        match piece.on {
            Carrier::Hand(hand, link) if hand == scene.moving_hand => {
                let finger = scene.hand().links.get(link).and_then(|link| usize::try_from(link.finger).ok());
                let is_tip = piece.is_tip && finger.is_some();
                let color = match finger {
                    Some(finger) if is_tip => palette::color(finger),
                    Some(_) => LINK,
                    None => PALM,
                };
                self.is_finger.push(finger.is_some());
                let body = FIRST_LINK + 2 * link as u32 + u32::from(is_tip);
                self.links.push((link, Prop { from_mesh, surface, paint: Paint::Plain(linear(color)), body }));
            }
            on if scene.is_moved_object(on) => {
                let paint = Paint::Octants {
                    center: from_mesh.inverse() * self.object_center,
                    axes: from_mesh.rotation,
                    tones: OBJECT_TONES.map(linear),
                    dots: AXIS_COLORS.map(linear),
                    dot_cosine: libm::cos(0.20),
                };
                self.object.push(Prop { from_mesh, surface, paint, body: OBJECT_BODY });
            }
            on => {
                let body = OBSTACLE_BODY + (self.obstacles.len() + self.at_rest.len()) as u32 % 90;
                let color = match on {
                    Carrier::Hand(..) if piece.is_tip => LINK,
                    Carrier::Hand(..) | Carrier::RobotPart(..) => PALM,
                    Carrier::Object(_) => OBJECT_TONES[0],
                    Carrier::Support(_) => SUPPORT,
                    Carrier::Obstacle(_) => OBSTACLE,
                };
                let prop = Prop { from_mesh, surface, paint: Paint::Plain(linear(color)), body };
                let model = prop.placed(&self.resting.world_from(on));
                let models = if matches!(on, Carrier::Obstacle(_)) { &mut self.obstacles } else { &mut self.at_rest };
                models.push(model);
            }
        }
    }

    /// Obstacles, placed in the world.
    pub fn obstacles(&self) -> &[PlacedSurface] {
        &self.obstacles
    }

    /// True when no obstacle is so large, or so far away, that hand and object would be small beside it.
    fn obstacles_are_near(&self) -> bool {
        let center = self.object_at_start * self.object_center;
        let mut corners = self.obstacles.iter().flat_map(|model| model.world_corners().flatten().collect::<Vec<_>>());
        corners.all(|corner| (corner - center).norm() < NEAR * self.object_radius)
    }

    /// How many models of [`Stage::solid`] are the object's.
    pub fn n_object_pieces(&self) -> usize {
        self.object.len()
    }

    /// For every model of [`Stage::solid`], whether it is of the object or a finger, not of the palm or an arm.
    pub fn matters(&self) -> impl Iterator<Item = bool> + '_ {
        std::iter::repeat_n(true, self.object.len()).chain(self.is_finger.iter().copied())
    }

    /// Where the middle of the object is, in the world.
    pub fn object_center_at(&self, frame: &KeyFrame) -> Point {
        Pose::from(&frame.world_from_object) * self.object_center
    }

    /// Object and hand at a moment, the object first.
    pub fn solid(&self, frame: &KeyFrame) -> Vec<PlacedSurface> {
        let world_from_link = self.scene.hand().world_from_links(&frame.joints);
        let world_from_object = Pose::from(&frame.world_from_object);
        let object = self.object.iter().map(|prop| prop.placed(&world_from_object));
        object.chain(self.links.iter().map(|(link, prop)| prop.placed(&world_from_link[*link]))).collect()
    }

    /// Obstacles, cones, and the marks of a moment.
    pub fn layers(&self, frame: &KeyFrame) -> Vec<Layer> {
        let world_from_object = Pose::from(&frame.world_from_object);
        let size = self.object_radius;
        let (mut cones, mut marks) = (Vec::new(), Vec::new());
        for (finger, contact) in frame.contacts.iter().enumerate().filter(|(_, contact)| contact.holds()) {
            let (Some(point), Some(normal)) = (contact.point_in_object, contact.normal_in_object) else { continue };
            let point = world_from_object * Point::from(point);
            let Some(normal) = UnitVector::try_new(world_from_object * Vector::from(normal), 1e-12) else { continue };
            let color = linear(palette::color(finger));
            let dark = mixed(color, [0.0; 3], 0.45);
            let body = MARK_BODY + finger as u32;
            let height = 0.55 * size;
            cones.push(marks::cone(&point, &normal, height, height * self.friction, color, body));
            marks.push(marks::disc(&point, &normal, 0.12 * size, dark, body));
            match contact.force_in_object.filter(|_| self.largest_force > 0.0) {
                Some(force) => {
                    let force = world_from_object * Vector::from(force);
                    let tail = point - force * (0.95 * size / self.largest_force);
                    marks.extend(marks::arrow(&tail, &point, 0.028 * size, dark, body));
                }
                None => {
                    marks.extend(marks::rod(&point, &(point + normal.into_inner() * height), 0.018 * size, dark, body))
                }
            }
        }
        for (finger, trace) in frame.traces.iter().enumerate() {
            let points: Vec<Point> =
                thinned(trace, 0.03 * size).iter().map(|point| world_from_object * point).collect();
            let color = mixed(linear(palette::color(finger)), [0.0; 3], 0.35);
            marks.extend(marks::rope(&points, 0.016 * size, color, MARK_BODY + finger as u32));
        }
        if let Some(finger) = frame.moving {
            let color = linear(palette::color(finger));
            marks.extend(marks::rope(&frame.path, 0.03 * size, color, MARK_BODY + finger as u32));
        }
        let mut layers = vec![
            Layer { models: self.obstacles.clone(), in_front: 0.40, hidden: 0.0, is_framed: self.obstacles_are_near() },
            Layer { models: cones, in_front: 0.38, hidden: 0.10, is_framed: true },
            Layer { models: marks, in_front: 1.0, hidden: 0.45, is_framed: true },
        ];
        if !self.at_rest.is_empty() {
            layers.insert(0, Layer { models: self.at_rest.clone(), in_front: 1.0, hidden: 0.0, is_framed: false });
        }
        layers
    }
}

/// The first and the last of `points`, and of those in between what is farther than `step` from the one before.
fn thinned(points: &[Point], step: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    for (k, point) in points.iter().enumerate() {
        if k + 1 == points.len() || kept.last().is_none_or(|last| (point - last).norm() > step) {
            kept.push(*point);
        }
    }
    kept
}

fn triangles_of(mesh: &MeshStory) -> Option<Triangles> {
    let (vertices, triangles) = pack::unpack(mesh)?;
    Some(Triangles { vertices, triangles, smooth_below: mesh.smooth_below })
}
