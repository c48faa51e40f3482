//! Where fingertips touch, and joints with which they touch where asked. Balls have their centre one radius from the contact
//! however the link stands; other tips touch with another point whenever the link turns.

use crate::model::FingerModel;
use regrasp_base::Rng;
use regrasp_geometry::collision::Placement;
use regrasp_geometry::{Point, Vector};
use regrasp_grasp::Contact;
use regrasp_robot::kinematics::body_frame::BodyFrame;
use regrasp_robot::kinematics::finger_ik::{Asked, AskedTravel, Coordinates, IkSettings};
use regrasp_robot::tip::CurvedTip;

/// Largest change of a joint between a posture that is nearly right and the one that touches, in radians or metres.
const LARGEST_CORRECTION: f64 = 0.6;

impl FingerModel<'_> {
    /// From the tip's centre to the point that touches where the object's outward normal is `normal`; in the frame of `link`'s
    /// parent.
    #[inline]
    pub fn arm(&self, link: &BodyFrame, normal: &Vector) -> Vector {
        match self.curved {
            Some(tip) => arm_of(tip, link, normal),
            None => -normal * self.tip_radius,
        }
    }

    /// As [`FingerModel::arm`], with the link where `joints` have it.
    #[inline]
    pub fn arm_with(&self, joints: &[f64], normal: &Vector) -> Vector {
        match self.curved {
            Some(tip) => arm_of(tip, &self.ik.chain().last_frame(joints), normal),
            None => -normal * self.tip_radius,
        }
    }

    /// True when the tip may touch with the point that faces the outward normal `normal` of the object.
    #[inline]
    pub fn pad_faces(&self, joints: &[f64], normal: &Vector) -> bool {
        self.pad.is_none_or(|pad| pad.holds(&-self.ik.chain().last_frame(joints).vector_to_child(normal)))
    }

    /// Centre of the tip that touches `contact`, in the world; for a tip that is no ball, about so, as at rest.
    #[inline]
    pub fn center_over(&self, world_from_object: &Placement, contact: &Contact) -> Point {
        let normal = contact.normal_in_object.into_inner();
        match self.curved {
            None => world_from_object.point(&(contact.point_in_object + normal * self.tip_radius)),
            Some(tip) => {
                let arm = arm_of(tip, &self.link_at_rest, &world_from_object.vector(&normal));
                world_from_object.point(&contact.point_in_object) - arm
            }
        }
    }

    /// Centre of the tip that touches `contact` with `joints`, in the world.
    #[inline]
    pub fn center_touching(&self, world_from_object: &Placement, contact: &Contact, joints: &[f64]) -> Point {
        match self.curved {
            None => self.center_over(world_from_object, contact),
            Some(_) => {
                let normal = world_from_object.vector(&contact.normal_in_object);
                world_from_object.point(&contact.point_in_object) - self.arm_with(joints, &normal)
            }
        }
    }

    /// Joints near `seed` with which the tip touches `contact`.
    #[inline]
    pub fn touch_near(
        &self,
        world_from_object: &Placement,
        contact: &Contact,
        seed: &[f64],
        settings: &IkSettings,
    ) -> Option<Coordinates> {
        let joints = match self.curved {
            None => self.ik.solve_near(&self.center_over(world_from_object, contact), seed, settings)?,
            Some(tip) => {
                let point = world_from_object.point(&contact.point_in_object);
                let normal = world_from_object.vector(&contact.normal_in_object);
                let asked = |link: &BodyFrame| {
                    let (arm, travel) = arm_and_travel(tip, link, &normal);
                    let error = point - (link.point(self.ik.center_in_body()) + arm);
                    Some(Asked { error, arm, travel, turn: None })
                };
                self.ik.follow(seed, settings, asked)?
            }
        };
        self.faces(world_from_object, contact, joints)
    }

    /// Joints drawn with which the tip touches `contact`.
    pub fn touch_random(
        &self,
        world_from_object: &Placement,
        contact: &Contact,
        settings: &IkSettings,
        rng: &mut Rng,
    ) -> Option<Coordinates> {
        let joints = self.ik.solve_random(&self.center_over(world_from_object, contact), settings, rng)?;
        match self.curved {
            None => self.faces(world_from_object, contact, joints),
            Some(_) => {
                let settings = IkSettings { max_step: LARGEST_CORRECTION, ..*settings };
                self.touch_near(world_from_object, contact, &joints, &settings)
            }
        }
    }

    fn faces(&self, world_from_object: &Placement, contact: &Contact, joints: Coordinates) -> Option<Coordinates> {
        let is_pad =
            self.pad.is_none() || self.pad_faces(&joints, &world_from_object.vector(&contact.normal_in_object));
        is_pad.then_some(joints)
    }

    /// True unless it is known that the tip reaches no place near `contact`.
    #[inline]
    pub fn may_reach(&self, world_from_object: &Placement, contact: &Contact) -> bool {
        self.curved.is_some() || self.ik.may_reach(&self.center_over(world_from_object, contact))
    }

    /// True when it is proven that no joints within the limits reach `contact`: by a closed form, for balls.
    pub fn cannot_touch(&self, world_from_object: &Placement, contact: &Contact, settings: &IkSettings) -> bool {
        if self.curved.is_some() || !self.ik.is_closed_form() {
            return false;
        }
        let mut solutions = Vec::new();
        self.ik.solve_all(&self.center_over(world_from_object, contact), settings, &mut solutions);
        solutions.is_empty()
    }
}

#[inline]
fn arm_of(tip: CurvedTip, link: &BodyFrame, normal: &Vector) -> Vector {
    link.vector(&tip.arm(&-link.vector_to_child(normal)))
}

/// The arm, and where the tip may be nearly flat how its end moves over the tip: without that Newton's steps would not settle.
fn arm_and_travel(tip: CurvedTip, link: &BodyFrame, normal: &Vector) -> (Vector, Option<AskedTravel>) {
    match tip {
        CurvedTip::Ellipsoid(_) => (arm_of(tip, link, normal), None),
        CurvedTip::Smooth(surface) => {
            let bend = surface.bend(&-link.vector_to_child(normal));
            let radii = link.rotation * bend.radii * link.rotation.transpose();
            (link.vector(&bend.point), Some(AskedTravel { radii, normal: *normal }))
        }
    }
}
