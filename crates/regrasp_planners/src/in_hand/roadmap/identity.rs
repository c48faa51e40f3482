//! What a roadmap was built for: digests of everything in a scene that decides which motions are feasible.
//!
//! Digests are of values, not of files: comments and the turn asked for do not matter, and a scene file may name the same
//! hand in another way.

use regrasp_base::files::sha256_bytes;
use regrasp_geometry::shape::PlacedShape;
use regrasp_geometry::{Point, Pose, Shape};
use regrasp_robot::kinematics::chain::JointMotion;
use regrasp_robot::{ContactModel, Hand, TipShape};
use regrasp_scene::{HandView, Object};

/// A SHA-256.
pub type Digest = [u8; 32];

/// What a roadmap was built for.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// Names of the fingers, in order.
    pub fingers: Vec<String>,
    /// Name of the robot that the hand is of.
    pub hand_name: String,
    /// The hand as it stands in the world: chains, limits, couplings, tips, how far these may reach, shapes, pairs that may
    /// touch. What its tips transmit is apart.
    pub hand: Digest,
    /// Contact model of every fingertip.
    pub contacts: Vec<ContactModel>,
    /// Name of the object.
    pub object_name: String,
    /// The object: shape, centre of mass, where contacts may be. Its friction is apart.
    pub object: Digest,
    /// The obstacles: shapes and places.
    pub obstacles: Digest,
    /// Coulomb friction coefficient.
    pub friction: f64,
}

impl Identity {
    /// Of a scene.
    pub fn of(view: &HandView) -> Self {
        let mut obstacles = Feed::default();
        obstacles.count(view.obstacles.len());
        for obstacle in view.obstacles.iter() {
            obstacles.placed(&obstacle.placed);
        }
        Identity {
            fingers: view.hand.fingers.iter().map(|finger| finger.name.clone()).collect(),
            hand_name: view.hand.robot.name.clone(),
            hand: hand(view.hand, view.reach),
            contacts: view.hand.fingers.iter().map(|finger| finger.tip.contact).collect(),
            object_name: view.object.name.clone(),
            object: object(view.object),
            obstacles: obstacles.digest(),
            friction: view.object.friction,
        }
    }
}

/// `reach` is what the scene allows the tips; without one the digest is that of the hand alone.
fn hand(hand: &Hand, reach: Option<f64>) -> Digest {
    let mut feed = Feed::default();
    feed.count(hand.fingers.len());
    for finger in &hand.fingers {
        feed.text(&finger.name);
        feed.count(finger.chain.joints.len());
        for joint in &finger.chain.joints {
            feed.pose(&joint.parent_from_joint);
            feed.numbers(joint.axis.iter().copied());
            feed.count(match joint.motion {
                JointMotion::Turn => 0,
                JointMotion::Slide => 1,
            });
            for (at, &(coordinate, multiplier)) in joint.drive.terms.iter().enumerate() {
                if at > 0 {
                    // Marks further leaders: no coordinate has this number.
                    feed.count(usize::MAX);
                }
                feed.count(coordinate);
                feed.numbers([multiplier]);
            }
            feed.numbers([joint.drive.offset]);
        }
        feed.count(finger.chain.n_coordinates());
        for name in &finger.chain.names {
            feed.text(name);
        }
        feed.numbers(finger.chain.lower.iter().copied());
        feed.numbers(finger.chain.upper.iter().copied());
        for limit in &finger.chain.linear_limits {
            for &(coordinate, multiplier) in &limit.terms {
                feed.count(coordinate);
                feed.numbers([multiplier]);
            }
            feed.numbers([limit.lower, limit.upper]);
        }
        feed.numbers(finger.rest.iter().copied());
        feed.point(&finger.tip.center_in_body);
        match &finger.tip.shape {
            TipShape::Point => feed.count(0),
            TipShape::Sphere { radius } => {
                feed.count(1);
                feed.numbers([*radius]);
            }
            TipShape::Hull { hull, .. } => {
                feed.count(2);
                feed.points(hull.vertices());
            }
            TipShape::Ellipsoid(ellipsoid) => {
                feed.count(3);
                feed.numbers(ellipsoid.radii.iter().copied());
                feed.numbers(ellipsoid.body_from_ellipsoid.coords.iter().copied());
            }
        }
        if let Some(pad) = &finger.tip.pad {
            feed.numbers(pad.axis_in_body.iter().copied().chain([pad.cosine]));
        }
        feed.count(finger.shapes.len());
        for shape in &finger.shapes {
            feed.count(shape.body);
            feed.count(shape.link.0);
            feed.count(usize::from(shape.is_tip));
            feed.placed(&shape.placed);
        }
    }
    feed.count(hand.palm.len());
    for shape in &hand.palm {
        feed.count(shape.link.0);
        feed.placed(&shape.placed);
    }
    feed.count(hand.allowed_pairs.len());
    for (a, b) in &hand.allowed_pairs {
        feed.count(a.0);
        feed.count(b.0);
    }
    feed.numbers(reach);
    feed.digest()
}

fn object(object: &Object) -> Digest {
    let mut feed = Feed::default();
    feed.shape(&object.shape);
    if let Some(hull) = &object.hull {
        feed.shape(hull);
    }
    feed.point(&object.center_of_mass);
    feed.numbers([object.edge_distance, object.crease_angle]);
    feed.digest()
}

/// Bytes to be digested. Every list is preceded by its length, so that no two values give the same bytes.
#[derive(Default)]
struct Feed {
    bytes: Vec<u8>,
}

impl Feed {
    fn digest(self) -> Digest {
        sha256_bytes(&self.bytes)
    }

    fn count(&mut self, n: usize) {
        self.bytes.extend((n as u64).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes.extend(text.as_bytes());
    }

    fn numbers(&mut self, numbers: impl IntoIterator<Item = f64>) {
        for number in numbers {
            // Minus zero is zero.
            self.bytes.extend((number + 0.0).to_bits().to_le_bytes());
        }
    }

    fn point(&mut self, point: &Point) {
        self.numbers(point.iter().copied());
    }

    fn points(&mut self, points: &[Point]) {
        self.count(points.len());
        for point in points {
            self.point(point);
        }
    }

    fn pose(&mut self, pose: &Pose) {
        let (position, quat_xyzw) = regrasp_geometry::frame::parts_of(pose);
        self.numbers(position);
        self.numbers(quat_xyzw);
    }

    fn placed(&mut self, placed: &PlacedShape) {
        self.pose(&placed.parent_from_shape);
        self.shape(&placed.shape);
    }

    fn shape(&mut self, shape: &Shape) {
        self.text(shape.kind());
        match shape {
            Shape::Sphere { radius } => self.numbers([*radius]),
            Shape::Capsule { half_length, radius } | Shape::Cylinder { half_length, radius } => {
                self.numbers([*half_length, *radius]);
            }
            Shape::Cuboid { half_extents } => self.numbers(half_extents.iter().copied()),
            Shape::Ellipsoid { radii } => self.numbers(radii.iter().copied()),
            Shape::Convex(hull) => self.points(hull.vertices()),
            Shape::Mesh(mesh) => {
                self.points(mesh.vertices());
                self.count(mesh.triangles().len());
                for triangle in mesh.triangles() {
                    for corner in triangle {
                        self.bytes.extend(corner.to_le_bytes());
                    }
                }
            }
        }
    }
}
