//! The scene prepared for planning: fingers with inverse kinematics, bodies with bounds, pairs to keep apart.
//!
//! Built once per query, shared by all threads, never changed.

use crate::forces::limits::ForceModel;
use crate::grasp::state::MAX_FINGERS;
use crate::settings::{PhysicsSettings, TransferMode};
use arrayvec::ArrayVec;
use regrasp_geometry::collision::{Ball, BallTree, MeshBody, MeshTree, Placement};
use regrasp_geometry::mass::solid_properties;
use regrasp_geometry::surface::SurfacePoint;
use regrasp_geometry::{Point, Pose, Shape};
use regrasp_grasp::{Contact, ContactModel, GraspFrame, Grip, closure};
use regrasp_robot::kinematics::body_frame::BodyFrame;
use regrasp_robot::kinematics::chain::Chain;
use regrasp_robot::kinematics::finger_ik::FingerIk;
use regrasp_robot::kinematics::motion_bound::MotionBound;
use regrasp_robot::tip::{CurvedTip, Pad, is_same_surface};
use regrasp_scene::{HandView, Object};
use std::sync::Arc;

/// A finger, prepared.
#[derive(Debug)]
pub struct FingerModel<'a> {
    /// Inverse kinematics of the tip's centre.
    pub ik: &'a FingerIk,
    /// Largest distance of the tip's surface from its centre: the radius of a ball, zero for a sharp tip.
    pub tip_radius: f64,
    /// The tip, where it is no ball and not sharp.
    pub curved: Option<CurvedTip<'a>>,
    /// Radius of a ball that stands for the tip when contacts are drawn: for a ball its own.
    pub settle_radius: f64,
    /// Where the tip may touch; anywhere without one.
    pub pad: Option<&'a Pad>,
    /// Distance that its joints keep from their limits: that of the settings, but at most a twentieth of the shortest range.
    pub limit_margin: f64,
    /// Its last link at rest, in the world.
    pub link_at_rest: BodyFrame,
    /// What the tip transmits where it touches.
    pub contact: ContactModel,
    /// Bounds of the motion of the tip's centre.
    pub tip_bound: MotionBound,
    /// Indices of its bodies in [`Model::bodies`].
    pub bodies: std::ops::Range<usize>,
    /// Pairs that a motion of this finger alone can bring together, but for those with obstacles.
    pub pairs: Vec<usize>,
    /// When the obstacles have their turn among these.
    pub turns: Vec<Turn>,
    /// Of these, the pairs with each other finger.
    pub pairs_with: Vec<Vec<usize>>,
    /// Tip centre at rest, in the world: where the finger likes to work.
    pub tip_at_rest: Point,
}

impl FingerModel<'_> {
    /// True for a finger that comes to no point that is chosen beforehand: it finds contacts by closing until its tip touches, and holds
    /// while the object stands still. It follows no motion of the object.
    #[inline]
    pub fn closes(&self) -> bool {
        !self.ik.reaches_points()
    }
}

/// What moves a body.
#[derive(Debug)]
pub enum Carrier {
    /// Moving body `link` of a finger.
    Finger {
        /// Which finger.
        finger: usize,
        /// Index of the moving body in the finger's chain.
        link: usize,
        /// Bounds of its motion.
        bound: Box<MotionBound>,
    },
    /// The object.
    Object,
    /// Nothing: palm and obstacles.
    World,
}

/// A shape with what collision tests ask about it.
#[derive(Debug)]
pub struct Body {
    /// Convex shape; for a mesh, its hull.
    pub shape: Shape,
    /// The exact triangles, where the hull is not the mesh.
    pub tree: Option<Arc<MeshTree>>,
    /// The triangles that fingertips touch: those of the mesh also where its hull stands for it to everything else.
    pub tree_for_tips: Option<Arc<MeshTree>>,
    /// Pose in its carrier's frame.
    pub carrier_from_body: Placement,
    /// Centre of the bounding ball, in the body frame.
    pub center: Point,
    /// Radius of the bounding ball.
    pub radius: f64,
    /// Some point of the shape, in the body frame: where it is inside a mesh, the body is that crosses none of its triangles.
    pub middle: Point,
    /// What moves it.
    pub carrier: Carrier,
    /// Name for messages.
    pub name: String,
}

/// Two bodies that are kept apart. In the order in which they are tested: by the first body, then by the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    /// First body.
    pub a: usize,
    /// Second body.
    pub b: usize,
    /// The finger whose tip touches the object, when the pair is a fingertip and the object.
    pub tip_of: Option<usize>,
}

/// The turn of the obstacles in a list of pairs: those of one body come after its other pairs, as in the order of [`Pair`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// Number of pairs of the list that come before.
    pub n_before: usize,
    /// The moving body whose pairs with all obstacles follow.
    pub body: usize,
}

/// The scene, prepared.
#[derive(Debug)]
pub struct Model<'a> {
    /// The scene as the hand sees it.
    pub view: &'a HandView<'a>,
    /// Fingers.
    pub fingers: Vec<FingerModel<'a>>,
    /// Bodies: fingers first, then palm, object, obstacles.
    pub bodies: Vec<Body>,
    /// Radii of the bodies' bounding balls, side by side.
    pub radii: Vec<f64>,
    /// Index of the object's body.
    pub object: usize,
    /// Pairs to keep apart, in order, but for those with obstacles: every moving body is kept apart from each of these.
    pub pairs: Vec<Pair>,
    /// The bodies of each of these pairs, in short, where their distance alone decides; None for a fingertip and the object.
    pub usual: Vec<Option<[u16; 2]>>,
    /// When the obstacles have their turn among these.
    pub turns: Vec<Turn>,
    /// Bounding balls of the obstacles, in the world.
    pub obstacles: BallTree,
    /// What closure is asked about; friction as planned with.
    pub frame: GraspFrame,
    /// What contact forces balance, and their limits; None for plans without forces.
    pub forces: Option<ForceModel>,
    /// Largest distance of a point of the object from its frame's origin: bounds its motion when it turns.
    pub object_reach: f64,
    /// True for an object so far from convex that rays from within miss some of what fingertips can touch.
    pub folds: bool,
    /// False for hands of which the others can never hold while one finger is away: they never change their grasp.
    pub may_release: bool,
    /// Settings.
    pub settings: PhysicsSettings,
    /// Distances that pairs keep which began nearer than the clearance, by their index in `pairs`: the others have infinity there. Empty where
    /// there are none.
    pub kept: Vec<f64>,
}

impl<'a> Model<'a> {
    /// True where a contact that is chosen may lie: off the edges, by the margin of the settings too.
    pub fn keeps_off_edges(&self, at: &SurfacePoint) -> bool {
        self.view.object.keeps_farther_off_edges(at, self.settings.edge_margin)
    }

    /// True where a finger may land: as far off the edges as the object asks for. Contacts of an observed start may be nearer, and a finger
    /// that has left one does not come back to it.
    pub fn may_land(&self, contact: &Contact) -> bool {
        let object = self.view.object;
        if object.edge_distance <= 0.0 {
            return true;
        }
        let distance = object.surface.crease_distance(&object.surface.project(&contact.point_in_object));
        distance >= object.edge_distance - ON_THE_SPOT
    }

    /// True where a contact at `from` may roll to `to`: off the edges, and nearer to them than the margin allows only where it does not come
    /// nearer still. Contacts of an observed start may be nearer than the object asks for.
    pub fn may_roll(&self, from: &Contact, to: &SurfacePoint) -> bool {
        if self.keeps_off_edges(to) {
            return true;
        }
        let object = self.view.object;
        let from = object.surface.project(&from.point_in_object);
        let [was, now] = [&from, to].map(|at| object.surface.crease_distance(at));
        now >= was - ALONG_AN_EDGE && (object.keeps_off_edges(to) || !object.keeps_off_edges(&from))
    }

    /// Prepares `view`; the scene's limits bound the settings.
    pub fn new(view: &'a HandView<'a>, settings: &PhysicsSettings) -> Self {
        let settings = settings.within(&view.limits);
        let hand = &view.hand;
        assert!(hand.fingers.len() <= MAX_FINGERS, "hands of more than {MAX_FINGERS} fingers");
        let mut bodies = Vec::new();
        let mut links = Vec::new();
        let mut fingers = Vec::new();
        for (f, finger) in hand.fingers.iter().enumerate() {
            let first = bodies.len();
            let mut add = |shape: &Shape, body_from_shape: &Pose, link: usize, id, name: &str, is_tip: bool| {
                let (center, radius) = shape.bounding_sphere();
                let bound = Box::new(MotionBound::new(&finger.chain, link, &(body_from_shape * center), radius));
                bodies.push(Body {
                    shape: shape.clone(),
                    tree: None,
                    tree_for_tips: None,
                    carrier_from_body: Placement::from(body_from_shape),
                    center,
                    radius,
                    middle: shape.middle(),
                    carrier: Carrier::Finger { finger: f, link, bound },
                    name: format!("{name} ({})", finger.name),
                });
                links.push((id, is_tip));
            };
            for part in &finger.shapes {
                let name = &hand.robot.links[part.link.0].name;
                add(&part.placed.shape, &part.placed.parent_from_shape, part.body, part.link, name, part.is_tip);
            }
            if let Some(own) = finger.tip.own_shape()
                && !finger.shapes.iter().any(|part| part.is_tip && is_same_surface(&part.placed, &own))
            {
                let link = finger.chain.joints.len() - 1;
                add(&own.shape, &own.parent_from_shape, link, finger.tip.link, "tip", true);
            }
            let ik = &finger.ik;
            fingers.push(FingerModel {
                tip_radius: finger.tip.radius(),
                curved: finger.tip.curved(),
                settle_radius: finger.tip.curved().map_or(finger.tip.radius(), |tip| tip.settle_radius()),
                pad: finger.tip.pad.as_ref(),
                limit_margin: limit_margin(&finger.chain, settings.limit_margin),
                link_at_rest: finger.chain.last_frame(&finger.rest),
                contact: finger.tip.contact,
                tip_bound: MotionBound::new(
                    &finger.chain,
                    finger.chain.joints.len() - 1,
                    &finger.tip.center_in_body,
                    0.0,
                ),
                tip_at_rest: ik.tip(&finger.rest),
                ik,
                bodies: first..bodies.len(),
                pairs: Vec::new(),
                turns: Vec::new(),
                pairs_with: Vec::new(),
            });
        }
        let n_finger_bodies = bodies.len();
        for part in &hand.palm {
            let (shape, place) = (&part.placed.shape, &part.placed.parent_from_shape);
            bodies.push(fixed_body(shape, None, place, &hand.robot.links[part.link.0].name));
            links.push((part.link, false));
        }
        let object = bodies.len();
        bodies.push(object_body(view.object));
        for obstacle in view.obstacles.iter() {
            let (shape, place) = (&obstacle.placed.shape, &obstacle.placed.parent_from_shape);
            bodies.push(fixed_body(shape, obstacle.mesh_body.as_ref(), place, &obstacle.name));
        }
        let mut pairs = Vec::new();
        let mut turns = Vec::new();
        let has_obstacles = !view.obstacles.is_empty();
        for a in 0..=object {
            pairs.extend(
                (a + 1..=object).filter_map(|b| pair_of(view, &bodies, &links, [a, b], n_finger_bodies, object)),
            );
            if has_obstacles && !matches!(bodies[a].carrier, Carrier::World) {
                turns.push(Turn { n_before: pairs.len(), body: a });
            }
        }
        for (f, finger) in fingers.iter_mut().enumerate() {
            let finger_of = |body: usize| match bodies[body].carrier {
                Carrier::Finger { finger, .. } => Some(finger),
                _ => None,
            };
            let moves = |body: usize| finger_of(body) == Some(f);
            let between = |pair: &Pair, g: usize| {
                let fingers = [finger_of(pair.a), finger_of(pair.b)];
                g != f && (fingers == [Some(f), Some(g)] || fingers == [Some(g), Some(f)])
            };
            finger.pairs_with = (0..view.hand.fingers.len())
                .map(|g| (0..pairs.len()).filter(|&p| between(&pairs[p], g)).collect())
                .collect();
            finger.pairs = (0..pairs.len()).filter(|&p| moves(pairs[p].a) || moves(pairs[p].b)).collect();
            let among_its_own = |turn: &Turn| {
                let n_before = finger.pairs.partition_point(|&pair| pair < turn.n_before);
                Turn { n_before, ..*turn }
            };
            finger.turns = turns.iter().filter(|turn| moves(turn.body)).map(among_its_own).collect();
        }
        let short = |pair: &Pair| match (pair.tip_of, u16::try_from(pair.a), u16::try_from(pair.b)) {
            (None, Ok(a), Ok(b)) => Some([a, b]),
            _ => None,
        };
        let usual = pairs.iter().map(short).collect();
        let friction = view.object.friction / settings.friction_margin;
        let others_may_hold = |away: usize| {
            let others: Vec<ContactModel> =
                (0..fingers.len()).filter(|&f| f != away).map(|f| fingers[f].contact).collect();
            closure::may_close(&others, friction)
        };
        let may_release = (0..fingers.len()).any(others_may_hold);
        Model {
            view,
            may_release,
            fingers,
            object,
            pairs,
            turns,
            folds: folds(view.object),
            obstacles: balls_of(&bodies[object + 1..]),
            frame: GraspFrame {
                center_of_mass: view.object.center_of_mass,
                torque_scale: view.object.radius,
                friction,
            },
            forces: ForceModel::new(view, &settings),
            object_reach: bodies[object].center.coords.norm() + bodies[object].radius,
            usual,
            radii: bodies.iter().map(|body| body.radius).collect(),
            bodies,
            settings,
            kept: Vec::new(),
        }
    }

    /// Index in [`Model::bodies`] of the first obstacle, and number of bodies before the obstacles.
    #[inline]
    pub fn first_obstacle(&self) -> usize {
        self.object + 1
    }

    /// Obstacles of which the bounding ball may be nearer than `reach` to `point` in the world, by their indices in
    /// [`Model::bodies`], in order.
    pub fn obstacles_near(&self, point: &Point, reach: f64) -> Vec<usize> {
        let mut near: Vec<Ball> = Vec::new();
        self.obstacles.near(point, reach, &mut near);
        let mut near: Vec<usize> = near.iter().map(|ball| self.first_obstacle() + ball.index as usize).collect();
        near.sort_unstable();
        near
    }

    /// Number of fingers.
    pub fn n_fingers(&self) -> usize {
        self.fingers.len()
    }

    /// True when `finger` rolls over the object while it moves; a sharp tip has nothing to roll on.
    #[inline]
    pub fn rolls(&self, finger: usize) -> bool {
        self.settings.transfer == TransferMode::Rolling && self.fingers[finger].tip_radius > 0.0
    }

    /// True when `finger` rolls and must not turn about the contact's normal: a soft fingertip holds on to what it touches.
    #[inline]
    pub fn resists_spin(&self, finger: usize) -> bool {
        let has_torsion =
            matches!(self.fingers[finger].contact, ContactModel::SoftFinger { torsion_radius } if torsion_radius > 0.0);
        has_torsion && self.rolls(finger)
    }

    /// True when the object must move so that soft fingertips do not turn about their normals: `finger` resists, and has no
    /// joint to spare with which it could turn along with the object.
    #[inline]
    pub fn restricts_motion(&self, finger: usize) -> bool {
        self.resists_spin(finger) && !self.fingers[finger].ik.is_redundant()
    }

    /// Fingers that follow no motion of the object, as bits.
    pub fn closing_fingers(&self) -> u32 {
        (0..self.n_fingers()).filter(|&f| self.fingers[f].closes()).fold(0, |bits, f| bits | 1 << f)
    }

    /// True when fingers of the hand that follow the object when it moves can hold it by themselves.
    pub fn may_move_object(&self) -> bool {
        let following: Vec<ContactModel> =
            self.fingers.iter().filter(|finger| !finger.closes()).map(|finger| finger.contact).collect();
        closure::may_close(&following, self.frame.friction)
    }

    /// True when some finger rolls: contacts then travel while the object moves.
    #[inline]
    pub fn any_rolls(&self) -> bool {
        (0..self.n_fingers()).any(|finger| self.rolls(finger))
    }

    /// Contact of `finger` with what its tip transmits.
    #[inline]
    pub fn grip(&self, finger: usize, contact: &Contact) -> Grip {
        Grip { contact: *contact, model: self.fingers[finger].contact }
    }

    /// Closure margin of the fingers whose bit is set in `holding`, each at its contact; the first found that is enough.
    pub fn closure_margin(&self, contacts: &[Contact], holding: u32) -> f64 {
        self.closure_margin_up_to(contacts, holding, self.settings.closure_margin)
    }

    /// As [`Self::closure_margin`], with another margin that is enough.
    pub fn closure_margin_up_to(&self, contacts: &[Contact], holding: u32, enough: f64) -> f64 {
        let grips: ArrayVec<Grip, MAX_FINGERS> = (0..contacts.len())
            .filter(|&finger| holding & (1 << finger) != 0)
            .map(|finger| self.grip(finger, &contacts[finger]))
            .collect();
        closure::closure_margin(&grips, &self.frame, enough)
    }

    /// Least distance that bodies keep which do not touch, in metres: the clearance, or less where a pair began nearer.
    pub fn least_clearance(&self) -> f64 {
        self.kept.iter().copied().fold(self.settings.clearance, f64::min)
    }

    /// Distance that the tip of a free finger keeps from the object: at least twice what the checker asks.
    #[inline]
    pub fn free_clearance(&self) -> f64 {
        self.settings.clearance.max(1e-4)
    }

    /// All fingers, as bits.
    #[inline]
    pub fn all_fingers(&self) -> u32 {
        (1 << self.fingers.len()) - 1
    }

    /// Length by which angles of object poses are weighed against distances: the object's radius.
    pub fn turn_length(&self) -> f64 {
        self.frame.torque_scale
    }
}

/// A body that nothing moves; `mesh_body` is that of a mesh, where it is known.
fn fixed_body(shape: &Shape, mesh_body: Option<&MeshBody>, world_from_shape: &Pose, name: &str) -> Body {
    let body = |shape: &Shape, tree| {
        let (center, radius) = shape.bounding_sphere();
        Body {
            shape: shape.clone(),
            tree_for_tips: Option::clone(&tree),
            tree,
            carrier_from_body: Placement::from(world_from_shape),
            center,
            radius,
            middle: shape.middle(),
            carrier: Carrier::World,
            name: name.to_owned(),
        }
    };
    match mesh_body.cloned().or_else(|| MeshBody::of(shape)) {
        // The bound is only a first test; the triangles decide.
        Some(MeshBody { bound, tree }) => body(&bound, Some(tree)),
        None => body(shape, None),
    }
}

/// The object: its triangles decide for everything, or where its hull stands for it for fingertips alone.
fn object_body(object: &Object) -> Body {
    let body = fixed_body(&object.shape, object.mesh_body.as_ref(), &Pose::identity(), &object.name);
    let tree = Option::clone(&body.tree).filter(|_| object.hull.is_none());
    Body { carrier: Carrier::Object, tree, ..body }
}

/// Share of the volume of its hull below which an object counts as far from convex. By hand: apples, cubes and bulbs have 0.85 and
/// more, bananas and mugs 0.65 and less.
const FOLDED: f64 = 0.8;

/// By how much a contact that rolls along an edge may come nearer to it in a step, in metres: steps leave some slip. After 500 of them the
/// checker would see it.
const ALONG_AN_EDGE: f64 = 2e-8;

/// How far a point may be from itself when it is sought on the surface again, in metres.
const ON_THE_SPOT: f64 = 1e-9;

/// True where the mesh of `object` fills clearly less than its hull.
fn folds(object: &Object) -> bool {
    let (Shape::Mesh(mesh), None, Some(body)) = (&object.shape, &object.hull, &object.mesh_body) else { return false };
    let hull = solid_properties(&body.bound).map(|solid| solid.volume);
    let solid = solid_properties(&Shape::Mesh(mesh.clone())).map(|solid| solid.volume);
    matches!((solid, hull), (Ok(solid), Ok(hull)) if solid < FOLDED * hull)
}

/// The bounding balls of bodies that nothing moves, in the world.
fn balls_of(bodies: &[Body]) -> BallTree {
    let ball = |body: &Body| (body.carrier_from_body.point(&body.center), body.radius);
    BallTree::new(&bodies.iter().map(ball).collect::<Vec<_>>())
}

/// The pair `(a, b)` of hand and object if it is one to keep apart.
fn pair_of(
    view: &HandView,
    bodies: &[Body],
    links: &[(regrasp_robot::LinkId, bool)],
    [a, b]: [usize; 2],
    n_finger_bodies: usize,
    object: usize,
) -> Option<Pair> {
    let on_hand = |body: usize| body < object;
    if on_hand(a) && on_hand(b) {
        let palm_only = a >= n_finger_bodies && b >= n_finger_bodies;
        let one_link = match (&bodies[a].carrier, &bodies[b].carrier) {
            (Carrier::Finger { finger: f, link: i, .. }, Carrier::Finger { finger: g, link: j, .. }) => {
                f == g && i == j
            }
            _ => false,
        };
        if palm_only || one_link || view.hand.may_touch(links[a].0, links[b].0) {
            return None;
        }
        return Some(Pair { a, b, tip_of: None });
    }
    let moving = |body: usize| !matches!(bodies[body].carrier, Carrier::World);
    if !moving(a) && !moving(b) {
        return None;
    }
    let tip_of = match bodies[a].carrier {
        Carrier::Finger { finger, .. } if b == object && links[a].1 => Some(finger),
        _ => None,
    };
    Some(Pair { a, b, tip_of })
}

/// Distance from their limits that joints keep at most, as a share of their range: slides of a few millimetres would keep from moving at all.
const SHARE_OF_RANGE: f64 = 0.05;

/// The distance from their limits that the joints of `chain` keep where `asked` is asked.
fn limit_margin(chain: &Chain, asked: f64) -> f64 {
    let ranges = chain.lower.iter().zip(&chain.upper).map(|(lower, upper)| upper - lower);
    ranges.map(|range| SHARE_OF_RANGE * range).fold(asked, f64::min)
}

/// The fingers with what their tips transmit.
pub fn fingers_in_words(model: &Model) -> String {
    let models: Vec<&str> = model.fingers.iter().map(|finger| finger.contact.name()).collect();
    format!("{} fingers with contacts {models:?}", model.n_fingers())
}

/// The friction that is planned with, and how it comes from what the scene says.
pub fn friction_in_words(model: &Model) -> String {
    let (friction, margin) = (model.view.object.friction, model.settings.friction_margin);
    if margin == 1.0 { format!("{friction}") } else { format!("{friction} of the scene over a margin of {margin}") }
}

/// Fingers of `holding` that the others of them would let go with these contacts, as bits.
pub fn releasable(model: &Model, contacts: &[Contact], holding: u32) -> u32 {
    let mut bits = 0;
    for finger in (0..contacts.len()).filter(|finger| holding & (1 << finger) != 0) {
        if model.closure_margin(contacts, holding & !(1 << finger)) >= model.settings.closure_margin {
            bits |= 1 << finger;
        }
    }
    bits
}
