//! Objects: free bodies, and what keeps those in place that the plan does not move.

use super::geom::{Geom, Look, Weight, as_collided, open_body, write_geom, write_inertial};
use super::inertia;
use super::names::ObjectNames;
use super::solid::ObjectSolid;
use super::xml::Xml;
use regrasp_geometry::collision::{Placed, Placement, Separation, separation};
use regrasp_geometry::{Pose, Shape, Vector};
use regrasp_scene::{Object, Support};

/// An object this near to a support stands on it, in metres.
const STANDS_WITHIN: f64 = 0.0005;

/// What holds an object.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Hold {
    /// The fingers of the hand that the plan moves.
    Fingers,
    /// A support that it stands on.
    Support,
    /// Nothing in the scene: a weld that is on.
    Pin,
}

/// An object of the model.
pub(super) struct ModelObject<'a> {
    pub object: &'a Object,
    pub names: &'a ObjectNames,
    pub solid: &'a ObjectSolid,
    pub world_from_object: Pose,
    pub hold: Hold,
}

impl ModelObject<'_> {
    pub fn write_body(&self, xml: &mut Xml) {
        open_body(xml, self.names.body.clone(), &self.world_from_object, Weight::Falls);
        xml.leaf("freejoint", &[("name", self.names.body.clone())]);
        write_inertial(xml, &inertia::of_object(self.object));
        for (shape, name) in self.solid.parts.iter().zip(&self.names.geoms) {
            write_geom(xml, &Geom { name, look: Look::Checkers, body_from_shape: Pose::identity(), shape });
        }
        xml.close();
    }

    /// The weld that can hold the object where it starts: on where nothing else holds it.
    pub fn write_pin(&self, xml: &mut Xml) {
        xml.leaf(
            "weld",
            &[
                ("name", self.names.pin.clone()),
                ("body1", self.names.body.clone()),
                ("active", (self.hold == Hold::Pin).to_string()),
                ("solref", "0.004 1".into()),
                ("solimp", "0.99 0.999 0.0001".into()),
            ],
        );
    }

    /// Its velocity in the world.
    pub fn write_sensors(&self, xml: &mut Xml) {
        for (kind, what) in [("framelinvel", "linear_velocity"), ("frameangvel", "angular_velocity")] {
            let name = format!("{}:{what}", self.names.sensor);
            xml.leaf(kind, &[("name", name), ("objtype", "xbody".into()), ("objname", self.names.body.clone())]);
        }
    }
}

/// What holds an object that the plan does not move: a support where it touches one from above, against `gravity`.
pub(super) fn hold_at_rest(object: &Object, world_from_object: &Pose, supports: &[Support], gravity: &Vector) -> Hold {
    let Some(down) = gravity.try_normalize(1e-9) else { return Hold::Pin };
    let solid = as_collided(&object.shape);
    let raised = Pose::from_parts(
        (world_from_object.translation.vector - 2.0 * STANDS_WITHIN * down).into(),
        world_from_object.rotation,
    );
    let stands_on = |support: &Support| {
        let placed = &support.body.placed;
        let body = (as_collided(&placed.shape), placed.parent_from_shape);
        !is_apart((&solid, world_from_object), &body) && is_apart((&solid, &raised), &body)
    };
    if supports.iter().any(stands_on) { Hold::Support } else { Hold::Pin }
}

/// True where an object at a pose is proved to be apart from a placed body.
fn is_apart((object, world_from_object): (&Shape, &Pose), (body, world_from_body): &(Shape, Pose)) -> bool {
    let [at, other] = [Placement::from(world_from_object), Placement::from(world_from_body)];
    let answer = separation(
        Placed { shape: object, at: &at },
        Placed { shape: body, at: &other },
        STANDS_WITHIN,
        STANDS_WITHIN,
        &mut Vector::zeros(),
        &mut [0; 2],
    );
    matches!(answer, Separation::SeparatedBy(_))
}
