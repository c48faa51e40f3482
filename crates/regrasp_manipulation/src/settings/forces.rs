//! Settings of contact forces.

use serde::{Deserialize, Serialize};

/// Contact forces along a plan.
///
/// All are newtons per finger, whatever the object weighs. The least force is what a finger must press with to be in
/// control of its contact, the largest what fingers and object stand: neither has to do with the object's mass. The
/// squeeze is a wish; weight is balanced on top of it. The defaults are for objects of some 10 to 300 g: replays
/// of a prototype kept 59 of 59 plans at 100 g, 16 of 16 at 50 g and 10 of 11 at 300 g where such forces existed at all.
/// Heavier objects need a larger `normal_force[1]`; a failure says so.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForceSettings {
    /// Normal force that every finger aims at, in newtons. What balances the weight comes on top. Origin: simulation of
    /// a prototype.
    pub squeeze: f64,
    /// Weight of the squared deviation from `squeeze`, against one squared newton of tangential force. Origin:
    /// simulation of a prototype.
    pub squeeze_weight: f64,
    /// Weight of the friction that contacts need, in squeezes: of normal force times `-log(1 - s^2)`, where a contact needs the share `s` of the
    /// friction that is counted on. The larger, the more friction may be missing before a contact slips. Origin: how much friction plans need, and
    /// how hard fingers press (docs/benchmarks/forces.md).
    pub cone_weight: f64,
    /// Least and largest normal force of a holding finger, in newtons. Origin: simulation of a prototype; below 2 N
    /// contacts were lost.
    pub normal_force: [f64; 2],
    /// Share of the robot's effort limits that contact forces may use. The default uses all, as URDF files state what
    /// the joint can do.
    pub torque_share: f64,
}

impl Default for ForceSettings {
    fn default() -> Self {
        ForceSettings {
            squeeze: 4.0,
            squeeze_weight: 0.2,
            cone_weight: 1.0,
            normal_force: [2.0, 15.0],
            torque_share: 1.0,
        }
    }
}

impl ForceSettings {
    /// What is wrong with the settings, if anything.
    pub fn validate(&self) -> Result<(), String> {
        let ForceSettings { squeeze, squeeze_weight, cone_weight, normal_force: [least, largest], torque_share } =
            *self;
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
        if !(0.0..=1e3).contains(&cone_weight) {
            return Err(format!("forces.cone_weight is {cone_weight}; it must be between 0 and 1000"));
        }
        if !(torque_share > 0.0 && torque_share <= 1.0) {
            return Err(format!("forces.torque_share is {torque_share}; it must be above 0 and at most 1"));
        }
        Ok(())
    }
}

/// Largest force of a finger that makes sense, in newtons.
const MAX_FORCE: f64 = 1e4;
