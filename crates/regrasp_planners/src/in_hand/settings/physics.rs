//! Settings of forces, gravity and time.

use regrasp_geometry::Vector;
use regrasp_scene::{Gravity, Scene};
use serde::{Deserialize, Serialize};

/// Contact forces along a plan.
///
/// All are newtons per finger, whatever the object weighs. The least force is what a finger must press with to be in
/// control of its contact, the largest what fingers and object stand: neither has to do with the object's mass. The
/// squeeze is a wish; weight is balanced on top of it. The defaults are for objects of some 10 to 300 g: replays
/// of a prototype kept 59 of 59 plans at 100 g, 16 of 16 at 50 g and 10 of 11 at 300 g where such forces existed at all (notes
/// on physics, section 3). Heavier objects want a larger `normal_force[1]`; a plan that fails for want of it says so.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForceSettings {
    /// Normal force wished for (notes on physics, section 1).
    pub squeeze: f64,
    /// What a square of a newton beside that counts, against one of tangential force (ibid.).
    pub squeeze_weight: f64,
    /// Least and largest normal force (ibid.: below 2 N contacts were lost).
    pub normal_force: [f64; 2],
    /// Share of the robot's effort limits that contact forces may take; the rest is for what is not planned. URDF files
    /// give what the joint can do, so all of it by default.
    pub torque_share: f64,
}

impl Default for ForceSettings {
    fn default() -> Self {
        ForceSettings { squeeze: 4.0, squeeze_weight: 0.2, normal_force: [2.0, 15.0], torque_share: 1.0 }
    }
}

impl ForceSettings {
    pub(super) fn validate(&self) -> Result<(), String> {
        let ForceSettings { squeeze, squeeze_weight, normal_force: [least, largest], torque_share } = *self;
        if !(least >= 0.0 && least < largest && largest <= MAX_FORCE) {
            return Err(format!(
                "forces.normal_force is [{least}, {largest}]; it must be the least and a larger largest force, between 0 and \
                 {MAX_FORCE} N"
            ));
        }
        if !(squeeze > 0.0 && squeeze >= least && squeeze <= largest) {
            return Err(format!(
                "forces.squeeze is {squeeze}; it must be above 0 and between the normal forces {least} and {largest} N"
            ));
        }
        if !(squeeze_weight > 0.0 && squeeze_weight <= 1e3) {
            return Err(format!("forces.squeeze_weight is {squeeze_weight}; it must be above 0 and at most 1000"));
        }
        if !(torque_share > 0.0 && torque_share <= 1.0) {
            return Err(format!("forces.torque_share is {torque_share}; it must be above 0 and at most 1"));
        }
        Ok(())
    }
}

/// A first try of the planner with more room than it asks for in the end.
///
/// Carried out on joints that give, links stray from their planned places by up to a millimetre: of 20 plans for cubes in the
/// Allegro hand that dropped the cube in simulation with the usual clearance, 18 had links that touched what they should not
/// (docs/benchmarks/replay). Fingertips that turn on the spot drag the object along, which plans for point contacts do not
/// know of: of 50 plans that turn a sphere below the palm, 6 ended more than 2 mm or 2 degrees off in simulation with the
/// usual closure margin, none with four times as much.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FirstTry {
    /// Distance that bodies keep which do not touch, in metres.
    /// As far as the hand's links can stand back: where they cannot, the usual clearance does.
    pub clearance: f64,
    /// Closure margin of every holding set; the usual one where that is larger.
    pub closure_margin: f64,
    /// Work after which the planner makes do with the usual ones. By hand: enough for most turns of an Allegro hand,
    /// about half a second.
    pub work: u64,
}

impl Default for FirstTry {
    fn default() -> Self {
        FirstTry { clearance: 0.001, closure_margin: 0.02, work: 150_000 }
    }
}

/// Largest force of a finger that makes sense, in newtons.
const MAX_FORCE: f64 = 1e4;

/// Gravity as seen from the hand: a direction of any length but zero in the frame of its base, or `"any"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum GravityInHand {
    /// Downwards.
    Direction([f64; 3]),
    /// Whichever.
    Any(AnyDirection),
}

/// The word `"any"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnyDirection {
    /// The word.
    #[serde(rename = "any")]
    Any,
}

impl GravityInHand {
    pub(super) fn validate(&self) -> Result<(), String> {
        match self {
            GravityInHand::Direction(down)
                if !(Vector::from(*down).norm() > 1e-9 && down.iter().all(|x| x.is_finite())) =>
            {
                Err(format!("gravity is {down:?}; it must be a direction in the hand's frame, or \"any\""))
            }
            _ => Ok(()),
        }
    }

    fn of(&self, scene: &Scene) -> Gravity {
        match self {
            GravityInHand::Direction(down) => Gravity::in_hand(&scene.hand, &Vector::from(*down)).unwrap_or_default(),
            GravityInHand::Any(_) => Gravity::Any,
        }
    }
}

/// Gravity that is planned with: the scene's, else that of the settings, else along the world's -Z.
///
/// Errors: the scene states one and the settings another.
pub fn gravity_of(scene: &Scene, stated: Option<&GravityInHand>) -> Result<Gravity, String> {
    let stated = stated.map(|gravity| gravity.of(scene));
    match (scene.gravity, stated) {
        (Some(scenes), Some(ours)) if !are_same(&scenes, &ours) => Err(format!(
            "the scene states gravity {}, the settings {}: leave one of them out",
            in_words(&scenes),
            in_words(&ours)
        )),
        (scenes, ours) => Ok(scenes.or(ours).unwrap_or_default()),
    }
}

fn are_same(a: &Gravity, b: &Gravity) -> bool {
    match (a, b) {
        (Gravity::Direction(a), Gravity::Direction(b)) => (a.into_inner() - b.into_inner()).norm() < 1e-9,
        (a, b) => a == b,
    }
}

fn in_words(gravity: &Gravity) -> String {
    match gravity {
        Gravity::Direction(down) => format!("along [{:.3}, {:.3}, {:.3}] of the world", down.x, down.y, down.z),
        Gravity::Any => "in any direction".into(),
    }
}

/// How fast plans are carried out. Plans are quasi-static: forces balance the weight, not accelerations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpeedSettings {
    /// Largest speed of fingertips and of the object's surface, in metres per second (notes on physics, section 1; 0.08
    /// made no clear difference).
    pub largest_speed: f64,
    /// Largest velocity of joints of which the robot has none, in radians or metres per second: what small servos do.
    pub joint_velocity: f64,
    /// Largest acceleration of joints, in radians or metres per second squared, as robot files have none: from rest to
    /// the velocity above in a tenth of a second.
    pub joint_acceleration: f64,
    /// Time in which forces change between two segments, in seconds (notes on physics, section 1; 0.05 made no
    /// difference).
    pub ramp: f64,
}

impl Default for SpeedSettings {
    fn default() -> Self {
        SpeedSettings { largest_speed: 0.04, joint_velocity: 2.0, joint_acceleration: 20.0, ramp: 0.25 }
    }
}

impl SpeedSettings {
    pub(super) fn validate(&self) -> Result<(), String> {
        let SpeedSettings { largest_speed, joint_velocity, joint_acceleration, ramp } = *self;
        let positive = [
            ("largest_speed", largest_speed),
            ("joint_velocity", joint_velocity),
            ("joint_acceleration", joint_acceleration),
        ];
        match positive.iter().find(|(_, value)| !(*value >= LEAST_SPEED && *value <= MAX_SPEED)) {
            Some((name, value)) => {
                Err(format!("speed.{name} is {value}; it must be between {LEAST_SPEED} and {MAX_SPEED}"))
            }
            None if !(0.0..=60.0).contains(&ramp) => {
                Err(format!("speed.ramp is {ramp}; it must be between 0 and 60 seconds"))
            }
            None => Ok(()),
        }
    }
}

/// Slowest and fastest that a plan may be carried out: times stay numbers that make sense.
const LEAST_SPEED: f64 = 1e-6;
/// See there.
const MAX_SPEED: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::super::InHandSettings;

    #[test]
    fn bad_settings_are_told() {
        assert_eq!(InHandSettings::default().validate(), Ok(()));
        let read = |text: &str| serde_json::from_str::<InHandSettings>(text);
        for (text, message) in [
            (
                r#"{"forces": {"normal_force": [5, 2]}}"#,
                "forces.normal_force is [5, 2]; it must be the least and a larger largest force, between 0 and 10000 N",
            ),
            (
                r#"{"forces": {"squeeze": 1}}"#,
                "forces.squeeze is 1; it must be above 0 and between the normal forces 2 and 15 N",
            ),
            (r#"{"forces": {"torque_share": 1.5}}"#, "forces.torque_share is 1.5; it must be above 0 and at most 1"),
            (r#"{"forces": {"squeeze_weight": 0}}"#, "forces.squeeze_weight is 0; it must be above 0 and at most 1000"),
            (
                r#"{"gravity": [0, 0, 0]}"#,
                "gravity is [0.0, 0.0, 0.0]; it must be a direction in the hand's frame, or \"any\"",
            ),
            (r#"{"speed": {"largest_speed": 0}}"#, "speed.largest_speed is 0; it must be between 0.000001 and 1000000"),
            (r#"{"speed": {"ramp": -1}}"#, "speed.ramp is -1; it must be between 0 and 60 seconds"),
        ] {
            assert_eq!(read(text).unwrap().validate(), Err(message.into()), "{text}");
        }
        for text in [r#"{"gravity": "down"}"#, r#"{"gravity": [1, 2]}"#, r#"{"forces": {"fmax": 3}}"#] {
            assert!(read(text).is_err(), "{text}");
        }
        for gravity in [r#""any""#, "[0.0,1.0,0.0]"] {
            let settings = read(&format!(r#"{{"gravity": {gravity}, "forces": null}}"#)).unwrap();
            assert_eq!(settings.validate(), Ok(()));
            assert_eq!(serde_json::to_string(&settings.gravity).unwrap(), gravity);
            assert_eq!(settings.forces, None);
        }
    }
}
