//! Montana's equations without charts: the contact frame moves over both bodies as a rigid frame, by the shape operators of
//! the two surfaces (`Surface::shape_operator`). For any surface; on meshes curvature is estimated, and the path is as exact
//! as the mesh.
//!
//! The frame does not turn about the normal relative to the object, as `super::RelativeControl::Transported`.

use super::dormand_prince;
use super::mode::RelativeVelocity;
use super::{ContactPose, NoStep, checked_request, point_rates};
use nalgebra::{Matrix2, Matrix2x3, Quaternion, SVector, Translation3, UnitQuaternion};
use regrasp_geometry::surface::{Surface, SurfacePoint};
use regrasp_geometry::{Point, Pose, Vector};

/// A point of a surface in the frame of its body.
struct Placed<'a> {
    surface: &'a Surface,
    /// Pose of the surface's frame in that of the body.
    body_from_surface: &'a Pose,
}

/// The two surfaces of a contact, each with its place in its body.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePair<'a> {
    /// Of the object.
    pub object: &'a Surface,
    /// Of the fingertip.
    pub tip: &'a Surface,
    /// Pose of the frame of the fingertip's surface in that of the fingertip.
    pub tip_from_surface: Pose,
}

/// Position and quaternion of the contact frame in both bodies.
type Packed = SVector<f64, 14>;

impl SurfacePair<'_> {
    /// Velocities of the contact frame relative to the object and to the fingertip, each linear and angular, in the contact
    /// frame.
    pub fn frame_velocities(
        &self,
        contact: &ContactPose,
        velocity: &RelativeVelocity,
    ) -> Result<[[Vector; 2]; 2], NoStep> {
        let object = self.placed_object(&Pose::identity()).curvature(&contact.object_from_contact);
        let tip = self.placed_tip().curvature(&contact.tip_from_contact);
        let points = point_rates(&object, &tip, velocity)?;
        let flat = |v: nalgebra::Vector2<f64>| Vector::new(v.x, v.y, 0.0);
        let on_object = flat(points.on_object);
        let turn = Vector::z().cross(&flat(object * points.on_object));
        Ok([[on_object, turn], [flat(points.on_tip), turn + velocity.angular]])
    }

    /// Moves a contact under constant components in the contact frame, which is carried along, for `duration` seconds.
    /// `tolerance` bounds the sum of the estimated errors, in metres and radians. After each step the frames are put back onto
    /// their surfaces.
    pub fn advance(
        &self,
        contact: &ContactPose,
        velocity: &RelativeVelocity,
        duration: f64,
        tolerance: f64,
    ) -> Result<ContactPose, NoStep> {
        checked_request(duration, tolerance, velocity)?;
        let (end, _) = dormand_prince::integrate(
            |_, packed| {
                let contact = unpack(packed);
                let [object, tip] = self.frame_velocities(&contact, velocity)?;
                let mut rate = Packed::zeros();
                for (k, [linear, angular], from_contact) in
                    [(0, object, contact.object_from_contact), (7, tip, contact.tip_from_contact)]
                {
                    let turn = from_contact.rotation.into_inner() * Quaternion::from_imag(angular * 0.5);
                    rate.fixed_rows_mut::<3>(k).copy_from(&(from_contact.rotation * linear));
                    rate.fixed_rows_mut::<4>(k + 3).copy_from(&turn.coords);
                }
                Ok(rate)
            },
            |_, error| error.norm(),
            |packed| pack(&self.put_back(&unpack(&packed))),
            pack(&self.put_back(contact)),
            duration,
            tolerance,
        )?;
        Ok(self.put_back(&unpack(&end)))
    }

    /// The contact with its frame moved onto the nearest point of each surface and turned to the normal there, the shortest way.
    pub fn put_back(&self, contact: &ContactPose) -> ContactPose {
        ContactPose {
            object_from_contact: self.placed_object(&Pose::identity()).put_back(&contact.object_from_contact, 1.0),
            tip_from_contact: self.placed_tip().put_back(&contact.tip_from_contact, -1.0),
        }
    }

    fn placed_object<'a>(&'a self, identity: &'a Pose) -> Placed<'a> {
        Placed { surface: self.object, body_from_surface: identity }
    }

    fn placed_tip(&self) -> Placed<'_> {
        Placed { surface: self.tip, body_from_surface: &self.tip_from_surface }
    }
}

impl Placed<'_> {
    fn nearest(&self, body_from_contact: &Pose) -> SurfacePoint {
        let point = Point::from(body_from_contact.translation.vector);
        self.surface.project(&self.body_from_surface.inverse_transform_point(&point))
    }

    /// Curvature in x and y of the contact frame.
    fn curvature(&self, body_from_contact: &Pose) -> Matrix2<f64> {
        let operator = self.surface.shape_operator(&self.nearest(body_from_contact));
        let turn = (self.body_from_surface.rotation.inverse() * body_from_contact.rotation).to_rotation_matrix();
        let across: Matrix2x3<f64> = turn.matrix().transpose().fixed_rows::<2>(0).into();
        across * operator * across.transpose()
    }

    /// `side` is the sign of the contact's z along the outward normal.
    fn put_back(&self, body_from_contact: &Pose, side: f64) -> Pose {
        let foot = self.nearest(body_from_contact);
        let normal = self.body_from_surface * foot.normal_in_object.into_inner() * side;
        let z = body_from_contact.rotation * Vector::z();
        // Quaternion of the shortest turn from z to the normal; less than half a turn for frames near their surface.
        let half = Quaternion::from_parts(1.0 + z.dot(&normal), z.cross(&normal));
        let turn = UnitQuaternion::new_normalize(half);
        let point = self.body_from_surface * foot.point_in_object;
        Pose::from_parts(Translation3::from(point.coords), turn * body_from_contact.rotation)
    }
}

fn pack(contact: &ContactPose) -> Packed {
    let mut packed = Packed::zeros();
    for (k, pose) in [(0, &contact.object_from_contact), (7, &contact.tip_from_contact)] {
        packed.fixed_rows_mut::<3>(k).copy_from(&pose.translation.vector);
        packed.fixed_rows_mut::<4>(k + 3).copy_from(&pose.rotation.coords);
    }
    packed
}

fn unpack(packed: &Packed) -> ContactPose {
    let [object_from_contact, tip_from_contact] = [0, 7].map(|k| {
        let rotation = Quaternion::from_vector(packed.fixed_rows::<4>(k + 3).into_owned());
        let translation = Translation3::from(packed.fixed_rows::<3>(k).into_owned());
        Pose::from_parts(translation, UnitQuaternion::new_normalize(rotation))
    });
    ContactPose { object_from_contact, tip_from_contact }
}
