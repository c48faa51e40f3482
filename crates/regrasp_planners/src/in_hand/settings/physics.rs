//! Settings of forces, gravity and time.

use super::InHandSettings;
use regrasp_scene::Limits;
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

impl InHandSettings {
    /// The same within the limits of a scene, which no plan may exceed.
    #[must_use]
    pub fn within(&self, limits: &Limits) -> Self {
        let mut within = self.clone();
        let speed = &mut within.speed;
        speed.largest_speed = speed.largest_speed.min(limits.largest_speed);
        speed.joint_velocity = speed.joint_velocity.min(limits.joint_velocity);
        speed.joint_acceleration = speed.joint_acceleration.min(limits.joint_acceleration);
        if let Some(forces) = &mut within.forces {
            forces.normal_force = forces.normal_force.map(|force| force.min(limits.normal_force));
            forces.squeeze = forces.squeeze.min(limits.normal_force);
        }
        within.friction_margin =
            limits.friction_margin.map_or(self.friction_margin, |least| self.friction_margin.max(least));
        within
    }
}

/// Slowest and fastest that a plan may be carried out: times stay numbers that make sense.
const LEAST_SPEED: f64 = 1e-6;
/// See there.
const MAX_SPEED: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::super::InHandSettings;
    use regrasp_scene::Limits;

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
            (r#"{"speed": {"largest_speed": 0}}"#, "speed.largest_speed is 0; it must be between 0.000001 and 1000000"),
            (r#"{"speed": {"ramp": -1}}"#, "speed.ramp is -1; it must be between 0 and 60 seconds"),
        ] {
            assert_eq!(read(text).unwrap().validate(), Err(message.into()), "{text}");
        }
        // Gravity belongs to the scene: what is judged by the scene's must not be planned under another.
        for text in [r#"{"gravity": "any"}"#, r#"{"forces": {"fmax": 3}}"#] {
            assert!(read(text).is_err(), "{text}");
        }
        assert_eq!(read(r#"{"forces": null}"#).unwrap().forces, None);
    }

    #[test]
    fn settings_are_bounded_by_the_limits_of_the_scene() {
        let settings = InHandSettings::default();
        assert_eq!(settings.within(&Limits::default()), settings);
        let tight = Limits {
            largest_speed: 0.01,
            joint_velocity: 0.5,
            joint_acceleration: 3.0,
            normal_force: 3.0,
            friction_margin: Some(2.0),
        };
        let within = settings.within(&tight);
        let (speed, forces) = (within.speed, within.forces.unwrap());
        assert_eq!((speed.largest_speed, speed.joint_velocity, speed.joint_acceleration), (0.01, 0.5, 3.0));
        assert_eq!((forces.normal_force, forces.squeeze, within.friction_margin), ([2.0, 3.0], 3.0, 2.0));
    }
}
