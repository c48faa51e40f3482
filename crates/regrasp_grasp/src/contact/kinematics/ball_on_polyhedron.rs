//! Balls that roll, slide and twist over faces, edges and vertices of a convex polyhedron (Cherif 1999, appendix A).
//!
//! The centre of a ball that touches keeps one radius from the polyhedron: it moves on a surface of planes, parts of cylinders
//! about the edges and parts of spheres about the vertices, smooth but for its curvature. In a contact frame that is carried
//! along without turning about the normal, constant relative velocities move it along straight lines, helices and great
//! circles, in closed form; the tip turns about two fixed axes, one after the other. `BallWay::of` joins such stretches.
//!
//! Cherif 1999 puts the fingertip onto the next face at once (equations 14 to 16): `relocate`, `advance_with_jumps`.

use super::mode::RelativeVelocity;
use super::polyhedron::{Feature, Polyhedron};
use super::{ContactPose, NoStep, checked_request};
use nalgebra::{Translation3, UnitQuaternion};
use regrasp_geometry::{Point, Pose, UnitVector, Vector};

/// A round fingertip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its centre, in the frame of the fingertip.
    pub center_in_tip: Point,
    /// In metres.
    pub radius: f64,
}

/// A ball that touches a polyhedron.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallContact {
    /// What it touches.
    pub feature: Feature,
    /// The contact; z points from it to the centre of the ball.
    pub pose: ContactPose,
}

impl BallContact {
    /// The centre of the ball, in the object frame.
    pub fn center_in_object(&self, ball: &Ball) -> Point {
        self.pose.object_from_contact * Point::new(0.0, 0.0, ball.radius)
    }
}

/// Lengths, in metres, and angles, in radians, within which a ball stands on the boundary of a feature.
const ON_BOUNDARY: f64 = 1e-10;
/// How far a start may be off the feature that it names, in metres and radians; it is put onto it.
const OFF_FEATURE: f64 = 1e-6;
/// Most edges and vertices that one motion crosses.
const MAX_CROSSINGS: usize = 10_000;

/// How the ball moves on a feature, in the object frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rates {
    /// Velocity of the contact point.
    point: Vector,
    /// Angular velocity of the contact frame.
    frame: Vector,
    /// Angular velocity of the contact frame relative to the tip, in the contact frame.
    frame_over_tip: Vector,
}

/// A motion on one feature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Where it begins.
    pub from: BallContact,
    /// In seconds.
    pub duration: f64,
    rates: Rates,
}

/// A motion over features.
#[derive(Debug, Clone, PartialEq)]
pub struct BallWay {
    ball: Ball,
    stretches: Vec<Stretch>,
    end: BallContact,
}

impl Ball {
    /// The contact of a ball with its orientation given, at a point of a feature with an outward normal of it; x of the contact
    /// frame is any.
    pub fn touching(
        &self,
        feature: Feature,
        point: &Point,
        normal: &UnitVector,
        object_from_tip: &UnitQuaternion<f64>,
    ) -> BallContact {
        let (x, _) = regrasp_geometry::frame::tangents(normal);
        let axes = nalgebra::Matrix3::from_columns(&[x.into_inner(), normal.cross(&x), normal.into_inner()]);
        let rotation = UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes));
        let object_from_contact = Pose::from_parts(Translation3::from(point.coords), rotation);
        let tip_from_contact = self.tip_from_contact(object_from_tip.inverse() * rotation);
        BallContact { feature, pose: ContactPose { object_from_contact, tip_from_contact } }
    }

    /// The contact of a ball at `object_from_tip` with what it is nearest to, and its distance from that along the normal,
    /// negative where they overlap; x of the contact frame is any. None with the centre inside.
    pub fn nearest(&self, polyhedron: &Polyhedron, object_from_tip: &Pose) -> Option<(BallContact, f64)> {
        let center = object_from_tip * self.center_in_tip;
        let (feature, point, distance) = polyhedron.nearest(&center)?;
        let normal = UnitVector::try_new(center - point, 1e-12)?;
        Some((self.touching(feature, &point, &normal, &object_from_tip.rotation), distance - self.radius))
    }

    fn tip_from_contact(&self, rotation: UnitQuaternion<f64>) -> Pose {
        let point = self.center_in_tip - rotation * Vector::new(0.0, 0.0, self.radius);
        Pose::from_parts(Translation3::from(point.coords), rotation)
    }

    /// Velocity of the centre relative to the object, in the contact frame.
    fn center_velocity(&self, velocity: &RelativeVelocity) -> Vector {
        let way = -velocity.linear - velocity.angular.cross(&Vector::new(0.0, 0.0, self.radius));
        Vector::new(way.x, way.y, 0.0)
    }

    fn rates(&self, polyhedron: &Polyhedron, at: &BallContact, velocity: &RelativeVelocity) -> Rates {
        let turn = at.pose.object_from_contact.rotation;
        let (normal, way) = (turn * Vector::z(), turn * self.center_velocity(velocity));
        let (point, frame) = match at.feature {
            Feature::Face(_) => (way, Vector::zeros()),
            Feature::Edge(e) => {
                let along = polyhedron.edges()[e].direction.into_inner();
                (along * along.dot(&way), along * (along.dot(&normal.cross(&way)) / self.radius))
            }
            Feature::Vertex(_) => (Vector::zeros(), normal.cross(&way) / self.radius),
        };
        Rates { point, frame, frame_over_tip: turn.inverse() * frame + velocity.angular }
    }
}

impl Stretch {
    /// The contact after `time` seconds.
    fn at(&self, ball: &Ball, time: f64) -> BallContact {
        let Pose { rotation, translation } = self.from.pose.object_from_contact;
        let object_from_contact = Pose::from_parts(
            Translation3::from(translation.vector + self.rates.point * time),
            UnitQuaternion::from_scaled_axis(self.rates.frame * time) * rotation,
        );
        let turn = UnitQuaternion::from_scaled_axis(self.rates.frame_over_tip * time);
        let tip_from_contact = ball.tip_from_contact(self.from.pose.tip_from_contact.rotation * turn);
        BallContact { feature: self.from.feature, pose: ContactPose { object_from_contact, tip_from_contact } }
    }
}

impl BallWay {
    /// Moves a ball under constant components of the relative velocity in the contact frame, which is carried along, for
    /// `duration` seconds. Time passes on edges and vertices too: there the ball goes round them.
    ///
    /// Panics where the feature is none of the polyhedron.
    pub fn of(
        polyhedron: &Polyhedron,
        ball: &Ball,
        from: &BallContact,
        velocity: &RelativeVelocity,
        duration: f64,
    ) -> Result<Self, NoStep> {
        checked_request(duration, 1.0, velocity)?;
        if !(ball.radius.is_finite() && ball.radius > 0.0) {
            let (what, expected) = ("the radius of the ball", "finite and above 0 m");
            return Err(NoStep::Request { what, value: ball.radius, expected });
        }
        if !(velocity.linear.z.abs() <= super::KEPT * velocity.sliding_speed().max(1.0)) {
            return Err(NoStep::NotKept { speed: velocity.linear.z });
        }
        let (mut stretches, mut at, mut left): (Vec<Stretch>, _, _) = (Vec::new(), start(polyhedron, from)?, duration);
        loop {
            let way = at.pose.object_from_contact.rotation * ball.center_velocity(velocity);
            at = on_feature_ahead(polyhedron, &at, &way).ok_or(NoStep::Stuck { crossings: stretches.len() })?;
            let rates = ball.rates(polyhedron, &at, velocity);
            let until = time_on_feature(polyhedron, &at, &rates);
            let stretch = Stretch { from: at, duration: until.min(left), rates };
            stretches.push(stretch);
            at = stretch.at(ball, stretch.duration);
            left -= stretch.duration;
            if until >= left + stretch.duration || left <= 0.0 {
                return Ok(BallWay { ball: *ball, stretches, end: at });
            }
            if stretches.len() > MAX_CROSSINGS {
                return Err(NoStep::Stuck { crossings: stretches.len() });
            }
        }
    }

    /// The motions on one feature each, in order.
    pub fn stretches(&self) -> &[Stretch] {
        &self.stretches
    }

    /// Where it ends.
    pub fn end(&self) -> BallContact {
        self.end
    }

    /// The contact `time` seconds after the start, at the end from there on.
    pub fn at(&self, time: f64) -> BallContact {
        let mut before = 0.0;
        for stretch in &self.stretches {
            if time < before + stretch.duration {
                return stretch.at(&self.ball, (time - before).max(0.0));
            }
            before += stretch.duration;
        }
        self.end
    }
}

/// The contact put onto its feature, refused where it is not there.
fn start(polyhedron: &Polyhedron, from: &BallContact) -> Result<BallContact, NoStep> {
    let on = put_onto(polyhedron, from.feature, from);
    let [was, is] = [from, &on].map(|contact| contact.pose.object_from_contact);
    let distance = (was.translation.vector - is.translation.vector).norm();
    let angle = was.rotation.angle_to(&is.rotation);
    let beyond = match on.feature {
        Feature::Face(f) => {
            let point = Point::from(is.translation.vector);
            polyhedron.depths(f, &point).fold(0.0, |worst, depth| f64::max(worst, -depth))
        }
        Feature::Edge(_) | Feature::Vertex(_) => 0.0,
    };
    let distance = distance.max(beyond);
    if distance <= OFF_FEATURE && angle <= OFF_FEATURE { Ok(on) } else { Err(NoStep::NotTouching { distance, angle }) }
}

/// The feature on which a ball goes on whose centre moves along `way`, and the ball put exactly onto it.
fn on_feature_ahead(polyhedron: &Polyhedron, at: &BallContact, way: &Vector) -> Option<BallContact> {
    let point = Point::from(at.pose.object_from_contact.translation.vector);
    let normal = at.pose.object_from_contact.rotation * Vector::z();
    let faces = (0..polyhedron.faces().len()).map(Feature::Face);
    let edges = (0..polyhedron.edges().len()).map(Feature::Edge);
    let vertices = (0..polyhedron.vertices().len()).map(Feature::Vertex);
    let feature =
        faces.chain(edges).chain(vertices).find(|&feature| leads_on(polyhedron, feature, &point, &normal, way))?;
    Some(put_onto(polyhedron, feature, at))
}

/// True when a ball at a point with a normal is on `feature`, and moving its centre along `way` keeps it there for a while.
fn leads_on(polyhedron: &Polyhedron, feature: Feature, point: &Point, normal: &Vector, way: &Vector) -> bool {
    // Where a quantity that must not fall below zero is zero, it must not fall.
    let least = -ON_BOUNDARY * way.norm();
    let holds = |value: f64, rate: f64| value >= -4.0 * ON_BOUNDARY && (value > ON_BOUNDARY || rate >= least);
    match feature {
        Feature::Face(f) => {
            let face = &polyhedron.faces()[f];
            let n = face.normal.into_inner();
            (n - normal).norm() <= 4.0 * ON_BOUNDARY
                && n.dot(&(point - polyhedron.corner(f, 0))).abs() <= 1e-9
                && polyhedron
                    .depths(f, point)
                    .enumerate()
                    .all(|(k, depth)| holds(depth, way.dot(&n.cross(&polyhedron.side(f, k)))))
        }
        Feature::Edge(e) => {
            let edge = &polyhedron.edges()[e];
            let along = edge.direction.into_inner();
            let from_end = point - polyhedron.vertices()[edge.ends[0]];
            let (s, angle) = (from_end.dot(&along), angle_on_edge(polyhedron, e, normal));
            let (rate, turn) = (way.dot(&along), way.dot(&along.cross(normal)));
            (from_end - along * s).norm() <= 1e-9
                && normal.dot(&along).abs() <= 4.0 * ON_BOUNDARY
                && holds(s, rate)
                && holds(edge.length - s, -rate)
                && holds(angle, turn)
                && holds(edge.exterior_angle - angle, -turn)
        }
        Feature::Vertex(v) => {
            (point - polyhedron.vertices()[v]).norm() <= 1e-9
                && !polyhedron.spokes(v).is_empty()
                && polyhedron.spokes(v).iter().all(|spoke| holds(-normal.dot(spoke), -way.dot(spoke)))
        }
    }
}

/// Angle about the edge from the normal of its left face.
fn angle_on_edge(polyhedron: &Polyhedron, e: usize, normal: &Vector) -> f64 {
    let edge = &polyhedron.edges()[e];
    let left = polyhedron.faces()[edge.faces[0]].normal.into_inner();
    left.cross(normal).dot(&edge.direction).atan2(left.dot(normal))
}

/// The contact with rounding taken off: point and normal exactly those of the feature. The tip stays as it is turned.
fn put_onto(polyhedron: &Polyhedron, feature: Feature, at: &BallContact) -> BallContact {
    let Pose { rotation, translation } = at.pose.object_from_contact;
    let (point, normal) = (Point::from(translation.vector), rotation * Vector::z());
    let (point, wanted) = match feature {
        Feature::Face(f) => {
            let n = polyhedron.faces()[f].normal.into_inner();
            (point - n * n.dot(&(point - polyhedron.corner(f, 0))), n)
        }
        Feature::Edge(e) => {
            let edge = &polyhedron.edges()[e];
            let (along, end) = (edge.direction.into_inner(), polyhedron.vertices()[edge.ends[0]]);
            let s = (point - end).dot(&along).clamp(0.0, edge.length);
            (end + along * s, (normal - along * along.dot(&normal)).normalize())
        }
        Feature::Vertex(v) => (polyhedron.vertices()[v], normal),
    };
    let turn = UnitQuaternion::from_scaled_axis(normal.cross(&wanted));
    let rotation = UnitQuaternion::new_normalize((turn * rotation).into_inner());
    let object_from_contact = Pose::from_parts(Translation3::from(point.coords), rotation);
    BallContact { feature, pose: ContactPose { object_from_contact, ..at.pose } }
}

/// Time until the ball leaves its feature, infinite when it does not.
fn time_on_feature(polyhedron: &Polyhedron, at: &BallContact, rates: &Rates) -> f64 {
    let point = Point::from(at.pose.object_from_contact.translation.vector);
    let normal = at.pose.object_from_contact.rotation * Vector::z();
    // Until `value`, which changes at `rate`, is zero; one that is zero and does not fall is no boundary ahead.
    let until = |value: f64, rate: f64, size: f64| {
        if rate >= -ON_BOUNDARY * size || size == 0.0 { f64::INFINITY } else { (value / -rate).max(0.0) }
    };
    match at.feature {
        Feature::Face(f) => {
            let n = polyhedron.faces()[f].normal.into_inner();
            let speed = rates.point.norm();
            polyhedron
                .depths(f, &point)
                .enumerate()
                .map(|(k, depth)| until(depth, rates.point.dot(&n.cross(&polyhedron.side(f, k))), speed))
                .fold(f64::INFINITY, f64::min)
        }
        Feature::Edge(e) => {
            let edge = &polyhedron.edges()[e];
            let along = edge.direction.into_inner();
            let s = (point - polyhedron.vertices()[edge.ends[0]]).dot(&along);
            let (rate, speed) = (rates.point.dot(&along), rates.point.norm());
            let (turn, spin) = (rates.frame.dot(&along), rates.frame.norm());
            let angle = angle_on_edge(polyhedron, e, &normal);
            [
                until(s, rate, speed),
                until(edge.length - s, -rate, speed),
                until(angle, turn, spin),
                until(edge.exterior_angle - angle, -turn, spin),
            ]
            .into_iter()
            .fold(f64::INFINITY, f64::min)
        }
        Feature::Vertex(v) => {
            let spin = rates.frame.norm();
            if spin == 0.0 {
                return f64::INFINITY;
            }
            // The normal goes along `normal cos(t) + ahead sin(t)`; it leaves where its product with a spoke turns positive.
            let ahead = rates.frame.cross(&normal) / spin;
            polyhedron
                .spokes(v)
                .iter()
                .map(|spoke| {
                    let (depth, rate) = ((-normal.dot(spoke)).max(0.0), ahead.dot(spoke));
                    if depth <= ON_BOUNDARY && rate <= ON_BOUNDARY { f64::INFINITY } else { depth.atan2(rate) / spin }
                })
                .fold(f64::INFINITY, f64::min)
        }
    }
}

/// How a fingertip is put onto the next face (appendix A).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transition {
    /// It turns with the contact about the edge: the contact on the fingertip stays (equation 16).
    Rolling,
    /// It keeps its orientation: the contact on the fingertip moves.
    Sliding,
}

/// Equations 14 to 16: a contact beyond an edge of face `from`, in its plane, is folded about the edge onto the other face.
///
/// What is carried over is the contact frame, so the angle of contact follows from the frames of the two faces. As printed,
/// equation 14 lacks the distance from the edge, equation 15 the sign of its angle; and 15 holds for sliding only in the frame
/// carried over, not with a chart of the fingertip, which is touched elsewhere.
pub fn relocate(
    polyhedron: &Polyhedron,
    ball: &Ball,
    beyond: &ContactPose,
    from: usize,
    edge: usize,
    transition: Transition,
) -> BallContact {
    let bent = &polyhedron.edges()[edge];
    let (to, angle) = if bent.faces[0] == from {
        (bent.faces[1], bent.exterior_angle)
    } else {
        (bent.faces[0], -bent.exterior_angle)
    };
    let about = polyhedron.vertices()[bent.ends[0]].coords;
    let turn = UnitQuaternion::from_axis_angle(&bent.direction, angle);
    let Pose { rotation, translation } = beyond.object_from_contact;
    let object_from_contact =
        Pose::from_parts(Translation3::from(about + turn * (translation.vector - about)), turn * rotation);
    let tip_from_contact = match transition {
        Transition::Rolling => beyond.tip_from_contact,
        Transition::Sliding => {
            let tip_from_object = beyond.tip_from_contact.rotation * rotation.inverse();
            ball.tip_from_contact(tip_from_object * object_from_contact.rotation)
        }
    };
    BallContact { feature: Feature::Face(to), pose: ContactPose { object_from_contact, tip_from_contact } }
}

/// Cherif 1999's motion between faces: on the plane of face `face` for the whole duration, then folded over every edge on the way,
/// at once. The fingertip jumps there; [`BallWay`] does not.
pub fn advance_with_jumps(
    polyhedron: &Polyhedron,
    ball: &Ball,
    face: usize,
    from: &ContactPose,
    velocity: &RelativeVelocity,
    duration: f64,
    transition: Transition,
) -> Result<BallContact, NoStep> {
    checked_request(duration, 1.0, velocity)?;
    let start = BallContact { feature: Feature::Face(face), pose: *from };
    let mut on = Stretch { from: start, duration, rates: ball.rates(polyhedron, &start, velocity) }.at(ball, duration);
    // Where the straight line enters the present face, folded along with it.
    let mut origin = Point::from(from.object_from_contact.translation.vector);
    let (mut at, mut came_over) = (face, None);
    for _ in 0..MAX_CROSSINGS {
        let end = Point::from(on.pose.object_from_contact.translation.vector);
        let ends: Vec<f64> = polyhedron.depths(at, &end).collect();
        // The first side that the way passes outwards.
        let crossed = polyhedron
            .depths(at, &origin)
            .zip(&ends)
            .enumerate()
            .filter(|(k, (_, end))| **end < 0.0 && Some(polyhedron.faces()[at].edges[*k]) != came_over)
            .map(|(k, (begin, end))| (k, begin.max(0.0) / (begin.max(0.0) - end)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((side, share)) = crossed else { return Ok(on) };
        let edge = polyhedron.faces()[at].edges[side];
        origin += (end - origin) * share;
        on = relocate(polyhedron, ball, &on.pose, at, edge, transition);
        came_over = Some(edge);
        if let Feature::Face(to) = on.feature {
            at = to;
        }
    }
    Err(NoStep::Stuck { crossings: MAX_CROSSINGS })
}
